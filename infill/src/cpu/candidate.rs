//! Twin of `shader/lib/candidate.wgsl`: what one source says about one pixel, in 32 bits.

use wavefront::cpu::shading::dot;

/// Distance in voxels at which [`soft_distance`] is one half.
const HALF_DISTANCE: f32 = 8.0;

/// What a source says about an unfinished pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Share of the pixel that shows the surface.
    pub coverage: f32,
    /// World-space unit normal towards the viewer; without meaning where the coverage is 0.
    pub normal: [f32; 3],
    /// Distance along the ray in voxels behind the nearest place where the surface may be.
    pub distance: f32,
}

/// A distance within -1 to 1.
pub fn soft_distance(distance: f32) -> f32 {
    distance / (HALF_DISTANCE + distance.abs())
}

/// What stands for no candidate: a soft distance that no distance has.
pub const NONE: u32 = 0x80;

/// A unit vector on the octahedron |x| + |y| + |z| = 1, unfolded to a square (Q. Meyer et al., On floating-point
/// normal vectors, 2010).
fn octahedron(n: [f32; 3]) -> [f32; 2] {
    let size = n[0].abs() + n[1].abs() + n[2].abs();
    let [x, y] = [n[0] / size, n[1] / size];
    if n[2] >= 0.0 { [x, y] } else { [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)] }
}

fn sign(x: f32) -> f32 {
    if x >= 0.0 { 1.0 } else { -1.0 }
}

fn from_octahedron(p: [f32; 2]) -> [f32; 3] {
    let z = 1.0 - p[0].abs() - p[1].abs();
    let fold = (-z).max(0.0);
    let v = [p[0] - sign(p[0]) * fold, p[1] - sign(p[1]) * fold, z];
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

fn snorm8(v: f32) -> u32 {
    ((0.5 + 127.0 * v.clamp(-1.0, 1.0)).floor() as i32 as u32) & 255
}

fn from_snorm8(v: u32) -> f32 {
    (f32::from(v as u8 as i8) / 127.0).max(-1.0)
}

/// A normal in the upper half of a word, on 8 bits an axis of the octahedron.
pub fn pack_normal(normal: [f32; 3]) -> u32 {
    let [x, y] = octahedron(normal).map(snorm8);
    x << 16 | y << 24
}

/// The normal in the upper half of a word.
pub fn unpack_normal(word: u32) -> [f32; 3] {
    from_octahedron([from_snorm8(word >> 16 & 255), from_snorm8(word >> 24)])
}

impl Candidate {
    /// Soft distance, coverage and normal in a word.
    pub fn pack(candidate: Option<Self>) -> u32 {
        candidate.map_or(NONE, |c| {
            let coverage = (0.5 + 255.0 * c.coverage.clamp(0.0, 1.0)).floor() as u32;
            let normal = if coverage == 0 { 0 } else { pack_normal(c.normal) };
            snorm8(soft_distance(c.distance)) | coverage << 8 | normal
        })
    }

    /// Twin of `candidate_unpack`.
    pub fn unpack(word: u32) -> Packed {
        if word & 255 == NONE {
            return Packed::default();
        }
        let coverage = (word >> 8 & 255) as f32 / 255.0;
        let covered = coverage > 0.0;
        Packed {
            valid: true,
            coverage,
            normal: if covered { unpack_normal(word) } else { [0.0; 3] },
            soft_distance: if covered { from_snorm8(word & 255) } else { 0.0 },
        }
    }
}

/// A candidate as the word holds it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Packed {
    /// Whether there is a candidate.
    pub valid: bool,
    /// Share of the pixel that shows the surface.
    pub coverage: f32,
    /// Unit normal; 0 without coverage.
    pub normal: [f32; 3],
    /// [`soft_distance`]; 0 without coverage.
    pub soft_distance: f32,
}

impl Packed {
    /// N.V, 0 to 1; 0 without coverage.
    pub fn facing(&self, to_viewer: [f32; 3]) -> f32 {
        dot(self.normal, to_viewer).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_word_holds_a_candidate(
            coverage in 0.0..=1.0_f32,
            v in prop::array::uniform3(-1.0..1.0_f32),
            distance in -1e4..1e4_f32,
        ) {
            let length = dot(v, v).sqrt();
            prop_assume!(length > 1e-3);
            let normal = v.map(|c| c / length);
            let word = Candidate::pack(Some(Candidate { coverage, normal, distance }));
            let found = Candidate::unpack(word);
            prop_assert!(found.valid);
            prop_assert!((found.coverage - coverage).abs() <= 0.501 / 255.0);
            if found.coverage > 0.0 {
                // Half a step on two axes and their sum on the third, on an octahedron whose faces are 1 / sqrt(3) away.
                let error = [0, 1, 2].map(|a| found.normal[a] - normal[a]);
                prop_assert!(dot(error, error).sqrt() <= 3.0 * f32::sqrt(2.0) * 0.501 / 127.0, "{:?} {normal:?}", found.normal);
                prop_assert!((found.soft_distance - soft_distance(distance)).abs() <= 0.501 / 127.0);
            }
        }
    }

    #[test]
    fn no_candidate_is_told_from_the_nearest_one() {
        let nearest = Candidate { coverage: 1.0, normal: [0.0, 0.0, 1.0], distance: -1e30 };
        assert!(Candidate::unpack(Candidate::pack(Some(nearest))).valid);
        assert!(!Candidate::unpack(Candidate::pack(None)).valid);
    }
}
