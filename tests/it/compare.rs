//! Comparison of a picture with the f64 reference renderer on the decoded samples: hit mask,
//! parameter, normal, colour and background of every pixel.

use gpu_testkit::bounds::{RayErrors, Sight, U};
use gpu_testkit::judge::{Answer, Judge, Truth};
use progressive_iso::{Camera, Capture, FrameView, PixelStatus, Shading};

use crate::support::{BACKGROUND, Scene, shading};

/// Rounding of one component of a unit vector to f16, in either direction.
const F16: f64 = 1.0 / 2048.0;

/// What a comparison found.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Summary {
    pub(crate) rays: usize,
    pub(crate) hits: usize,
    /// Rays whose answer differs where the reference itself is ambiguous.
    pub(crate) excused: usize,
    /// Rays that may differ: the reference's answer hangs on less than the value error.
    pub(crate) ambiguous: usize,
    /// Largest share of its bound that a parameter's error takes.
    pub(crate) worst_t: f64,
    /// Largest error of a parameter in voxels.
    pub(crate) worst_voxels: f64,
    /// Largest share of its bound that a residual takes.
    pub(crate) worst_residual: f64,
    /// Largest share of its bound that a normal's error takes.
    pub(crate) worst_normal: f64,
    /// Largest error of a colour in 255ths, where the normal's bound is small.
    pub(crate) worst_color: f64,
    /// Hits whose normal is so uncertain that its colour says nothing.
    pub(crate) vague_colors: usize,
}

impl Summary {
    pub(crate) fn add(&mut self, other: &Summary) {
        self.rays += other.rays;
        self.hits += other.hits;
        self.excused += other.excused;
        self.ambiguous += other.ambiguous;
        self.vague_colors += other.vague_colors;
        for (mine, theirs) in [
            (&mut self.worst_t, other.worst_t),
            (&mut self.worst_voxels, other.worst_voxels),
            (&mut self.worst_residual, other.worst_residual),
            (&mut self.worst_normal, other.worst_normal),
            (&mut self.worst_color, other.worst_color),
        ] {
            *mine = mine.max(theirs);
        }
    }
}

/// One view of a scene with the reference's answers.
pub(crate) struct Expected<'a> {
    judge: Judge<'a>,
    samples: &'a [f32],
    dims: [u32; 3],
    world_from_index: [[f64; 4]; 4],
    size: [u32; 2],
    shading: Shading,
    pixels: Vec<(Sight, Truth)>,
}

/// One pixel of a picture.
#[derive(Clone, Copy, Debug)]
struct Pixel {
    status: PixelStatus,
    depth: f32,
    normal: [f32; 3],
    color: [u8; 4],
}

impl<'a> Expected<'a> {
    pub(crate) fn new(scene: &Scene, samples: &'a [f32], camera: &Camera, size: [u32; 2]) -> Self {
        let dims = scene.volume.dims;
        let judge = Judge::new(dims, samples, f64::from(scene.isovalue));
        let view = FrameView::new(camera, size, scene.world_from_index, dims).unwrap();
        let errors = RayErrors::new(size, view.start_depth(), |pixel| view.ray(pixel));
        let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
        let sights: Vec<Sight> = pixels.map(|pixel| errors.sight(pixel, view.ray(pixel))).collect();
        let rays: Vec<_> = sights.iter().map(|sight| sight.ray).collect();
        let traces = judge.scene().trace_rays(&rays);
        let with_truth = |(sight, trace)| (sight, judge.truth(&sight, trace));
        let pixels = sights.into_iter().zip(traces).map(with_truth).collect();
        Self {
            judge,
            samples,
            dims,
            world_from_index: scene.world_from_index,
            size,
            shading: shading(),
            pixels,
        }
    }

    /// Compares every pixel.
    pub(crate) fn check(&self, picture: &Capture) -> Result<Summary, String> {
        let mut summary = Summary::default();
        for index in 0..self.pixels.len() {
            let pixel = [index as u32 % self.size[0], index as u32 / self.size[0]];
            self.check_pixel(index, &pixel_of(picture, index), &mut summary)
                .map_err(|problem| format!("pixel {pixel:?}: {problem}"))?;
        }
        Ok(summary)
    }

    fn check_pixel(
        &self,
        index: usize,
        found: &Pixel,
        summary: &mut Summary,
    ) -> Result<(), String> {
        let (sight, truth) = &self.pixels[index];
        let depth = match found.status {
            PixelStatus::Background => None,
            PixelStatus::Hit => Some(found.depth),
            PixelStatus::Unfinished => return Err("unfinished".into()),
        };
        summary.rays += 1;
        summary.ambiguous += usize::from(truth.may_miss);
        let verdict = self.judge.verdict(sight, truth, depth);
        if verdict.answer.is_wrong() {
            return Err(format!("{:?}: {:?}", verdict.answer, truth.trace));
        }
        summary.excused += usize::from(verdict.answer == Answer::Tie);
        if let Some(measured) = verdict.parameter {
            summary.worst_t = summary.worst_t.max(measured.share());
            summary.worst_voxels = summary.worst_voxels.max(measured.found);
        }
        if let Some(measured) = verdict.residual {
            summary.worst_residual = summary.worst_residual.max(measured.share());
        }
        match verdict.t {
            None => check_empty(found),
            Some(t) => {
                summary.hits += 1;
                self.check_shading(sight, t, found, summary)
            }
        }
    }

    /// Normal and colour follow from the gradient of a cell that holds the hit.
    fn check_shading(
        &self,
        sight: &Sight,
        t: f64,
        found: &Pixel,
        summary: &mut Summary,
    ) -> Result<(), String> {
        let ray = &sight.ray;
        let position = ray.at(t);
        let (moved, slack) = (sight.error.position(t), sight.parameter_error(t.max(0.0)));
        let tolerance = [0, 1, 2].map(|a| moved[a] + slack * ray.direction[a].abs());
        let columns = self.world_from_index;
        let along =
            [0, 1, 2].map(|r| (0..3).map(|c| columns[c][r] * ray.direction[c]).sum::<f64>());
        let to_viewer = normalized(along).map(|v| v.map(|x| -x)).unwrap_or([0.0, 0.0, 1.0]);
        let mut best: Option<(f64, f64, f64, String)> = None;
        for cell in self.cells(position, tolerance) {
            let gradient = self.judge.scene().gradient(cell, position);
            let world = transform_normal(&columns, gradient);
            let error = self.gradient_error(cell, tolerance);
            let error = length(transform_normal_size(&columns, error));
            let share = 2.0 * error / length(world).max(1e-300) + 20.0 * U;
            let normal = normalized(world).unwrap_or(to_viewer);
            for sign in [-1.0, 1.0] {
                let normal = normal.map(|x| sign * x);
                // Only a normal at right angles to the view may face either way.
                if dot(normal, to_viewer) < -share {
                    continue;
                }
                let off = length([0, 1, 2].map(|a| f64::from(found.normal[a]) - normal[a]));
                let ratio = off / (share + 3f64.sqrt() * F16);
                let (color, problem) = self.color_error(normal, to_viewer, share, found);
                let problem = if ratio > 1.0 {
                    format!("normal {:?}, expected {normal:?}", found.normal)
                } else {
                    problem
                };
                let worse = ratio.max(color);
                if best.as_ref().is_none_or(|b| worse < b.0.max(b.1)) {
                    best = Some((ratio, color, share, problem));
                }
            }
        }
        let (ratio, color, share, problem) = best.ok_or("no cell holds the hit")?;
        summary.vague_colors += usize::from(255.0 * self.color_sensitivity() * share > 2.0);
        summary.worst_normal = summary.worst_normal.max(ratio);
        summary.worst_color = summary.worst_color.max(color);
        if ratio <= 1.0 && color <= 1.0 { Ok(()) } else { Err(format!("at t = {t}: {problem}")) }
    }

    /// How far the gradient at a point of a cell may be from that within a tolerance of it: the
    /// field's mixed second differences, and roundings.
    fn gradient_error(&self, cell: [u32; 3], tolerance: [f64; 3]) -> [f64; 3] {
        let sample = |p: [usize; 3]| {
            let [x, y, z] = [0, 1, 2].map(|a| cell[a] as usize + p[a]);
            let [nx, ny, _] = self.dims.map(|n| n as usize);
            f64::from(self.samples[x + nx * (y + ny * z)])
        };
        let bits = |n: usize| [n & 1, n >> 1 & 1, n >> 2];
        [0, 1, 2].map(|a| {
            let step = |mut p: [usize; 3]| {
                p[a] = 1;
                let high = sample(p);
                p[a] = 0;
                high - sample(p)
            };
            let largest = (0..8).map(|n| step(bits(n)).abs()).fold(0.0, f64::max);
            let moved: f64 = (0..3)
                .filter(|&b| b != a)
                .map(|b| {
                    let mixed = (0..8).map(|n| {
                        let (mut low, mut high) = (bits(n), bits(n));
                        (low[b], high[b]) = (0, 1);
                        (step(high) - step(low)).abs()
                    });
                    tolerance[b] * mixed.fold(0.0, f64::max)
                })
                .sum();
            moved + 12.0 * U * largest
        })
    }

    /// The dual cells that hold a position, up to a tolerance.
    fn cells(&self, position: [f64; 3], tolerance: [f64; 3]) -> Vec<[u32; 3]> {
        let choices = [0, 1, 2].map(|a| {
            let last = i64::from(self.dims[a]) - 2;
            let cell = |x: f64| (x.floor() as i64).clamp(0, last) as u32;
            [cell(position[a] - tolerance[a]), cell(position[a] + tolerance[a])]
        });
        let mut cells: Vec<[u32; 3]> = (0..8)
            .map(|n| [choices[0][n & 1], choices[1][n >> 1 & 1], choices[2][n >> 2]])
            .collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Largest change of a colour channel per change of the unit normal.
    fn color_sensitivity(&self) -> f64 {
        let s = &self.shading;
        f64::from(s.diffuse) + f64::from(s.specular) * f64::from(s.shininess)
    }

    /// Largest error of a colour channel as a share of what is allowed: one step of 8 bits and what
    /// an error of the normal makes of it.
    fn color_error(
        &self,
        normal: [f64; 3],
        to_viewer: [f64; 3],
        normal_error: f64,
        found: &Pixel,
    ) -> (f64, String) {
        let s = &self.shading;
        let [ambient, diffuse, specular, shininess] =
            [s.ambient, s.diffuse, s.specular, s.shininess].map(f64::from);
        // A headlight: light and halfway vector are the direction to the viewer.
        let lambert = dot(normal, to_viewer).max(0.0);
        let highlight = if lambert > 0.0 { specular * lambert.powf(shininess) } else { 0.0 };
        let slack = 255.0 * self.color_sensitivity() * normal_error;
        let expected = s.base_color.map(|base| {
            255.0 * (f64::from(base) * (ambient + diffuse * lambert) + highlight).clamp(0.0, 1.0)
        });
        let off = |c: usize| (f64::from(found.color[c]) - expected[c]).abs();
        let worst = (0..3).map(off).fold(0.0, f64::max) / (1.0 + slack);
        let alpha = if found.color[3] == 255 { 0.0 } else { f64::INFINITY };
        (worst.max(alpha), format!("colour {:?}, expected {expected:?}", found.color))
    }
}

fn pixel_of(picture: &Capture, index: usize) -> Pixel {
    let c = &picture.color[4 * index..][..4];
    Pixel {
        status: picture.status.as_ref().unwrap()[index],
        depth: picture.depth.as_ref().unwrap()[index],
        normal: picture.normal.as_ref().unwrap()[index],
        color: [c[0], c[1], c[2], c[3]],
    }
}

fn check_empty(found: &Pixel) -> Result<(), String> {
    let exact = found.color == BACKGROUND
        && found.depth == f32::INFINITY
        && found.normal.map(f32::to_bits) == [0; 3];
    if exact { Ok(()) } else { Err(format!("a background pixel shows {found:?}")) }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

fn normalized(v: [f64; 3]) -> Option<[f64; 3]> {
    let l = length(v);
    (l > 0.0 && l.is_finite()).then(|| v.map(|x| x / l))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

/// Columns of the cofactor matrix of the linear part: the inverse transpose times the determinant.
fn cofactors(m: &[[f64; 4]; 4]) -> [[f64; 3]; 3] {
    let [x, y, z] = [0, 1, 2].map(|c| [m[c][0], m[c][1], m[c][2]]);
    let columns = [cross(y, z), cross(z, x), cross(x, y)];
    let sign = dot(x, columns[0]).signum();
    columns.map(|c| c.map(|v| sign * v))
}

fn transform_normal(m: &[[f64; 4]; 4], g: [f64; 3]) -> [f64; 3] {
    let c = cofactors(m);
    [0, 1, 2].map(|r| (0..3).map(|a| c[a][r] * g[a]).sum())
}

/// The same with all terms positive: a bound for errors.
fn transform_normal_size(m: &[[f64; 4]; 4], g: [f64; 3]) -> [f64; 3] {
    let c = cofactors(m);
    [0, 1, 2].map(|r| (0..3).map(|a| (c[a][r] * g[a]).abs()).sum())
}
