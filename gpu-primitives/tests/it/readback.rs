use crate::{encoder, own_device, words};
use gpu_primitives::memory::{Category, Ledger};
use gpu_primitives::readback::{Lost, ReadbackRing};
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
    assert_eq!(ring.take(), Some((77, Ok(bytes(&[2, 3, 6, 1])))));
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
    assert_eq!(taken, [(0, Ok(bytes(&[10]))), (1, Ok(bytes(&[11]))), (2, Ok(bytes(&[12])))]);
}

#[test]
fn a_full_ring_records_nothing() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 4, 2);
    assert_eq!(ring.bytes_limit(), 24, "two records and their stamps");
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
        assert_eq!(ring.take(), Some((2 * round, Ok(bytes(&[1])))));
        assert_eq!(ring.take(), Some((2 * round + 1, Ok(bytes(&[1])))));
        assert_eq!(ring.take(), None);
        assert_eq!(ledger.by_category(), [(Category::Readback, 24)], "buffers are used again");
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
fn records_of_another_size_leave_those_in_flight_alone() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 4, 2);
    let source = words(device, &[1, 2, 3]);
    for size in [12, 8, 4] {
        let mut encoder = encoder(device);
        assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], size));
        ring.set_bytes(size);
        assert!(ring.record(device, &mut encoder, &[(&source, 0, size)], 0));
        gpu::submit_and_wait(device, queue, encoder);
        assert_eq!(ring.take(), Some((size, Ok(bytes(&[1])))));
        let all = bytes(&[1, 2, 3]);
        assert_eq!(ring.take(), Some((0, Ok(all[..size as usize].to_vec()))));
        assert_eq!(ledger.total(), 8 + size + 4, "one staging buffer and the stamps");
    }
}

#[test]
fn buffers_of_another_size_are_not_used_again() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = ReadbackRing::new(&ledger, "test", 4, 1);
    let source = words(device, &[1, 2, 3]);
    for size in [4, 12, 8] {
        ring.set_bytes(size);
        let mut encoder = encoder(device);
        assert!(ring.record(device, &mut encoder, &[(&source, 0, size)], size));
        gpu::submit_and_wait(device, queue, encoder);
        let all = bytes(&[1, 2, 3]);
        assert_eq!(ring.take(), Some((size, Ok(all[..size as usize].to_vec()))));
        assert_eq!(ledger.total(), size + 4 + 8, "one staging buffer, which waits, and the stamps");
    }
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
    assert_eq!(ring.take(), Some((0, Err(Lost::Dropped))));
    assert_eq!(ring.take(), Some((1, Ok(bytes(&[2])))));
    assert_eq!((ring.take(), ring.in_flight()), (None, 0));
}

/// wgpu refuses the submission and maps the buffer all the same: with zeros, or with what the record
/// before left in it.
#[test]
fn a_refused_submission_gives_no_bytes() {
    let (device, queue) = &own_device();
    for earlier_records in 0..3 {
        let mut ring = ReadbackRing::new(&Ledger::new(), "test", 4, 1);
        let source = words(device, &[1]);
        for tag in 0..earlier_records {
            let mut encoder = encoder(device);
            assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], tag));
            gpu::submit_and_wait(device, queue, encoder);
            assert_eq!(ring.take(), Some((tag, Ok(bytes(&[1])))));
        }
        let mut encoder = encoder(device);
        assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], 9));
        source.destroy();
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        gpu::submit_and_wait(device, queue, encoder);
        assert!(pollster::block_on(scope.pop()).is_some());
        assert_eq!(ring.take(), Some((9, Err(Lost::NotRun))));
    }
}

#[test]
fn a_staging_buffer_that_cannot_be_made_gives_no_bytes() {
    let (device, queue) = &own_device();
    let mut ring = ReadbackRing::new(&Ledger::new(), "test", device.limits().max_buffer_size, 1);
    let source = words(device, &[1]);
    let mut encoder = encoder(device);
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], 0));
    gpu::submit_and_wait(device, queue, encoder);
    assert!(pollster::block_on(scope.pop()).is_some());
    assert_eq!(ring.take(), Some((0, Err(Lost::NotMapped))));
}

#[test]
fn a_lost_device_gives_no_bytes() {
    let (device, queue) = &own_device();
    let mut ring = ReadbackRing::new(&Ledger::new(), "test", 4, 2);
    let source = words(device, &[1]);
    // What is made on a lost device is invalid.
    let _scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    for (tag, lose) in [(0, true), (1, false)] {
        let mut encoder = encoder(device);
        assert!(ring.record(device, &mut encoder, &[(&source, 0, 4)], tag));
        if lose {
            device.destroy();
        }
        gpu::submit_and_wait(device, queue, encoder);
    }
    assert_eq!(ring.take(), Some((0, Err(Lost::NotMapped))));
    assert_eq!(ring.take(), Some((1, Err(Lost::NotMapped))));
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
