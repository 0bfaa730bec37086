//! The page's object: a canvas, and the volume on it.

use progressive_iso::{
    BlockSortedOptions, Capture, Outputs, PendingCapture, PixelStatus, RendererOptions,
    TraversalStrategy,
};
use volume_io::Geometry;
use wasm_bindgen::prelude::*;
use web_sys::HtmlCanvasElement;

use super::gpu::Gpu;
use super::present::{Copy, Presenter};
use crate::bars;
use crate::camera::Orbit;
use crate::exchange::Exchange;
use crate::link::{Link, infill_name, infill_named};
use crate::rows::rows;
use crate::session::{Session, Settings};
use crate::text;

/// A canvas, and the volume on it.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Viewer {
    gpu: Gpu,
    presenter: Presenter,
    volumes: Exchange,
    /// In the mode that reads pictures back instead of presenting them.
    copies: bool,
    copy: Option<Copy>,
    /// Whether something newer is shown than what is being copied.
    copy_is_stale: bool,
    capture: Option<PendingCapture>,
}

/// A picture in main memory.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Picture {
    size: [u32; 2],
    color: Vec<u8>,
    depth: Vec<f32>,
    status: Vec<u8>,
}

#[wasm_bindgen]
impl Viewer {
    /// Asks for a GPU. With `copies`, pictures are read back for the page to draw, and depth with them;
    /// the canvas is left alone.
    pub async fn create(canvas: HtmlCanvasElement, copies: bool) -> Result<Self, JsError> {
        console_error_panic_hook::set_once();
        let size = [canvas.width().max(1), canvas.height().max(1)];
        let gpu = Gpu::new(canvas, !copies).await?;
        let presenter = Presenter::new(&gpu, size);
        gpu.check()?;
        let outputs = Outputs { status: true, depth: copies, ..Outputs::default() };
        let renderer = RendererOptions { size, outputs, capture: true, ..Default::default() };
        let settings = Settings { renderer, ..Settings::default() };
        Ok(Self {
            gpu,
            presenter,
            volumes: Exchange::new(settings),
            copies,
            copy: None,
            copy_is_stale: false,
            capture: None,
        })
    }

    /// Name of the adapter.
    pub fn adapter(&self) -> String {
        self.gpu.name()
    }

    /// Begins with a volume whose fixed-rate file starts with these bytes, which are to be pushed again
    /// with the others. It replaces the one that is shown when it has its first picture.
    /// `geometry`: spacing and origin, or nothing.
    pub fn open(&mut self, start: &[u8], geometry: &[f64]) -> Result<(), JsError> {
        let geometry = match *geometry {
            [a, b, c, x, y, z] => Geometry { spacing: [a, b, c], origin: [x, y, z] },
            _ => Geometry::default(),
        };
        Ok(self.volumes.open(&self.gpu.device, &self.gpu.queue, start, geometry)?)
    }

    /// Takes in the next bytes of the file and returns how many wait for the GPU.
    pub fn push(&mut self, bytes: &[u8]) -> Result<f64, JsError> {
        Ok(self.volumes.push(bytes)? as f64)
    }

    /// Bytes that wait for the GPU.
    pub fn waiting(&self) -> f64 {
        self.volumes.waiting_bytes() as f64
    }

    /// Says that the file has ended.
    pub fn finish(&mut self) -> Result<(), JsError> {
        Ok(self.volumes.finish()?)
    }

    /// Gives up the volume that is on its way; what is shown stays.
    #[wasm_bindgen(js_name = giveUp)]
    pub fn give_up(&mut self) {
        self.volumes.give_up();
    }

    /// Whether a volume is on its way, or an error if it has been given up.
    #[wasm_bindgen(js_name = isOpening)]
    pub fn is_opening(&mut self) -> Result<bool, JsError> {
        match self.volumes.take_failure() {
            Some(failure) => Err(failure.into()),
            None => Ok(self.volumes.incoming().is_some()),
        }
    }

    /// Goes on, and shows what is new. False when there is nothing left to do until something changes.
    pub fn advance(&mut self) -> Result<bool, JsError> {
        self.gpu.check()?;
        let step = self.volumes.advance(&self.gpu.device, &self.gpu.queue)?;
        let Some(session) = self.volumes.shown() else { return Ok(!step.rests) };
        let size = session.settings().renderer.size;
        let resized = self.presenter.size() != size;
        if resized {
            self.presenter.resize(&self.gpu, size);
        }
        if step.is_new {
            let mut encoder = self.gpu.encoder();
            let pictures = session.renderer().textures();
            let all = step.rests || session.is_filled();
            self.presenter.record_take(&self.gpu, &mut encoder, pictures, all);
            self.gpu.submit(encoder);
        }
        if step.is_new || resized {
            self.presenter.present(&self.gpu);
            self.copy_is_stale = self.copies;
        }
        if self.copy_is_stale && self.copy.is_none() {
            self.copy = Some(self.presenter.copy(&self.gpu));
            self.copy_is_stale = false;
        }
        Ok(!step.rests || self.copy.is_some() || self.capture.is_some())
    }

    /// What is shown, where the page draws it: once for every change.
    #[wasm_bindgen(js_name = takeCopy)]
    pub fn take_copy(&mut self) -> Option<Picture> {
        let (size, color) = self.copy.as_ref()?.pixels()?;
        self.copy = None;
        Some(Picture { size, color, depth: Vec::new(), status: Vec::new() })
    }

    /// Asks for the newest picture, which [`Viewer::take_capture`] gives after some calls of
    /// [`Viewer::advance`].
    #[wasm_bindgen(js_name = startCapture)]
    pub fn start_capture(&mut self) -> Result<(), JsError> {
        if let Some(session) = self.volumes.shown() {
            let mut encoder = self.gpu.encoder();
            let capture = session.renderer().capture(&self.gpu.device, &mut encoder)?;
            self.gpu.submit(encoder);
            self.capture = Some(capture);
        }
        Ok(())
    }

    /// The picture that was asked for, when it is there.
    #[wasm_bindgen(js_name = takeCapture)]
    pub fn take_capture(&mut self) -> Option<Picture> {
        let picture = self.capture.as_mut()?.try_take()?;
        self.capture = None;
        Some(picture.into())
    }

    /// Size of the picture in pixels, memory budget in MiB, share of rays with which a picture is
    /// complete enough, whether rays are sorted by block, and what unfinished pixels show.
    pub fn set(
        &mut self,
        width: u32,
        height: u32,
        budget: f64,
        threshold: f64,
        sorted: bool,
        infill: &str,
    ) {
        let mut settings = *self.volumes.settings();
        settings.renderer.size = [width.max(1), height.max(1)];
        settings.renderer.budget_bytes = (budget * f64::from(1 << 20)) as u64;
        settings.renderer.strategy = if sorted {
            TraversalStrategy::BlockSorted(BlockSortedOptions::default())
        } else {
            TraversalStrategy::RunAhead
        };
        settings.threshold = threshold;
        settings.infill = infill_named(infill).unwrap_or(settings.infill);
        self.volumes.set(settings);
    }

    /// Whether the settings that were asked for last are in force.
    #[wasm_bindgen(js_name = areSettingsApplied)]
    pub fn are_settings_applied(&self) -> bool {
        self.volumes.shown().is_some_and(|shown| shown.settings() == self.volumes.settings())
    }

    /// Why the last settings were refused, if they were.
    #[wasm_bindgen(js_name = takeRefusal)]
    pub fn take_refusal(&mut self) -> Option<String> {
        self.volumes.take_refusal().map(|error| error.to_string())
    }

    /// Turns, by shares of the picture's height.
    pub fn turn(&mut self, right: f64, down: f64) {
        self.change_view(|view| view.turned(right, down));
    }

    /// Moves sideways, by shares of the picture's height.
    #[wasm_bindgen(js_name = move)]
    pub fn translate(&mut self, right: f64, down: f64) {
        self.change_view(|view| view.moved(right, down));
    }

    /// Comes nearer by a factor.
    pub fn zoom(&mut self, factor: f64) {
        self.change_view(|view| view.zoomed(factor));
    }

    /// Goes back to the first view.
    #[wasm_bindgen(js_name = resetView)]
    pub fn reset_view(&mut self) {
        self.change_view(|_| Orbit::default());
    }

    fn change_view(&mut self, change: impl FnOnce(Orbit) -> Orbit) {
        if let Some(session) = self.volumes.shown_mut() {
            session.set_view(change(session.view()));
        }
    }

    /// The value of the surface; `undefined` before there is one.
    pub fn isovalue(&self) -> Option<f32> {
        self.volumes.shown()?.isovalue()
    }

    /// Changes the surface.
    #[wasm_bindgen(js_name = setIsovalue)]
    pub fn set_isovalue(&mut self, isovalue: f32) {
        if let Some(session) = self.volumes.shown_mut() {
            session.set_isovalue(isovalue);
        }
    }

    /// Restores isovalue and view from the part of an address behind `#`, of the volume that is on its
    /// way if there is one.
    pub fn restore(&mut self, fragment: &str) {
        let is_opening = self.volumes.incoming().is_some();
        let session =
            if is_opening { self.volumes.incoming_mut() } else { self.volumes.shown_mut() };
        if let Some(session) = session {
            let link = Link::parse(fragment);
            if let Some(isovalue) = link.isovalue {
                session.set_isovalue(isovalue);
            }
            if let Some(view) = link.view {
                session.set_view(view);
            }
        }
    }

    /// The part of an address behind `#` that restores what is shown of a volume at this address.
    pub fn link(&self, volume: Option<String>) -> String {
        let session = self.volumes.shown();
        let isovalue = session.and_then(Session::isovalue);
        let infill = Some(self.volumes.settings().infill);
        Link { volume, isovalue, view: session.map(Session::view), infill }.format()
    }

    /// Heights of the histogram's bars, 0 to 1; nothing before the volume is there.
    pub fn bars(&self) -> Vec<f32> {
        let histogram = self.volumes.shown().and_then(Session::histogram);
        histogram.map_or_else(Vec::new, |histogram| bars::heights(histogram.counts()))
    }

    /// The histogram's range.
    pub fn range(&self) -> Vec<f32> {
        let histogram = self.volumes.shown().and_then(Session::histogram);
        histogram.map_or_else(Vec::new, |histogram| histogram.range().to_vec())
    }

    /// Share of the newest volume that is on the GPU, 0 to 1.
    pub fn loaded(&self) -> f32 {
        self.volumes
            .incoming()
            .or(self.volumes.shown())
            .map_or(0.0, |session| session.report().loaded)
    }

    /// Finished share of the rays that enter the volume, 0 to 1.
    pub fn completeness(&self) -> f64 {
        self.volumes.shown().map_or(0.0, |session| session.report().completeness())
    }

    /// Read-outs: names and values in turn.
    pub fn rows(&self) -> Vec<String> {
        let mut rows = self.volumes.shown().map(rows).unwrap_or_default();
        if let (false, Some(incoming)) = (rows.is_empty(), self.volumes.incoming()) {
            rows.push(("next volume", text::bytes(incoming.report().bytes)));
        }
        rows.into_iter().flat_map(|(name, value)| [name.to_owned(), value]).collect()
    }

    /// Name of what unfinished pixels are asked to show.
    pub fn infill(&self) -> String {
        infill_name(self.volumes.settings().infill).to_owned()
    }

    /// Milliseconds and completeness of the frame's passes in turn.
    pub fn passes(&self) -> Vec<f64> {
        let passes = self.volumes.shown().map_or(&[][..], Session::passes);
        passes.iter().flat_map(|pass| [pass.ms, pass.completeness]).collect()
    }

    /// Most bytes of GPU memory that the renderer ever had.
    #[wasm_bindgen(js_name = peakBytes)]
    pub fn peak_bytes(&self) -> f64 {
        self.volumes.shown().map_or(0.0, |session| session.report().peak_bytes as f64)
    }
}

#[wasm_bindgen]
impl Picture {
    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.size[0]
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.size[1]
    }

    /// Red, green, blue and alpha of every pixel.
    pub fn color(&self) -> Vec<u8> {
        self.color.clone()
    }

    /// Distance along the view axis in world units, infinity without a surface; empty where depth is
    /// not made.
    pub fn depth(&self) -> Vec<f32> {
        self.depth.clone()
    }

    /// 1 where a pixel shows the surface, 0 where it shows none, 2 where that is not known.
    pub fn status(&self) -> Vec<u8> {
        self.status.clone()
    }
}

impl From<Capture> for Picture {
    fn from(capture: Capture) -> Self {
        let number = |status: &PixelStatus| *status as u8;
        Self {
            size: capture.size,
            color: capture.color,
            depth: capture.depth.unwrap_or_default(),
            status: capture.status.unwrap_or_default().iter().map(number).collect(),
        }
    }
}
