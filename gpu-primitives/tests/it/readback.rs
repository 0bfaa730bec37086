use crate::{encoder, own_device, words};
use gpu_primitives::memory::{Category, Ledger};
use gpu_primitives::readback::ReadbackRing;
use gpu_testkit::gpu;

fn bytes(words: &[u32]) -> Vec<u8> {
    bytemuck::cast_slice(words).to_vec()
}

#[test]
fn parts_follow_each_other() {
    let (device, queue) = &own_device();
    let mut ring = ReadbackRing::new(&Ledger::new(), "test", 64, 1);
    let (a, b) = (words(device, &[1, 2, 3, 4]), words(device, &[5, 6]));
    let mut encoder = encoder(device);
    let parts = [(&a, 4, 8), (&b, 4, 4), (&a, 0, 0), (&a, 0, 4)];
    assert!(ring.record(device, &mut encoder, &parts, 77));
    assert_eq!(ring.take(), None, "not submitted");
    gpu::submit_and_wait(device, queue, encoder);
    assert_eq!(ring.take(), Some((77, bytes(&[2, 3, 6, 1]))));
    assert_eq!(ring.take(), None);
}

#[test]
fn records_come_in_order_of_recording() {
    let (device, queue) = &own_device();
    let mut ring = ReadbackRing::new(&Ledger::new(), "test", 4, 3);
    let source = words(device, &[10, 11, 12]);
    let (mut late, mut early) = (encoder(device), encoder(device));
    assert!(ring.record(device, &mut late, &[(&source, 0, 4)], 0));
    assert!(ring.record(device, &mut early, &[(&source, 4, 4)], 1));
    assert!(ring.record(device, &mut early, &[(&source, 8, 4)], 2));
    gpu::submit_and_wait(device, queue, early);
    assert_eq!(ring.take(), None, "the oldest record is not submitted");
    gpu::submit_and_wait(device, queue, late);
    let taken: Vec<_> = std::iter::from_fn(|| ring.take()).collect();
    assert_eq!(taken, [(0, bytes(&[10])), (1, bytes(&[11])), (2, bytes(&[12]))]);
}

#[test]
fn a_full_ring_records_nothing() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 4, 2);
    assert_eq!(ring.bytes_limit(), 8);
    let source = words(device, &[1]);
    for round in 0..4u64 {
        let mut encoder = encoder(device);
        assert!(ring.has_room());
        assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], 2 * round));
        assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], 2 * round + 1));
        assert!(!ring.has_room());
        assert!(!ring.record(device, &mut encoder, &[(&source, 0, 4)], 99));
        gpu::submit_and_wait(device, queue, encoder);
        assert!(!ring.has_room(), "only take makes room");
        assert_eq!(ring.take(), Some((2 * round, bytes(&[1]))));
        assert_eq!(ring.take(), Some((2 * round + 1, bytes(&[1]))));
        assert_eq!(ring.take(), None);
        assert_eq!(ledger.by_category(), [(Category::Readback, 8)], "buffers are used again");
    }
}

#[test]
fn too_large_a_record_is_refused() {
    let (device, _) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 8, 1);
    let source = words(device, &[1, 2, 3]);
    let mut encoder = encoder(device);
    assert!(!ring.record(device, &mut encoder, &[(&source, 0, 8), (&source, 8, 4)], 0));
    assert!(!ring.record(device, &mut encoder, &[(&source, 0, u64::MAX), (&source, 8, 4)], 0));
    assert_eq!((ring.in_flight(), ledger.total()), (0, 0));
}

#[test]
fn a_dropped_encoder_loses_only_its_record() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 4, 2);
    let source = words(device, &[1, 2]);
    let (mut dropped, mut kept) = (encoder(device), encoder(device));
    assert!(ring.record(device, &mut dropped, &[(&source, 0, 4)], 0));
    assert!(ring.record(device, &mut kept, &[(&source, 4, 4)], 1));
    drop(dropped);
    gpu::submit_and_wait(device, queue, kept);
    assert_eq!(ring.take(), Some((1, bytes(&[2]))));
    assert_eq!(ring.in_flight(), 0);
}

#[test]
fn a_ring_may_go_before_its_encoder() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 4, 2);
    let source = words(device, &[1]);
    let mut encoder = encoder(device);
    assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], 0));
    drop(ring);
    gpu::submit_and_wait(device, queue, encoder);
    assert_eq!(ledger.total(), 0);
}
