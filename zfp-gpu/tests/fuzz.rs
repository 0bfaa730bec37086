//! Any bytes as a payload, for both decoders: seeded inputs, a few in every run of the tests and any number of
//! them by `PROGRESSIVE_ISO_FUZZ_RUNS` (inputs of the CPU decoder, blocks of the GPU's), from the seed
//! `PROGRESSIVE_ISO_FUZZ_SEED` on.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(clippy::print_stdout, reason = "executions, shown with --nocapture and when a run fails")]

mod common;
#[allow(unreachable_pub, reason = "a library of its own for the fuzzer")]
#[path = "../fuzz/exercise.rs"]
mod exercise;

use common::Random;
use common::gpu::{Cache, Gpu};
use zfp_gpu::StreamLayout;
use zfp_gpu::cpu::decode::decode_block;

fn number(variable: &str, default: u64) -> u64 {
    std::env::var(variable).map_or(default, |text| text.parse().unwrap())
}

/// Runs, and the first seed.
fn runs(default: u64) -> (u64, u64) {
    (number("PROGRESSIVE_ISO_FUZZ_RUNS", default), number("PROGRESSIVE_ISO_FUZZ_SEED", 1))
}

/// Says which run it was that panics.
struct Run(u64);

impl Drop for Run {
    fn drop(&mut self) {
        if std::thread::panicking() {
            println!("PROGRESSIVE_ISO_FUZZ_SEED={}", self.0);
        }
    }
}

fn bytes(random: &mut Random, count: usize) -> Vec<u8> {
    (0..count).map(|_| random.next() as u8).collect()
}

#[test]
fn the_cpu_decodes_any_bytes() {
    let (runs, seed) = runs(2000);
    for run in seed..seed + runs {
        let _run = Run(run);
        let mut random = Random::new(run);
        let count = random.below(600) as usize;
        exercise::decode(&bytes(&mut random, count));
    }
    println!("{runs} payloads from seed {seed} on");
}

/// What the guards of the other tests would show, did a decoder read them.
#[test]
fn flipped_bits_are_other_samples() {
    let layout = StreamLayout::new([8, 4, 4], 300, 5).unwrap();
    let samples = |bytes: &[u8], block| decode_block(bytes, &layout, block).map(f32::to_bits);
    // Half of random blocks are empty: one bit says so.
    let payload = (1..)
        .map(|seed| bytes(&mut Random::new(seed), layout.stream_bytes() as usize))
        .find(|payload| [0, 1].iter().all(|&block| samples(payload, block) != [0; 64]))
        .unwrap();
    let flipped: Vec<u8> = payload.iter().map(|byte| !byte).collect();
    let guarded = exercise::with_block(&flipped, &payload, &layout, 1);
    assert_eq!(samples(&guarded, 1), samples(&payload, 1));
    assert_ne!(samples(&guarded, 0), samples(&payload, 0));
    assert_ne!(samples(&flipped, 1), samples(&payload, 1));
}

/// A layout of at most 1000 blocks of any size, most of them small, anywhere in a word.
fn layout(random: &mut Random) -> StreamLayout {
    let most = [40, 300, 2200][random.below(3) as usize];
    let (bits, first_bit) = (9 + random.below(most), u64::from(random.below(64)));
    let dims = [0; 3].map(|_| 1 + random.below(40));
    StreamLayout::new(dims, bits, first_bit).unwrap()
}

/// The samples of all blocks in order, from pages of at most `page_bytes`.
fn decoded(gpu: &mut Gpu, layout: &StreamLayout, stream: &[u8], page_bytes: u64) -> Vec<f32> {
    let blocks = layout.block_count() as u32;
    let payload = gpu.payload(layout, stream, page_bytes);
    let jobs: Vec<[u32; 2]> = (0..blocks).map(|block| [block, block]).collect();
    Cache::new(gpu, 1, blocks).run(gpu, &payload, &jobs, blocks)
}

/// Both decoders agree on every finite sample, bit for bit; what overflows is the CPU's infinity and the
/// GPU's choice. A block's samples depend on its own bits alone: with all others flipped, before it, after
/// it and at the ends of its page, they stay.
#[test]
fn the_gpu_decodes_any_bytes_as_the_cpu_does() {
    let (least_blocks, seed) = runs(4000);
    let mut gpu = Gpu::new();
    let (mut blocks, mut run, mut infinite) = (0, seed, 0);
    while blocks < least_blocks {
        let _run = Run(run);
        let mut random = Random::new(run);
        let layout = layout(&mut random);
        let stream = bytes(&mut random, layout.stream_bytes() as usize);
        let least_page = u64::from(layout.bits_per_block + 3) * 4;
        let page_bytes = least_page.max(256) << random.below(6);
        let found = decoded(&mut gpu, &layout, &stream, page_bytes);
        for (block, found) in (0..layout.block_count()).zip(found.chunks_exact(64)) {
            let expected = decode_block(&stream, &layout, block);
            for (found, expected) in found.iter().zip(expected) {
                let same = found.to_bits() == expected.to_bits();
                assert!(
                    same || !expected.is_finite(),
                    "{found} {expected}, block {block}, {layout:?}"
                );
                infinite += u64::from(!expected.is_finite());
            }
        }
        let block = u64::from(random.below(layout.block_count() as u32));
        let flipped: Vec<u8> = stream.iter().map(|byte| !byte).collect();
        let guarded = exercise::with_block(&flipped, &stream, &layout, block);
        let again = decoded(&mut gpu, &layout, &guarded, page_bytes);
        let place = 64 * block as usize..64 * (block as usize + 1);
        for (found, again) in found[place.clone()].iter().zip(&again[place]) {
            assert_eq!(found.to_bits(), again.to_bits(), "block {block} of {layout:?}");
        }
        blocks += 2 * layout.block_count();
        run += 1;
    }
    println!("{blocks} blocks, seeds {seed} to {}, {infinite} samples overflow", run - 1);
}
