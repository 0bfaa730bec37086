//! From a field to samples: one block, a whole array, or a compressed stream.

use std::num::NonZero;
use std::ops::Range;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use volume_io::{BlockEncoder, Error, Result, ZfpVolume, bits_per_block, pad_block};

use crate::Field;

/// Blocks that a thread samples and encodes at a time: their bits fill whole words at every rate.
const CHUNK: u64 = 1024;

/// Threads at most.
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
    if valid == [4; 3] {
        return field.block(origin);
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
/// the whole volume never exist at once, so that 1024^3 voxels at rate 1 take 270 MB (the stream and
/// one copy of it at the end). Several threads sample and encode where there are cores for them; the
/// stream does not depend on their number. Where a field says that it is [`Field::constant`], its
/// blocks cost next to nothing.
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
    let blocks = BlockEncoder::new(dims, rate)?.block_count();
    let mut encoder = ChunkEncoder::new(field, dims, rate);
    let bits_per_block = bits_per_block(rate)?;
    let length = blocks.div_ceil(CHUNK) * CHUNK * u64::from(bits_per_block) / 8;
    let mut bytes = Vec::new();
    let room = usize::try_from(length).unwrap_or(usize::MAX);
    if bytes.try_reserve_exact(room).is_err() {
        return Err(Error::OutOfMemory { bytes: length });
    }
    thread::scope(|scope| {
        let workers = Workers::start(scope, field, dims, rate, threads);
        for chunk in 0..blocks.div_ceil(CHUNK) {
            bytes.extend_from_slice(&workers.chunk(chunk, || encoder.encode(chunk))?);
        }
        Ok::<(), Error>(())
    })?;
    let mut volume = ZfpVolume::from_stream(dims, bits_per_block, 0, bytes)?;
    volume.source.encoded = true;
    Ok(volume)
}

/// Makes the stream of a volume in pieces of [`CHUNK`] blocks, which follow each other without a gap.
struct ChunkEncoder<'a, F: ?Sized> {
    field: &'a F,
    dims: [u32; 3],
    rate: f64,
    /// The last chunk of one value: its bits and its piece of the stream.
    constant: Option<(u32, Vec<u8>)>,
}

impl<'a, F: Field + ?Sized> ChunkEncoder<'a, F> {
    fn new(field: &'a F, dims: [u32; 3], rate: f64) -> Self {
        Self { field, dims, rate, constant: None }
    }

    /// The piece of the stream with the blocks of a chunk.
    fn encode(&mut self, chunk: u64) -> Result<Vec<u8>> {
        let blocks = chunk * CHUNK..((chunk + 1) * CHUNK).min(block_count(self.dims));
        let values: Vec<Option<f32>> = blocks.clone().map(|k| self.constant_value(k)).collect();
        let whole = values[0].filter(|v| values.iter().all(|w| *w == Some(*v)));
        let whole = whole.filter(|_| values.len() as u64 == CHUNK).map(f32::to_bits);
        match (&self.constant, whole) {
            (Some((bits, piece)), Some(value)) if *bits == value => Ok(piece.clone()),
            _ => {
                let piece = self.encode_blocks(blocks, &values)?;
                self.constant = whole.map(|value| (value, piece.clone())).or(self.constant.take());
                Ok(piece)
            }
        }
    }

    fn encode_blocks(&self, blocks: Range<u64>, values: &[Option<f32>]) -> Result<Vec<u8>> {
        let mut encoder = self.encoder(values.len() as u32)?;
        for (k, value) in blocks.clone().zip(values) {
            let samples = match value {
                Some(value) => [*value; 64],
                None => sample_block(self.field, self.dims, self.block(k)),
            };
            encoder.push(&samples).map_err(|error| self.in_volume(error, blocks.start))?;
        }
        Ok(encoder.finish()?.bytes.to_vec())
    }

    /// An encoder for `count` blocks in a row.
    fn encoder(&self, count: u32) -> Result<BlockEncoder> {
        BlockEncoder::new([4 * count, 4, 4], self.rate)
    }

    /// Position of block `k` in blocks.
    fn block(&self, k: u64) -> [u32; 3] {
        let [bx, by, _] = self.dims.map(|n| u64::from(n.div_ceil(4).max(1)));
        [k % bx, k / bx % by, k / bx / by].map(|i| i as u32)
    }

    fn constant_value(&self, k: u64) -> Option<f32> {
        let low = self.block(k).map(|b| f64::from(4 * b));
        self.field.constant(low, low.map(|x| x + 3.0)).map(|value| value as f32)
    }

    /// An error with the voxel in the volume instead of the one in a row of blocks that starts with
    /// block `first`.
    fn in_volume(&self, error: Error, first: u64) -> Error {
        let global = |[x, y, z]: [u32; 3]| {
            let [bx, by, bz] = self.block(first + u64::from(x / 4));
            [4 * bx + x % 4, 4 * by + y, 4 * bz + z]
        };
        match error {
            Error::NonFinite { voxel, value } => Error::NonFinite { voxel: global(voxel), value },
            Error::TooLarge { voxel, value } => Error::TooLarge { voxel: global(voxel), value },
            other => other,
        }
    }
}

/// Threads that encode chunks ahead of the one that puts them together: with n threads, thread i
/// encodes the chunks i, i + n, ...
struct Workers {
    chunks: Vec<Receiver<Result<Vec<u8>>>>,
}

impl Workers {
    /// Starts `threads` threads, or none if one is as good or the system refuses.
    fn start<'scope, 'env, F: Field + ?Sized>(
        scope: &'scope thread::Scope<'scope, 'env>,
        field: &'env F,
        dims: [u32; 3],
        rate: f64,
        threads: usize,
    ) -> Workers {
        let mut chunks = Vec::new();
        if threads < 2 {
            return Workers { chunks };
        }
        for first in 0..threads {
            let (sender, receiver) = sync_channel(8);
            let encoder = ChunkEncoder::new(field, dims, rate);
            let send = move || send_chunks(encoder, first..threads, &sender);
            if thread::Builder::new().spawn_scoped(scope, send).is_err() {
                return Workers { chunks: Vec::new() };
            }
            chunks.push(receiver);
        }
        Workers { chunks }
    }

    /// The next chunk, from its thread or, without one, from `encode`.
    fn chunk(&self, chunk: u64, encode: impl FnOnce() -> Result<Vec<u8>>) -> Result<Vec<u8>> {
        let thread = chunk % (self.chunks.len().max(1) as u64);
        let receiver = self.chunks.get(thread as usize);
        receiver.and_then(|chunks| chunks.recv().ok()).unwrap_or_else(encode)
    }
}

/// Sends every chunk of one thread (`share` = its number to the number of threads), in order; stops
/// early once nobody receives them any more.
fn send_chunks(
    mut encoder: ChunkEncoder<'_, impl Field + ?Sized>,
    share: Range<usize>,
    sender: &SyncSender<Result<Vec<u8>>>,
) {
    let chunks = block_count(encoder.dims).div_ceil(CHUNK);
    for chunk in (share.start as u64..chunks).step_by(share.end) {
        if sender.send(encoder.encode(chunk)).is_err() {
            return;
        }
    }
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
            // Constant chunks too.
            ("patch", [300, 64, 300], 0.5),
            ("mixing-layer", [60, 130, 200], 1.0),
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
        assert!(matches!(error, Error::NonFinite { voxel: [5, 6, 7], .. }), "{error}");
        let error = generate(&Broken, [0, 4, 4], 1.0).unwrap_err();
        assert!(matches!(error, Error::Dims { .. }), "{error}");
    }
}
