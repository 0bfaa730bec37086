//! Metrics between two pictures of the same size.

pub use crate::flip::{flip, flip_map};
pub use crate::ssim::{ssim, ssim_map};

/// Peak signal-to-noise ratio in dB of values in `0..=peak`; infinite for equal pictures, and
/// minus infinity where one has a NaN or an infinity that the other has not.
///
/// # Panics
/// When the lengths differ or are 0.
#[must_use]
pub fn psnr(actual: &[f32], expected: &[f32], peak: f64) -> f64 {
    let error = mean_square_error(actual, expected);
    if error == 0.0 { f64::INFINITY } else { 10.0 * (peak * peak / error).log10() }
}

/// [`psnr`] of the pixels that `chosen` names, colours of 0 to 1; `None` if there are none.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn psnr_where(actual: &[[f32; 3]], expected: &[[f32; 3]], chosen: &[bool]) -> Option<f64> {
    assert!(actual.len() == chosen.len(), "a choice of other pixels");
    let pick = |picture: &[[f32; 3]]| -> Vec<f32> {
        picture.iter().zip(chosen).filter(|(_, chosen)| **chosen).flat_map(|(c, _)| *c).collect()
    };
    assert_eq!(actual.len(), expected.len(), "pictures of different sizes");
    let (actual, expected) = (pick(actual), pick(expected));
    (!actual.is_empty()).then(|| psnr(&actual, &expected, 1.0))
}

/// [`psnr`] of the changes from one picture to the next, colours of 0 to 1: low where `actual` flickers. The pairs are
/// (previous, this).
///
/// # Panics
/// When the lengths differ or are 0.
#[must_use]
pub fn psnr_of_change(actual: [&[[f32; 3]]; 2], expected: [&[[f32; 3]]; 2]) -> f64 {
    let change = |[before, after]: [&[[f32; 3]]; 2]| -> Vec<f32> {
        assert_eq!(before.len(), after.len(), "pictures of different sizes");
        before.iter().flatten().zip(after.iter().flatten()).map(|(b, a)| a - b).collect()
    };
    psnr(&change(actual), &change(expected), 1.0)
}

/// Pixels set in both masks over pixels set in any, among those that `chosen` names; `None` where none is set.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn intersection_over_union(actual: &[bool], expected: &[bool], chosen: &[bool]) -> Option<f64> {
    assert_eq!(actual.len(), expected.len(), "masks of different sizes");
    assert_eq!(actual.len(), chosen.len(), "a choice of other pixels");
    let count =
        |set: &dyn Fn(usize) -> bool| (0..chosen.len()).filter(|&i| chosen[i] && set(i)).count();
    let union = count(&|i| actual[i] || expected[i]);
    (union > 0).then(|| count(&|i| actual[i] && expected[i]) as f64 / union as f64)
}

/// [`psnr`] of 8-bit channels, with a peak of 255.
///
/// # Panics
/// When the lengths differ or are 0.
#[must_use]
pub fn psnr_u8(actual: &[u8], expected: &[u8]) -> f64 {
    let floats = |bytes: &[u8]| bytes.iter().copied().map(f32::from).collect::<Vec<_>>();
    psnr(&floats(actual), &floats(expected), 255.0)
}

/// Mean of the squared differences; infinite where a difference is not a number.
///
/// # Panics
/// When the lengths differ or are 0.
#[must_use]
pub fn mean_square_error(actual: &[f32], expected: &[f32]) -> f64 {
    assert_eq!(actual.len(), expected.len(), "pictures of different sizes");
    assert!(!actual.is_empty(), "pictures without pixels");
    let square = |(a, b): (&f32, &f32)| {
        if a.to_bits() == b.to_bits() {
            return 0.0;
        }
        let difference = f64::from(*a) - f64::from(*b);
        if difference.is_finite() { difference * difference } else { f64::INFINITY }
    };
    actual.iter().zip(expected).map(square).sum::<f64>() / actual.len() as f64
}

/// How two coverage masks differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MaskDifference {
    /// Pixels set in the expected mask only.
    pub missing: usize,
    /// Pixels set in the actual mask only.
    pub surplus: usize,
    /// The first pixel that differs.
    pub first: Option<usize>,
}

impl MaskDifference {
    /// Number of pixels that differ.
    #[must_use]
    pub fn count(&self) -> usize {
        self.missing + self.surplus
    }
}

/// Compares two coverage masks pixel by pixel.
///
/// # Panics
/// When the lengths differ.
#[must_use]
pub fn mask_difference(actual: &[bool], expected: &[bool]) -> MaskDifference {
    assert_eq!(actual.len(), expected.len(), "masks of different sizes");
    let mut difference = MaskDifference::default();
    for (pixel, (&a, &b)) in actual.iter().zip(expected).enumerate() {
        difference.missing += usize::from(b && !a);
        difference.surplus += usize::from(a && !b);
        if a != b {
            difference.first.get_or_insert(pixel);
        }
    }
    difference
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_have_infinite_psnr() {
        assert_eq!(psnr(&[0.25, f32::NAN], &[0.25, f32::NAN], 1.0), f64::INFINITY);
        assert_eq!(psnr_u8(&[0, 255], &[0, 255]), f64::INFINITY);
    }

    #[test]
    fn one_corrupted_pixel_lowers_the_psnr() {
        let expected = [0.5f32; 100];
        let mut actual = expected;
        actual[42] = 0.6;
        // Error 0.1^2 / 100 = 1e-4, hence 40 dB.
        assert!((psnr(&actual, &expected, 1.0) - 40.0).abs() < 1e-5);
        actual[42] = f32::NAN;
        assert_eq!(psnr(&actual, &expected, 1.0), f64::NEG_INFINITY);
        let bytes = [10u8; 4];
        assert!((psnr_u8(&[10, 10, 11, 10], &bytes) - 54.151_40).abs() < 1e-4);
    }

    #[test]
    fn one_flipped_mask_pixel_is_found() {
        let expected = [true, false, true, false];
        assert_eq!(mask_difference(&expected, &expected), MaskDifference::default());
        for pixel in 0..4 {
            let mut actual = expected;
            actual[pixel] = !actual[pixel];
            let difference = mask_difference(&actual, &expected);
            assert_eq!(difference.first, Some(pixel));
            assert_eq!(difference.count(), 1);
            assert_eq!(difference.missing, usize::from(expected[pixel]));
        }
    }

    #[test]
    fn chosen_pixels_alone_count() {
        let expected = [[0.5f32; 3]; 10];
        let mut actual = expected;
        actual[3] = [0.6; 3];
        actual[7] = [0.9; 3];
        let chosen: Vec<bool> = (0..10).map(|i| i < 5).collect();
        // Error 0.1^2 / 5 = 2e-3.
        let found = psnr_where(&actual, &expected, &chosen).unwrap();
        assert!((found - 10.0 * 500.0f64.log10()).abs() < 1e-4, "{found}");
        let others: Vec<bool> = (0..10).map(|i| i != 3 && i != 7).collect();
        assert_eq!(psnr_where(&actual, &expected, &others), Some(f64::INFINITY));
        assert_eq!(psnr_where(&actual, &expected, &[false; 10]), None);
    }

    #[test]
    fn a_flicker_is_seen_and_a_constant_error_is_not() {
        let truth = [[[0.25f32; 3]; 4], [[0.5; 3]; 4]];
        let pair = |p: &[[[f32; 3]; 4]; 2]| psnr_of_change([&p[0], &p[1]], [&truth[0], &truth[1]]);
        assert_eq!(pair(&truth.map(|p| p.map(|c| c.map(|v| v + 0.25)))), f64::INFINITY);
        let mut flicker = truth;
        flicker[1][2] = [0.625; 3];
        // (1/8)^2 / 4.
        assert!((pair(&flicker) - 10.0 * 256.0f64.log10()).abs() < 1e-6);
    }

    #[test]
    fn overlap_of_masks() {
        let (a, b) = ([true, true, false, false], [true, false, true, false]);
        assert_eq!(intersection_over_union(&a, &b, &[true; 4]), Some(1.0 / 3.0));
        assert_eq!(intersection_over_union(&a, &a, &[true; 4]), Some(1.0));
        assert_eq!(intersection_over_union(&a, &b, &[true, false, false, true]), Some(1.0));
        assert_eq!(intersection_over_union(&a, &b, &[false, false, false, true]), None);
    }

    #[test]
    #[should_panic(expected = "different sizes")]
    fn pictures_of_different_sizes_are_refused() {
        let _error = mean_square_error(&[1.0], &[1.0, 2.0]);
    }
}
