//! The way from samples of any type, block by block, to an encoded volume.

use zfp_rs::{ZfpScalar, ZfpScalarType};

use crate::encode::{BlockEncoder, TOO_LARGE};
use crate::error::{Error, Result};
use crate::formats::ReadOptions;
use crate::grid::pad_block;
use crate::source::{Format, SampleType};
use crate::volume::ZfpVolume;

/// Checks, replaces, pads, encodes and measures the blocks of a file's samples.
pub(crate) struct Converter {
    encoder: BlockEncoder,
    replacement: Option<f32>,
    replaced: u64,
}

impl Converter {
    pub(crate) fn new(dims: [u32; 3], options: &ReadOptions) -> Result<Self> {
        if let Some(value) = options.replace_non_finite
            && (value.is_nan() || value.abs() >= TOO_LARGE)
        {
            return Err(Error::Replacement { value });
        }
        let encoder = BlockEncoder::new(dims, options.rate)?.measured();
        Ok(Self { encoder, replacement: options.replace_non_finite, replaced: 0 })
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
        self.encoder.push_exact(&exact.map(|value| value as f32), |i| exact[i])
    }

    pub(crate) fn finish(
        self,
        format: Format,
        sample_type: SampleType,
        rank: u32,
    ) -> Result<ZfpVolume> {
        let mut volume = self.encoder.finish()?;
        volume.source.format = format;
        volume.source.sample_type = sample_type;
        volume.source.rank = rank;
        volume.source.replaced = self.replaced;
        Ok(volume)
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
