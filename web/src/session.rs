//! A volume on its way from file to finished pictures, one step per call.

use progressive_iso::{
    Completeness, CompressedVolume, Frame, FrameOptions, Infill, InfillOptions, InfillWeights,
    PassReport, ProgressiveIsoRenderer, RendererOptions, Residency, ScenePlan, Shading, StreamFeed,
    wgpu,
};
use volume_io::{FixedRateHeader, Geometry, Histogram, StreamScan};
use web_time::Instant;

use crate::camera::Orbit;

/// Samples that the histogram is made of: 1 MB.
const SAMPLES: usize = 1 << 18;
/// Bins of the histogram.
const BINS: usize = 256;
/// Cool grey, so that unfinished pixels are told apart from the background, but quiet.
const UNFINISHED: [f32; 4] = [0.80, 0.83, 0.87, 1.0];
/// The colour behind the surface.
pub const BACKGROUND: [f32; 4] = [0.96, 0.965, 0.97, 1.0];

/// What goes wrong between a file and its picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that starts with something else.
    #[error("no fixed-rate zfp stream of 3D floats")]
    NoFixedRate,
    /// The file.
    #[error(transparent)]
    File(#[from] volume_io::Error),
    /// The renderer.
    #[error(transparent)]
    Renderer(#[from] progressive_iso::Error),
}

/// State of a frame when a pass was reported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pass {
    /// Milliseconds since the frame was set.
    pub ms: f64,
    /// Finished share of the rays that enter the volume.
    pub completeness: f64,
}

/// What came of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step {
    /// The pictures hold something of the newest frame that they did not hold at the last step.
    pub is_new: bool,
    /// The newest frame is as complete as it was asked to be, and nothing waits.
    pub rests: bool,
}

/// What a session may be asked for at any time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What the renderer is made with; the session plans its in-fill.
    pub renderer: RendererOptions,
    /// What unfinished pixels show. Nothing is planned for it where the whole volume is resident, which
    /// leaves next to nothing to fill, or where the budget has no room for it.
    pub infill: Infill,
    /// Share of the rays that enter the volume with which a frame is complete enough, 0 to 1.
    pub threshold: f64,
}

impl Default for Settings {
    /// The renderer's defaults; holes are filled by the network until pictures are finished.
    fn default() -> Self {
        Self { renderer: RendererOptions::default(), infill: Infill::Network, threshold: 1.0 }
    }
}

impl Settings {
    /// The renderer's options, with what in-fill needs.
    fn planned(&self, volume: &CompressedVolume, limits: &wgpu::Limits) -> RendererOptions {
        let plan = |options| ScenePlan::new(volume, &options, limits);
        let network = (self.infill == Infill::Network).then(InfillWeights::trained);
        let infill = Some(InfillOptions { network, ..InfillOptions::default() });
        let filled = RendererOptions { infill, ..self.renderer };
        let is_cached = plan(self.renderer).is_ok_and(|p| p.residency() == Residency::Cached);
        let is_filled = self.infill != Infill::Off && is_cached && plan(filled).is_ok();
        if is_filled { filled } else { RendererOptions { infill: None, ..self.renderer } }
    }
}

/// One volume, its view and its renderer.
#[derive(Debug)]
pub struct Session {
    renderer: ProgressiveIsoRenderer,
    /// While the file arrives.
    feed: Option<StreamFeed>,
    scan: StreamScan,
    histogram: Option<Histogram>,
    /// In force, with what is planned for in-fill.
    options: RendererOptions,
    settings: Settings,
    wanted: Settings,
    refused: Option<progressive_iso::Error>,
    view: Orbit,
    /// None until it is chosen or the histogram suggests one.
    isovalue: Option<f32>,
    /// Whether view or isovalue are newer than the renderer's frame.
    is_changed: bool,
    began: Instant,
    passes: Vec<Pass>,
    report: PassReport,
    /// Frame and pass after the last step, and whether the session rested.
    last: (u64, u32, bool),
}

impl Session {
    /// Makes a renderer for a file with this header, whose bytes are still to come.
    ///
    /// # Errors
    /// As [`ProgressiveIsoRenderer::new`].
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        header: FixedRateHeader,
        geometry: Geometry,
        settings: Settings,
    ) -> Result<Self, Error> {
        let FixedRateHeader { dims, bits_per_block, first_bit, .. } = header;
        let (mut volume, feed) = CompressedVolume::streamed(dims, bits_per_block, first_bit)?;
        volume.world_from_index = CompressedVolume::placed(geometry.spacing, geometry.origin);
        let options = settings.planned(&volume, &device.limits());
        let renderer = ProgressiveIsoRenderer::new(device, queue, volume, options)?;
        let mut session = Self {
            renderer,
            feed: Some(feed),
            scan: StreamScan::new(header, SAMPLES),
            histogram: None,
            options,
            settings,
            wanted: settings,
            refused: None,
            view: Orbit::default(),
            isovalue: None,
            is_changed: true,
            began: Instant::now(),
            passes: Vec::new(),
            report: PassReport::default(),
            last: (0, 0, false),
        };
        // Loading needs a frame; rays start when the isovalue is known.
        session.set_frame()?;
        Ok(session)
    }

    /// Takes in the next bytes of the file, its header included.
    ///
    /// # Errors
    /// If a block cannot be decoded safely.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(), Error> {
        self.scan.push(bytes)?;
        if self.scan.is_complete() && self.histogram.is_none() {
            let histogram = self.scan.histogram(BINS);
            self.isovalue.get_or_insert_with(|| histogram.suggested_isovalue());
            self.histogram = Some(histogram);
            self.is_changed = true;
        }
        if let Some(feed) = &self.feed {
            feed.push(bytes);
        }
        Ok(())
    }

    /// Says that the file has ended.
    ///
    /// # Errors
    /// If it ended too early: the session is of no use then.
    pub fn finish(&mut self) -> Result<(), Error> {
        self.scan.finish()?;
        self.feed = None;
        Ok(())
    }

    /// Bytes that have arrived and are not on their way to the GPU: hold back while there are many.
    #[must_use]
    pub fn waiting_bytes(&self) -> u64 {
        self.feed.as_ref().map_or(0, StreamFeed::waiting_bytes)
    }

    /// Goes on: takes in what the GPU has done, and submits the next pass if there is something to do.
    ///
    /// # Errors
    /// What went wrong with the device.
    pub fn advance(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Step, Error> {
        self.take_report();
        let report = self.report;
        if self.wanted != self.settings && report.loaded >= 1.0 {
            self.apply(device)?;
        }
        // A frame that shows nothing yet is not given up, or a moving camera would show nothing at all.
        if self.is_changed && (shows_newest(&report) || report.loaded < 1.0) {
            self.set_frame()?;
        }
        if !self.is_complete_enough() {
            self.renderer.render_pass(device, queue)?;
            self.take_report();
        }
        let report = self.report;
        let rests = self.is_complete_enough() && !self.is_changed && self.wanted == self.settings;
        let now = (report.frame, report.pass, rests);
        let is_new = shows_newest(&report) && now != self.last;
        self.last = now;
        Ok(Step { is_new, rests })
    }

    fn set_frame(&mut self) -> Result<(), progressive_iso::Error> {
        self.set_frame_filled(self.infill())
    }

    fn set_frame_filled(&mut self, infill: Infill) -> Result<(), progressive_iso::Error> {
        let threshold = self.settings.threshold;
        let stop_at = (threshold < 1.0).then_some(Completeness(threshold as f32));
        let ball = self.renderer.volume().bounding_ball();
        let shading =
            Shading { background: BACKGROUND, unfinished: UNFINISHED, ..Shading::default() };
        self.renderer.set_frame(&Frame {
            camera: self.view.camera(ball, self.options.size),
            isovalues: vec![self.isovalue.unwrap_or(0.0)],
            options: FrameOptions { shading, infill, stop_at, ..FrameOptions::default() },
        })?;
        self.report = self.renderer.poll_report();
        self.is_changed = false;
        self.began = Instant::now();
        self.passes.clear();
        Ok(())
    }

    /// Takes in what the GPU has finished of the newest frame.
    fn take_report(&mut self) {
        let before = std::mem::replace(&mut self.report, self.renderer.poll_report());
        let report = self.report;
        if shows_newest(&report) && (report.frame, report.pass) != (before.frame, before.pass) {
            let ms = 1e3 * self.began.elapsed().as_secs_f64();
            self.passes.push(Pass { ms, completeness: report.completeness() });
        }
    }

    /// Applies the settings that were asked for; those that are refused are forgotten.
    fn apply(&mut self, device: &wgpu::Device) -> Result<(), Error> {
        let mut wanted = self.wanted;
        if self.renderer.plan().residency() == Residency::Cached {
            // As the renderer does.
            wanted.renderer.residency = Residency::Cached;
        }
        let planned = wanted.planned(self.renderer.volume(), &device.limits());
        let options = RendererOptions { residency: self.wanted.renderer.residency, ..planned };
        if options != self.options {
            if self.infill() != Infill::Off {
                // The frame must not ask for more than the new options have.
                self.set_frame_filled(Infill::Off)?;
            }
            if let Err(error) = self.renderer.set_options(device, options) {
                self.wanted = self.settings;
                self.refused = Some(error);
                return Ok(self.set_frame()?);
            }
        }
        self.options = options;
        self.settings = self.wanted;
        Ok(self.set_frame()?)
    }

    /// What unfinished pixels show: what was asked for, as far as it is planned.
    #[must_use]
    pub fn infill(&self) -> Infill {
        if self.options.infill.is_some() { self.settings.infill } else { Infill::Off }
    }

    /// Whether the newest picture shows no unfinished pixel as such: all are filled or finished.
    #[must_use]
    pub fn is_filled(&self) -> bool {
        let is_due = self.settings.threshold >= 1.0 || self.report.stopped();
        self.report.complete() || (self.infill() != Infill::Off && is_due)
    }

    /// Whether the newest frame is as complete as it should be.
    fn is_complete_enough(&self) -> bool {
        shows_newest(&self.report) && (self.report.complete() || self.report.stopped())
    }

    /// The view.
    #[must_use]
    pub fn view(&self) -> Orbit {
        self.view
    }

    /// Changes the view, with the next frame.
    pub fn set_view(&mut self, view: Orbit) {
        self.is_changed |= self.view != view;
        self.view = view;
    }

    /// The value of the surface, once it is chosen or suggested.
    #[must_use]
    pub fn isovalue(&self) -> Option<f32> {
        self.isovalue
    }

    /// Changes the surface, with the next frame.
    pub fn set_isovalue(&mut self, isovalue: f32) {
        if isovalue.is_finite() {
            self.is_changed |= self.isovalue != Some(isovalue);
            self.isovalue = Some(isovalue);
        }
    }

    /// Asks for other settings, which a later step applies, as soon as the volume is loaded.
    pub fn set(&mut self, settings: Settings) {
        self.wanted = settings;
    }

    /// The settings in force.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Why settings were refused since the last call; what was in force still is.
    pub fn take_refusal(&mut self) -> Option<progressive_iso::Error> {
        self.refused.take()
    }

    /// Histogram of the volume's values, once all of it has arrived.
    #[must_use]
    pub fn histogram(&self) -> Option<&Histogram> {
        self.histogram.as_ref()
    }

    /// The passes of the newest frame so far.
    #[must_use]
    pub fn passes(&self) -> &[Pass] {
        &self.passes
    }

    /// What the renderer told last.
    #[must_use]
    pub fn report(&self) -> &PassReport {
        &self.report
    }

    /// Whether the pictures hold something of the newest frame.
    #[must_use]
    pub fn has_picture(&self) -> bool {
        shows_newest(&self.report)
    }

    /// The renderer, for showing and reading its pictures.
    #[must_use]
    pub fn renderer(&self) -> &ProgressiveIsoRenderer {
        &self.renderer
    }
}

/// Whether the pictures hold something of the newest frame.
fn shows_newest(report: &PassReport) -> bool {
    report.pass > 0 && report.frame == report.newest_frame
}
