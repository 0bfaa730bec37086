//! Draws a case and compares every picture with the reference and the twin.

use gpu_testkit::bounds::{RayErrors, Sight};
use gpu_testkit::judge::Judge;
use progressive_iso::{
    Capture, Frame, FrameOptions, FrameView, Outputs, PixelStatus, ProgressiveIsoRenderer,
    RendererOptions, wgpu,
};

use super::case::{Case, Rays, View, Volume};
use super::row::{Failure, Row};
use super::twin::Twin;
use super::views::Effort;

/// Draws pictures of one volume.
pub struct Painter<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    renderer: ProgressiveIsoRenderer,
    size: [u32; 2],
}

impl<'a> Painter<'a> {
    pub fn new(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        volume: &Volume,
        size: [u32; 2],
    ) -> Result<Self, Failure> {
        let options = RendererOptions {
            size,
            budget_bytes: 2 << 30,
            outputs: Outputs { depth: true, normal: false, status: true },
            capture: true,
            ..RendererOptions::default()
        };
        let compressed = volume.compressed.clone();
        let renderer = ProgressiveIsoRenderer::new(device, queue, compressed, options)?;
        Ok(Self { device, queue, renderer, size })
    }

    /// The finished picture, and how many rays enter the volume.
    pub fn picture(&mut self, view: &View, isovalue: f32) -> Result<(Capture, u32), Failure> {
        if view.size != self.size {
            self.renderer.resize(self.device, view.size)?;
            self.size = view.size;
        }
        let options = FrameOptions::default();
        let frame = Frame { camera: view.camera, isovalues: vec![isovalue], options };
        self.renderer.set_frame(&frame)?;
        let report = self.renderer.render_to_completion(self.device, self.queue, |_, _| true)?;
        Ok((self.renderer.capture_blocking(self.device, self.queue)?, report.entered_rays))
    }
}

/// Everything about a case. A failure of the library is a problem of the row.
pub fn measure(device: &wgpu::Device, queue: &wgpu::Queue, case: &Case, effort: Effort) -> Row {
    let mut row = Row::new(case.group, &case.name);
    if let Err(problem) = pictures(device, queue, case, effort, &mut row) {
        row.problem(|| problem.to_string());
    }
    row.finish()
}

fn pictures(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    case: &Case,
    effort: Effort,
    row: &mut Row,
) -> Result<(), Failure> {
    let volume = case.volume()?;
    let mut painter: Option<Painter<'_>> = None;
    for isovalue in (case.isovalues)(&volume) {
        for (number, view) in (case.views)(&volume, isovalue, effort).into_iter().enumerate() {
            let mut ready = match painter.take() {
                Some(painter) => painter,
                None => Painter::new(device, queue, &volume, view.size)?,
            };
            let (picture, entered) = ready.picture(&view, isovalue)?;
            painter = Some(ready);
            let problems = row.problems.len();
            whole_picture(case, &picture, entered, row);
            compare(case, &volume, &view, isovalue, &picture, row)?;
            for problem in &mut row.problems[problems..] {
                *problem = format!("isovalue {isovalue:e}, view {number}: {problem}");
            }
        }
    }
    Ok(())
}

/// What needs no reference.
pub fn whole_picture(case: &Case, picture: &Capture, entered: u32, row: &mut Row) {
    let status = picture.status.as_deref().unwrap_or_default();
    let hit: Vec<bool> = status.iter().map(|&s| s == PixelStatus::Hit).collect();
    let hits = hit.iter().filter(|&&hit| hit).count() as u64;
    row.pictures += 1;
    row.rays += hit.len() as u64;
    row.hits += hits;
    if status.contains(&PixelStatus::Unfinished) {
        row.problem(|| "unfinished pixels".into());
    }
    let wanted = hit.len() as u64;
    if case.all_hit && (hits != wanted || u64::from(entered) != wanted) {
        row.watertight_violations += wanted - hits;
        row.problem(|| format!("{hits} hits of {wanted} rays, {entered} enter"));
    }
    if case.none_hit && hits > 0 {
        row.problem(|| format!("{hits} hits where there is no surface"));
    }
    if case.closed {
        row.cracks += cracks(picture.size, &hit);
    }
}

/// Misses whose eight neighbours all hit.
pub fn cracks(size: [u32; 2], hit: &[bool]) -> u64 {
    let [width, height] = size.map(|n| n as usize);
    let mut found = 0;
    for y in 1..height.max(1) - 1 {
        for x in 1..width.max(1) - 1 {
            let around = |[dx, dy]: [usize; 2]| hit[x + dx - 1 + width * (y + dy - 1)];
            let neighbours = (0..9).filter(|&n| n != 4).all(|n| around([n % 3, n / 3]));
            found += u64::from(neighbours && !around([1, 1]));
        }
    }
    found
}

/// Every pixel, or every `view.stride`-th, against the f64 reference and the twin.
pub fn compare(
    case: &Case,
    volume: &Volume,
    view: &View,
    isovalue: f32,
    picture: &Capture,
    row: &mut Row,
) -> Result<(), Failure> {
    let world = volume.compressed.world_from_index;
    let frame = FrameView::new(&view.camera, view.size, world, volume.dims)?;
    let twin = Twin::new(volume, &frame, isovalue)?;
    let judge = Judge::new(volume.dims, &volume.samples, f64::from(isovalue));
    let sights = sights(case.rays, &frame, &twin, view);
    let rays: Vec<_> = sights.iter().map(|&(_, sight)| sight.ray).collect();
    let traces = judge.scene().trace_rays(&rays);
    for ((pixel, sight), trace) in sights.iter().zip(traces) {
        let index = (pixel[0] + view.size[0] * pixel[1]) as usize;
        let depth = hit_depth(picture, index);
        let truth = judge.truth(sight, trace);
        let verdict = judge.verdict(sight, &truth, depth);
        let ulp = depth.map_or(1.0, |d| f64::from(d.abs().next_up() - d.abs()));
        row.add(&verdict, ulp / sight.depth_per_voxel);
        if verdict.answer.is_wrong() {
            row.problem(|| format!("pixel {pixel:?}: {:?}, {:?}", verdict.answer, truth));
        }
        let walk = twin.walk(&twin.ray(*pixel).ray);
        walk.root_steps.iter().for_each(|&steps| row.add_root(steps));
        let missed = walk.ends_differ && depth.is_none();
        if missed || walk.leak.is_some() {
            row.watertight_violations += 1;
            row.problem(|| format!("pixel {pixel:?}: missed: {missed}, {:?}", walk.leak));
        }
    }
    Ok(())
}

fn hit_depth(picture: &Capture, index: usize) -> Option<f32> {
    let hit = picture.status.as_ref()?[index] == PixelStatus::Hit;
    picture.depth.as_ref().filter(|_| hit).map(|depth| depth[index])
}

/// The pixels that are compared, with their rays.
fn sights(rays: Rays, frame: &FrameView, twin: &Twin<'_>, view: &View) -> Vec<([u32; 2], Sight)> {
    let start_depth = match rays {
        Rays::Camera => frame.start_depth(),
        Rays::Own => twin.start_depth(),
    };
    let errors = RayErrors::new(view.size, start_depth, |pixel| frame.ray(pixel));
    let [width, height] = view.size;
    let pixels = (0..width * height).step_by(view.stride).map(|i| [i % width, i / width]);
    let sight = |pixel| {
        let ray = match rays {
            Rays::Camera => frame.ray(pixel),
            Rays::Own => {
                let own = twin.ray(pixel);
                let wide = |v: [f32; 3]| v.map(f64::from);
                (wide(own.ray.origin), wide(own.ray.direction), f64::from(own.depth_per_voxel))
            }
        };
        (pixel, errors.sight(pixel, ray))
    };
    pixels.map(sight).collect()
}
