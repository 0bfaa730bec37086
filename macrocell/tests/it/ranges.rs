//! Ranges and masks of the GPU equal those of the twin, bit for bit.

use gpu_primitives::memory::Ledger;
use macrocell::cpu::ranges;
use macrocell::wgpu::Limits;
use macrocell::{Grid, MacrocellPlan, Masks, RangeBuffers, RangeScratch, Region, wgpu};

use crate::common::{Kind, Random, SENTINEL, gpu, isovalues, positions, sample};

/// Extrema of a region's blocks as the decoder leaves them: blocks outside the volume untouched.
fn extrema(dims: [u32; 3], samples: &[f32], region: &Region) -> Vec<f32> {
    let blocks = Grid::new(dims).blocks();
    let mut out = Vec::new();
    for offset in positions(region.block_size()) {
        let block: [u32; 3] = std::array::from_fn(|a| region.block_origin()[a] + offset[a]);
        if (0..3).any(|a| block[a] >= blocks[a]) {
            out.extend([f32::from_bits(SENTINEL); 16]);
            continue;
        }
        let mut pairs = [[f32::MAX, f32::MIN]; 8];
        let size: [u32; 3] = std::array::from_fn(|a| (dims[a] - 4 * block[a]).min(4));
        for local in positions(size) {
            let at = std::array::from_fn(|a| 4 * block[a] + local[a]);
            let value = sample(dims, samples, at);
            let faces = (0..3).fold(0, |faces, a| faces | usize::from(local[a] == 0) << a);
            for (class, [low, high]) in pairs.iter_mut().enumerate() {
                if class & !faces == 0 {
                    (*low, *high) = (low.min(value), high.max(value));
                }
            }
        }
        out.extend(pairs.as_flattened());
    }
    out
}

fn fill(buffer: &wgpu::Buffer, encoder: &mut wgpu::CommandEncoder) {
    let words = vec![SENTINEL; buffer.size() as usize / 4];
    let source = gpu().buffer(&words, wgpu::BufferUsages::COPY_SRC);
    encoder.copy_buffer_to_buffer(&source, 0, buffer, 0, buffer.size());
}

struct OnGpu {
    ledger: Ledger,
    buffers: RangeBuffers,
    masks: Masks,
}

fn build(plan: &MacrocellPlan, samples: &[f32]) -> OnGpu {
    let gpu = gpu();
    let ledger = Ledger::new();
    let buffers = RangeBuffers::new(&gpu.device, &ledger, plan);
    let scratch = RangeScratch::new(&gpu.device, &ledger, &gpu.ranges, &buffers);
    let mut upload = gpu.upload(&ledger);
    let mut encoder = gpu.encoder();
    fill(buffers.coarse_ranges(), &mut encoder);
    buffers.code_pages().iter().for_each(|page| fill(page, &mut encoder));
    for index in 0..plan.region_count() {
        let region = plan.region(index);
        let extrema = extrema(plan.grid().dims(), samples, &region);
        let bytes = bytemuck::cast_slice(&extrema);
        upload.write(&gpu.device, &mut encoder, scratch.extrema(), 0, bytes);
        gpu.ranges.record(&gpu.device, &mut encoder, &mut upload, &buffers, &scratch, region);
    }
    gpu.submit(encoder);
    let masks = Masks::new(&gpu.device, &ledger, &gpu.activate, &buffers);
    OnGpu { ledger, buffers, masks }
}

impl OnGpu {
    fn ranges(&self) -> ranges::Ranges {
        let low_high = |pair: &[u32]| [pair[0], pair[1]].map(f32::from_bits);
        let coarse = gpu().read(self.buffers.coarse_ranges());
        let codes = self.buffers.code_pages().iter().flat_map(|page| gpu().read(page));
        ranges::Ranges {
            coarse: coarse.chunks_exact(2).map(low_high).collect(),
            codes: codes.flat_map(|word| [word as u16, (word >> 16) as u16]).collect(),
        }
    }

    fn masks(&self, isovalue: f32) -> Vec<u64> {
        let gpu = gpu();
        let mut encoder = gpu.encoder();
        let mut upload = gpu.upload(&self.ledger);
        gpu.activate.record(
            &gpu.device,
            &mut encoder,
            &mut upload,
            &self.buffers,
            &self.masks,
            isovalue,
        );
        gpu.submit(encoder);
        let words = gpu.read(self.masks.buffer());
        words.chunks_exact(2).map(|w| u64::from(w[0]) | u64::from(w[1]) << 32).collect()
    }
}

fn compare(dims: [u32; 3], kind: Kind, limits: &Limits) {
    let mut random = Random::new(u64::from(dims[0] * 7 + dims[1] * 3 + dims[2]));
    let samples = kind.volume(dims, &mut random);
    let plan = MacrocellPlan::new(dims, limits).unwrap();
    let grid = plan.grid();
    let gpu = build(&plan, &samples);
    let expected = ranges::build(&grid, &samples);
    let found = gpu.ranges();
    let bits =
        |list: &[[f32; 2]]| list.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&found.coarse), bits(&expected.coarse), "{dims:?} {kind:?}");
    assert_eq!(found.codes, expected.codes, "{dims:?} {kind:?}");
    for isovalue in isovalues(&grid, &samples, &mut random) {
        let expected = ranges::activate(&grid, &expected, isovalue).buffer(&grid);
        assert_eq!(gpu.masks(isovalue), expected, "{dims:?} {kind:?} at {isovalue}");
    }
}

#[test]
fn small_volumes_of_every_kind() {
    for kind in Kind::ALL {
        for dims in [[1, 1, 1], [2, 2, 2], [5, 4, 3], [17, 16, 33], [21, 1, 9]] {
            compare(dims, kind, &Limits::default());
        }
    }
}

#[test]
fn sizes_around_blocks_and_coarse_cells() {
    let mut random = Random::new(1);
    for _ in 0..12 {
        let dims = std::array::from_fn(|_| 1 + random.below(70));
        compare(dims, random.choose(&Kind::ALL), &Limits::default());
    }
}

#[test]
fn several_pages_of_codes() {
    let limits = Limits { max_storage_buffer_binding_size: 1152, ..Limits::default() };
    for dims in [[70, 69, 67], [33, 50, 80], [16, 16, 160]] {
        let plan = MacrocellPlan::new(dims, &limits).unwrap();
        assert!(plan.pages().count() > 1, "{dims:?}");
        compare(dims, Kind::Noise, &limits);
    }
}

#[test]
fn several_regions_and_a_third_level() {
    for dims in [[130, 131, 129], [1030, 130, 5]] {
        let plan = MacrocellPlan::new(dims, &Limits::default()).unwrap();
        assert!(plan.region_count() > 1 && plan.grid().has_third_level(), "{dims:?}");
        compare(dims, Kind::Smooth, &Limits::default());
    }
    let limits = Limits { max_storage_buffer_binding_size: 1 << 13, ..Limits::default() };
    compare([1030, 130, 5], Kind::Levels, &limits);
}

#[test]
fn masks_follow_the_isovalue_back_and_forth() {
    let dims = [70, 20, 20];
    let samples = Kind::Smooth.volume(dims, &mut Random::new(5));
    let gpu = build(&MacrocellPlan::new(dims, &Limits::default()).unwrap(), &samples);
    let first = gpu.masks(3.0);
    assert!(first.iter().any(|&mask| mask != 0));
    let none = macrocell::cpu::skip::Masks { words: vec![0; first.len() - 4] };
    assert_eq!(gpu.masks(1.0e9), none.buffer(&Grid::new(dims)));
    assert_eq!(gpu.masks(3.0), first);
}
