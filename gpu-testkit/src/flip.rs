//! FLIP: how different two pictures look when one alternates with the other.

use std::f64::consts::PI;

/// Pixels per degree of vision: a display of 3840 pixels and 0.7 m, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 3840.0 * PI / 180.0;

/// Contrast sensitivity of one channel: a sum of two Gaussians (amplitude, spread).
type Sensitivity = [(f64, f64); 2];
const ACHROMATIC: Sensitivity = [(1.0, 0.0047), (0.0, 1e-5)];
const RED_GREEN: Sensitivity = [(1.0, 0.0053), (0.0, 1e-5)];
const BLUE_YELLOW: Sensitivity = [(34.1, 0.04), (13.5, 0.025)];
/// The widest of them, which sets the radius of all.
const WIDEST: f64 = 0.04;

/// Exponents of the colour and of the feature difference.
const COLOR_EXPONENT: f64 = 0.7;
const FEATURE_EXPONENT: f64 = 0.5;
/// Colour differences up to this share of the largest one take [`SMALL_RANGE`] of the result.
const SMALL_SHARE: f64 = 0.4;
const SMALL_RANGE: f64 = 0.95;
/// Width of the edges and points that are looked for, in degrees.
const FEATURE_WIDTH: f64 = 0.082;

type Color = [f64; 3];

/// XYZ from linear sRGB with the white point D65, scaled so that white has Y = 1.
const XYZ_FROM_RGB: [Color; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

/// Mean difference of two pictures of sRGB-encoded colours from 0 to 1, pixels row by row: 0 for equal pictures, at
/// most 1 (P. Andersson, J. Nilsson, T. Akenine-Moeller et al., FLIP: A Difference Evaluator for Alternating Images,
/// 2020; a viewer as far from the display as it is wide, 67 pixels per degree).
///
/// # Panics
/// When a length is not that of `size`, or there is no pixel.
#[must_use]
pub fn flip(actual: &[[f32; 3]], expected: &[[f32; 3]], size: [usize; 2]) -> f64 {
    let map = flip_map(actual, expected, size);
    map.iter().sum::<f64>() / map.len() as f64
}

/// The difference at every pixel, of which [`flip`] is the mean.
///
/// # Panics
/// When a length is not that of `size`, or there is no pixel.
#[must_use]
pub fn flip_map(actual: &[[f32; 3]], expected: &[[f32; 3]], size: [usize; 2]) -> Vec<f64> {
    let pixels = size[0] * size[1];
    assert!(pixels > 0, "pictures without pixels");
    assert!(actual.len() == pixels && expected.len() == pixels, "pictures of different sizes");
    let [a, b] = [actual, expected].map(|picture| Seen::new(picture, size));
    let largest = hyab(hunt(lab([0.0, 1.0, 0.0])), hunt(lab([0.0, 0.0, 1.0]))).powf(COLOR_EXPONENT);
    let error = |i: usize| {
        let color = hyab(a.colors[i], b.colors[i]).powf(COLOR_EXPONENT);
        let edges = (a.edges[i] - b.edges[i]).abs();
        let points = (a.points[i] - b.points[i]).abs();
        let feature = (edges.max(points) / 2.0f64.sqrt()).powf(FEATURE_EXPONENT);
        stretched(color, largest).powf(1.0 - feature)
    };
    (0..pixels).map(error).collect()
}

/// What the eye makes of a picture.
struct Seen {
    /// Blurred, in a perceptually even space.
    colors: Vec<Color>,
    /// Strength of edges and of points.
    edges: Vec<f64>,
    points: Vec<f64>,
}

impl Seen {
    fn new(picture: &[[f32; 3]], size: [usize; 2]) -> Self {
        let opponent: Vec<Color> =
            picture.iter().map(|c| opponent(c.map(|v| linear(f64::from(v))))).collect();
        let channel = |c: usize| opponent.iter().map(|o| o[c]).collect::<Vec<f64>>();
        let [y, cx, cz] = [(0, ACHROMATIC), (1, RED_GREEN), (2, BLUE_YELLOW)]
            .map(|(c, sensitivity)| filtered(&channel(c), size, sensitivity));
        let color = |i: usize| {
            let rgb = rgb_from_opponent([y[i], cx[i], cz[i]]).map(|v| v.clamp(0.0, 1.0));
            hunt(lab(rgb))
        };
        let luminance: Vec<f64> = opponent.iter().map(|o| (o[0] + 16.0) / 116.0).collect();
        let [edges, points] = features(&luminance, size);
        Self { colors: (0..picture.len()).map(color).collect(), edges, points }
    }
}

fn linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// XYZ over that of white.
fn relative_xyz(rgb: Color) -> Color {
    let xyz = XYZ_FROM_RGB.map(|row| (0..3).map(|i| row[i] * rgb[i]).sum::<f64>());
    let white = XYZ_FROM_RGB.map(|row| row.iter().sum::<f64>());
    std::array::from_fn(|i| xyz[i] / white[i])
}

/// Luminance, red against green, blue against yellow: CIELAB without its cube roots.
fn opponent(rgb: Color) -> Color {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_opponent([luminance, red, blue]: Color) -> Color {
    let y = (luminance + 16.0) / 116.0;
    let relative = [y + red / 500.0, y, y - blue / 200.0];
    let white = XYZ_FROM_RGB.map(|row| row.iter().sum::<f64>());
    solved(XYZ_FROM_RGB, std::array::from_fn(|i| relative[i] * white[i]))
}

/// x with `rows` x = `right`, by Cramer's rule.
fn solved(rows: [Color; 3], right: Color) -> Color {
    let determinant = |m: [Color; 3]| {
        let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
        m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
    };
    let whole = determinant(rows);
    std::array::from_fn(|column| {
        let mut replaced = rows;
        for (row, value) in replaced.iter_mut().zip(right) {
            row[column] = value;
        }
        determinant(replaced) / whole
    })
}

fn lab(rgb: Color) -> Color {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb)
        .map(|t| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Colours look less colourful in the dark (Hunt).
fn hunt([l, a, b]: Color) -> Color {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// A distance for large colour differences: city-block in lightness, Euclidean in colour.
fn hyab(a: Color, b: Color) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// 0 to 1, small differences first.
fn stretched(color: f64, largest: f64) -> f64 {
    let small = SMALL_SHARE * largest;
    if color < small {
        SMALL_RANGE / small * color
    } else {
        SMALL_RANGE + (color - small) / (largest - small) * (1.0 - SMALL_RANGE)
    }
}

/// A channel as the eye resolves it.
fn filtered(channel: &[f64], size: [usize; 2], sensitivity: Sensitivity) -> Vec<f64> {
    let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let (mut sum, mut total) = (vec![0.0; channel.len()], 0.0);
    for (amplitude, spread) in sensitivity.into_iter().filter(|(amplitude, _)| *amplitude != 0.0) {
        let kernel: Vec<f64> = (-radius..=radius)
            .map(|i| (-(PI * f64::from(i) / PIXELS_PER_DEGREE).powi(2) / spread).exp())
            .collect();
        let amplitude = amplitude * (PI / spread).sqrt();
        total += amplitude * kernel.iter().sum::<f64>().powi(2);
        for (sum, value) in sum.iter_mut().zip(convolved(channel, size, &kernel, &kernel)) {
            *sum += amplitude * value;
        }
    }
    sum.iter().map(|value| value / total).collect()
}

/// Strength of edges and of points in luminances of 0 to 1.
fn features(luminance: &[f64], size: [usize; 2]) -> [Vec<f64>; 2] {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let kernel = |of: &dyn Fn(f64) -> f64| {
        let value = |i: i32| {
            let x = f64::from(i);
            of(x) * (-x * x / (2.0 * deviation * deviation)).exp()
        };
        (-radius..=radius).map(value).collect::<Vec<f64>>()
    };
    let mut gaussian = kernel(&|_| 1.0);
    let total: f64 = gaussian.iter().sum();
    gaussian.iter_mut().for_each(|v| *v /= total);
    let detectors = [kernel(&|x| -x), kernel(&|x| x * x / (deviation * deviation) - 1.0)];
    detectors.map(|detector| {
        let detector = balanced(detector);
        let along_x = convolved(luminance, size, &detector, &gaussian);
        let along_y = convolved(luminance, size, &gaussian, &detector);
        along_x.iter().zip(along_y).map(|(x, y)| x.hypot(y)).collect()
    })
}

/// The kernel with its positive and its negative part scaled to sums of 1 and -1.
fn balanced(kernel: Vec<f64>) -> Vec<f64> {
    let sum = |sign: f64| kernel.iter().map(|v| (sign * v).max(0.0)).sum::<f64>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    kernel.iter().map(|v| if *v > 0.0 { v / positive } else { v / negative }).collect()
}

/// Both axes one after the other; pixels beyond an edge are those of the edge.
fn convolved(
    channel: &[f64],
    [width, height]: [usize; 2],
    x_kernel: &[f64],
    y_kernel: &[f64],
) -> Vec<f64> {
    let sum = |kernel: &[f64], center: usize, size: usize, value: &dyn Fn(usize) -> f64| {
        let radius = kernel.len() / 2;
        let at = |k: usize| (center + k).saturating_sub(radius).min(size - 1);
        kernel.iter().enumerate().map(|(k, weight)| weight * value(at(k))).sum::<f64>()
    };
    let pixels = || (0..width * height).map(|i| (i % width, i / width));
    let rows: Vec<f64> =
        pixels().map(|(x, y)| sum(x_kernel, x, width, &|x| channel[x + width * y])).collect();
    pixels().map(|(x, y)| sum(y_kernel, y, height, &|y| rows[x + width * y])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [40, 28];

    /// The formulas of `infill/training/flip_reference.py`.
    fn smooth(x: usize, y: usize) -> [usize; 3] {
        [(3 * x + 5 * y) % 256, (7 * x + 2 * y + 40) % 256, (x * y / 4 + 90) % 256]
    }

    fn edges(x: usize, y: usize) -> [usize; 3] {
        let grey = if (x / 8 + y / 8).is_multiple_of(2) { 90 } else { 255 };
        let dot = (x + 3 * y).is_multiple_of(7);
        [if dot { 120 } else { grey }, grey, if dot { 60 } else { grey }]
    }

    fn picture(of: impl Fn(usize, usize) -> [usize; 3]) -> Vec<[f32; 3]> {
        let pixels = (0..SIZE[0] * SIZE[1]).map(|i| of(i % SIZE[0], i / SIZE[0]));
        pixels.map(|color| color.map(|v| v as f32 / 255.0)).collect()
    }

    #[test]
    fn it_is_what_the_authors_program_says() {
        // flip-evaluator 1.7, printed by flip_reference.py; it computes in f32.
        let found = flip(&picture(|x, y| smooth(x + 4, y)), &picture(smooth), SIZE);
        assert!((found - 0.557_790).abs() < 2e-5, "{found}");
        let found = flip(&picture(|x, y| edges(x + 1, y)), &picture(edges), SIZE);
        assert!((found - 0.327_013).abs() < 2e-5, "{found}");
    }

    #[test]
    fn equal_pictures_do_not_differ_and_one_corrupted_pixel_is_seen() {
        let expected = picture(smooth);
        assert_eq!(flip(&expected, &expected, SIZE), 0.0);
        for pixel in [0, 600, 1119] {
            let mut actual = expected.clone();
            actual[pixel] = actual[pixel].map(|v| 1.0 - v);
            assert!(flip(&actual, &expected, SIZE) > 1e-4, "pixel {pixel}");
        }
    }

    #[test]
    fn opponent_colours_and_back() {
        for rgb in [[0.1, 0.5, 0.9], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]] {
            let back = rgb_from_opponent(opponent(rgb));
            assert!((0..3).all(|i| (back[i] - rgb[i]).abs() < 1e-12), "{rgb:?}: {back:?}");
        }
    }

    #[test]
    #[should_panic(expected = "different sizes")]
    fn pictures_of_different_sizes_are_refused() {
        let _difference = flip(&[[1.0; 3]; 4], &[[1.0; 3]; 3], [2, 2]);
    }
}
