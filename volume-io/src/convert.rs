//! The way from samples of any type, block by block, to an encoded volume.

use zfp_rs::{ZfpScalar, ZfpScalarType};

use crate::encode::{Encoded, Encoder, TOO_LARGE};
use crate::error::{Error, Result};
use crate::grid::pad_block;
use crate::options::ReadOptions;
use crate::sink::Sink;
use crate::source::{Format, SampleType};

/// Is told the number of blocks done and their total, after every layer of blocks.
pub(crate) type Progress<'p> = &'p mut dyn FnMut(u64, u64);

/// Checks, replaces, pads, encodes and measures the blocks of a file's samples.
pub(crate) struct Converter<'p, S> {
    encoder: Encoder<S>,
    replacement: Option<f32>,
    replaced: u64,
    progress: Option<Progress<'p>>,
}

/// Fails if the replacement for NaN and infinity is not usable itself.
fn check_options(options: &ReadOptions) -> Result<()> {
    match options.replace_non_finite {
        Some(value) if value.is_nan() || value.abs() >= TOO_LARGE => {
            Err(Error::Replacement { value })
        }
        _ => Ok(()),
    }
}

impl<'p, S: Sink> Converter<'p, S> {
    pub(crate) fn new(
        mut encoder: Encoder<S>,
        options: &ReadOptions,
        progress: Option<Progress<'p>>,
    ) -> Result<Self> {
        check_options(options)?;
        encoder.measure();
        Ok(Self { encoder, replacement: options.replace_non_finite, replaced: 0, progress })
    }

    pub(crate) fn block_count(&self) -> u64 {
        self.encoder.block_count()
    }

    pub(crate) fn next_origin(&self) -> [u32; 3] {
        self.encoder.next_origin()
    }

    pub(crate) fn next_valid(&self) -> [u32; 3] {
        self.encoder.next_valid()
    }

    /// Adds the next block; only its samples inside the volume are looked at.
    pub(crate) fn push(&mut self, mut exact: [f64; 64]) -> Result<()> {
        let (origin, valid) = (self.next_origin(), self.next_valid());
        let [nx, ny, nz] = valid;
        for [x, y, z] in
            (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
        {
            let value = &mut exact[(x + 4 * y + 16 * z) as usize];
            if value.is_finite() {
                // A finite double may still exceed the range of a float, which the encoder would
                // call infinite.
                if value.abs() >= f64::from(TOO_LARGE) {
                    let voxel = [origin[0] + x, origin[1] + y, origin[2] + z];
                    return Err(Error::TooLarge { voxel, value: *value });
                }
                continue;
            }
            let Some(replacement) = self.replacement else {
                let voxel = [origin[0] + x, origin[1] + y, origin[2] + z];
                return Err(Error::NonFinite { voxel, value: *value });
            };
            *value = f64::from(replacement);
            self.replaced += 1;
        }
        pad_block(&mut exact, valid);
        self.encoder.push_exact(&exact.map(|value| value as f32), |i| exact[i])?;
        let layer_ends = self.next_origin()[2] != origin[2];
        if let Some(progress) = &mut self.progress
            && layer_ends
        {
            progress(self.encoder.blocks_done(), self.encoder.block_count());
        }
        Ok(())
    }

    pub(crate) fn finish(
        self,
        format: Format,
        sample_type: SampleType,
        rank: u32,
    ) -> Result<Encoded<S>> {
        let mut encoded = self.encoder.finish()?;
        encoded.source.format = format;
        encoded.source.sample_type = sample_type;
        encoded.source.rank = rank;
        encoded.source.replaced = self.replaced;
        Ok(encoded)
    }
}

/// A scalar type of the ZFP codec.
pub(crate) trait Sample: ZfpScalar {
    fn to_f64(self) -> f64;
}

impl Sample for i32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Sample for i64 {
    fn to_f64(self) -> f64 {
        // Rounds beyond 2^53, far below the precision of the floats that follow.
        self as f64
    }
}

impl Sample for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Sample for f64 {
    fn to_f64(self) -> f64 {
        self
    }
}

impl From<ZfpScalarType> for SampleType {
    fn from(ty: ZfpScalarType) -> Self {
        match ty {
            ZfpScalarType::I32 => Self::I32,
            ZfpScalarType::I64 => Self::I64,
            ZfpScalarType::F32 => Self::F32,
            ZfpScalarType::F64 => Self::F64,
        }
    }
}
