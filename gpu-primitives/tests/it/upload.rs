use crate::{SENTINEL, encoder, own_device};
use gpu_primitives::memory::{Category, Ledger};
use gpu_primitives::upload::UploadRing;
use gpu_testkit::gpu;

#[test]
fn writes_take_effect_in_order() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = UploadRing::new(&ledger, "test", 1 << 16);
    let target = gpu::sentinel_buffer(device, 16, SENTINEL);
    let seen = gpu::sentinel_buffer(device, 48, SENTINEL);
    let mut encoder = encoder(device);
    ring.write(device, &mut encoder, &target, 0, bytemuck::bytes_of(&[1u32, 2, 3]));
    encoder.copy_buffer_to_buffer(&target, 0, &seen, 0, 16);
    ring.write(device, &mut encoder, &target, 4, bytemuck::bytes_of(&[9u32]));
    encoder.copy_buffer_to_buffer(&target, 0, &seen, 16, 16);
    ring.write(device, &mut encoder, &target, 4, bytemuck::bytes_of(&[7u32, 8]));
    ring.write(device, &mut encoder, &target, 0, &[]);
    encoder.copy_buffer_to_buffer(&target, 0, &seen, 32, 16);
    gpu::submit_and_wait(device, queue, encoder);
    let expected = [1, 2, 3, SENTINEL, 1, 9, 3, SENTINEL, 1, 7, 8, SENTINEL];
    assert_eq!(gpu::read_u32s(device, queue, &seen), expected);
}

#[test]
fn data_larger_than_a_chunk_is_split() {
    let (device, queue) = &own_device();
    let mut ring = UploadRing::new(&Ledger::new(), "test", 256);
    let target = gpu::sentinel_buffer(device, 4 * 3000, SENTINEL);
    let data: Vec<u32> = (0..2500).collect();
    let mut encoder = encoder(device);
    ring.write(device, &mut encoder, &target, 4 * 300, bytemuck::cast_slice(&data));
    gpu::submit_and_wait(device, queue, encoder);
    let mut expected = vec![SENTINEL; 3000];
    expected[300..2800].copy_from_slice(&data);
    assert_eq!(crate::first_difference(&gpu::read_u32s(device, queue, &target), &expected), None);
}

#[test]
fn chunks_come_back_and_are_used_again() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = UploadRing::new(&ledger, "test", 1 << 16);
    let target = gpu::sentinel_buffer(device, 4096, SENTINEL);
    for round in 0..5u32 {
        let mut encoder = encoder(device);
        let data = vec![round; 1024];
        ring.write(device, &mut encoder, &target, 0, bytemuck::cast_slice(&data));
        ring.write(device, &mut encoder, &target, 64, bytemuck::bytes_of(&[!round]));
        assert_eq!(ledger.bytes(Category::Upload), 4096 + 256, "round {round}");
        assert_eq!(ring.waiting_bytes(), 0);
        gpu::submit_and_wait(device, queue, encoder);
        assert_eq!(ring.waiting_bytes(), 4096 + 256);
        let mut expected = data;
        expected[16] = !round;
        assert_eq!(gpu::read_u32s(device, queue, &target), expected);
    }
    drop(ring);
    assert_eq!(ledger.total(), 0);
}

#[test]
fn memory_shrinks_after_a_spike() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let mut ring = UploadRing::new(&ledger, "test", 1 << 16);
    let target = gpu::sentinel_buffer(device, 1 << 22, SENTINEL);
    let mut encoder = encoder(device);
    ring.write(device, &mut encoder, &target, 0, &vec![5u8; 1 << 22]);
    assert_eq!(ledger.total(), 1 << 22);
    gpu::submit_and_wait(device, queue, encoder);
    assert!(ledger.total() <= ring.waiting_bytes_limit());
    assert_eq!(ledger.total(), ring.waiting_bytes());
    assert!(ring.waiting_bytes() > 0, "some chunks stay for reuse");
    assert_eq!(ledger.peak(), 1 << 22);
    let expected = vec![0x0505_0505; 1 << 20];
    assert_eq!(crate::first_difference(&gpu::read_u32s(device, queue, &target), &expected), None);
}

#[test]
fn a_dropped_encoder_frees_its_chunks() {
    let (device, _) = &own_device();
    let ledger = Ledger::new();
    let mut ring = UploadRing::new(&ledger, "test", 1 << 16);
    let target = gpu::sentinel_buffer(device, 16, SENTINEL);
    let mut encoder = encoder(device);
    ring.write(device, &mut encoder, &target, 0, &[0; 16]);
    assert_eq!(ledger.total(), 256);
    drop(encoder);
    assert_eq!(ledger.total(), 0);
}

#[test]
fn a_ring_may_go_before_its_encoder() {
    let (device, queue) = &own_device();
    let ledger = Ledger::new();
    let target = gpu::sentinel_buffer(device, 8, SENTINEL);
    let mut encoder = encoder(device);
    let mut ring = UploadRing::new(&ledger, "test", 1 << 16);
    ring.write(device, &mut encoder, &target, 4, bytemuck::bytes_of(&[6u32]));
    drop(ring);
    gpu::submit_and_wait(device, queue, encoder);
    assert_eq!(gpu::read_u32s(device, queue, &target), [SENTINEL, 6]);
    assert_eq!(ledger.total(), 0);
}
