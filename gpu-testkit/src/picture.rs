//! Errors of a picture of an isosurface against another one.

use serde::Serialize;

use crate::image::{mask_difference, mean_square_error, ssim};
use crate::statistics::quantile;

/// Largest value of a colour channel.
const PEAK: f64 = 255.0;

/// What a picture shows, pixels row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Red, green and blue, 0 to 255 each.
    pub color: Vec<[u8; 3]>,
    /// Way along the ray to the surface in voxels; infinite where a pixel shows none.
    pub depth_voxels: Vec<f64>,
    /// Unit normals; without meaning where a pixel shows no surface.
    pub normal: Vec<[f64; 3]>,
}

/// How far one picture is from another. Depths and normals are compared where both pictures show the
/// surface; where only one does, the mask disagrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PictureErrors {
    /// Peak signal-to-noise ratio of the colour channels in dB; infinite (JSON: null) for equal ones.
    pub psnr: f64,
    /// Root of the mean square of the colour channels' errors, in 255ths.
    pub color_rms: f64,
    /// Structural similarity of the luminance.
    pub ssim: f64,
    /// Share of the rays (pixels) that show the surface in one picture only.
    pub mask_disagreement: f64,
    /// Median error of the depth in voxels along the ray; `None` where no pixel can be compared.
    pub depth_p50_voxels: Option<f64>,
    /// What 99 % of the depth's errors do not exceed.
    pub depth_p99_voxels: Option<f64>,
    /// The worst error of the depth.
    pub depth_max_voxels: Option<f64>,
    /// Median angle between normals, in degrees.
    pub normal_p50_degrees: Option<f64>,
    /// What 99 % of the angles do not exceed.
    pub normal_p99_degrees: Option<f64>,
    /// The largest angle.
    pub normal_max_degrees: Option<f64>,
}

impl Picture {
    /// Which pixels show the surface.
    #[must_use]
    pub fn mask(&self) -> Vec<bool> {
        self.depth_voxels.iter().map(|depth| depth.is_finite()).collect()
    }

    fn channels(&self) -> Vec<f32> {
        self.color.iter().flatten().copied().map(f32::from).collect()
    }

    /// Rec. 601 luma, 0 to 255.
    fn luma(&self) -> Vec<f64> {
        let luma = |[r, g, b]: [f64; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
        self.color.iter().map(|color| luma(color.map(f64::from))).collect()
    }

    /// The errors of this picture, were `expected` right.
    ///
    /// # Panics
    /// When the pictures differ in size or have no pixel.
    #[must_use]
    pub fn errors(&self, expected: &Self) -> PictureErrors {
        assert_eq!(self.size, expected.size, "pictures of different sizes");
        let mean_square = mean_square_error(&self.channels(), &expected.channels());
        let (mask, expected_mask) = (self.mask(), expected.mask());
        let both: Vec<usize> = (0..mask.len()).filter(|&i| mask[i] && expected_mask[i]).collect();
        let depth = |&i: &usize| (self.depth_voxels[i] - expected.depth_voxels[i]).abs();
        let angle = |&i: &usize| degrees_between(self.normal[i], expected.normal[i]);
        let depths: Vec<f64> = both.iter().map(depth).collect();
        let angles: Vec<f64> = both.iter().map(angle).collect();
        PictureErrors {
            psnr: 10.0 * (PEAK * PEAK / mean_square).log10(),
            color_rms: mean_square.sqrt(),
            ssim: ssim(&self.luma(), &expected.luma(), self.size.map(|n| n as usize)),
            mask_disagreement: mask_difference(&mask, &expected_mask).count() as f64
                / mask.len() as f64,
            depth_p50_voxels: quantile(&depths, 0.5),
            depth_p99_voxels: quantile(&depths, 0.99),
            depth_max_voxels: quantile(&depths, 1.0),
            normal_p50_degrees: quantile(&angles, 0.5),
            normal_p99_degrees: quantile(&angles, 0.99),
            normal_max_degrees: quantile(&angles, 1.0),
        }
    }
}

/// The angle between two directions; exact for small angles, too.
fn degrees_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cross = [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    });
    let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
    cross.map(|x| x * x).iter().sum::<f64>().sqrt().atan2(dot).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slope on the left, background on the right.
    fn picture() -> Picture {
        let depth = |i: usize| if i % 10 < 6 { 5.0 + i as f64 } else { f64::INFINITY };
        Picture {
            size: [10, 10],
            color: (0..100)
                .map(|i| if i % 10 < 6 { [100, 150, i as u8] } else { [255; 3] })
                .collect(),
            depth_voxels: (0..100).map(depth).collect(),
            normal: vec![[0.0, 0.0, 1.0]; 100],
        }
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let errors = picture().errors(&picture());
        assert_eq!((errors.psnr, errors.color_rms), (f64::INFINITY, 0.0));
        assert!((errors.ssim - 1.0).abs() < 1e-12);
        assert_eq!(errors.mask_disagreement, 0.0);
        assert_eq!(errors.depth_max_voxels, Some(0.0));
        assert_eq!(errors.normal_max_degrees, Some(0.0));
    }

    #[test]
    fn every_kind_of_error_is_found() {
        let expected = picture();
        let mut actual = picture();
        actual.color[0] = [110, 150, 0];
        let errors = actual.errors(&expected);
        // 10^2 in one of 300 channels.
        assert!((errors.color_rms - (100.0f64 / 300.0).sqrt()).abs() < 1e-6);
        assert!((errors.psnr - 10.0 * (255.0f64.powi(2) * 3.0).log10()).abs() < 1e-6);
        assert!(errors.ssim < 1.0 - 1e-6);

        let mut actual = picture();
        actual.depth_voxels[11] += 0.75;
        let errors = actual.errors(&expected);
        assert_eq!(errors.depth_p50_voxels, Some(0.0));
        // One of 60 pixels is more than 1 %.
        assert_eq!(errors.depth_p99_voxels, Some(0.75));
        assert_eq!(errors.depth_max_voxels, Some(0.75));

        let mut actual = picture();
        actual.normal[12] = [0.0, 0.6, 0.8];
        let angle = actual.errors(&expected).normal_max_degrees.unwrap();
        assert!((angle - 0.6f64.asin().to_degrees()).abs() < 1e-9);

        let mut actual = picture();
        actual.depth_voxels[13] = f64::INFINITY;
        actual.depth_voxels[19] = 3.0;
        assert_eq!(actual.errors(&expected).mask_disagreement, 0.02);
    }

    #[test]
    fn without_a_common_pixel_there_is_no_depth_error() {
        let mut empty = picture();
        empty.depth_voxels = vec![f64::INFINITY; 100];
        let errors = empty.errors(&picture());
        assert_eq!((errors.depth_max_voxels, errors.normal_p50_degrees), (None, None));
        assert_eq!(errors.mask_disagreement, 0.6);
    }

    #[test]
    fn angles_are_those_between_directions() {
        for (b, expected) in
            [([1.0, 0.0, 0.0], 0.0), ([0.0, 2.0, 0.0], 90.0), ([-1.0, 0.0, 0.0], 180.0)]
        {
            assert!((degrees_between([1.0, 0.0, 0.0], b) - expected).abs() < 1e-12);
        }
        let tiny = 1e-9f64;
        assert!(
            (degrees_between([1.0, 0.0, 0.0], [1.0, tiny, 0.0]) / tiny.to_degrees() - 1.0).abs()
                < 1e-9
        );
    }

    #[test]
    #[should_panic(expected = "different sizes")]
    fn pictures_of_different_sizes_are_refused() {
        let other = Picture { size: [20, 5], ..picture() };
        let _errors = other.errors(&picture());
    }
}
