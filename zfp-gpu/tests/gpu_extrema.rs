//! Extrema of blocks on the GPU against their CPU twin, and the twin against a plain search.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::gpu::{Gpu, SENTINEL};
use common::{Kind, Random, assert_same_bits, behind_header, encode, field};
use gpu_primitives::memory::{Buffer, Category};
use gpu_testkit::gpu::{read_f32s, sentinel_buffer, submit_and_wait};
use zfp_gpu::cpu::decode::{decode_block, decode_volume};
use zfp_gpu::cpu::extrema::{block_extrema, region_extrema};
use zfp_gpu::{BlockExtrema, Error, ExtremaBuffers, KeptSamples, Payload, StreamLayout};

type Region = ([u32; 3], [u32; 3]);

fn stream(kind: Kind, layout: &StreamLayout) -> Vec<u8> {
    let plain = encode(&field(kind, layout.dims, 4), layout.dims, layout.bits_per_block);
    behind_header(&plain, layout, &mut Random::new(9))
}

fn elements((_, size): Region) -> usize {
    size.iter().product::<u32>() as usize
}

fn check(gpu: &mut Gpu, stage: &BlockExtrema, kind: Kind, layout: &StreamLayout, page_bytes: u64) {
    let [bx, by, bz] = layout.blocks();
    let regions: [Region; 6] = [
        ([0; 3], [bx, by, bz]),
        ([0; 3], [bx + 1, by + 2, bz + 1]),
        ([bx - 1, by - 1, bz - 1], [3, 2, 2]),
        ([bx / 2, by / 3, bz / 2], [2, 3, 1]),
        ([bx, 0, 0], [2, 2, 2]),
        ([u32::MAX, 0, u32::MAX - 1], [1, 2, 3]),
    ];
    let stream = stream(kind, layout);
    let payload = gpu.payload(layout, &stream, page_bytes);
    let most = regions.iter().map(|&r| elements(r)).max().unwrap() + 1;
    for region in regions {
        let output = sentinel_buffer(&gpu.device, most as u64 * 64, SENTINEL);
        let buffers =
            ExtremaBuffers::new(&gpu.device, &gpu.ledger, stage, &payload, &output, None).unwrap();
        let mut encoder = gpu.encoder();
        let (origin, size) = region;
        stage.record(&gpu.device, &mut encoder, &mut gpu.upload, &buffers, origin, size).unwrap();
        submit_and_wait(&gpu.device, &gpu.queue, encoder);
        let mut expected = vec![f32::from_bits(SENTINEL); most * 16];
        region_extrema(&stream, layout, origin, size, &mut expected);
        let found = read_f32s(&gpu.device, &gpu.queue, &output);
        assert_same_bits(&found, &expected, &format!("{kind:?} {layout:?} {region:?}"));
    }
}

#[test]
fn every_shape_equals_the_cpu() {
    let mut gpu = Gpu::new();
    let stage = BlockExtrema::new(&gpu.device, 0).unwrap();
    for shape in 0..64 {
        let dims = [shape % 4 + 9, shape / 4 % 4 + 5, shape / 16 + 1];
        let layout = StreamLayout::new(dims, 190 + shape * 3, u64::from(shape)).unwrap();
        check(&mut gpu, &stage, Kind::Mixed, &layout, 128 << 20);
    }
}

#[test]
fn page_splits_do_not_show() {
    let mut gpu = Gpu::new();
    let stage = BlockExtrema::new(&gpu.device, 0).unwrap();
    let layout = StreamLayout::new([61, 37, 30], 413, 148).unwrap();
    for page_bytes in [4096, 16 << 10] {
        check(&mut gpu, &stage, Kind::Noise, &layout, page_bytes);
    }
}

#[test]
fn the_twin_equals_a_plain_search() {
    let layout = StreamLayout::new([10, 7, 5], 700, 0).unwrap();
    let stream = stream(Kind::Noise, &layout);
    let samples = decode_volume(&stream, &layout);
    for block in 0..12 {
        let block = [block % 3, block / 3 % 2, block / 6];
        let found = block_extrema(&stream, &layout, block);
        for class in 0..8 {
            let chosen = (0..350_u32).filter(|i| {
                let at = [i % 10, i / 10 % 7, i / 70];
                (0..3).all(|axis| {
                    at[axis] / 4 == block[axis] && (class >> axis & 1 == 0 || at[axis] % 4 == 0)
                })
            });
            let values: Vec<f32> = chosen.map(|i| samples[i as usize]).collect();
            let least = values.iter().copied().reduce(f32::min).unwrap();
            let most = values.iter().copied().reduce(f32::max).unwrap();
            let context = format!("block {block:?}, class {class}");
            assert_same_bits(&found[2 * class..2 * class + 2], &[least, most], &context);
        }
    }
}

#[test]
fn two_regions_of_one_encoder_keep_their_parameters() {
    let mut gpu = Gpu::new();
    let stage = BlockExtrema::new(&gpu.device, 0).unwrap();
    let layout = StreamLayout::new([16, 12, 8], 200, 0).unwrap();
    let stream = stream(Kind::Smooth, &layout);
    let payload = gpu.payload(&layout, &stream, 128 << 20);
    let regions: [Region; 2] = [([0, 0, 0], [2, 2, 1]), ([1, 1, 0], [1, 2, 2])];
    let outputs = regions.map(|_| sentinel_buffer(&gpu.device, 4 * 64, SENTINEL));
    let work = sentinel_buffer(&gpu.device, 4 * 64, SENTINEL);
    let buffers =
        ExtremaBuffers::new(&gpu.device, &gpu.ledger, &stage, &payload, &work, None).unwrap();
    let mut encoder = gpu.encoder();
    for ((origin, size), output) in regions.into_iter().zip(&outputs) {
        stage.record(&gpu.device, &mut encoder, &mut gpu.upload, &buffers, origin, size).unwrap();
        encoder.copy_buffer_to_buffer(&work, 0, output, 0, 4 * 64);
    }
    submit_and_wait(&gpu.device, &gpu.queue, encoder);
    for ((origin, size), output) in regions.into_iter().zip(&outputs) {
        let mut expected = [0.0; 64];
        region_extrema(&stream, &layout, origin, size, &mut expected);
        let found = read_f32s(&gpu.device, &gpu.queue, output);
        assert_same_bits(&found, &expected, &format!("region at {origin:?}"));
    }
}

#[test]
fn outputs_that_are_too_small_are_refused() {
    let mut gpu = Gpu::new();
    let stage = BlockExtrema::new(&gpu.device, 0).unwrap();
    let layout = StreamLayout::new([16, 12, 8], 200, 0).unwrap();
    let plan = Payload::plan(&layout, &wgpu::Limits::default()).unwrap();
    let payload = Payload::new(&gpu.device, &gpu.ledger, &plan);
    let before = gpu.ledger.total();
    let output = |bytes| sentinel_buffer(&gpu.device, bytes, SENTINEL);
    let bind =
        |output: &_| ExtremaBuffers::new(&gpu.device, &gpu.ledger, &stage, &payload, output, None);
    assert!(matches!(bind(&output(60)), Err(Error::BufferTooSmall { expected: 64, .. })));
    let buffers = bind(&output(23 * 64)).unwrap();
    assert_eq!(gpu.ledger.total() - before, ExtremaBuffers::BYTES);
    let mut encoder = gpu.encoder();
    let (device, upload) = (&gpu.device, &mut gpu.upload);
    for size in [[4, 3, 2], [u32::MAX; 3]] {
        let result = stage.record(device, &mut encoder, upload, &buffers, [0; 3], size);
        assert!(matches!(result, Err(Error::BufferTooSmall { .. })), "{size:?}");
    }
    assert!(stage.record(device, &mut encoder, upload, &buffers, [0; 3], [4, 5, 1]).is_ok());
}

/// Pages of `per_page` slots for `slots` slots, filled with the sentinel.
fn slot_pages(gpu: &Gpu, slots: u64, per_page: u64) -> Vec<Buffer> {
    let page = |first: u64| {
        let count = per_page.min(slots - first) as usize;
        let words = vec![SENTINEL; 64 * count];
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let bytes = bytemuck::cast_slice(&words);
        gpu.ledger.buffer_with(&gpu.device, Category::Slots, "test.slots", usage, bytes)
    };
    (0..slots).step_by(per_page as usize).map(page).collect()
}

#[test]
fn kept_samples_equal_the_decoded_ones() {
    let mut gpu = Gpu::new();
    let layout = StreamLayout::new([61, 37, 30], 413, 148).unwrap();
    let [bx, by, bz] = layout.blocks();
    let blocks = u64::from(bx * by * bz);
    let stream = stream(Kind::Mixed, &layout);
    let payload = gpu.payload(&layout, &stream, 16 << 10);
    let output = sentinel_buffer(&gpu.device, u64::from((bx + 1) * (by + 1) * 5) * 64, SENTINEL);
    for pages in 1..=4 {
        let stage = BlockExtrema::new(&gpu.device, pages).unwrap();
        let per_page = blocks.div_ceil(u64::from(pages));
        let slots = slot_pages(&gpu, blocks, per_page);
        let kept = KeptSamples { pages: &slots, slots_per_page: per_page as u32 };
        let buffers =
            ExtremaBuffers::new(&gpu.device, &gpu.ledger, &stage, &payload, &output, Some(kept))
                .unwrap();
        let mut encoder = gpu.encoder();
        // Two layers of regions, each with the next layer on top.
        for (origin, size) in [([0; 3], [bx + 1, by + 1, 5]), ([0, 0, 4], [bx + 1, by + 1, 5])] {
            let (device, upload) = (&gpu.device, &mut gpu.upload);
            stage.record(device, &mut encoder, upload, &buffers, origin, size).unwrap();
        }
        submit_and_wait(&gpu.device, &gpu.queue, encoder);
        let read = |page: &Buffer| read_f32s(&gpu.device, &gpu.queue, page);
        let found: Vec<f32> = slots.iter().flat_map(read).collect();
        let block = |b: u64| decode_block(&stream, &layout, b);
        let expected: Vec<f32> = (0..blocks).flat_map(block).collect();
        assert_same_bits(&found, &expected, &format!("{pages} pages"));
    }
}

#[test]
fn unfit_pages_of_kept_samples_are_refused() {
    let mut gpu = Gpu::new();
    let layout = StreamLayout::new([16, 12, 8], 200, 0).unwrap();
    let payload = gpu.payload(&layout, &stream(Kind::Smooth, &layout), 1 << 20);
    let stage = BlockExtrema::new(&gpu.device, 2).unwrap();
    let output = sentinel_buffer(&gpu.device, 24 * 64, SENTINEL);
    let bind = |kept| {
        ExtremaBuffers::new(&gpu.device, &gpu.ledger, &stage, &payload, &output, kept).map(drop)
    };
    let (good, short) = (slot_pages(&gpu, 24, 12), slot_pages(&gpu, 23, 12));
    let kept = |pages, slots_per_page| Some(KeptSamples { pages, slots_per_page });
    assert!(bind(kept(&good, 12)).is_ok());
    assert!(matches!(bind(None), Err(Error::CachePages { found: 0, .. })));
    assert!(matches!(bind(kept(&good[..1], 24)), Err(Error::CachePages { found: 1, .. })));
    assert!(matches!(bind(kept(&short, 12)), Err(Error::BufferTooSmall { .. })));
    assert!(matches!(bind(kept(&good, 11)), Err(Error::BufferTooSmall { .. })));
    assert!(BlockExtrema::new(&gpu.device, 5).is_err());
}
