//! What the examples share: a device, picture files, reports.

#![allow(dead_code, unreachable_pub, reason = "every example uses a part of this")]

use std::path::Path;

use progressive_iso::{Capture, PassReport, ProgressiveIsoRenderer, wgpu};
use serde::Serialize;

pub type Failure = Box<dyn std::error::Error>;

/// A device on the adapter whose name contains `wanted`, or on the first that serves.
pub struct Gpu {
    pub info: wgpu::AdapterInfo,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

/// All adapters, the native APIs' before OpenGL's.
pub fn adapters() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.extend(pollster::block_on(instance.enumerate_adapters(wgpu::Backends::GL)));
    adapters
}

impl Gpu {
    pub fn new(wanted: Option<&str>) -> Result<Self, Failure> {
        let adapters = adapters();
        let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        let matches = |a: &&wgpu::Adapter| {
            wanted.is_none_or(|w| a.get_info().name.to_lowercase().contains(&w.to_lowercase()))
        };
        let Some(adapter) = adapters.iter().find(matches) else {
            return Err(match wanted {
                Some(name) => format!("no adapter's name contains \"{name}\"; there are {names:?}"),
                None => "no GPU adapter found; on Debian and Ubuntu the package \
                         mesa-vulkan-drivers brings a software one"
                    .into(),
            }
            .into());
        };
        let features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("example"),
            required_features: features,
            ..Default::default()
        }))
        .map_err(|error| {
            format!("{} offers less than WebGPU asks for: {error}", adapter.get_info().name)
        })?;
        Ok(Self { info: adapter.get_info(), device, queue })
    }

    pub fn name(&self) -> String {
        format!("{} ({:?})", self.info.name, self.info.backend)
    }
}

/// One pass of a report file.
#[derive(Serialize, Clone, Debug)]
pub struct PassEntry {
    pub pass: u32,
    pub rounds: u32,
    /// Wall time since the frame was set, loading and waiting included.
    pub ms: f64,
    pub completeness: f64,
    pub completeness_pixels: f64,
    pub entered_rays: u32,
    pub active_rays: u32,
    pub hits: u32,
    pub blocks_requested: u32,
    pub blocks_decoded: u32,
    pub blocks_evicted: u32,
    pub cpu_ms: f64,
    pub gpu_ms: Option<f64>,
    pub bytes: u64,
    pub peak_bytes: u64,
}

impl PassEntry {
    pub fn new(report: &PassReport, ms: f64) -> Self {
        Self {
            pass: report.pass,
            rounds: report.rounds,
            ms,
            completeness: report.completeness(),
            completeness_pixels: report.completeness_pixels(),
            entered_rays: report.entered_rays,
            active_rays: report.active_rays,
            hits: report.hits,
            blocks_requested: report.blocks_requested,
            blocks_decoded: report.blocks_decoded,
            blocks_evicted: report.blocks_evicted,
            cpu_ms: report.cpu_ms,
            gpu_ms: report.gpu_ms,
            bytes: report.bytes,
            peak_bytes: report.peak_bytes,
        }
    }
}

/// One part of the plan in a report file.
#[derive(Serialize, Clone, Debug)]
pub struct PlanEntry {
    pub part: String,
    pub included: bool,
    pub bytes: u64,
    pub why: String,
}

/// A report file.
#[derive(Serialize, Clone, Debug)]
pub struct Report {
    pub adapter: String,
    pub volume: String,
    pub dims: [u32; 3],
    pub bits_per_block: u32,
    pub isovalue: f32,
    pub size: [u32; 2],
    pub budget_bytes: u64,
    pub plan: Vec<PlanEntry>,
    pub bytes_by_category: Vec<(String, u64)>,
    /// Time to make pipelines and allocate memory, before the first pass.
    pub setup_ms: f64,
    pub passes: Vec<PassEntry>,
}

impl Report {
    pub fn new(
        gpu: &Gpu,
        volume: &str,
        renderer: &ProgressiveIsoRenderer,
        isovalue: f32,
        setup_ms: f64,
        passes: Vec<PassEntry>,
    ) -> Self {
        let plan = renderer.plan();
        let [width, height] =
            [renderer.textures().color().width(), renderer.textures().color().height()];
        Self {
            adapter: gpu.name(),
            volume: volume.into(),
            dims: renderer.volume().dims(),
            bits_per_block: renderer.volume().layout().bits_per_block,
            isovalue,
            size: [width, height],
            budget_bytes: plan.budget_bytes(),
            plan: plan
                .parts()
                .iter()
                .map(|p| PlanEntry {
                    part: p.name.into(),
                    included: p.included,
                    bytes: p.bytes,
                    why: p.why.clone(),
                })
                .collect(),
            bytes_by_category: renderer
                .bytes_by_category()
                .into_iter()
                .map(|(category, bytes)| (format!("{category:?}"), bytes))
                .collect(),
            setup_ms,
            passes,
        }
    }

    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        write_file(path, serde_json::to_string_pretty(self)?.as_bytes())
    }
}

pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

pub fn write_png(path: &Path, capture: &Capture) -> Result<(), Failure> {
    let [width, height] = capture.size;
    image::save_buffer(path, &capture.color, width, height, image::ColorType::Rgba8)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

/// One 32-bit float channel "Z", as renderers store depth.
pub fn write_depth_exr(path: &Path, capture: &Capture) -> Result<(), Failure> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, SmallVec,
        WritableImage,
    };
    let depth = capture.depth.clone().ok_or("the picture has no depth")?;
    let size = (capture.size[0] as usize, capture.size[1] as usize);
    let channel = AnyChannel::new("Z", FlatSamples::F32(depth));
    let layer = Layer::new(
        size,
        LayerAttributes::named("depth"),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(SmallVec::from_vec(vec![channel])),
    );
    Image::from_layer(layer)
        .write()
        .to_file(path)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}
