//! A volume on its way from file to finished pictures, one step per call.

use progressive_iso::{
    CompressedVolume, Frame, FrameOptions, PassReport, ProgressiveIsoRenderer, RendererOptions,
    Shading, StreamFeed, wgpu,
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

/// One volume, its view and its renderer.
#[derive(Debug)]
pub struct Session {
    renderer: ProgressiveIsoRenderer,
    /// While the file arrives.
    feed: Option<StreamFeed>,
    scan: StreamScan,
    histogram: Option<Histogram>,
    options: RendererOptions,
    wanted: RendererOptions,
    refused: Option<progressive_iso::Error>,
    view: Orbit,
    /// None until it is chosen or the histogram suggests one.
    isovalue: Option<f32>,
    threshold: f64,
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
        options: RendererOptions,
    ) -> Result<Self, Error> {
        let FixedRateHeader { dims, bits_per_block, first_bit, .. } = header;
        let (mut volume, feed) = CompressedVolume::streamed(dims, bits_per_block, first_bit)?;
        volume.world_from_index = CompressedVolume::placed(geometry.spacing, geometry.origin);
        let renderer = ProgressiveIsoRenderer::new(device, queue, volume, options)?;
        let mut session = Self {
            renderer,
            feed: Some(feed),
            scan: StreamScan::new(header, SAMPLES),
            histogram: None,
            options,
            wanted: options,
            refused: None,
            view: Orbit::default(),
            isovalue: None,
            threshold: 1.0,
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
        if self.wanted != self.options && report.loaded >= 1.0 {
            self.apply_options(device)?;
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
        let rests = self.is_complete_enough() && !self.is_changed && self.wanted == self.options;
        let now = (report.frame, report.pass, rests);
        let is_new = shows_newest(&report) && now != self.last;
        self.last = now;
        Ok(Step { is_new, rests })
    }

    fn set_frame(&mut self) -> Result<(), progressive_iso::Error> {
        let ball = self.renderer.volume().bounding_ball();
        let shading =
            Shading { background: BACKGROUND, unfinished: UNFINISHED, ..Shading::default() };
        self.renderer.set_frame(&Frame {
            camera: self.view.camera(ball, self.options.size),
            isovalues: vec![self.isovalue.unwrap_or(0.0)],
            options: FrameOptions { shading, ..FrameOptions::default() },
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

    /// Applies the options that were asked for; those that are refused are forgotten.
    fn apply_options(&mut self, device: &wgpu::Device) -> Result<(), Error> {
        match self.renderer.set_options(device, self.wanted) {
            Ok(()) => {
                self.options = self.wanted;
                Ok(self.set_frame()?)
            }
            Err(error) => {
                self.wanted = self.options;
                self.refused = Some(error);
                Ok(())
            }
        }
    }

    /// Whether the newest frame is as complete as it should be.
    fn is_complete_enough(&self) -> bool {
        let report = &self.report;
        shows_newest(report) && (report.complete() || report.completeness() >= self.threshold)
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

    /// Share of the rays that enter the volume with which a frame is complete enough, 0 to 1.
    pub fn set_threshold(&mut self, threshold: f64) {
        self.threshold = threshold;
    }

    /// Choices that a later step applies, as soon as the volume is loaded.
    pub fn set_options(&mut self, options: RendererOptions) {
        self.wanted = options;
    }

    /// The choices in force.
    #[must_use]
    pub fn options(&self) -> &RendererOptions {
        &self.options
    }

    /// Why choices were refused since the last call; what was in force still is.
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
