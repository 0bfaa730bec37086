//! Twin of `features_at` in `shader/encode.wgsl`: what the network reads.

use wavefront::cpu::frame::FrameRay;
use wavefront::cpu::shading::{self, dot};

use super::candidate::{Candidate, Packed, soft_distance};
use super::fill::{Scene, Surroundings};
use super::network::{FEATURES, Map, OWN};
use super::push_pull::Average;
use super::reproject;

/// Coverage and coverage N.V.
type Pair = [f32; 2];

fn pair(candidate: &Packed, to_viewer: [f32; 3]) -> Pair {
    [candidate.coverage, candidate.coverage * candidate.facing(to_viewer)]
}

/// What the head reads of a hole's own candidates.
pub fn own(candidates: &[Packed; 4], to_viewer: [f32; 3]) -> [f32; OWN] {
    let pairs = candidates.map(|c| pair(&c, to_viewer));
    std::array::from_fn(|i| pairs[i / 2][i % 2])
}

/// What a quad's finished pixels and its candidates say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quad {
    /// Share of the quad that is finished, and that is holes; what lies outside the picture is neither.
    pub shares: [f32; 2],
    /// Of the finished pixels, on average.
    pub finished: Pair,
    /// Of the neighbours, for the whole quad.
    pub neighbours: Pair,
    /// Of coarse field, its thin variant and history.
    pub candidates: [Pair; 3],
    /// 1 where history has a hit.
    pub has_history: f32,
    /// Soft distances of coarse field, its thin variant, neighbours, history.
    pub soft_distances: [f32; 4],
}

impl Quad {
    /// The network's inputs.
    pub fn features(&self) -> [f32; FEATURES] {
        let mut features = [0.0; FEATURES];
        let [done, holes] = self.shares;
        let [coarse, thin, history] =
            self.candidates.map(|c| [0, 1].map(|i| done * self.finished[i] + holes * c[i]));
        let near = if done > 0.0 { self.finished } else { self.neighbours };
        features[0] = done;
        features[1..3].copy_from_slice(&self.finished.map(|v| done * v));
        features[3..5].copy_from_slice(&near);
        features[5..7].copy_from_slice(&coarse);
        features[7..9].copy_from_slice(&thin);
        features[9] = done + holes * self.has_history;
        features[10..12].copy_from_slice(&history);
        features[12..].copy_from_slice(&self.soft_distances.map(|d| holes * d));
        features
    }
}

impl Scene<'_> {
    /// What the network reads, at half of the size padded to multiples of 4.
    pub fn features(
        &self,
        surroundings: &Surroundings<'_>,
        candidates: &[Option<[Packed; 4]>],
    ) -> Map {
        let size = self.size().map(|s| s.next_multiple_of(4) as usize / 2);
        let mut map = Map::zero(size, FEATURES);
        for y in 0..self.size()[1].div_ceil(2) {
            for x in 0..self.size()[0].div_ceil(2) {
                let features = self.quad(surroundings, candidates, [x, y]).features();
                let first = (x as usize + size[0] * y as usize) * FEATURES;
                map.values[first..first + FEATURES].copy_from_slice(&features);
            }
        }
        map
    }

    fn quad(
        &self,
        surroundings: &Surroundings<'_>,
        candidates: &[Option<[Packed; 4]>],
        quad: [u32; 2],
    ) -> Quad {
        let pixels: Vec<[u32; 2]> = self.quad_pixels(quad).collect();
        let first_hole = self.first_hole(quad);
        let pixel = first_hole.unwrap_or(quad.map(|q| 2 * q));
        let frame_ray = FrameRay::new(self.frame, pixel);
        let to_viewer = shading::to_viewer(self.shading, frame_ray.ray.direction);
        let holes = pixels.iter().filter(|&&p| self.is_hole(p)).count();
        let done = pixels.len() - holes;
        let mut found = Quad { shares: [done, holes].map(|n| 0.25 * n as f32), ..Quad::default() };
        if done > 0 {
            let mean = self.average_of(quad);
            let facing = dot(mean.normal, to_viewer).clamp(0.0, 1.0);
            found.finished = [mean.coverage, facing];
        }
        let Some(own) = first_hole.and_then(|p| candidates[self.index(p)].as_ref()) else {
            return found;
        };
        let t_low = self.t_low[self.index(pixel)];
        if let Some(average) = surroundings.quad(quad).filter(|a| a.weight > 0.0) {
            let coverage = average.coverage / average.weight;
            let normal = shading::safe_normalize(average.normal, to_viewer);
            found.neighbours = [coverage, coverage * dot(normal, to_viewer).clamp(0.0, 1.0)];
            if average.coverage > 0.0 {
                found.soft_distances[2] = soft_distance(average.t / average.coverage - t_low);
            }
        }
        let history = self.history.filter(|_| self.sources.history).and_then(|keys| {
            let holes = pixels.iter().filter(|&&p| self.is_hole(p));
            let least = holes.map(|&p| keys[self.index(p)]).min()?;
            reproject::candidate(&self.grid, &frame_ray, least, t_low)
        });
        let history = Candidate::unpack(Candidate::pack(history));
        found.has_history = f32::from(u8::from(history.valid));
        let others = [own[1], own[2], history];
        found.candidates = others.map(|c| pair(&c, to_viewer));
        for (place, candidate) in [0, 1, 3].into_iter().zip(others) {
            found.soft_distances[place] = candidate.soft_distance;
        }
        found
    }

    /// Of a quad's finished pixels.
    fn average_of(&self, quad: [u32; 2]) -> Average {
        let mut children = [Average::default(); 4];
        for (child, pixel) in children.iter_mut().zip(self.quad_pixels(quad)) {
            *child = self.average(pixel);
        }
        Average::parent(children)
    }
}
