//! From a field to samples: one block, a whole array, or a compressed stream.

use std::num::NonZero;
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use volume_io::{BlockEncoder, Result, ZfpVolume, pad_block};

use crate::Field;

/// Blocks that a thread samples at a time: 256 KiB of samples.
const CHUNK: u64 = 1024;

/// Sampling threads at most; the encoder's own thread keeps up with about this many.
const MAX_THREADS: usize = 8;

/// Samples of one block, sample (x, y, z) at x + 4 y + 16 z.
type Block = [f32; 64];

/// The 64 samples of one 4x4x4 block, sample (x, y, z) at x + 4 y + 16 z. Where the volume ends
/// inside the block, the rest is padded as zfp pads partial blocks, along x, then y, then z: one
/// valid sample is repeated, two (a, b) become (a, b, b, a), three (a, b, c) become (a, b, c, a).
///
/// A block that lies outside the volume is all zero.
#[must_use]
pub fn sample_block(field: &(impl Field + ?Sized), dims: [u32; 3], block: [u32; 3]) -> Block {
    let origin = block.map(|b| b.saturating_mul(4));
    let valid = [0, 1, 2].map(|axis| dims[axis].saturating_sub(origin[axis]).min(4));
    let mut samples = [0.0; 64];
    if valid.contains(&0) {
        return samples;
    }
    for z in 0..valid[2] {
        for y in 0..valid[1] {
            for x in 0..valid[0] {
                let p = [origin[0] + x, origin[1] + y, origin[2] + z];
                samples[(x + 4 * y + 16 * z) as usize] = field.value(p.map(f64::from)) as f32;
            }
        }
    }
    pad_block(&mut samples, valid);
    samples
}

/// All samples of a volume, x fastest: for tests and small volumes.
#[must_use]
pub fn samples(field: &(impl Field + ?Sized), dims: [u32; 3]) -> Vec<f32> {
    let mut samples = Vec::new();
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            for x in 0..dims[0] {
                samples.push(field.value([x, y, z].map(f64::from)) as f32);
            }
        }
    }
    samples
}

/// Samples a field block by block into a fixed-rate stream of `rate` bits per voxel: the samples of
/// the whole volume never exist at once, so that 1024^3 voxels at rate 1 take 270 MB (the stream
/// and one copy of it while the encoder finishes). Several threads sample where there are cores for
/// them; the stream does not depend on their number.
///
/// # Errors
/// [`volume_io::Error::Dims`], [`volume_io::Error::Rate`], or what
/// [`BlockEncoder::push`] says about a field with values that ZFP cannot hold.
pub fn generate(field: &(impl Field + ?Sized), dims: [u32; 3], rate: f64) -> Result<ZfpVolume> {
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    generate_with(field, dims, rate, cores.min(MAX_THREADS))
}

fn generate_with(
    field: &(impl Field + ?Sized),
    dims: [u32; 3],
    rate: f64,
    threads: usize,
) -> Result<ZfpVolume> {
    let mut encoder = BlockEncoder::new(dims, rate)?;
    let chunks = encoder.block_count().div_ceil(CHUNK);
    thread::scope(|scope| {
        let workers = Workers::start(scope, field, dims, threads);
        for chunk in 0..chunks {
            for block in workers.chunk(chunk, || sample_chunk(field, dims, chunk)) {
                encoder.push(&block)?;
            }
        }
        Ok(())
    })?;
    encoder.finish()
}

/// Threads that sample chunks ahead of the encoder: with n threads, thread i samples the chunks i,
/// i + n, ...
struct Workers {
    chunks: Vec<Receiver<Vec<Block>>>,
}

impl Workers {
    /// Starts `threads` threads, or none if one is as good or the system refuses.
    fn start<'scope, 'env, F: Field + ?Sized>(
        scope: &'scope thread::Scope<'scope, 'env>,
        field: &'env F,
        dims: [u32; 3],
        threads: usize,
    ) -> Workers {
        let mut chunks = Vec::new();
        if threads < 2 {
            return Workers { chunks };
        }
        for first in 0..threads {
            let (sender, receiver) = sync_channel(2);
            let sample = move || send_chunks(field, dims, first..threads, &sender);
            if thread::Builder::new().spawn_scoped(scope, sample).is_err() {
                return Workers { chunks: Vec::new() };
            }
            chunks.push(receiver);
        }
        Workers { chunks }
    }

    /// The next chunk, from its thread or, without one, from `sample`.
    fn chunk(&self, chunk: u64, sample: impl FnOnce() -> Vec<Block>) -> Vec<Block> {
        let thread = chunk % (self.chunks.len().max(1) as u64);
        let receiver = self.chunks.get(thread as usize);
        receiver.and_then(|chunks| chunks.recv().ok()).unwrap_or_else(sample)
    }
}

/// Sends every chunk of one thread (`share` = its number to the number of threads), in order; stops
/// early once nobody receives them any more.
fn send_chunks(
    field: &(impl Field + ?Sized),
    dims: [u32; 3],
    share: Range<usize>,
    sender: &SyncSender<Vec<Block>>,
) {
    let chunks = block_count(dims).div_ceil(CHUNK);
    for chunk in (share.start as u64..chunks).step_by(share.end) {
        if sender.send(sample_chunk(field, dims, chunk)).is_err() {
            return;
        }
    }
}

fn sample_chunk(field: &(impl Field + ?Sized), dims: [u32; 3], chunk: u64) -> Vec<Block> {
    let [bx, by, _] = dims.map(|n| u64::from(n.div_ceil(4).max(1)));
    let end = ((chunk + 1) * CHUNK).min(block_count(dims));
    let block = |k: u64| [k % bx, k / bx % by, k / bx / by].map(|i| i as u32);
    (chunk * CHUNK..end).map(|k| sample_block(field, dims, block(k))).collect()
}

/// Blocks of a volume whose sizes were checked.
fn block_count(dims: [u32; 3]) -> u64 {
    dims.map(|n| u64::from(n.div_ceil(4))).iter().product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Turbulence, by_name};

    #[test]
    fn the_stream_does_not_depend_on_the_number_of_threads() {
        // More than three chunks, the last one short.
        let dims = [61, 66, 50];
        assert!(block_count(dims) > 3 * CHUNK && !block_count(dims).is_multiple_of(CHUNK));
        let field = Turbulence::new(dims);
        let alone = generate_with(&field, dims, 4.0, 1).unwrap();
        for threads in [2, 3, 8] {
            let together = generate_with(&field, dims, 4.0, threads).unwrap();
            assert_eq!(together.bytes, alone.bytes, "{threads} threads");
        }
    }

    #[test]
    fn generating_block_by_block_equals_encoding_the_whole_array() {
        for (name, dims, rate) in [
            ("rough-solid", [33, 18, 27], 6.0),
            ("gyroid", [1, 2, 3], 8.0),
            ("shells", [64, 65, 4], 2.25),
        ] {
            let field = by_name(name, dims).unwrap();
            let blocks = generate(&*field, dims, rate).unwrap();
            let whole = volume_io::encode(&samples(&*field, dims), dims, rate).unwrap();
            assert_eq!(blocks.bytes, whole.bytes, "{name}");
            assert_eq!((blocks.dims, blocks.bits_per_block), (dims, whole.bits_per_block));
        }
    }

    #[test]
    fn an_error_of_the_encoder_stops_the_threads() {
        struct Broken;
        impl Field for Broken {
            fn value(&self, p: [f64; 3]) -> f64 {
                if p == [5.0, 6.0, 7.0] { f64::NAN } else { 0.0 }
            }
            fn gradient(&self, _p: [f64; 3]) -> Option<[f64; 3]> {
                None
            }
            fn name(&self) -> &'static str {
                "broken"
            }
            fn suggested_isovalue(&self) -> f64 {
                0.0
            }
        }
        let error = generate_with(&Broken, [200, 100, 100], 1.0, 3).unwrap_err();
        assert!(matches!(error, volume_io::Error::NonFinite { voxel: [5, 6, 7], .. }), "{error}");
        let error = generate(&Broken, [0, 4, 4], 1.0).unwrap_err();
        assert!(matches!(error, volume_io::Error::Dims { .. }), "{error}");
    }
}
