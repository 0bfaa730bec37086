//! Blocks at the upper faces of a volume.

use proptest::prelude::*;
use volumes::{PlaneRamp, sample_block};

/// A field whose value tells the voxel apart: x + 100 y + 10000 z.
fn indexed() -> PlaneRamp {
    PlaneRamp { slope: [1.0, 100.0, 10000.0], offset: 0.0, through: [0.0; 3] }
}

/// zfp's rule written out: source of each of four positions for 1 to 4 valid samples.
const SOURCES: [[u32; 4]; 4] = [[0, 0, 0, 0], [0, 1, 1, 0], [0, 1, 2, 0], [0, 1, 2, 3]];

proptest! {
    #[test]
    fn partial_blocks_repeat_samples_as_zfp_does(
        dims in prop::array::uniform3(1..14_u32),
        pick in prop::array::uniform3(0..64_u32),
    ) {
        let block = [0, 1, 2].map(|axis| pick[axis] % dims[axis].div_ceil(4));
        let samples = sample_block(&indexed(), dims, block);
        for (i, sample) in samples.iter().enumerate() {
            let local = [i % 4, i / 4 % 4, i / 16];
            let voxel = [0, 1, 2].map(|axis| {
                let valid = (dims[axis] - 4 * block[axis]).min(4) as usize;
                4 * block[axis] + SOURCES[valid - 1][local[axis]]
            });
            let expected = (voxel[0] + 100 * voxel[1] + 10000 * voxel[2]) as f32;
            prop_assert_eq!(*sample, expected, "sample {:?} of block {:?}", local, block);
        }
    }
}

#[test]
fn a_block_outside_the_volume_is_zero() {
    for block in [[2, 0, 0], [0, 2, 0], [0, 0, u32::MAX]] {
        assert_eq!(sample_block(&indexed(), [8, 8, 8], block), [0.0; 64]);
    }
}
