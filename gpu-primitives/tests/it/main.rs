//! Tests of the crate through its public API; one binary, so that wgpu is linked once.

mod compact;
mod compose;
mod indirect;
mod memory;
mod readback;
mod scan;
mod shaders;
mod sort;
mod upload;

use gpu_primitives::wgpu;
use std::sync::OnceLock;

/// What outputs hold before a kernel writes them.
const SENTINEL: u32 = 0xDEAD_BEEF;

const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);

fn device() -> &'static (wgpu::Device, wgpu::Queue) {
    static DEVICE: OnceLock<(wgpu::Device, wgpu::Queue)> = OnceLock::new();
    DEVICE.get_or_init(gpu_testkit::gpu::device)
}

/// A device whose callbacks no other test's polling runs, for tests of when they have run.
fn own_device() -> (wgpu::Device, wgpu::Queue) {
    gpu_testkit::gpu::device()
}

fn encoder(device: &wgpu::Device) -> wgpu::CommandEncoder {
    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

fn words(device: &wgpu::Device, words: &[u32]) -> wgpu::Buffer {
    gpu_testkit::gpu::buffer_with(device, bytemuck::cast_slice(words), STORAGE)
}

/// Index and values of the first difference; also tells lengths apart.
fn first_difference(found: &[u32], expected: &[u32]) -> Option<(usize, Option<u32>, Option<u32>)> {
    (0..found.len().max(expected.len()))
        .map(|index| (index, found.get(index).copied(), expected.get(index).copied()))
        .find(|(_, found, expected)| found != expected)
}

#[test]
fn differences_are_found() {
    assert_eq!(first_difference(&[1, 2, 3], &[1, 2, 3]), None);
    assert_eq!(first_difference(&[1, 2, 3], &[1, 7, 3]), Some((1, Some(2), Some(7))));
    assert_eq!(first_difference(&[1], &[1, 0]), Some((1, None, Some(0))));
}
