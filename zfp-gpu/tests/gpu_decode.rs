//! The GPU decoder against the CPU decoder, bit for bit, and what it must leave alone.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::gpu::{Cache, Gpu, SENTINEL};
use common::{KINDS, Kind, Random, assert_same_bits, behind_header, encode, field};
use gpu_testkit::gpu::{sentinel_buffer, submit_and_wait};
use zfp_gpu::cpu::decode::decode_block;
use zfp_gpu::{Decode, DecodeBuffers, Error, Payload, SLOT_BYTES, StreamLayout};

/// What the cache must hold: decoded blocks in the slots of the jobs, the sentinel elsewhere.
fn expected(
    stream: &[u8],
    layout: &StreamLayout,
    jobs: &[[u32; 2]],
    cache_floats: usize,
) -> Vec<f32> {
    let mut cache = vec![f32::from_bits(SENTINEL); cache_floats];
    for &[block, slot] in jobs {
        if let Some(slot) = cache.chunks_exact_mut(64).nth(slot as usize) {
            slot.copy_from_slice(&decode_block(stream, layout, block.into()));
        }
    }
    cache
}

/// Decodes all blocks in shuffled order into shuffled slots, with some slots to spare.
fn check(gpu: &mut Gpu, kind: Kind, layout: &StreamLayout, page_bytes: u64, cache_pages: u32) {
    let context = format!("{kind:?} {layout:?}, pages of {page_bytes} bytes, cache {cache_pages}");
    let mut random = Random::new(layout.first_bit + u64::from(layout.bits_per_block));
    let plain = encode(&field(kind, layout.dims, 11), layout.dims, layout.bits_per_block);
    let stream = behind_header(&plain, layout, &mut random);
    let payload = gpu.payload(layout, &stream, page_bytes);
    let blocks = layout.block_count() as u32;
    let mut slots: Vec<u32> = (0..blocks + blocks / 3 + 3).collect();
    random.shuffle(&mut slots);
    let mut jobs: Vec<[u32; 2]> = (0..blocks).zip(slots).map(|(b, s)| [b, s]).collect();
    random.shuffle(&mut jobs);
    let cache = Cache::new(gpu, cache_pages, blocks + blocks / 3 + 3);
    let found = cache.run(gpu, &payload, &jobs, blocks);
    assert_same_bits(&found, &expected(&stream, layout, &jobs, found.len()), &context);
}

#[test]
fn every_kind_equals_the_cpu() {
    let mut gpu = Gpu::new();
    for (index, kind) in KINDS.into_iter().enumerate() {
        for bits in [9, 10, 33, 64, 77, 160, 291, 512, 1023, 1377, 2048, 2119, 2120, 2121] {
            let first_bit = [0, 96, 148, 31, 33][(index + bits as usize) % 5];
            let layout = StreamLayout::new([13, 10, 7], bits, first_bit).unwrap();
            check(&mut gpu, kind, &layout, 128 << 20, 1 + bits % 3);
        }
    }
}

#[test]
fn every_bit_offset_equals_the_cpu() {
    let mut gpu = Gpu::new();
    for first_bit in 0..40 {
        let layout = StreamLayout::new([9, 5, 6], 211, first_bit).unwrap();
        check(&mut gpu, Kind::Mixed, &layout, 128 << 20, 1);
    }
}

#[test]
fn page_splits_do_not_show() {
    let mut gpu = Gpu::new();
    for (bits, first_bit, page_bytes) in [
        (64, 0, 16 << 10),
        (413, 148, 64 << 10),
        (413, 96, (413 + 3) * 4),
        (1999, 5, (1999 + 3) * 4),
        (77, 31, 4099),
    ] {
        let layout = StreamLayout::new([70, 50, 41], bits, first_bit).unwrap();
        let limits = wgpu::Limits { max_buffer_size: page_bytes, ..wgpu::Limits::default() };
        assert!(Payload::plan(&layout, &limits).unwrap().page_count() > 1, "{bits} bits split");
        check(&mut gpu, Kind::Mixed, &layout, page_bytes, 2);
    }
}

fn small_case(gpu: &mut Gpu) -> (StreamLayout, Vec<u8>, Payload) {
    let layout = StreamLayout::new([32, 16, 12], 300, 96).unwrap();
    let plain = encode(&field(Kind::Smooth, layout.dims, 5), layout.dims, 300);
    let stream = behind_header(&plain, &layout, &mut Random::new(1));
    let payload = gpu.payload(&layout, &stream, 128 << 20);
    (layout, stream, payload)
}

#[test]
fn only_counted_jobs_run() {
    let mut gpu = Gpu::new();
    let (layout, stream, payload) = small_case(&mut gpu);
    let jobs: Vec<_> = (0..90).map(|i| [89 - i, i]).collect();
    for count in [0, 1, 63, 64, 65, 89, 90, 91, u32::MAX] {
        let cache = Cache::new(&gpu, 3, 91);
        let found = cache.run(&gpu, &payload, &jobs, count);
        let run = &jobs[..jobs.len().min(count as usize)];
        let expected = expected(&stream, &layout, run, found.len());
        assert_same_bits(&found, &expected, &format!("{count} jobs"));
    }
}

#[test]
fn jobs_outside_volume_or_cache_are_skipped() {
    let mut gpu = Gpu::new();
    let (layout, stream, payload) = small_case(&mut gpu);
    let good = [[3, 1], [95, 5], [0, 7]];
    let bad = [[96, 0], [u32::MAX, 2], [5, 8], [6, u32::MAX], [1 << 31, 3], [7, 1 << 31]];
    let jobs: Vec<_> = bad.into_iter().chain(good).collect();
    for pages in [1, 2] {
        let cache = Cache::new(&gpu, pages, 8);
        let found = cache.run(&gpu, &payload, &jobs, jobs.len() as u32);
        let expected = expected(&stream, &layout, &good, found.len());
        assert_same_bits(&found, &expected, &format!("{pages} cache pages"));
    }
}

#[test]
fn indirect_dispatches_equal_direct_ones() {
    let mut gpu = Gpu::new();
    let (layout, stream, payload) = small_case(&mut gpu);
    let jobs: Vec<_> = (0..96).map(|i| [i, 95 - i]).collect();
    let list = gpu.storage(jobs.as_flattened());
    let args = gpu.storage(&[9, 9, 3, 1, 1, 9]);
    let count = gpu.storage(&[80]);
    let cache = Cache::new(&gpu, 1, 96);
    let buffers = cache.bind(&gpu, &payload, &list, (&count, 0));
    let mut encoder = gpu.encoder();
    cache.decode.record_indirect(&mut encoder, &buffers, &args, 8);
    submit_and_wait(&gpu.device, &gpu.queue, encoder);
    let found = cache.read(&gpu);
    let expected = expected(&stream, &layout, &jobs[..80], found.len());
    assert_same_bits(&found, &expected, "80 jobs of three groups");
}

#[test]
fn blocks_not_uploaded_decode_as_zeros() {
    let mut gpu = Gpu::new();
    let layout = StreamLayout::new([16, 4, 4], 640, 0).unwrap();
    let stream = encode(&field(Kind::Noise, layout.dims, 5), layout.dims, 640);
    let plan = Payload::plan(&layout, &wgpu::Limits::default()).unwrap();
    let mut payload = Payload::new(&gpu.device, &gpu.ledger, &plan);
    let mut encoder = gpu.encoder();
    payload.record_upload(&gpu.device, &mut encoder, &mut gpu.upload, 0, &stream[..160]).unwrap();
    submit_and_wait(&gpu.device, &gpu.queue, encoder);
    assert!(!payload.is_complete());
    let cache = Cache::new(&gpu, 1, 4);
    let jobs = [[0, 0], [1, 1], [2, 2], [3, 3]];
    let found = cache.run(&gpu, &payload, &jobs, 4);
    let expected = expected(&stream[..160], &layout, &jobs, 256);
    assert_same_bits(&found, &expected, "half a stream");
    assert!(found[128..].iter().all(|&v| v == 0.0));
}

#[test]
fn a_second_stream_replaces_the_first() {
    let mut gpu = Gpu::new();
    let (layout, _, mut payload) = small_case(&mut gpu);
    let plain = encode(&field(Kind::Noise, layout.dims, 6), layout.dims, 300);
    let stream = behind_header(&plain, &layout, &mut Random::new(2));
    let mut encoder = gpu.encoder();
    let (head, tail) = stream.split_at(777);
    let (device, upload) = (&gpu.device, &mut gpu.upload);
    payload.record_upload(device, &mut encoder, upload, 0, head).unwrap();
    let gap = payload.record_upload(device, &mut encoder, upload, 778, &tail[1..]);
    assert!(matches!(gap, Err(Error::UploadOrder { expected: 777, found: 778 })));
    payload.record_upload(device, &mut encoder, upload, 777, tail).unwrap();
    submit_and_wait(&gpu.device, &gpu.queue, encoder);
    let jobs: Vec<_> = (0..96).map(|i| [i, i]).collect();
    let found = Cache::new(&gpu, 1, 96).run(&gpu, &payload, &jobs, 96);
    assert_same_bits(&found, &expected(&stream, &layout, &jobs, found.len()), "second stream");
}

#[test]
fn reported_bytes_are_allocated_bytes() {
    let gpu = Gpu::new();
    let layout = StreamLayout::new([70, 50, 41], 413, 148).unwrap();
    let limits = wgpu::Limits { max_buffer_size: 1 << 16, ..wgpu::Limits::default() };
    let plan = Payload::plan(&layout, &limits).unwrap();
    let payload = Payload::new(&gpu.device, &gpu.ledger, &plan);
    assert_eq!(gpu.ledger.total(), plan.bytes());
    let sum = (0..payload.page_count()).map(|page| {
        let words = payload.page_words(page).unwrap().size();
        words + payload.page_params(page).unwrap().size()
    });
    assert_eq!(sum.sum::<u64>(), plan.bytes());
    let cache = Cache::new(&gpu, 1, 4);
    let words = gpu.storage(&[0; 4]);
    let buffers = cache.bind(&gpu, &payload, &words, (&words, 0));
    assert_eq!(gpu.ledger.total(), plan.bytes() + DecodeBuffers::BYTES);
    drop((payload, buffers));
    assert_eq!(gpu.ledger.total(), 0);
}

#[test]
fn unfit_buffers_are_refused() {
    let mut gpu = Gpu::new();
    let (_, _, payload) = small_case(&mut gpu);
    assert!(matches!(Decode::new(&gpu.device, 5), Err(Error::CachePages { found: 5, .. })));
    let decode = Decode::new(&gpu.device, 2).unwrap();
    let slots = sentinel_buffer(&gpu.device, 4 * SLOT_BYTES, SENTINEL);
    let words = gpu.storage(&[0; 4]);
    let bind = |cache: &[&wgpu::Buffer], slots_per_page, offset| {
        let count = (&words, offset);
        let ledger = &gpu.ledger;
        DecodeBuffers::new(
            &gpu.device,
            ledger,
            &decode,
            &payload,
            &words,
            count,
            cache,
            slots_per_page,
        )
    };
    let other = sentinel_buffer(&gpu.device, 2 * SLOT_BYTES, SENTINEL);
    assert!(bind(&[&slots, &other], 4, 12).is_ok(), "the last page may be shorter");
    assert!(matches!(bind(&[&slots], 4, 0), Err(Error::CachePages { found: 1, .. })));
    assert!(matches!(bind(&[&slots, &other], 0, 0), Err(Error::CachePages { .. })));
    assert!(matches!(bind(&[&other, &slots], 4, 0), Err(Error::BufferTooSmall { .. })));
    assert!(matches!(bind(&[&slots, &words], 4, 0), Err(Error::BufferTooSmall { .. })));
    assert!(matches!(bind(&[&slots, &other], 4, 16), Err(Error::BufferTooSmall { .. })));
    assert!(matches!(bind(&[&slots, &other], 4, 2), Err(Error::Unaligned { .. })));
}
