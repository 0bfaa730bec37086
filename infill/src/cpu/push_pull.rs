//! Twin of `shader/push.wgsl` and `shader/lib/pull.wgsl`: averages of the finished pixels (S. Gortler et al., The
//! lumigraph, 1996), spread over the holes.

/// Coarsest level: texels of 16x16 pixels.
pub const LEVELS: usize = 4;

/// Sums over finished pixels: each counts `weight`, which is at most 1 for a whole texel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Average {
    /// Share of what is known.
    pub weight: f32,
    /// Coverage, times the weight.
    pub coverage: f32,
    /// Normal, times coverage and weight.
    pub normal: [f32; 3],
    /// Parameter along the ray, times coverage and weight.
    pub t: f32,
}

impl Average {
    /// The sum of `self` and `factor` times the other.
    #[must_use]
    pub fn plus(self, other: Self, factor: f32) -> Self {
        Self {
            weight: self.weight + factor * other.weight,
            coverage: self.coverage + factor * other.coverage,
            normal: std::array::from_fn(|a| self.normal[a] + factor * other.normal[a]),
            t: self.t + factor * other.t,
        }
    }

    /// Four texels as one of the next level.
    #[must_use]
    pub fn parent(children: [Self; 4]) -> Self {
        let sum = children.iter().fold(Self::default(), |sum, child| sum.plus(*child, 1.0));
        let factor = if sum.weight > 1.0 { 1.0 / sum.weight } else { 1.0 };
        Self::default().plus(sum, factor)
    }
}

/// One level of the pyramid.
#[derive(Clone, Debug)]
struct Level {
    size: [usize; 2],
    texels: Vec<Average>,
}

impl Level {
    /// Bilinear interpolation at the middle of a texel of the next finer level; clamped at the edges.
    fn pulled(&self, finer: [usize; 2]) -> Average {
        let place: [[(usize, f32); 2]; 2] = std::array::from_fn(|a| {
            let low = finer[a].div_ceil(2);
            let share = if finer[a].is_multiple_of(2) { 0.75 } else { 0.25 };
            // Texels low - 1 and low; an even texel lies nearer to the second.
            let clamp = |i: usize| i.min(self.size[a] - 1);
            [(clamp(low.saturating_sub(1)), 1.0 - share), (clamp(low), share)]
        });
        let mut sum = Average::default();
        for (y, wy) in place[1] {
            for (x, wx) in place[0] {
                sum = sum.plus(self.texels[x + self.size[0] * y], wx * wy);
            }
        }
        sum
    }
}

/// The averages of a picture.
#[derive(Clone, Debug)]
pub struct Pyramid {
    /// From 2x2 pixels to a texel on, pulled.
    levels: Vec<Level>,
}

impl Pyramid {
    /// Averages of a picture of `size` pixels; `pixel` gives a finished pixel with weight 1, others with 0.
    pub fn new(size: [u32; 2], pixel: impl Fn([u32; 2]) -> Average) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        for level in 1..=LEVELS {
            let finer = [0, 1].map(|a| (size[a] as usize).div_ceil(1 << (level - 1)));
            let own = [0, 1].map(|a| (size[a] as usize).div_ceil(1 << level));
            let child = |x: usize, y: usize| match levels.last() {
                _ if x >= finer[0] || y >= finer[1] => Average::default(),
                None => pixel([x as u32, y as u32]),
                Some(below) => below.texels[x + finer[0] * y],
            };
            let texel = |i: usize| {
                let [x, y] = [2 * (i % own[0]), 2 * (i / own[0])];
                Average::parent([
                    child(x, y),
                    child(x + 1, y),
                    child(x, y + 1),
                    child(x + 1, y + 1),
                ])
            };
            let texels = (0..own[0] * own[1]).map(texel).collect();
            levels.push(Level { size: own, texels });
        }
        for level in (1..LEVELS).rev() {
            let (finer, coarser) = levels.split_at_mut(level);
            let own = &mut finer[level - 1];
            for i in 0..own.texels.len() {
                let texel = own.texels[i];
                let pulled = coarser[0].pulled([i % own.size[0], i / own.size[0]]);
                own.texels[i] = texel.plus(pulled, 1.0 - texel.weight);
            }
        }
        Self { levels }
    }

    /// What is known about a quad of 2x2 pixels, or the surroundings say where nothing is.
    pub fn quad(&self, quad: [u32; 2]) -> Average {
        let level = &self.levels[0];
        level.texels[quad[0] as usize + level.size[0] * quad[1] as usize]
    }

    /// What the surroundings say about an unfinished pixel.
    pub fn at(&self, pixel: [u32; 2]) -> Average {
        self.levels[0].pulled(pixel.map(|p| p as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(coverage: f32, t: f32) -> Average {
        Average { weight: 1.0, coverage, normal: [0.0, 0.0, coverage], t: coverage * t }
    }

    #[test]
    fn a_hole_in_a_constant_picture_takes_the_constant() {
        let hole = |p: [u32; 2]| (10..25).contains(&p[0]) && (3..20).contains(&p[1]);
        let pyramid =
            Pyramid::new([45, 31], |p| if hole(p) { Average::default() } else { known(1.0, 7.0) });
        for pixel in [[10, 3], [17, 12], [24, 19]] {
            let found = pyramid.at(pixel);
            assert!(found.weight > 0.0);
            assert!((found.coverage / found.weight - 1.0).abs() < 1e-5);
            assert!((found.t / found.coverage - 7.0).abs() < 1e-4);
        }
    }

    #[test]
    fn nothing_known_is_nothing_found() {
        assert_eq!(Pyramid::new([20, 9], |_| Average::default()).at([3, 4]), Average::default());
    }

    #[test]
    fn an_edge_falls_off_smoothly() {
        let pyramid = Pyramid::new([32, 32], |p| match p[0] {
            0..12 => known(1.0, 1.0),
            20.. => known(0.0, 0.0),
            _ => Average::default(),
        });
        let share = |x| {
            let found = pyramid.at([x, 16]);
            found.coverage / found.weight
        };
        let across: Vec<f32> = (12..20).map(share).collect();
        assert!(across.windows(2).all(|w| w[1] <= w[0] + 1e-6), "{across:?}");
        assert!(across[0] > 0.8 && across[7] < 0.2, "{across:?}");
    }
}
