//! The bundled scan.

use volume_io::{ReadOptions, ZfpVolume, read_bytes};

/// An isovalue of [`brain`] whose surface is the cortex: between the fluid in its furrows (about
/// 25) and grey matter (about 70; white matter has 86), with zero outside the brain.
pub const BRAIN_ISOVALUE: f32 = 58.0;

/// Bits per voxel at which the bundled scan is stored: 256 bits per block.
pub const BRAIN_RATE: f64 = 4.0;

const FILE: &[u8] = include_bytes!("../data/icbm152-2009c-t1-brain.zfp");

/// A T1-weighted magnetic resonance image of a human brain, the average of 152 people: the ICBM
/// 2009c nonlinear asymmetric template without skull, 193 x 229 x 193 voxels of 1 mm, values 0 to
/// about 98, stored as fixed-rate ZFP at [`BRAIN_RATE`]. x runs from left to right, y from back to
/// front, z from feet to head. Copying its 4.3 MiB is all that a call costs.
///
/// Against the original integers the decoded values are off by at most 25.2 (at the cut-out edge of
/// the brain, where values jump from 0 to 50 and more, and ripple there to -21.5) and by 0.49 in
/// the root mean square; 99.4 % of the voxels by less than 3.
///
/// The notice that must stay with the data is `data/icbm152-2009c-t1-brain.NOTICE.txt`.
#[must_use]
pub fn brain() -> ZfpVolume {
    read_bytes("icbm152-2009c-t1-brain.zfp", FILE, &ReadOptions::default())
        .expect("a test reads the bundled file")
}
