//! A plain CPU renderer to compare with: two threads, the decoded volume, the same traversal.

use progressive_iso::{FrameView, Light, Shading};

use crate::cpu_volume::for_each;
use crate::cpu_walk::{Hit, Ray, Surface};

/// Rows that a thread takes at a time.
const ROWS: usize = 8;

/// The rays of a picture, affine in the pixel before they are normalised.
#[derive(Clone, Copy)]
pub struct PictureRays {
    size: [u32; 2],
    origin: [[f32; 3]; 3],
    direction: [[f32; 3]; 3],
}

impl PictureRays {
    pub fn new(view: &FrameView, size: [u32; 2]) -> Self {
        let middle = size.map(|n| n / 2);
        let ray = |right: u32, down: u32| {
            let (origin, unit, depth_per_voxel) = view.ray([middle[0] + right, middle[1] + down]);
            (origin, unit.map(|d| d / depth_per_voxel))
        };
        let (center, right, down) = (ray(0, 0), ray(1, 0), ray(0, 1));
        let affine = |base: [f64; 3], right: [f64; 3], down: [f64; 3]| {
            let change = |v: [f64; 3]| std::array::from_fn(|a| (v[a] - base[a]) as f32);
            [base.map(|v| v as f32), change(right), change(down)]
        };
        Self {
            size,
            origin: affine(center.0, right.0, down.0),
            direction: affine(center.1, right.1, down.1),
        }
    }

    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The ray through the centre of a pixel.
    pub fn ray(&self, pixel: [u32; 2]) -> Ray {
        let [x, y] = [0, 1].map(|a| (pixel[a] as i32 - (self.size[a] / 2) as i32) as f32);
        let at = |v: &[[f32; 3]; 3]| -> [f32; 3] {
            std::array::from_fn(|a| v[0][a] + x * v[1][a] + y * v[2][a])
        };
        let direction = at(&self.direction);
        let scale = 1.0 / dot(direction, direction).sqrt();
        Ray::new(at(&self.origin), direction.map(|d| d * scale))
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    pub color: [u8; 4],
    pub hit: bool,
}

/// Draws the surface: pixels row by row.
pub fn render(surface: &Surface<'_>, rays: &PictureRays, shading: &Shading) -> Vec<Pixel> {
    let [width, height] = rays.size.map(|n| n as usize);
    let mut pixels = vec![Pixel::default(); width * height];
    let background = Pixel { color: shading.background.map(byte), hit: false };
    for_each(pixels.chunks_mut(width * ROWS).enumerate(), |(tile, pixels)| {
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let ray = rays.ray([(i % width) as u32, (tile * ROWS + i / width) as u32]);
            *pixel = match surface.trace(&ray, &mut ()) {
                Some(hit) => Pixel { color: shade(&ray, &hit, shading), hit: true },
                None => background,
            };
        }
    });
    pixels
}

/// Share of the pixels that show the surface in one picture only; `color` has four bytes a pixel.
pub fn difference(pixels: &[Pixel], color: &[u8], shading: &Shading) -> f64 {
    let background = shading.background.map(byte);
    let differs = |(ours, theirs): &(&Pixel, &[u8])| ours.hit == (theirs[..] == background[..]);
    let count = pixels.iter().zip(color.chunks_exact(4)).filter(differs).count();
    count as f64 / pixels.len() as f64
}

fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: [f32; 3], fallback: [f32; 3]) -> [f32; 3] {
    let length = dot(v, v).sqrt();
    if length > 0.0 { v.map(|x| x / length) } else { fallback }
}

/// Blinn-Phong, for volumes of equal spacing: index space is world space up to a scale.
fn shade(ray: &Ray, hit: &Hit, shading: &Shading) -> [u8; 4] {
    let to_viewer = ray.direction.map(|d| -d);
    let mut normal = unit(hit.gradient, to_viewer);
    if dot(normal, to_viewer) < 0.0 {
        normal = normal.map(|n| -n);
    }
    let to_light = match shading.light {
        Light::Headlight => to_viewer,
        Light::Directional(light) => unit(light, to_viewer),
    };
    let halfway = unit(std::array::from_fn(|a| to_light[a] + to_viewer[a]), to_viewer);
    let lambert = dot(normal, to_light).max(0.0);
    let gloss = dot(normal, halfway).max(0.0);
    let highlight =
        if lambert > 0.0 { shading.specular * gloss.powf(shading.shininess) } else { 0.0 };
    let lit = shading.ambient + shading.diffuse * lambert;
    let [r, g, b] = shading.base_color.map(|base| byte(base * lit + highlight));
    [r, g, b, 255]
}
