//! Pictures as fillers are compared by.

use std::path::Path;

use progressive_iso::{Capture, PixelStatus, Shading};

use super::Failure;

/// The published renderer's colours, for which its network was trained, over a background that alpha tells from the
/// surface.
pub fn published_shading() -> Shading {
    Shading {
        base_color: [0.3, 0.3, 0.9],
        ambient: 0.2,
        diffuse: 0.6,
        specular: 0.1,
        shininess: 5.0,
        background: [1.0, 1.0, 1.0, 0.0],
        unfinished: [1.0, 0.0, 0.0, 0.0],
        ..Shading::default()
    }
}

/// A picture of colours from 0 to 1 and which pixels show rather surface than background.
#[derive(Clone)]
pub struct Shown {
    pub colors: Vec<[f32; 3]>,
    /// None where colours alone are known.
    pub surface: Option<Vec<bool>>,
}

impl Shown {
    /// From red, green, blue and a word more of every pixel, f32, as the published network has them.
    pub fn from_words(words: &[u32]) -> Self {
        let color = |p: &[u32]| [p[0], p[1], p[2]].map(|v| f32::from_bits(v).clamp(0.0, 1.0));
        Self { colors: words.chunks_exact(4).map(color).collect(), surface: None }
    }

    /// Rec. 601 luma, 0 to 255.
    pub fn luma(&self) -> Vec<f64> {
        let luma = |[r, g, b]: [f64; 3]| 255.0 * (0.299 * r + 0.587 * g + 0.114 * b);
        self.colors.iter().map(|color| luma(color.map(f64::from))).collect()
    }

    /// Writes the colours as a PNG file.
    pub fn write(&self, path: &Path, [width, height]: [u32; 2]) -> Result<(), Failure> {
        let byte = |v: f32| (255.0 * v + 0.5) as u8;
        let bytes: Vec<u8> = self.colors.iter().flatten().map(|v| byte(*v)).collect();
        image::save_buffer(path, &bytes, width, height, image::ColorType::Rgb8)
            .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
    }
}

impl From<&Capture> for Shown {
    fn from(capture: &Capture) -> Self {
        let pixels = || capture.color.chunks_exact(4);
        let color = |p: &[u8]| [p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0);
        Self {
            colors: pixels().map(color).collect(),
            surface: Some(pixels().map(|p| p[3] >= 128).collect()),
        }
    }
}

/// Which pixels are unfinished.
pub fn holes(capture: &Capture) -> Vec<bool> {
    let status = capture.status.as_deref().unwrap_or_default();
    status.iter().map(|status| *status == PixelStatus::Unfinished).collect()
}

/// Every hole as the nearest finished pixel.
pub fn nearest(shown: &Shown, holes: &[bool], size: [u32; 2]) -> Shown {
    let mut filled = shown.clone();
    let [width, height] = size.map(|s| s as i32);
    let reach = width.max(height);
    for hole in (0..holes.len()).filter(|&i| holes[i]) {
        let (x, y) = (hole as i32 % width, hole as i32 / width);
        let mut best: Option<(i32, usize)> = None;
        for radius in 1..reach {
            // Nothing farther out is nearer.
            if best.is_some_and(|(square, _)| square <= radius * radius) {
                break;
            }
            for (dx, dy) in ring(radius) {
                let (x, y) = (x + dx, y + dy);
                let inside = x >= 0 && y >= 0 && x < width && y < height;
                let pixel = (x + width * y) as usize;
                let square = dx * dx + dy * dy;
                if inside && !holes[pixel] && best.is_none_or(|(least, _)| square < least) {
                    best = Some((square, pixel));
                }
            }
        }
        if let Some((_, pixel)) = best {
            filled.colors[hole] = shown.colors[pixel];
            if let (Some(surface), Some(known)) = (&mut filled.surface, &shown.surface) {
                surface[hole] = known[pixel];
            }
        }
    }
    filled
}

/// Offsets on the edge of a square.
fn ring(radius: i32) -> impl Iterator<Item = (i32, i32)> {
    (-radius..=radius).flat_map(move |i| [(i, -radius), (i, radius), (-radius, i), (radius, i)])
}
