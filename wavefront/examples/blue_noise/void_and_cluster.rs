//! Spatiotemporal blue noise by void-and-cluster (R. Ulichney, The void-and-cluster method for dither array
//! generation, 1993; A. Wolfe et al., Spatiotemporal Blue Noise Masks, EGSR 2022): pixels of one slice repel each other
//! by their distance in the slice, pixels of one column by their distance in time, others not at all. Everything is
//! toroidal. In integers, so that every machine makes the same tiles.

/// Seed of the tiles that the crate has.
pub(crate) const SEED: u64 = 1;

/// Standard deviation of both Gaussians, in pixels and in slices.
const SIGMA: f64 = 1.9;

/// Energy of two pixels at one place.
const UNIT: f64 = (1 << 20) as f64;

/// Share of the pixels that the first pattern has.
const FIRST_SHARE: usize = 10;

/// Edge of a slice in pixels, and slices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) edge: usize,
    pub(crate) slices: usize,
}

impl Shape {
    fn slice(self) -> usize {
        self.edge * self.edge
    }

    fn pixels(self) -> usize {
        self.slice() * self.slices
    }
}

/// The pixel of a slice that is to be taken or filled next.
#[derive(Clone, Copy, Debug)]
struct Best {
    pixel: usize,
    energy: u32,
}

/// A pattern of pixels, the energy that each place has from them, and where each slice's tightest cluster and largest
/// void are.
struct Pattern {
    shape: Shape,
    /// By column and row apart.
    space: Vec<u32>,
    /// By slices apart; nothing for the pixel itself, which `space` has.
    time: Vec<u32>,
    filled: Vec<bool>,
    energy: Vec<u32>,
    clusters: Vec<Option<Best>>,
    voids: Vec<Option<Best>>,
}

impl Pattern {
    fn new(shape: Shape) -> Self {
        let apart = |d: usize, of: usize| d.min(of - d) as f64;
        let gauss = |square: f64| (UNIT * (-0.5 * square / (SIGMA * SIGMA)).exp()).round() as u32;
        let edge = shape.edge;
        let space = (0..shape.slice()).map(|i| {
            let [dx, dy] = [apart(i % edge, edge), apart(i / edge, edge)];
            gauss(dx * dx + dy * dy)
        });
        let time = (0..shape.slices).map(|d| match apart(d, shape.slices) {
            0.0 => 0,
            d => gauss(d * d),
        });
        let mut pattern = Self {
            shape,
            space: space.collect(),
            time: time.collect(),
            filled: vec![false; shape.pixels()],
            energy: vec![0; shape.pixels()],
            clusters: vec![None; shape.slices],
            voids: vec![None; shape.slices],
        };
        (0..shape.slices).for_each(|z| pattern.look(z));
        pattern
    }

    /// Finds the best pixels of a slice again.
    fn look(&mut self, z: usize) {
        let first = z * self.shape.slice();
        let (mut cluster, mut void): (Option<Best>, Option<Best>) = (None, None);
        for pixel in first..first + self.shape.slice() {
            let energy = self.energy[pixel];
            if self.filled[pixel] {
                if cluster.is_none_or(|best| energy > best.energy) {
                    cluster = Some(Best { pixel, energy });
                }
            } else if void.is_none_or(|best| energy < best.energy) {
                void = Some(Best { pixel, energy });
            }
        }
        (self.clusters[z], self.voids[z]) = (cluster, void);
    }

    /// Fills or empties a pixel.
    fn set(&mut self, pixel: usize, filled: bool) {
        let Shape { edge, slices } = self.shape;
        let add = |energy: &mut u32, by: u32| {
            *energy = if filled { *energy + by } else { *energy - by };
        };
        self.filled[pixel] = filled;
        let (z, within) = (pixel / self.shape.slice(), pixel % self.shape.slice());
        let (x, y) = (within % edge, within / edge);
        for (i, energy) in self.energy[z * edge * edge..][..edge * edge].iter_mut().enumerate() {
            let [dx, dy] = [(i % edge + edge - x) % edge, (i / edge + edge - y) % edge];
            add(energy, self.space[dx + edge * dy]);
        }
        self.look(z);
        for other in (0..slices).filter(|&other| other != z) {
            let by = self.time[(other + slices - z) % slices];
            if by > 0 {
                let pixel = other * self.shape.slice() + within;
                add(&mut self.energy[pixel], by);
                self.look_at(other, pixel);
            }
        }
    }

    /// Finds the best pixels of a slice again if a pixel's new energy may have changed them.
    fn look_at(&mut self, z: usize, pixel: usize) {
        let energy = self.energy[pixel];
        let changed = if self.filled[pixel] {
            self.clusters[z].is_none_or(|best| best.pixel == pixel || energy >= best.energy)
        } else {
            self.voids[z].is_none_or(|best| best.pixel == pixel || energy <= best.energy)
        };
        if changed {
            self.look(z);
        }
    }

    /// The filled pixel with the most energy; the first of equals.
    fn tightest_cluster(&self) -> Option<usize> {
        let all = self.clusters.iter().flatten();
        all.reduce(|a, b| if b.energy > a.energy { b } else { a }).map(|best| best.pixel)
    }

    /// The empty pixel with the least energy; the first of equals.
    fn largest_void(&self) -> Option<usize> {
        let all = self.voids.iter().flatten();
        all.reduce(|a, b| if b.energy < a.energy { b } else { a }).map(|best| best.pixel)
    }

    /// Moves pixels from clusters to voids until none moves.
    fn relax(&mut self) {
        while let Some(cluster) = self.tightest_cluster() {
            self.set(cluster, false);
            let void = self.largest_void().unwrap_or(cluster);
            self.set(void, true);
            if void == cluster {
                return;
            }
        }
    }
}

/// `SplitMix64` (G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom number generators, 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end as u64) as usize
    }
}

/// Ranks of the pixels, slice by slice, row by row: every slice has each rank below `edge * edge` once, so that a
/// threshold gives every slice the same number of pixels.
pub(crate) fn ranks(shape: Shape, seed: u64) -> Vec<u16> {
    let (mut random, pixels) = (Random(seed), shape.pixels());
    let mut order: Vec<usize> = (0..pixels).collect();
    let mut first = Pattern::new(shape);
    let count = pixels / FIRST_SHARE;
    for i in 0..count {
        order.swap(i, i + random.below(pixels - i));
        first.set(order[i], true);
    }
    first.relax();
    // Pixels in the order of their ranks in the whole volume: the first pattern backwards by its clusters, then the
    // others by its voids. (The published third step, clusters of empty pixels, finds the same pixels: the energies
    // of all pixels together are the same everywhere.)
    let mut order: Vec<usize> = Vec::with_capacity(pixels);
    let initially_filled = first.filled.clone();
    while let Some(cluster) = first.tightest_cluster() {
        first.set(cluster, false);
        order.push(cluster);
    }
    order.reverse();
    for pixel in (0..pixels).filter(|&pixel| initially_filled[pixel]) {
        first.set(pixel, true);
    }
    while let Some(void) = first.largest_void() {
        first.set(void, true);
        order.push(void);
    }
    ranks_within_slices(shape, &order)
}

fn ranks_within_slices(shape: Shape, order: &[usize]) -> Vec<u16> {
    let mut next = vec![0u16; shape.slices];
    let mut ranks = vec![0; shape.pixels()];
    for &pixel in order {
        let rank = &mut next[pixel / shape.slice()];
        ranks[pixel] = *rank;
        *rank += 1;
    }
    ranks
}
