//! The CPU twin's walk along a ray: watertightness by parity, iterations of the root search.

use lru_cache_gpu::CachePlan;
use macrocell::Grid;
use macrocell::cpu::dda::Ray;
use progressive_iso::{FrameView, wgpu};
use wavefront::cpu::block_walk::Step;
use wavefront::cpu::cell::{first_crossing, root_and_steps};
use wavefront::cpu::frame::FrameRay;
use wavefront::cpu::walk::{crossings, steps};
use wavefront::{FrameParams, LookAhead};

use super::case::Volume;
use super::row::Failure;

/// One picture's rays as the GPU has them, up to fused operations.
#[derive(Debug)]
pub struct Twin<'a> {
    volume: &'a Volume,
    grid: Grid,
    params: FrameParams,
    isovalue: f32,
}

/// What the twin sees along a ray.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    /// Why the walk is not watertight.
    pub leak: Option<String>,
    /// Whether the ray's ends are on different sides of the surface.
    pub ends_differ: bool,
    /// Evaluations in the search for the first root.
    pub root_steps: Option<u32>,
}

impl<'a> Twin<'a> {
    pub fn new(volume: &'a Volume, view: &FrameView, isovalue: f32) -> Result<Self, Failure> {
        let grid = Grid::new(volume.dims);
        let plan = CachePlan::fit(grid.block_count(), 1 << 30, &wgpu::Limits::default())?;
        let params = view.params(grid, plan.params(), isovalue, LookAhead::NONE);
        Ok(Self { volume, grid, params, isovalue })
    }

    pub fn ray(&self, pixel: [u32; 2]) -> FrameRay {
        FrameRay::new(&self.params, pixel)
    }

    /// Depth in f32 at the start of all rays.
    pub fn start_depth(&self) -> f64 {
        f64::from(self.ray([0, 0]).depth(&self.params, 0.0))
    }

    pub fn walk(&self, ray: &Ray) -> Walk {
        let sample = |p: [i32; 3]| self.volume.sample(p.map(|v| v as u32));
        let steps = steps(&self.grid, ray, self.isovalue, &sample);
        let (Some(first), Some(last)) = (steps.first(), steps.last()) else {
            return Walk::default();
        };
        let ends_differ = first.inside_low != last.inside_high;
        let leak = match crossings(&steps) {
            Err(problem) => Some(problem),
            Ok(all) => {
                let count: usize = all.iter().map(|&(_, count)| count).sum();
                let odd = count % 2 == 1;
                (odd != ends_differ)
                    .then(|| format!("{count} crossings, ends differ: {ends_differ}"))
            }
        };
        Walk { leak, ends_differ, root_steps: steps.iter().find_map(root_steps) }
    }
}

fn root_steps(step: &Step) -> Option<u32> {
    let bernstein = step.bernstein?;
    let bracket = first_crossing(bernstein, step.inside_low, step.inside_high)?;
    Some(root_and_steps(bernstein, bracket, step.inside_low).1)
}
