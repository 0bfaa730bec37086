//! A volume and a camera that moves: frames cut while they are unfinished.

use std::path::Path;

use bytemuck::Zeroable as _;
use infill::cpu::field::CoarseField;
use infill::cpu::fill::{Candidates, Finished, Scene};
use infill::cpu::reproject::{self, EMPTY, OldHit};
use infill::options::Sources;
use macrocell::Grid;
use progressive_iso::{
    BlockSortedOptions, BlueNoise, Camera, Capture, CompressedVolume, Frame, FrameView, Outputs,
    PixelStatus, ProgressiveIsoRenderer, RendererOptions, Residency, Shading, TraversalStrategy,
};
use serde::Serialize;
use volumes::Field;
use wavefront::cpu::frame::{FrameRay, RayStates};
use wavefront::cpu::shading::{self, dot};
use wavefront::{FrameParams, LookAhead, ShadingParams};

use crate::picture::{self, Pixel};
use crate::random::Random;
use crate::sampling::{End, Sampling};
use crate::shapes::{BrainPart, Rods};
use crate::support::{Failure, Gpu, read_words};

/// Edges of the volumes in voxels.
const EDGES: [u32; 5] = [96, 128, 160, 192, 224];
/// Longest edge of a part of the bundled scan.
const LARGEST_PART: u32 = 128;
/// Bits per voxel of their streams.
const RATE: f64 = 8.0;
const FIELD_OF_VIEW_DEGREES: f64 = 50.0;
const BUDGET_BYTES: u64 = 512 << 20;
/// Degrees between frames: the slowest and the fastest camera.
const DEGREES: [f64; 2] = [0.5, 8.0];

/// A volume.
pub struct Subject {
    kind: String,
    seed: u32,
    volume: CompressedVolume,
    isovalue: f32,
    field: CoarseField,
    grid: Grid,
}

impl Subject {
    /// A volume of this kind of random size, seed and orientation.
    pub fn random(kind: &str, random: &mut Random) -> Self {
        let most = if kind == "brain-part" { LARGEST_PART } else { u32::MAX };
        let edge = EDGES[random.below(EDGES.len() as u32) as usize].min(most);
        let dims = [edge; 3];
        let seed = random.below(1 << 30);
        let field: Box<dyn Field> = match kind {
            "brain-part" => Box::new(BrainPart::random(edge, random)),
            "rods" => Box::new(Rods::random(edge, random)),
            _ => {
                let rows = rotation(random);
                let field =
                    volumes::by_name_with_seed(kind, dims, seed).expect("a kind of the list");
                Box::new(volumes::Rotated::new(field, dims, rows))
            }
        };
        let zfp = volumes::generate(&*field, dims, RATE).expect("a field that ZFP can hold");
        let volume = CompressedVolume::try_from(&zfp).expect("a stream just made");
        let grid = Grid::new(dims);
        let ranges = macrocell::cpu::ranges::build(&grid, &zfp.decode());
        let isovalue = field.suggested_isovalue() as f32;
        let field = CoarseField::new(&grid, &ranges);
        Self { kind: kind.into(), seed, volume, isovalue, field, grid }
    }
}

/// Rows of a random rotation.
fn rotation(random: &mut Random) -> [[f64; 3]; 3] {
    let a = glam::DVec3::from(random.direction());
    let b = a.cross(random.direction().into()).normalize();
    [a, b, a.cross(b)].map(|v| v.to_array())
}

/// How the camera moves.
#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Motion {
    Orbit,
    Zoom,
    Static,
    /// The isovalue changes in the middle of the sequence; an orbit besides.
    IsovalueJump,
}

/// A picture of the data set.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    file: String,
    volume: String,
    volume_seed: u32,
    dims: [u32; 3],
    isovalue: f32,
    strategy: &'static str,
    motion: Motion,
    degrees: f64,
    sequence: u32,
    frame: u32,
    size: [u32; 2],
    /// Where the frame was to end, and the share of the pixels that it had then.
    #[serde(flatten)]
    end: End,
    completeness_pixels: f64,
    holes: usize,
}

/// One volume and the camera's way.
pub struct Sequence {
    subject: Subject,
    renderer: ProgressiveIsoRenderer,
    sampling: Sampling,
    resident: bool,
    strategy: &'static str,
    motion: Motion,
    degrees: f64,
    away: glam::DVec3,
    axis: glam::DVec3,
    up: glam::DVec3,
    distance: f64,
    number: u32,
    frames: u32,
    size: [u32; 2],
    random: Random,
}

/// A frame with its parameters.
struct View {
    camera: Camera,
    isovalue: f32,
    view: FrameView,
    params: FrameParams,
    shading: ShadingParams,
}

impl Sequence {
    pub fn new(
        gpu: &Gpu,
        subject: Subject,
        (number, frames, size): (u32, u32, [u32; 2]),
        sampling: Sampling,
        mut random: Random,
    ) -> Result<Self, Failure> {
        let resident = sampling.resident(&mut random);
        let (strategy, name) = match random.below(4) {
            // No other has the volume resident.
            _ if resident => (TraversalStrategy::RunAhead, "run-ahead"),
            0 => (TraversalStrategy::RunAhead, "run-ahead"),
            _ => (TraversalStrategy::BlockSorted(BlockSortedOptions::default()), "block-sorted"),
        };
        let motion = match random.below(8) {
            0 => Motion::Static,
            1 | 2 => Motion::Zoom,
            3 => Motion::IsovalueJump,
            _ => Motion::Orbit,
        };
        let options = RendererOptions {
            size,
            budget_bytes: BUDGET_BYTES,
            outputs: Outputs { depth: true, normal: true, status: true },
            capture: true,
            strategy,
            residency: if resident { Residency::Full } else { Residency::Cached },
            foveation: (sampling == Sampling::Sparse).then(BlueNoise::tiles),
            ..Default::default()
        };
        let (device, queue) = (&gpu.device, &gpu.queue);
        let renderer = ProgressiveIsoRenderer::new(device, queue, subject.volume.clone(), options)?;
        let away = glam::DVec3::from(random.direction());
        let axis = away.cross(random.direction().into()).normalize();
        let (_, radius) = subject.volume.bounding_ball();
        Ok(Self {
            away,
            axis,
            up: away.cross(random.direction().into()).normalize(),
            // From close enough to fill the picture to far enough to see the volume's corners.
            distance: radius * random.between(0.7, 2.2),
            degrees: DEGREES[0] * (DEGREES[1] / DEGREES[0]).powf(random.between(0.0, 1.0)),
            subject,
            renderer,
            sampling,
            resident,
            strategy: name,
            motion,
            number,
            frames,
            size,
            random,
        })
    }

    fn view(&self, frame: u32) -> Result<View, Failure> {
        let (center, radius) = self.subject.volume.bounding_ball();
        let (angle, closer) = match self.motion {
            Motion::Orbit | Motion::IsovalueJump => (self.degrees * f64::from(frame), 1.0),
            Motion::Zoom => (0.0, 0.97_f64.powi(frame as i32)),
            Motion::Static => (0.0, 1.0),
        };
        let turn = glam::DQuat::from_axis_angle(self.axis, angle.to_radians());
        let eye = glam::DVec3::from(center) + turn * self.away * (self.distance * closer);
        let aspect = f64::from(self.size[0]) / f64::from(self.size[1]);
        let (up, fov) = (self.up.to_array(), FIELD_OF_VIEW_DEGREES);
        let (near, far) = (0.01 * radius, 4.0 * radius);
        let camera = Camera::perspective(eye.to_array(), center, up, fov, aspect, near, far);
        let world = self.subject.volume.world_from_index;
        let view = FrameView::new(&camera, self.size, world, self.subject.volume.dims())?;
        let jumped = matches!(self.motion, Motion::IsovalueJump) && 2 * frame >= self.frames;
        let isovalue = self.subject.isovalue * if jumped { 0.9 } else { 1.0 };
        let lru = lru_cache_gpu::LruParams::zeroed();
        let params = view.params(self.subject.grid, lru, isovalue, LookAhead::NONE);
        let shading = ShadingParams::new(&Shading::default(), world);
        Ok(View { camera, isovalue, view, params, shading })
    }

    /// Renders and writes all frames that were unfinished at the cut.
    pub fn write(mut self, gpu: &Gpu, out: &Path) -> Result<Vec<Entry>, Failure> {
        let mut entries = Vec::new();
        let mut history: Option<(f32, Vec<OldHit>)> = None;
        for frame in 0..self.frames {
            let view = self.view(frame)?;
            let end = self.sampling.end(self.resident, &mut self.random);
            let (share, cut, states) = self.cut(gpu, &view, end)?;
            let truth = self.finish(gpu)?;
            let old = history.take().filter(|(isovalue, _)| *isovalue == view.isovalue);
            let keys = old.map(|(_, hits)| self.scatter(&view, &hits));
            let holes =
                cut.status.iter().flatten().filter(|s| **s == PixelStatus::Unfinished).count();
            if holes > 0 {
                let pixels = self.pixels(&view, &cut, &truth, &states, keys.as_deref());
                let file = format!("{:04}_{frame:02}.exr", self.number);
                picture::write(&out.join(&file), self.size, &pixels)?;
                entries.push(self.entry(file, frame, &view, end, share, holes));
            }
            history = Some((view.isovalue, old_hits(&view, &cut, self.size)));
        }
        Ok(entries)
    }

    fn entry(
        &self,
        file: String,
        frame: u32,
        view: &View,
        end: End,
        share: f64,
        holes: usize,
    ) -> Entry {
        Entry {
            file,
            volume: self.subject.kind.clone(),
            volume_seed: self.subject.seed,
            dims: self.subject.volume.dims(),
            isovalue: view.isovalue,
            strategy: self.strategy,
            motion: self.motion,
            degrees: self.degrees,
            sequence: self.number,
            frame,
            size: self.size,
            end,
            completeness_pixels: share,
            holes,
        }
    }

    /// Renders up to `end`: the share finished then, the pictures
    /// and the rays' states.
    fn cut(
        &mut self,
        gpu: &Gpu,
        view: &View,
        end: End,
    ) -> Result<(f64, Capture, Vec<u32>), Failure> {
        let frame =
            Frame { camera: view.camera, isovalues: vec![view.isovalue], options: end.options() };
        self.renderer.clear_cache();
        self.renderer.set_frame(&frame)?;
        let (device, queue) = (&gpu.device, &gpu.queue);
        let before = |report: &progressive_iso::PassReport| {
            report.pass == 0 || report.completeness_pixels() < end.share()
        };
        let report = self.renderer.render_to_completion(device, queue, |_, r| before(r))?;
        let capture = self.renderer.capture_blocking(device, queue)?;
        let rays = self.renderer.rays().ok_or("rays that have not started")?;
        Ok((report.completeness_pixels(), capture, read_words(gpu, rays.rays())?))
    }

    fn finish(&mut self, gpu: &Gpu) -> Result<Capture, Failure> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        self.renderer.render_to_completion(device, queue, |_, _| true)?;
        Ok(self.renderer.capture_blocking(device, queue)?)
    }

    /// The previous frame's hits in this frame's picture.
    fn scatter(&self, view: &View, hits: &[OldHit]) -> Vec<u32> {
        let mut keys = vec![EMPTY; (self.size[0] * self.size[1]) as usize];
        let rows = view.view.pixel_from_index();
        for hit in hits {
            let found = reproject::key(&view.params, &self.subject.grid, &rows, &view.shading, hit);
            if let Some(([x, y], key)) = found {
                let least = &mut keys[(x + self.size[0] * y) as usize];
                *least = key.min(*least);
            }
        }
        keys
    }

    fn pixels(
        &self,
        view: &View,
        cut: &Capture,
        truth: &Capture,
        states: &[u32],
        history: Option<&[u32]>,
    ) -> Vec<Pixel> {
        let (known, shown) = (finished(cut), finished(truth));
        let states = RayStates::new(&view.params, states);
        let all = pixels(self.size);
        let waiting = |(pixel, known): (&[u32; 2], &Option<Finished>)| {
            if known.is_none() { states.t_low(*pixel) } else { 0.0 }
        };
        let t_low: Vec<f32> = all.iter().zip(&known).map(waiting).collect();
        let scene = Scene {
            frame: &view.params,
            shading: &view.shading,
            grid: self.subject.grid,
            field: Some(&self.subject.field),
            pixels: &known,
            t_low: &t_low,
            history,
            sources: Sources::default(),
        };
        let surroundings = scene.surroundings();
        let pixel = |(i, pixel): (usize, &[u32; 2])| {
            let direction = FrameRay::new(&view.params, *pixel).ray.direction;
            let to_viewer = shading::to_viewer(&view.shading, direction);
            let truth = values(shown[i], to_viewer);
            match known[i] {
                Some(_) => finished_pixel(values(known[i], to_viewer), truth),
                None => hole(&scene.candidates(&surroundings, *pixel), to_viewer, truth),
            }
        };
        all.iter().enumerate().map(pixel).collect()
    }
}

fn pixels(size: [u32; 2]) -> Vec<[u32; 2]> {
    (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]]).collect()
}

/// What a capture knows of every pixel.
fn finished(capture: &Capture) -> Vec<Option<Finished>> {
    let (Some(status), Some(depth), Some(normal)) =
        (&capture.status, &capture.depth, &capture.normal)
    else {
        return Vec::new();
    };
    let pixel = |i: usize| match status[i] {
        PixelStatus::Background => Some(Finished::Background),
        PixelStatus::Hit => Some(Finished::Hit { depth: depth[i], normal: normal[i] }),
        PixelStatus::Unfinished => None,
    };
    (0..status.len()).map(pixel).collect()
}

/// Coverage and N.V of a finished pixel.
fn values(pixel: Option<Finished>, to_viewer: [f32; 3]) -> [f32; 2] {
    match pixel {
        Some(Finished::Hit { normal, .. }) => [1.0, dot(normal, to_viewer).clamp(0.0, 1.0)],
        _ => [0.0; 2],
    }
}

/// Every candidate of a finished pixel is what it shows.
fn finished_pixel([c, nv]: [f32; 2], [truth_c, truth_nv]: [f32; 2]) -> Pixel {
    [1.0, c, nv, c, nv, c, nv, c, nv, 1.0, c, nv, 0.0, 0.0, 0.0, 0.0, truth_c, truth_nv]
}

fn hole(candidates: &Candidates, to_viewer: [f32; 3], [truth_c, truth_nv]: [f32; 2]) -> Pixel {
    let values = candidates.map(|candidate| match candidate {
        Some(c) if c.coverage > 0.0 => {
            [c.coverage, dot(c.normal, to_viewer).clamp(0.0, 1.0), c.distance]
        }
        _ => [0.0; 3],
    });
    let [p, l, x, r] = values;
    let valid = f32::from(u8::from(candidates[3].is_some()));
    [
        0.0, 0.0, 0.0, p[0], p[1], l[0], l[1], x[0], x[1], valid, r[0], r[1], l[2], x[2], p[2],
        r[2], truth_c, truth_nv,
    ]
}

fn old_hits(view: &View, capture: &Capture, size: [u32; 2]) -> Vec<OldHit> {
    let hit = |(pixel, known): (&[u32; 2], Option<Finished>)| {
        let Some(Finished::Hit { depth, normal }) = known else { return None };
        let ray = FrameRay::new(&view.params, *pixel);
        let t = ray.t(&view.params, depth);
        let position = [0, 1, 2].map(|a| ray.ray.origin[a] + t * ray.ray.direction[a]);
        Some(OldHit { position, normal })
    };
    pixels(size).iter().zip(finished(capture)).filter_map(hit).collect()
}
