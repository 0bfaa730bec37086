//! Structural similarity.

/// Radius of the window in pixels: windows of 11x11.
const RADIUS: usize = 5;
/// Standard deviation of the window's Gaussian in pixels.
const SIGMA: f64 = 1.5;
/// (0.01 * 255)^2 and (0.03 * 255)^2.
const STABILISERS: [f64; 2] = [6.5025, 58.5225];

/// Mean structural similarity of two grey pictures with values 0 to 255, pixels row by row: 1 for
/// equal pictures, less for all others (Wang, Bovik, Sheikh, Simoncelli: Image Quality Assessment:
/// From Error Visibility to Structural Similarity, 2004; windows of 11x11 pixels under a Gaussian of
/// 1.5 pixels, K1 = 0.01, K2 = 0.03). Windows are cut off at the picture's edges and their weights
/// scaled to a sum of 1.
///
/// # Panics
/// When a length is not that of `size`, or there is no pixel.
#[must_use]
pub fn ssim(actual: &[f64], expected: &[f64], size: [usize; 2]) -> f64 {
    let map = ssim_map(actual, expected, size);
    map.iter().sum::<f64>() / map.len() as f64
}

/// The similarity of every pixel's window, of which [`ssim`] is the mean.
///
/// # Panics
/// When a length is not that of `size`, or there is no pixel.
#[must_use]
pub fn ssim_map(actual: &[f64], expected: &[f64], size: [usize; 2]) -> Vec<f64> {
    let pixels = size[0] * size[1];
    assert!(pixels > 0, "pictures without pixels");
    assert!(actual.len() == pixels && expected.len() == pixels, "pictures of different sizes");
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>();
    let [a, b] = [actual, expected].map(|picture| blurred(picture, size));
    let [aa, bb, ab] = [(actual, actual), (expected, expected), (actual, expected)]
        .map(|(a, b)| blurred(&product(a, b), size));
    let similarity = |i: usize| {
        let (variances, covariance) =
            (aa[i] - a[i] * a[i] + bb[i] - b[i] * b[i], ab[i] - a[i] * b[i]);
        let [c1, c2] = STABILISERS;
        let means = (2.0 * a[i] * b[i] + c1) / (a[i] * a[i] + b[i] * b[i] + c1);
        means * (2.0 * covariance + c2) / (variances + c2)
    };
    (0..pixels).map(similarity).collect()
}

/// Mean of every pixel's window, one axis after the other.
fn blurred(picture: &[f64], [width, height]: [usize; 2]) -> Vec<f64> {
    let mut rows = vec![0.0; picture.len()];
    for (row, out) in picture.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        for (x, out) in out.iter_mut().enumerate() {
            *out = weighted(x, width, |i| row[i]);
        }
    }
    let mut both = vec![0.0; picture.len()];
    for y in 0..height {
        for x in 0..width {
            both[x + width * y] = weighted(y, height, |i| rows[x + width * i]);
        }
    }
    both
}

/// Mean of the values around `center` on one axis.
fn weighted(center: usize, end: usize, value: impl Fn(usize) -> f64) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in center.saturating_sub(RADIUS)..(center + RADIUS + 1).min(end) {
        let weight = KERNEL[i.abs_diff(center)];
        sum += weight * value(i);
        weights += weight;
    }
    sum / weights
}

/// exp(-d^2 / (2 sigma^2)) at distances of 0 to [`RADIUS`] pixels.
static KERNEL: std::sync::LazyLock<[f64; RADIUS + 1]> =
    std::sync::LazyLock::new(|| std::array::from_fn(|d| (-0.5 * (d as f64 / SIGMA).powi(2)).exp()));

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(size: [usize; 2], value: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x as f64, y as f64)));
        pixels.map(|(x, y)| value(x, y)).collect()
    }

    fn waves(size: [usize; 2]) -> Vec<f64> {
        picture(size, |x, y| 128.0 + 60.0 * (0.7 * x).sin() + 40.0 * (0.4 * y + 0.1 * x).cos())
    }

    /// The definition, window by window.
    fn by_definition(a: &[f64], b: &[f64], [width, height]: [usize; 2]) -> f64 {
        let mut sum = 0.0;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let near = |i: usize, c: usize| i.abs_diff(c) <= 5;
            let window: Vec<(f64, usize)> = (0..width * height)
                .filter(|i| near(i % width, x) && near(i / width, y))
                .map(|i| {
                    let [dx, dy] = [(i % width).abs_diff(x), (i / width).abs_diff(y)];
                    ((-((dx * dx + dy * dy) as f64) / (2.0 * 1.5 * 1.5)).exp(), i)
                })
                .collect();
            let total: f64 = window.iter().map(|(w, _)| w).sum();
            let mean = |f: &dyn Fn(usize) -> f64| {
                window.iter().map(|&(w, i)| w * f(i)).sum::<f64>() / total
            };
            let (ma, mb) = (mean(&|i| a[i]), mean(&|i| b[i]));
            let va = mean(&|i| (a[i] - ma).powi(2));
            let vb = mean(&|i| (b[i] - mb).powi(2));
            let cov = mean(&|i| (a[i] - ma) * (b[i] - mb));
            let (c1, c2) = ((0.01f64 * 255.0).powi(2), (0.03f64 * 255.0).powi(2));
            sum += (2.0 * ma * mb + c1) * (2.0 * cov + c2)
                / ((ma * ma + mb * mb + c1) * (va + vb + c2));
        }
        sum / (width * height) as f64
    }

    #[test]
    fn it_is_what_the_definition_says() {
        for size in [[1, 1], [7, 3], [23, 17]] {
            let expected = waves(size);
            let shifted = picture(size, |x, y| 100.0 + 90.0 * (0.5 * x * y).sin());
            let (found, right) =
                (ssim(&shifted, &expected, size), by_definition(&shifted, &expected, size));
            assert!((found - right).abs() < 1e-9, "{size:?}: {found}, by definition {right}");
        }
    }

    #[test]
    fn equal_pictures_have_one_and_constant_ones_their_formula() {
        let size = [20, 15];
        let expected = waves(size);
        assert!((ssim(&expected, &expected, size) - 1.0).abs() < 1e-12);
        let (a, b) = (vec![100.0; 300], vec![50.0; 300]);
        let right = (2.0 * 100.0 * 50.0 + 6.5025) / (100.0f64.powi(2) + 50.0f64.powi(2) + 6.5025);
        assert!((ssim(&a, &b, size) - right).abs() < 1e-9);
    }

    #[test]
    fn one_corrupted_pixel_lowers_it() {
        let size = [20, 15];
        let expected = waves(size);
        for pixel in [0, 150, 299] {
            let mut actual = expected.clone();
            actual[pixel] += 30.0;
            let found = ssim(&actual, &expected, size);
            assert!(found < 1.0 - 1e-4, "pixel {pixel}: {found}");
        }
    }

    #[test]
    #[should_panic(expected = "different sizes")]
    fn pictures_of_different_sizes_are_refused() {
        let _similarity = ssim(&[1.0; 4], &[1.0; 3], [2, 2]);
    }
}
