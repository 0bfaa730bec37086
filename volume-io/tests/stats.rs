//! Value range, histogram and suggested isovalue against direct computation.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use volume_io::{Histogram, encode, value_range};

#[test]
fn range_and_histogram_count_each_voxel_once() {
    // Sizes that leave 1, 2 and 3 valid samples in the last blocks.
    let dims = [9, 6, 7];
    let samples: Vec<f32> = (0..9 * 6 * 7).map(|i| ((i * 37) % 101) as f32).collect();
    let volume = encode(&samples, dims, 12.0).unwrap();
    let decoded = volume.decode();
    let min = decoded.iter().copied().fold(f32::INFINITY, f32::min);
    let max = decoded.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    assert_eq!(volume.value_range(), [min, max]);

    let histogram = volume.histogram(10);
    assert_eq!(histogram.total(), 9 * 6 * 7);
    assert_eq!(histogram.range(), [min, max]);
    let mut expected = [0u64; 10];
    for value in decoded {
        let bin = (f64::from(value - min) / f64::from(max - min) * 10.0) as usize;
        expected[bin.min(9)] += 1;
    }
    assert_eq!(histogram.counts(), expected);
}

#[test]
fn the_voxels_of_all_blocks_cover_the_volume_in_place() {
    let dims = [5, 3, 6];
    let samples: Vec<f32> = (0..90).map(|i| i as f32).collect();
    let volume = encode(&samples, dims, 32.0).unwrap();
    let mut seen = [0; 90];
    for ([x, y, z], value) in volume.decoded_blocks().flat_map(|b| b.voxels().collect::<Vec<_>>()) {
        let at = (x + 5 * (y + 3 * z)) as usize;
        seen[at] += 1;
        assert!((value - at as f32).abs() < 1e-3, "{at}: {value}");
    }
    assert_eq!(seen, [1; 90]);
    let one = volume.decode_block(3);
    assert_eq!((one.index, one.origin, one.valid), (3, [4, 0, 4], [1, 3, 2]));
    assert_eq!(Some(one), volume.decoded_blocks().nth(3));
}

#[test]
fn the_suggested_isovalue_separates_two_classes() {
    let mut histogram = Histogram::new([0.0, 100.0], 100);
    for i in 0..900 {
        histogram.add((i % 10) as f32);
    }
    for i in 0..100 {
        histogram.add(80.0 + (i % 5) as f32);
    }
    let isovalue = histogram.suggested_isovalue();
    assert!((10.0..=80.0).contains(&isovalue), "{isovalue}");
    assert_eq!(isovalue, 45.0, "the middle of the gap from 10 to 80");
}

#[test]
fn constant_and_empty_volumes_have_statistics_too() {
    let volume = encode(&[2.5; 64], [4, 4, 4], 8.0).unwrap();
    assert_eq!(volume.value_range(), [2.5; 2]);
    assert_eq!(volume.histogram(32).suggested_isovalue(), 2.5);
    assert_eq!(volume.histogram(32).counts()[0], 64);
    assert_eq!(value_range(std::iter::empty()), None);
}
