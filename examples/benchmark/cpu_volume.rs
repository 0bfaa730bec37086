//! A decoded volume as a plain CPU program holds it: linear samples, ranges of blocks, active masks.

use std::sync::{Mutex, PoisonError};

use volume_io::ZfpVolume;
use zfp_gpu::StreamLayout;
use zfp_gpu::cpu::decode::decode_block;

use crate::support::Failure;

/// Threads of everything that the CPU computes here.
const THREADS: usize = 2;

/// Runs `work` on every item, on two threads that take the items in turn.
pub fn for_each<T: Send>(items: impl Iterator<Item = T> + Send, work: impl Fn(T) + Sync) {
    let items = Mutex::new(items);
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                while let Some(item) = next() {
                    work(item);
                }
            });
        }
    });
}

/// All samples of a volume and the value ranges of its blocks.
pub struct CpuVolume {
    dims: [usize; 3],
    samples: Vec<f32>,
    /// Coarse cells (4^3 blocks) on each axis.
    coarse: [usize; 3],
    /// Least and greatest sample of each block's own dual cells, 64 blocks per coarse cell.
    ranges: Vec<[f32; 2]>,
}

/// Which blocks have a sample on either side of an isovalue: a bit for each of a coarse cell's blocks.
pub struct Masks {
    words: Vec<u64>,
}

/// Range of a block without dual cells.
const EMPTY: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

impl CpuVolume {
    pub fn decode(volume: &ZfpVolume) -> Result<Self, Failure> {
        let dims = volume.dims.map(|n| n as usize);
        let coarse = dims.map(|n| n.div_ceil(16));
        let mut decoded = Self { dims, samples: decode_samples(volume)?, coarse, ranges: vec![] };
        decoded.ranges = decoded.block_ranges();
        Ok(decoded)
    }

    /// Voxels on each axis.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// Samples, x fastest.
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    pub fn bytes(&self) -> u64 {
        (size_of_val(&self.samples[..]) + size_of_val(&self.ranges[..])) as u64
    }

    /// Index of the coarse cell that holds a dual cell.
    pub fn coarse_index(&self, cell: [i32; 3]) -> usize {
        let [x, y, z] = cell.map(|c| (c >> 4) as usize);
        x + self.coarse[0] * (y + self.coarse[1] * z)
    }

    /// Active blocks of an isovalue: min < isovalue <= max.
    pub fn masks(&self, isovalue: f32) -> Masks {
        let active = |[low, high]: [f32; 2]| low < isovalue && isovalue <= high;
        let word = |ranges: &[[f32; 2]]| {
            ranges.iter().rev().fold(0, |word, &range| word << 1 | u64::from(active(range)))
        };
        Masks { words: self.ranges.chunks_exact(64).map(word).collect() }
    }

    fn block_ranges(&self) -> Vec<[f32; 2]> {
        let mut ranges = vec![EMPTY; self.coarse.iter().product::<usize>() * 64];
        for_each(ranges.chunks_exact_mut(64).enumerate(), |(index, ranges)| {
            let [nx, ny, _] = self.coarse;
            let coarse = [index % nx, index / nx % ny, index / (nx * ny)];
            for (lane, range) in ranges.iter_mut().enumerate() {
                let block = [lane % 4, lane / 4 % 4, lane / 16];
                *range = self.block_range(std::array::from_fn(|a| 4 * coarse[a] + block[a]));
            }
        });
        ranges
    }

    /// Over the 5^3 samples of the block's own dual cells, fewer at the volume's end.
    fn block_range(&self, block: [usize; 3]) -> [f32; 2] {
        let mut range = EMPTY;
        let low = block.map(|b| 4 * b);
        if (0..3).any(|a| low[a] + 1 >= self.dims[a]) {
            return range;
        }
        let high: [usize; 3] = std::array::from_fn(|a| (low[a] + 5).min(self.dims[a]));
        for z in low[2]..high[2] {
            for y in low[1]..high[1] {
                let row = self.dims[0] * (y + self.dims[1] * z);
                for &value in &self.samples[row + low[0]..row + high[0]] {
                    range = [range[0].min(value), range[1].max(value)];
                }
            }
        }
        range
    }
}

impl Masks {
    /// The 64 blocks of a coarse cell; block (x, y, z) in it has bit x + 4y + 16z.
    pub fn word(&self, coarse: usize) -> u64 {
        self.words[coarse]
    }

    pub fn bytes(&self) -> u64 {
        size_of_val(&self.words[..]) as u64
    }
}

fn decode_samples(volume: &ZfpVolume) -> Result<Vec<f32>, Failure> {
    let layout = StreamLayout::new(volume.dims, volume.bits_per_block, volume.first_bit)?;
    let [nx, ny, nz] = volume.dims.map(|n| n as usize);
    let [bx, by, _] = layout.blocks().map(|n| n as usize);
    let mut samples = vec![0.0; nx * ny * nz];
    let slabs = samples.chunks_mut(nx * ny * 4).enumerate();
    for_each(slabs, |(slab, samples)| {
        for block in 0..bx * by {
            let values = decode_block(&volume.bytes, &layout, (slab * bx * by + block) as u64);
            let [x0, y0] = [block % bx * 4, block / bx * 4];
            let width = (nx - x0).min(4);
            for (z, layer) in samples.chunks_exact_mut(nx * ny).enumerate() {
                for y in 0..(ny - y0).min(4) {
                    let (from, to) = (4 * y + 16 * z, x0 + nx * (y0 + y));
                    layer[to..to + width].copy_from_slice(&values[from..from + width]);
                }
            }
        }
    });
    Ok(samples)
}
