use crate::device;
use gpu_primitives::memory::{Category, Ledger, texture_bytes};
use gpu_primitives::wgpu;

fn buffer_of(size: u64) -> wgpu::BufferDescriptor<'static> {
    wgpu::BufferDescriptor {
        label: Some("test"),
        size,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    }
}

fn texture_of(
    size: [u32; 3],
    mip_level_count: u32,
    sample_count: u32,
    format: wgpu::TextureFormat,
) -> wgpu::TextureDescriptor<'static> {
    let [width, height, depth_or_array_layers] = size;
    wgpu::TextureDescriptor {
        label: Some("test"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    }
}

#[test]
fn drops_subtract_and_the_peak_stays() {
    let (device, _) = device();
    let ledger = Ledger::new();
    let shared = ledger.clone();
    let first = ledger.buffer(device, Category::Slots, &buffer_of(1024));
    let second = shared.buffer(device, Category::Rays, &buffer_of(512));
    let third = ledger.buffer(device, Category::Slots, &buffer_of(256));
    assert_eq!((first.size(), first.category()), (1024, Category::Slots));
    assert_eq!(ledger.total(), 1792);
    assert_eq!(ledger.bytes(Category::Slots), 1280);
    assert_eq!(ledger.by_category(), [(Category::Slots, 1280), (Category::Rays, 512)]);

    drop(first);
    assert_eq!((ledger.total(), ledger.peak()), (768, 1792));
    let fourth = ledger.buffer(device, Category::Params, &buffer_of(16));
    assert_eq!((ledger.total(), ledger.peak()), (784, 1792));
    drop((second, third, fourth));
    assert_eq!((ledger.total(), shared.total(), ledger.peak()), (0, 0, 1792));
    assert_eq!(ledger.by_category(), []);
}

#[test]
fn textures_count_levels_layers_and_samples() {
    use wgpu::TextureFormat::{Depth32Float, R32Float, Rgba8Unorm};
    assert_eq!(texture_bytes(&texture_of([8, 4, 1], 1, 1, Rgba8Unorm)), 128);
    assert_eq!(texture_bytes(&texture_of([8, 4, 3], 1, 1, R32Float)), 384);
    assert_eq!(texture_bytes(&texture_of([8, 4, 1], 4, 1, Rgba8Unorm)), 4 * (32 + 8 + 2 + 1));
    assert_eq!(texture_bytes(&texture_of([8, 4, 1], 1, 4, Depth32Float)), 512);

    let (device, _) = device();
    let ledger = Ledger::new();
    let desc = texture_of([8, 4, 1], 4, 1, Rgba8Unorm);
    let texture = ledger.texture(device, Category::Outputs, &desc);
    assert_eq!((texture.width(), texture.bytes()), (8, 172));
    assert_eq!(ledger.by_category(), [(Category::Outputs, 172)]);
    drop(texture);
    assert_eq!(ledger.total(), 0);
}

#[test]
fn contents_arrive() {
    let (device, queue) = device();
    let ledger = Ledger::new();
    let usage = wgpu::BufferUsages::COPY_SRC;
    let contents = [1, 2, 3, 4, 5, 6, 7, 8];
    let buffer = ledger.buffer_with(device, Category::Params, "test", usage, &contents);
    assert_eq!(gpu_testkit::gpu::read_buffer(device, queue, &buffer), contents);
    let empty = ledger.buffer_with(device, Category::Params, "test", usage, &[]);
    assert_eq!((empty.size(), ledger.total()), (0, 8));
}
