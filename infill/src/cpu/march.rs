//! Twin of `shader/lib/march.wgsl`: the unfinished rays through the coarse field.

use macrocell::Grid;
use macrocell::cpu::dda::{CellBox, Ray};

use super::field::CoarseField;

/// Voxels of the first step: half a block.
const FIRST_STEP: f32 = 2.0;
/// Growth of the step per voxel from the start.
const STEP_GROWTH: f32 = 1.0 / 128.0;
/// Most steps of a ray; with growing steps they lead farther than any volume that can be rendered is deep.
const MOST_STEPS: u32 = 512;

/// Where a ray crosses a coarse field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseHit {
    /// Parameter along the ray in voxels.
    pub t: f32,
    /// Gradient of the field there, per voxel.
    pub gradient: [f32; 3],
}

/// First crossings of the field at a share of the way from the lower to the upper end of the blocks' ranges, and of the field
/// that favours thin features, halfway to the end on the side that the ray looks for; from `t_low` on.
///
/// The side on which the ray starts is that of the first field where it enters the volume; up to `t_low` it has
/// not changed sides.
pub fn march(
    grid: &Grid,
    field: &CoarseField,
    ray: &Ray,
    t_low: f32,
    isovalue: f32,
    share: f32,
) -> [Option<CoarseHit>; 2] {
    let volume = CellBox { low: [0; 3], high: grid.last_cell() };
    let (entry, exit) = (ray.entry(volume).t, ray.exit(volume).t);
    let at = |t: f32| field.at(std::array::from_fn(|a| ray.origin[a] + t * ray.direction[a]));
    let inside = at(entry).value(share) >= isovalue;
    let shares = [share, 0.5 * (share + if inside { 0.0 } else { 1.0 })];
    let mut hits = [None; 2];
    let (mut t, mut before) = (t_low, t_low);
    let mut values_before = [0.0; 2];
    for step in 0..MOST_STEPS {
        let sample = at(t);
        let values = shares.map(|share| sample.value(share) - isovalue);
        for i in 0..2 {
            if hits[i].is_none() && (values[i] >= 0.0) != inside {
                let t = if step == 0 {
                    t
                } else {
                    let s = values_before[i] / (values_before[i] - values[i]);
                    before + s * (t - before)
                };
                hits[i] = Some(CoarseHit { t, gradient: at(t).gradient(shares[i]) });
            }
        }
        if t >= exit || hits.iter().all(Option::is_some) {
            break;
        }
        (before, values_before) = (t, values);
        t = (t + FIRST_STEP + STEP_GROWTH * (t - t_low)).min(exit);
    }
    hits
}
