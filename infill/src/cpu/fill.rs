//! Twin of `shader/guess.wgsl`, `lib/sources.wgsl` and `shader/fill.wgsl`: from a picture with holes to a filled one.

use macrocell::Grid;
use wavefront::cpu::frame::FrameRay;
use wavefront::cpu::shading::{self, dot};
use wavefront::{FrameParams, ShadingParams};

use super::candidate::{Candidate, Packed};
use super::features;
use super::field::CoarseField;
use super::march::march;
use super::network::{Map, OUTPUTS, head, network};
use super::push_pull::{Average, Pyramid};
use super::reproject;
use crate::options::{DOUBT, PRIOR, Sources};
use crate::weights::Weights;

/// A finished pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finished {
    /// No surface.
    Background,
    /// The surface: view depth in world units and world-space unit normal.
    Hit {
        /// View depth.
        depth: f32,
        /// Normal.
        normal: [f32; 3],
    },
}

/// What a fill needs to know.
#[derive(Debug)]
pub struct Scene<'a> {
    /// The frame.
    pub frame: &'a FrameParams,
    /// Its shading.
    pub shading: &'a ShadingParams,
    /// The volume's grids.
    pub grid: Grid,
    /// The coarse field, unless it is left out.
    pub field: Option<&'a CoarseField>,
    /// Finished pixels, row by row; `None` for holes.
    pub pixels: &'a [Option<Finished>],
    /// Where the rays of holes wait, in voxels; anything elsewhere.
    pub t_low: &'a [f32],
    /// Least keys of the previous frame's hits, if there is one.
    pub history: Option<&'a [u32]>,
    /// Candidates to be used.
    pub sources: Sources,
}

/// What finished pixels tell about holes: of the sources that are used.
#[derive(Debug)]
pub struct Surroundings<'a> {
    pyramid: Option<Pyramid>,
    /// The coarse field and the share of the blocks' ranges at which the surface lies.
    field: Option<(&'a CoarseField, f32)>,
}

/// The candidates of a hole in the order of [`crate::options::Source`].
pub type Candidates = [Option<Candidate>; 4];

impl Scene<'_> {
    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.frame.size()
    }

    pub(super) fn index(&self, pixel: [u32; 2]) -> usize {
        (pixel[0] + self.size()[0] * pixel[1]) as usize
    }

    pub(super) fn is_hole(&self, pixel: [u32; 2]) -> bool {
        self.pixels[self.index(pixel)].is_none()
    }

    /// The pixels of a quad of 2x2 that lie in the picture, row by row.
    pub(super) fn quad_pixels(&self, quad: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
        let size = self.size();
        (0..4)
            .map(move |i| [2 * quad[0] + i % 2, 2 * quad[1] + i / 2])
            .filter(move |p| p[0] < size[0] && p[1] < size[1])
    }

    /// The pixel whose ray goes through the coarse field for all holes of its quad.
    pub(super) fn first_hole(&self, quad: [u32; 2]) -> Option<[u32; 2]> {
        self.quad_pixels(quad).find(|&pixel| self.is_hole(pixel))
    }

    pub(super) fn average(&self, pixel: [u32; 2]) -> Average {
        match self.pixels[self.index(pixel)] {
            None => Average::default(),
            Some(Finished::Background) => Average { weight: 1.0, ..Average::default() },
            Some(Finished::Hit { depth, normal }) => {
                let t = FrameRay::new(self.frame, pixel).t(self.frame, depth);
                Average { weight: 1.0, coverage: 1.0, normal, t }
            }
        }
    }

    /// What finished pixels tell about holes.
    pub fn surroundings(&self) -> Surroundings<'_> {
        let field = self.field.filter(|_| self.sources.coarse_field);
        Surroundings {
            pyramid: self
                .sources
                .neighbours
                .then(|| Pyramid::new(self.size(), |pixel| self.average(pixel))),
            field: field.map(|field| (field, self.share(field))),
        }
    }

    /// The candidates of a hole.
    pub fn candidates(&self, surroundings: &Surroundings<'_>, pixel: [u32; 2]) -> Candidates {
        let frame_ray = FrameRay::new(self.frame, pixel);
        let ray = &frame_ray.ray;
        let to_viewer = shading::to_viewer(self.shading, ray.direction);
        let t_low = self.t_low[self.index(pixel)];
        let neighbours =
            surroundings.pyramid.as_ref().map(|p| p.at(pixel)).filter(|a| a.weight > 0.0).map(
                |a| Candidate {
                    coverage: a.coverage / a.weight,
                    normal: shading::safe_normalize(a.normal, to_viewer),
                    distance: if a.coverage > 0.0 { a.t / a.coverage - t_low } else { 0.0 },
                },
            );
        let miss = Candidate { coverage: 0.0, normal: [0.0; 3], distance: 0.0 };
        let coarse = surroundings.field.map(|(field, share)| {
            let first = self.first_hole(pixel.map(|p| p / 2)).unwrap_or(pixel);
            let ray = &FrameRay::new(self.frame, first).ray;
            let to_viewer = shading::to_viewer(self.shading, ray.direction);
            let t_low = self.t_low[self.index(first)];
            march(&self.grid, field, ray, t_low, self.frame.isovalue(), share).map(|hit| {
                hit.map_or(miss, |hit| Candidate {
                    coverage: 1.0,
                    normal: shading::normal(self.shading, hit.gradient, to_viewer),
                    distance: hit.t - t_low,
                })
            })
        });
        let history = self.history.filter(|_| self.sources.history).and_then(|keys| {
            reproject::candidate(&self.grid, &frame_ray, keys[self.index(pixel)], t_low)
        });
        [neighbours, coarse.map(|c| c[0]), coarse.map(|c| c[1]), history]
    }
}

impl Surroundings<'_> {
    /// What they say about a quad.
    pub(super) fn quad(&self, quad: [u32; 2]) -> Option<Average> {
        self.pyramid.as_ref().map(|pyramid| pyramid.quad(quad))
    }
}

/// A filled pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filled {
    /// Share of the pixel that shows the surface.
    pub coverage: f32,
    /// N.V.
    pub facing: f32,
    /// World-space unit normal with that N.V.
    pub normal: [f32; 3],
}

/// Some unit vector perpendicular to a unit vector.
fn perpendicular(v: [f32; 3]) -> [f32; 3] {
    let other = if v[2].abs() < 0.9 { [-v[1], v[0], 0.0] } else { [0.0, -v[2], v[1]] };
    shading::safe_normalize(other, [1.0, 0.0, 0.0])
}

/// The mixture of a hole's candidates, with what the network says and what its weights add to [`DOUBT`];
/// `None` without any candidate.
pub fn mix(
    candidates: &[Packed; 4],
    output: &[f32; OUTPUTS],
    doubt: f32,
    to_viewer: [f32; 3],
) -> Option<Filled> {
    let share = candidates[0].coverage;
    let doubt = [(DOUBT + doubt) * 4.0 * share * (1.0 - share), 0.0, 0.0, 0.0];
    let logit = |i: usize| PRIOR[i] + output[i] - doubt[i];
    let valid = || (0..4).filter(|&i| candidates[i].valid);
    let most = valid().map(logit).reduce(f32::max)?;
    let (mut total, mut coverage, mut facing, mut normal) = (0.0, 0.0, 0.0, [0.0; 3]);
    for i in valid() {
        let candidate = &candidates[i];
        let weight = (logit(i) - most).exp();
        let covered = weight * candidate.coverage;
        total += weight;
        coverage += covered;
        facing += covered * candidate.facing(to_viewer);
        normal = std::array::from_fn(|a| normal[a] + covered * candidate.normal[a]);
    }
    let mean = if coverage > 0.0 { facing / coverage } else { 0.5 };
    let facing = (mean + output[5]).clamp(0.0, 1.0);
    // Of the normal only the direction around the view axis stays.
    let along = dot(normal, to_viewer);
    let across: [f32; 3] = std::array::from_fn(|a| normal[a] - along * to_viewer[a]);
    let across = if dot(across, across) > 1e-12 {
        shading::safe_normalize(across, perpendicular(to_viewer))
    } else {
        perpendicular(to_viewer)
    };
    let sine = (1.0 - facing * facing).max(0.0).sqrt();
    Some(Filled {
        coverage: (coverage / total + output[4]).clamp(0.0, 1.0),
        facing,
        normal: std::array::from_fn(|a| facing * to_viewer[a] + sine * across[a]),
    })
}

/// A filled picture.
#[derive(Clone, Debug)]
pub struct Fill {
    /// Holes: what fills them. `None` for finished pixels and holes without a candidate.
    pub pixels: Vec<Option<Filled>>,
    /// What the head read of the network at a half of the size padded to multiples of 4.
    pub map: Map,
}

impl Scene<'_> {
    /// Fills every hole.
    pub fn fill(&self, weights: &Weights) -> Fill {
        let size = self.size();
        let surroundings = self.surroundings();
        let all = || (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]]);
        let packed: Vec<Option<[Packed; 4]>> = all()
            .map(|pixel| {
                self.is_hole(pixel).then(|| {
                    let candidates = self.candidates(&surroundings, pixel);
                    candidates.map(|c| Candidate::unpack(Candidate::pack(c)))
                })
            })
            .collect();
        let map = network(weights, &self.features(&surroundings, &packed));
        let fill = |(pixel, candidates): ([u32; 2], &Option<[Packed; 4]>)| {
            let candidates = candidates.as_ref()?;
            let ray = FrameRay::new(self.frame, pixel).ray;
            let to_viewer = shading::to_viewer(self.shading, ray.direction);
            let own = features::own(candidates, to_viewer);
            let output = head(weights, &map, pixel.map(|p| p as usize), own);
            mix(candidates, &output, weights.doubt(), to_viewer)
        };
        Fill { pixels: all().zip(&packed).map(fill).collect(), map }
    }
}
