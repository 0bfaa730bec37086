//! Samples of resident blocks, over one to four pages.

use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_testkit::gpu::{buffer_with, sentinel_buffer};
use lru_cache_gpu::wgpu::BufferUsages;
use lru_cache_gpu::wgsl;

use crate::harness::{SENTINEL, gpu};

const SAMPLE: &str = "#import lru_slots
@group(0) @binding(0) var<uniform> per_page: vec2<u32>; // slots per page, samples
@group(0) @binding(1) var<storage, read_write> out: array<f32>;
@group(0) @binding(2) var<storage, read> lru_slots_0: array<f32>;
#ifdef LRU_PAGES_2
@group(0) @binding(3) var<storage, read> lru_slots_1: array<f32>;
#endif
#ifdef LRU_PAGES_3
@group(0) @binding(4) var<storage, read> lru_slots_2: array<f32>;
#endif
#ifdef LRU_PAGES_4
@group(0) @binding(5) var<storage, read> lru_slots_3: array<f32>;
#endif
fn lru_slots_per_page() -> u32 {
    return per_page.x;
}
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < per_page.y) {
        out[id.x] = lru_sample(id.x / 64u, id.x % 64u);
    }
}";

pub(crate) fn sample_source(pages: u32) -> KernelSource {
    let module = Module { name: "sample", source: SAMPLE };
    let constants = wgsl::page_constants(pages);
    let mut bindings =
        vec![Binding::Uniform { bytes: 8 }, Binding::StorageReadWrite { min_bytes: 4 }];
    bindings.extend((0..pages).map(|_| Binding::StorageRead { min_bytes: 4 }));
    KernelSource {
        label: "test.sample",
        wgsl: compose_fixed(module, &wgsl::MODULES, &constants),
        entry_point: "main",
        bindings,
    }
}

#[test]
fn every_sample_of_every_page_is_found() {
    let gpu = gpu();
    for (pages, slots) in [(1, 5u32), (2, 9), (2, 16), (3, 11), (4, 13), (4, 16)] {
        let per_page = slots.div_ceil(pages).next_power_of_two();
        let samples: Vec<f32> = (0..slots * 64).map(|i| i as f32 + 0.5).collect();
        let buffers: Vec<_> = samples
            .chunks(per_page as usize * 64)
            .map(|page| buffer_with(&gpu.device, bytemuck::cast_slice(page), BufferUsages::STORAGE))
            .collect();
        assert_eq!(buffers.len() as u32, pages);
        let params = bytemuck::cast([per_page, slots * 64]);
        let params: [u8; 8] = params;
        let params = buffer_with(&gpu.device, &params, BufferUsages::UNIFORM);
        let out = sentinel_buffer(&gpu.device, u64::from(slots) * 256, SENTINEL);
        let resources: Vec<_> =
            [&params, &out].into_iter().chain(&buffers).map(|b| b.as_entire_binding()).collect();
        let kernel = sample_source(pages).kernel(&gpu.device);
        let bind = kernel.bind(&gpu.device, "test.sample", &resources);
        let mut encoder = gpu.encoder();
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            kernel.dispatch(&mut pass, &bind, u64::from(slots));
        }
        gpu.submit(encoder);
        let found: Vec<f32> = bytemuck::cast_vec(gpu.read(&out));
        assert_eq!(found, samples, "{pages} pages of {per_page} slots");
    }
}
