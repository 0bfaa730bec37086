//! A device, volumes and random numbers that the tests share.

use std::sync::OnceLock;

use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use gpu_testkit::gpu;
use macrocell::{Activate, Grid, Ranges, wgpu};

/// What outputs hold before a kernel writes them.
pub(crate) const SENTINEL: u32 = 0xDEAD_BEEF;

pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) ranges: Ranges,
    pub(crate) activate: Activate,
}

pub(crate) fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| {
        let (device, queue) = gpu::device();
        let (ranges, activate) = (Ranges::new(&device), Activate::new(&device, true));
        Gpu { device, queue, ranges, activate }
    })
}

impl Gpu {
    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    pub(crate) fn read(&self, buffer: &wgpu::Buffer) -> Vec<u32> {
        gpu::read_u32s(&self.device, &self.queue, buffer)
    }

    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        gpu::submit_and_wait(&self.device, &self.queue, encoder);
    }

    pub(crate) fn buffer(&self, words: &[u32], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        gpu::buffer_with(&self.device, bytemuck::cast_slice(words), usage)
    }

    pub(crate) fn upload(&self, ledger: &Ledger) -> UploadRing {
        UploadRing::new(ledger, "test.upload", 1 << 20)
    }
}

/// Numbers that look random, the same in every run.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678_9ABC_DEF1)
    }

    pub(crate) fn bits(&mut self) -> u32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = self.0 ^ (self.0 >> 33);
        (x.wrapping_mul(0xFF51_AFD7_ED55_8CCD) >> 32) as u32
    }

    pub(crate) fn below(&mut self, end: u32) -> u32 {
        ((u64::from(self.bits()) * u64::from(end)) >> 32) as u32
    }

    /// From 0 up to, without, 1.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    pub(crate) fn within(&mut self, low: f32, high: f32) -> f32 {
        low + self.unit() * (high - low)
    }

    pub(crate) fn choose<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len() as u32) as usize]
    }
}

pub(crate) fn voxels(dims: [u32; 3]) -> usize {
    dims.iter().map(|&d| d as usize).product()
}

pub(crate) fn sample(dims: [u32; 3], samples: &[f32], [x, y, z]: [u32; 3]) -> f32 {
    samples[x as usize + dims[0] as usize * (y as usize + dims[1] as usize * z as usize)]
}

/// Least and greatest of a dual cell's 8 samples.
pub(crate) fn cell_range(dims: [u32; 3], samples: &[f32], cell: [u32; 3]) -> [f32; 2] {
    (0..8u32).fold([f32::MAX, f32::MIN], |[low, high], corner| {
        let at = [cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)];
        let value = sample(dims, samples, at);
        [low.min(value), high.max(value)]
    })
}

/// All positions below `size`, x fastest.
pub(crate) fn positions(size: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..size[2])
        .flat_map(move |z| (0..size[1]).flat_map(move |y| (0..size[0]).map(move |x| [x, y, z])))
}

/// Kinds of volumes that stress ranges in different ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Constant,
    /// Few different values, so that isovalues meet them exactly.
    Levels,
    Smooth,
    Noise,
    /// Up to 2^124 in size.
    Huge,
    /// Down to the least normal numbers.
    Tiny,
    /// Small differences on a large offset.
    Offset,
}

impl Kind {
    pub(crate) const ALL: [Kind; 7] = [
        Kind::Constant,
        Kind::Levels,
        Kind::Smooth,
        Kind::Noise,
        Kind::Huge,
        Kind::Tiny,
        Kind::Offset,
    ];

    pub(crate) fn volume(self, dims: [u32; 3], random: &mut Random) -> Vec<f32> {
        let level = random.within(-100.0, 100.0);
        let wave: [f32; 3] = std::array::from_fn(|_| random.within(0.01, 0.3));
        positions(dims)
            .map(|position| match self {
                Kind::Constant => level,
                Kind::Levels => random.below(4) as f32 - 1.0,
                Kind::Smooth => {
                    let phases = (0..3).map(|a| (position[a] as f32 * wave[a]).sin());
                    40.0 * phases.sum::<f32>()
                }
                Kind::Noise => random.within(-3.0, 5.0),
                Kind::Huge => random.choose(&[1.0, -1.0]) * random.unit() * 2.0f32.powi(124),
                Kind::Tiny => {
                    (1.0 + random.unit()) * f32::MIN_POSITIVE * random.choose(&[1.0, 4.0])
                }
                Kind::Offset => 30_000.0 + random.below(64) as f32 / 256.0,
            })
            // One zero, so that minima have one bit pattern.
            .map(|value| if value == 0.0 { 0.0 } else { value })
            .collect()
    }
}

/// Values where a range test may go wrong: block minima and maxima and their neighbours.
pub(crate) fn isovalues(grid: &Grid, samples: &[f32], random: &mut Random) -> Vec<f32> {
    let mut list = vec![0.0, 1.0e30, -1.0e30];
    for _ in 0..4 {
        let block = grid.blocks().map(|b| random.below(b));
        let [low, high] = macrocell::cpu::ranges::block_range(grid.dims(), samples, block);
        if low <= high {
            list.extend([low, high, low + (high - low) * random.unit()]);
            list.extend([low, high].map(f32::next_up).into_iter().filter(|v| v.is_normal()));
        }
    }
    list.extend((0..4).map(|_| samples[random.below(samples.len() as u32) as usize]));
    list
}
