//! P24: strategy `BlockSorted` takes the passes, speculation counts and visible blocks that the
//! published algorithm takes, as predicted by a simulation of it on the CPU.

use std::collections::BTreeSet;

use macrocell::Grid;
use macrocell::cpu::dda::{CellBox, Ray};
use macrocell::cpu::ranges;
use macrocell::cpu::skip::{self, Masks};
use progressive_iso::{
    BlockSortedOptions, FrameView, ProgressiveIsoRenderer, RendererOptions, TraversalStrategy,
};
use wavefront::LookAhead;
use wavefront::cpu::block_walk::{BlockWalk, block_walk};
use wavefront::cpu::frame::FrameRay;

use crate::support::{Gpu, Scene, options};

/// What a pass does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Pass {
    speculation: u32,
    visible_blocks: u32,
    /// The visible blocks and their plus-side neighbours.
    active_blocks: u32,
    active_rays_after: u32,
}

/// The active blocks along a ray, and how many of them it visits up to its hit.
struct Way {
    blocks: Vec<u64>,
    visited: usize,
}

fn way(
    grid: &Grid,
    masks: &Masks,
    ray: &Ray,
    isovalue: f32,
    sample: &impl Fn([i32; 3]) -> f32,
) -> Way {
    let volume = CellBox { low: [0; 3], high: grid.last_cell() };
    let mut way = Way { blocks: Vec::new(), visited: 0 };
    let mut hit = false;
    let mut next = skip::enter(ray, volume);
    while let Some(place) = next.and_then(|place| skip::advance(grid, masks, ray, place)) {
        way.blocks.push(grid.block_index(place.cell.map(|c| c as u32 / 4)));
        if !hit {
            way.visited += 1;
            let bounds = CellBox::around(place.cell, 2, grid.last_cell());
            hit = matches!(block_walk(ray, place, bounds, isovalue, sample), BlockWalk::Hit(_));
        }
        next = Some(skip::leave(grid, ray, place, 2));
    }
    way
}

fn with_neighbours(grid: &Grid, blocks: &BTreeSet<u64>) -> BTreeSet<u64> {
    let [x, y, z] = grid.blocks().map(u64::from);
    let mut all = BTreeSet::new();
    for block in blocks {
        let position = [block % x, block / x % y, block / (x * y)];
        for corner in 0..8_u64 {
            let [i, j, k] = [0, 1, 2].map(|a| position[a] + ((corner >> a) & 1));
            if i < x && j < y && k < z {
                all.insert(i + x * (j + y * k));
            }
        }
    }
    all
}

/// The published algorithm: every pass takes each active ray to its next n active blocks, n being
/// as many as fill `capacity` pairs, `most` at most.
fn simulate(grid: &Grid, ways: &[Way], capacity: usize, most: usize) -> Vec<Pass> {
    // The empty-space step ends rays without active blocks.
    let mut active: Vec<(&Way, usize)> =
        ways.iter().filter(|way| !way.blocks.is_empty()).map(|way| (way, 0)).collect();
    let mut passes = Vec::new();
    while !active.is_empty() {
        let speculation = (capacity / active.len()).clamp(1, most);
        let mut visible: BTreeSet<u64> = BTreeSet::new();
        for (way, position) in &mut active {
            let end = (*position + speculation).min(way.blocks.len());
            visible.extend(&way.blocks[*position..end]);
            *position = end;
        }
        active.retain(|(way, position)| *position < way.visited);
        passes.push(Pass {
            speculation: speculation as u32,
            visible_blocks: visible.len() as u32,
            active_blocks: with_neighbours(grid, &visible).len() as u32,
            active_rays_after: active.len() as u32,
        });
    }
    passes
}

fn rendered(gpu: &Gpu, scene: &Scene, size: [u32; 2], options: BlockSortedOptions) -> Vec<Pass> {
    let options = RendererOptions {
        strategy: TraversalStrategy::BlockSorted(options),
        ..crate::support::options(size)
    };
    let mut renderer =
        ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, scene.compressed(), options).unwrap();
    renderer.set_frame(&scene.frame(scene.orbit(35.0, 20.0, size))).unwrap();
    let mut passes = Vec::new();
    let mut needed = 0;
    renderer
        .render_to_completion(&gpu.device, &gpu.queue, |_, report| {
            if report.pass > 0 {
                let needed_now = report.blocks_used + report.blocks_requested;
                passes.push(Pass {
                    speculation: report.speculation,
                    visible_blocks: report.visible_blocks,
                    active_blocks: needed_now - needed,
                    active_rays_after: report.active_rays,
                });
                needed = needed_now;
            }
            true
        })
        .unwrap();
    passes
}

fn ways(scene: &Scene, size: [u32; 2]) -> Vec<Way> {
    let dims = scene.volume.dims;
    let samples = scene.volume.decode();
    let grid = Grid::new(dims);
    let masks = ranges::activate(&grid, &ranges::build(&grid, &samples), scene.isovalue);
    let lru = lru_params(scene, size);
    let camera = scene.orbit(35.0, 20.0, size);
    let view = FrameView::new(&camera, size, scene.world_from_index, dims).unwrap();
    let params = view.params(grid, lru, scene.isovalue, LookAhead::NONE);
    let sample = |v: [i32; 3]| {
        let [x, y, z] = v.map(|c| c as usize);
        samples[x + dims[0] as usize * (y + dims[1] as usize * z)]
    };
    (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| [x, y]))
        .map(|pixel| {
            let ray = FrameRay::new(&params, pixel).ray;
            way(&grid, &masks, &ray, scene.isovalue, &sample)
        })
        .collect()
}

/// Any cache: the rays do not depend on it.
fn lru_params(scene: &Scene, size: [u32; 2]) -> lru_cache_gpu::LruParams {
    let blocks = Grid::new(scene.volume.dims).block_count();
    let bytes = options(size).budget_bytes;
    let limits = wgpu::Limits::default();
    lru_cache_gpu::CachePlan::fit(blocks, bytes, &limits).unwrap().params()
}

#[test]
fn passes_are_those_of_the_published_algorithm() {
    let gpu = Gpu::new();
    let size = [96, 64];
    let pixels = (size[0] * size[1]) as usize;
    for (name, dims) in [("gyroid", [41, 42, 43]), ("turbulence", [48, 45, 39])] {
        let scene = Scene::generated(name, dims, 16.0);
        let (grid, ways) = (Grid::new(dims), ways(&scene, size));
        let step = BlockSortedOptions { start_factor: 1, speculation: false };
        let predicted = simulate(&grid, &ways, pixels, 1);
        assert!(predicted.len() > 4, "{name}: {} passes say little", predicted.len());
        assert_eq!(rendered(&gpu, &scene, size, step), predicted, "{name}, one block a pass");
        for start_factor in [1, 3, 8] {
            let options = BlockSortedOptions { start_factor, speculation: true };
            let predicted = simulate(&grid, &ways, pixels * start_factor as usize, 64);
            let rendered = rendered(&gpu, &scene, size, options);
            assert_eq!(rendered, predicted, "{name}, start factor {start_factor}");
        }
    }
}

#[test]
fn a_simulation_of_another_algorithm_is_noticed() {
    let gpu = Gpu::new();
    let size = [48, 32];
    let scene = Scene::generated("gyroid", [41, 42, 43], 16.0);
    let (grid, ways) = (Grid::new(scene.volume.dims), ways(&scene, size));
    let options = BlockSortedOptions { start_factor: 1, speculation: true };
    let rendered = rendered(&gpu, &scene, size, options);
    assert_ne!(rendered, simulate(&grid, &ways, 2 * (size[0] * size[1]) as usize, 64));
    assert_ne!(rendered, simulate(&grid, &ways, (size[0] * size[1]) as usize, 1));
}
