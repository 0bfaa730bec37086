//! Files that are no fixed-rate zfp stream become one, in a worker: its memory goes when it ends.

use js_sys::Function;
use volume_io::{FixedRateHeader, Geometry, ReadOptions, convert_bytes};
use wasm_bindgen::prelude::*;

use crate::link::{Link, infill_name};

/// Whether a file with these first bytes can be streamed to the GPU as it is.
#[wasm_bindgen(js_name = isFixedRate)]
pub fn is_fixed_rate(start: &[u8]) -> bool {
    FixedRateHeader::parse(start).is_some()
}

/// Bytes from the start of a file with which [`is_fixed_rate`] is sure.
#[wasm_bindgen(js_name = headerBytes)]
pub fn header_bytes() -> usize {
    FixedRateHeader::BYTES
}

/// Collects a file.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Converter {
    name: String,
    bytes: Vec<u8>,
}

/// A fixed-rate zfp file in pieces.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Converted {
    bytes: Vec<u8>,
    taken: usize,
    geometry: Geometry,
    about: String,
}

#[wasm_bindgen]
impl Converter {
    /// For a file with this name, whose parts may say what it holds, and about so many bytes.
    #[wasm_bindgen(constructor)]
    pub fn new(name: String, length: usize) -> Result<Self, JsError> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(length)?;
        Ok(Self { name, bytes })
    }

    /// Adds the next bytes.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(), JsError> {
        self.bytes.try_reserve(bytes.len())?;
        self.bytes.extend_from_slice(bytes);
        Ok(())
    }

    /// Encodes the volume, and tells `progress` the share that is done.
    pub fn convert(self, progress: &Function) -> Result<Converted, JsError> {
        let mut bytes = Vec::new();
        let tell = |done: u64, all: u64| {
            let share = JsValue::from_f64(done as f64 / all.max(1) as f64);
            // What the page does with it is no matter of the conversion.
            drop(progress.call1(&JsValue::NULL, &share));
        };
        let options = ReadOptions::default();
        let done = convert_bytes(&self.name, &self.bytes, &mut bytes, &options, tell)?;
        let source = &done.source;
        let mut about = format!(
            "{} with {} samples, encoded at {} bits per voxel",
            source.format,
            source.sample_type.raw_name(),
            options.rate
        );
        if let Some(distortion) = &source.distortion {
            about += &format!(", largest error {:.3}", distortion.max);
        }
        Ok(Converted { bytes, taken: 0, geometry: done.geometry, about })
    }
}

#[wasm_bindgen]
impl Converted {
    /// Spacing and origin, x first.
    pub fn geometry(&self) -> Vec<f64> {
        [self.geometry.spacing, self.geometry.origin].concat()
    }

    /// What was converted, in a line.
    pub fn about(&self) -> String {
        self.about.clone()
    }

    /// Bytes in all.
    pub fn length(&self) -> usize {
        self.bytes.len()
    }

    /// The next piece; empty behind the last one.
    pub fn take(&mut self) -> Vec<u8> {
        const PIECE: usize = 1 << 20;
        let end = (self.taken + PIECE).min(self.bytes.len());
        let piece = self.bytes[self.taken..end].to_vec();
        self.taken = end;
        piece
    }
}

/// The address of the volume in the part of an address behind `#`, if there is one.
#[wasm_bindgen(js_name = linkedVolume)]
pub fn linked_volume(fragment: &str) -> Option<String> {
    Link::parse(fragment).volume
}

/// The in-fill that the part of an address behind `#` asks for, if it does.
#[wasm_bindgen(js_name = linkedInfill)]
pub fn linked_infill(fragment: &str) -> Option<String> {
    Link::parse(fragment).infill.map(|infill| infill_name(infill).to_owned())
}
