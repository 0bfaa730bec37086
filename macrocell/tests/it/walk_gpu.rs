//! The traversal WGSL and its twin agree exactly.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_testkit::gpu::sentinel_buffer;
use gpu_testkit::layout::struct_size;
use macrocell::Grid;
use macrocell::cpu::dda::{CellBox, Ray};
use macrocell::cpu::skip::{Masks, advance, enter, leave};
use macrocell::wgpu::BufferUsages;

use crate::common::{Random, SENTINEL, gpu};
use crate::rays::{masks, rays};

const BLOCKS: usize = 64;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct WalkParams {
    blocks: [u32; 3],
    coarse_count: u32,
    coarse: [u32; 3],
    has_third_level: u32,
    third: [u32; 3],
    active_box: u32,
    last_cell: [i32; 3],
    pad0: u32,
    first_block: [i32; 3],
    pad1: u32,
    rays: u32,
    pad2: [u32; 3],
}

/// As the kernel writes it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Visits {
    inverse: [f32; 3],
    count: u32,
    blocks: [[u32; 2]; BLOCKS],
}

pub(crate) fn walk_source() -> KernelSource {
    let module = Module { name: "walk", source: include_str!("walk.wgsl") };
    KernelSource {
        label: "test.walk",
        wgsl: compose_fixed(module, &macrocell::wgsl::MODULES, &[]),
        entry_point: "main",
        bindings: vec![
            Binding::Uniform { bytes: size_of::<WalkParams>() as u64 },
            Binding::StorageRead { min_bytes: 8 },
            Binding::StorageRead { min_bytes: 16 },
            Binding::StorageReadWrite { min_bytes: size_of::<Visits>() as u64 },
        ],
    }
}

fn on_gpu(grid: &Grid, masks: &Masks, rays: &[Ray]) -> Vec<Visits> {
    let gpu = gpu();
    let params = WalkParams {
        blocks: grid.blocks(),
        coarse_count: grid.coarse_count() as u32,
        coarse: grid.coarse(),
        has_third_level: grid.has_third_level().into(),
        third: grid.third(),
        active_box: grid.mask_count() as u32,
        last_cell: grid.last_cell(),
        pad0: 0,
        first_block: [0; 3],
        pad1: 0,
        rays: rays.len() as u32,
        pad2: [0; 3],
    };
    let params = gpu.buffer(bytemuck::cast_slice(&[params]), BufferUsages::UNIFORM);
    let masks = gpu.buffer(bytemuck::cast_slice(&masks.buffer(grid)), BufferUsages::STORAGE);
    let lists: Vec<[f32; 8]> = rays
        .iter()
        .map(|Ray { origin: [ox, oy, oz], direction: [dx, dy, dz], .. }| {
            [*ox, *oy, *oz, 0.0, *dx, *dy, *dz, 0.0]
        })
        .collect();
    let lists = gpu.buffer(bytemuck::cast_slice(lists.as_flattened()), BufferUsages::STORAGE);
    let bytes = size_of_val(&Visits::zeroed()) * rays.len();
    let out = sentinel_buffer(&gpu.device, bytes as u64, SENTINEL);
    let kernel = walk_source().kernel(&gpu.device);
    let resources = [&params, &masks, &lists, &out].map(|b| b.as_entire_binding());
    let bind = kernel.bind(&gpu.device, "test.walk", &resources);
    let mut encoder = gpu.encoder();
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        kernel.dispatch(&mut pass, &bind, rays.len().div_ceil(64) as u64);
    }
    gpu.submit(encoder);
    bytemuck::pod_collect_to_vec(&gpu.read(&out))
}

fn twin(grid: &Grid, masks: &Masks, ray: &Ray) -> Visits {
    let blocks = [[SENTINEL; 2]; BLOCKS];
    let mut visits = Visits { inverse: ray.inverse, count: 0, blocks };
    let mut place = enter(ray, CellBox { low: [0; 3], high: grid.last_cell() });
    while visits.count < BLOCKS as u32 {
        let Some(found) = place.and_then(|place| advance(grid, masks, ray, place)) else { break };
        let [x, y, z] = found.cell.map(|c| c as u32);
        visits.blocks[visits.count as usize] = [x | y << 10 | z << 20, found.event.t.to_bits()];
        visits.count += 1;
        place = Some(leave(grid, ray, found, 2));
    }
    visits
}

fn compare(dims: [u32; 3], density: u32, count: usize) {
    let grid = Grid::new(dims);
    let mut random = Random::new(u64::from(density));
    let masks = masks(&grid, density, &mut random);
    let rays = rays(dims, count, u64::from(dims[0]));
    let found = on_gpu(&grid, &masks, &rays);
    let mut visited = 0;
    for (ray, found) in rays.iter().zip(&found) {
        for axis in 0..3 {
            let (gpu, exact) = (found.inverse[axis], ray.inverse[axis]);
            assert!((gpu - exact).abs() <= exact.abs() * 4.0 * f32::EPSILON, "{ray:?}");
        }
        let ray = Ray { inverse: found.inverse, ..*ray };
        let expected = twin(&grid, &masks, &ray);
        assert!(*found == expected, "{dims:?} {ray:?}\nGPU {found:?}\ntwin {expected:?}");
        visited += expected.count;
    }
    assert!(visited as usize > count / 8, "only {visited} blocks by {count} rays");
}

#[test]
fn small_volumes() {
    for (dims, density) in [([2, 2, 2], 64), ([9, 6, 4], 64), ([33, 40, 18], 20), ([70, 3, 50], 30)]
    {
        compare(dims, density, 2000);
    }
}

#[test]
fn three_levels() {
    for density in [2, 64] {
        compare([260, 140, 131], density, 3000);
    }
}

#[test]
fn the_comparison_sees_another_walk() {
    let grid = Grid::new([33, 40, 18]);
    let mut random = Random::new(4);
    let ray = Ray::new([-1.0, 20.0, 9.0], [1.0, 0.01, 0.02]);
    let full = twin(&grid, &masks(&grid, 64, &mut random), &ray);
    assert_ne!(full, twin(&grid, &masks(&grid, 20, &mut random), &ray));
    let other = Ray::new([-1.0, 20.0, 9.0], [1.0, 0.011, 0.02]);
    assert_ne!(full, twin(&grid, &masks(&grid, 64, &mut random), &other));
}

#[test]
fn parameters_lie_where_the_host_writes_them() {
    let text = walk_source().wgsl.source;
    assert_eq!(struct_size(&text, "WalkParams").unwrap() as usize, size_of::<WalkParams>());
    assert_eq!(struct_size(&text, "Visits").unwrap() as usize, size_of::<Visits>());
    let grid = [
        ("blocks", 0, 12),
        ("coarse_count", 12, 4),
        ("coarse", 16, 12),
        ("has_third_level", 28, 4),
        ("third", 32, 12),
        ("active_box", 44, 4),
        ("last_cell", 48, 12),
        ("pad0", 60, 4),
        ("first_block", 64, 12),
        ("pad1", 76, 4),
    ];
    gpu_testkit::layout::check_struct(&text, "MacrocellGrid", &grid).unwrap();
}
