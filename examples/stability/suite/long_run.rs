//! Many frames on one renderer: no drift, no leak, the same bits as a fresh renderer's.

use std::fmt;

use progressive_iso::{
    Capture, Frame, FrameOptions, Outputs, ProgressiveIsoRenderer, RendererOptions, Residency, wgpu,
};
use serde::Serialize;

use super::case::{Case, Volume};
use super::cases::gyroid;
use super::random::Random;
use super::row::Failure;
use super::views;

const SIZES: [[u32; 2]; 2] = [[37, 29], [21, 30]];
/// Frames between changes of size.
const RESIZE: u32 = 97;
/// Frames between comparisons with a fresh renderer, on average.
const CHECK: u32 = 250;

/// What came of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LongRun {
    pub frames: u32,
    pub passes: u64,
    pub hits: u64,
    /// Pictures compared bit for bit with those of fresh renderers with caches of other sizes.
    pub checkpoints: u32,
    pub different_checkpoints: u32,
    /// Bytes of GPU memory after a frame of each size: least and most.
    pub bytes: [[u64; 2]; 2],
    /// Whether the last frame, which repeats the first, has the same bits.
    pub no_drift: bool,
    pub ok: bool,
}

impl fmt::Display for LongRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [[a, b], [c, d]] = self.bytes;
        write!(
            f,
            "long run: {} frames, {} passes, {} hits; {} of {} checkpoints differ; bytes {a} to {b} at one \
             size, {c} to {d} at the other; last frame equals the first: {}",
            self.frames,
            self.passes,
            self.hits,
            self.different_checkpoints,
            self.checkpoints,
            self.no_drift,
        )
    }
}

/// The scene and the device.
struct Setting<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    volume: Volume,
    most_slots: u64,
}

/// `frames` frames with random cameras, isovalues, rounds per pass and look-ahead, with changes of size.
pub fn run(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    frames: u32,
    seed: u64,
) -> Result<LongRun, Failure> {
    let volume = Case::new("long run", "gyroid", [25, 27, 22], gyroid).volume()?;
    let setting = Setting { device, queue, volume, most_slots: 130 };
    let mut random = Random::new(seed);
    let mut result = LongRun { frames, bytes: [[u64::MAX, 0]; 2], ..LongRun::default() };
    let mut renderer = setting.renderer(SIZES[0], setting.most_slots)?;
    let mut which = 0;
    let mut first: Option<(Frame, Capture)> = None;
    for number in 0..frames {
        if number % RESIZE == RESIZE - 1 {
            which = 1 - which;
            renderer.resize(device, SIZES[which])?;
        }
        let frame = setting.frame(&mut random, SIZES[which]);
        setting.draw(&mut renderer, &frame, which, &mut result)?;
        if number == 0 || random.below(CHECK) == 0 {
            let picture = renderer.capture_blocking(device, queue)?;
            let slots = u64::from(8 + random.below(200));
            result.checkpoints += 1;
            let same = setting.fresh(&frame, SIZES[which], slots)? == bits(&picture);
            result.different_checkpoints += u32::from(!same);
            first.get_or_insert((frame, picture));
        }
    }
    let (frame, expected) = first.ok_or("a run without frames")?;
    renderer.resize(device, SIZES[0])?;
    setting.draw(&mut renderer, &frame, 0, &mut result)?;
    result.no_drift = bits(&renderer.capture_blocking(device, queue)?) == bits(&expected);
    let steady = result.bytes.iter().all(|[least, most]| *least == u64::MAX || least == most);
    result.ok = steady && result.no_drift && result.different_checkpoints == 0;
    Ok(result)
}

/// Every word of a picture.
pub fn bits(picture: &Capture) -> Vec<u32> {
    let color = picture.color.iter().map(|&c| u32::from(c));
    let depth = picture.depth.iter().flatten().map(|d| d.to_bits());
    let normal = picture.normal.iter().flatten().flatten().map(|n| n.to_bits());
    let status = picture.status.iter().flatten().map(|&s| s as u32);
    color.chain(depth).chain(normal).chain(status).collect()
}

impl Setting<'_> {
    fn renderer(&self, size: [u32; 2], most_slots: u64) -> Result<ProgressiveIsoRenderer, Failure> {
        let options = RendererOptions {
            size,
            outputs: Outputs { depth: true, normal: true, status: true },
            capture: true,
            residency: Residency::Cached,
            most_slots: Some(most_slots),
            ..RendererOptions::default()
        };
        let volume = self.volume.compressed.clone();
        Ok(ProgressiveIsoRenderer::new(self.device, self.queue, volume, options)?)
    }

    fn frame(&self, random: &mut Random, size: [u32; 2]) -> Frame {
        let angles = [random.between(-180.0, 180.0), random.between(-80.0, 80.0)];
        let last = self.volume.dims.map(|n| f64::from(n) - 1.0);
        let view = match random.below(3) {
            0 => views::orbit(&self.volume, angles, random.between(5.0, 90.0), size),
            1 => {
                let mut inside = || random.vector(0.1, 0.9);
                views::inside(&self.volume, inside(), inside(), size)
            }
            _ => {
                let center = last.map(|v| 0.5 * v);
                let pitch = random.between(1.0, 4.0);
                views::parallel(&self.volume, center, random.direction(), pitch, size)
            }
        };
        let options = FrameOptions {
            rounds_per_pass: 1 + random.below(6),
            look_ahead: 1 + random.below(8),
            pass_ms: f32::INFINITY,
            ..FrameOptions::default()
        };
        let isovalues = vec![random.between(-1.2, 1.2) as f32];
        Frame { camera: view.camera, isovalues, options }
    }

    fn draw(
        &self,
        renderer: &mut ProgressiveIsoRenderer,
        frame: &Frame,
        which: usize,
        result: &mut LongRun,
    ) -> Result<(), Failure> {
        renderer.set_frame(frame)?;
        let report = renderer.render_to_completion(self.device, self.queue, |_, _| true)?;
        result.passes += u64::from(report.pass);
        result.hits += u64::from(report.hits);
        let [least, most] = &mut result.bytes[which];
        (*least, *most) = ((*least).min(report.bytes), (*most).max(report.bytes));
        Ok(())
    }

    /// The frame on a renderer of its own.
    fn fresh(&self, frame: &Frame, size: [u32; 2], slots: u64) -> Result<Vec<u32>, Failure> {
        let mut renderer = self.renderer(size, slots)?;
        renderer.set_frame(frame)?;
        renderer.render_to_completion(self.device, self.queue, |_, _| true)?;
        Ok(bits(&renderer.capture_blocking(self.device, self.queue)?))
    }
}
