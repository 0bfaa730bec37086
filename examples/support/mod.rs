//! What the examples share: a device, picture files, reports.

#![allow(dead_code, unreachable_pub, unused_imports, reason = "every example uses a part of this")]

mod origin;
mod table;

pub mod plot;
#[cfg(feature = "published-network")]
pub mod published;
pub mod shown;
pub mod subject;

use std::path::Path;

pub use origin::Origin;
use progressive_iso::{
    Camera, Capture, CompressedVolume, PassReport, ProgressiveIsoRenderer, wgpu,
};
use serde::Serialize;
pub use table::Table;

pub type Failure = Box<dyn std::error::Error>;

/// Colour of pixels that are not known yet: told apart from the background, but quiet.
pub const UNFINISHED: [f32; 4] = [0.88, 0.91, 0.95, 1.0];

/// Environment variable that names an adapter where no option does.
pub const ADAPTER_VARIABLE: &str = "PROGRESSIVE_ISO_ADAPTER";

/// Runs a program that logs what the environment asks for, and ends with 1 and what went wrong.
pub fn main(name: &str, run: impl FnOnce() -> Result<(), Failure>) {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::from_default_env())
        .init();
    if let Err(error) = run() {
        eprintln!("{name}: {error}");
        std::process::exit(1);
    }
}

/// A device on one of the adapters.
pub struct Gpu {
    pub info: wgpu::AdapterInfo,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

/// All adapters, best first: the native APIs' before OpenGL's, hardware before software.
pub fn adapters() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    [wgpu::Backends::PRIMARY, wgpu::Backends::GL]
        .into_iter()
        .flat_map(|backends| {
            let mut found = pollster::block_on(instance.enumerate_adapters(backends));
            found.sort_by_key(|adapter| match adapter.get_info().device_type {
                wgpu::DeviceType::DiscreteGpu => 0,
                wgpu::DeviceType::IntegratedGpu => 1,
                wgpu::DeviceType::VirtualGpu => 2,
                wgpu::DeviceType::Other => 3,
                wgpu::DeviceType::Cpu => 4,
            });
            found
        })
        .collect()
}

/// Name and back end.
pub fn adapter_name(info: &wgpu::AdapterInfo) -> String {
    format!("{} ({:?})", info.name, info.backend)
}

/// The adapters whose names contain `wanted`, or else the value of [`ADAPTER_VARIABLE`], or all.
/// At least one.
pub fn matching_adapters(wanted: Option<&str>) -> Result<Vec<wgpu::Adapter>, Failure> {
    let wanted = wanted.map(str::to_owned).or_else(|| std::env::var(ADAPTER_VARIABLE).ok());
    let wanted = wanted.unwrap_or_default().to_lowercase();
    let mut adapters = adapters();
    let names: Vec<String> = adapters.iter().map(|a| adapter_name(&a.get_info())).collect();
    adapters.retain(|a| adapter_name(&a.get_info()).to_lowercase().contains(&wanted));
    if names.is_empty() {
        Err("no GPU adapter found; on Debian and Ubuntu the package mesa-vulkan-drivers brings a \
             software one"
            .into())
    } else if adapters.is_empty() {
        Err(format!("no adapter's name contains \"{wanted}\"; there are {names:?}").into())
    } else {
        Ok(adapters)
    }
}

impl Gpu {
    /// A device on the best adapter whose name contains `wanted`.
    pub fn new(wanted: Option<&str>) -> Result<Self, Failure> {
        Self::open(&matching_adapters(wanted)?)
    }

    /// A device on the first of the adapters that offers WebGPU's default limits.
    pub fn open(adapters: &[wgpu::Adapter]) -> Result<Self, Failure> {
        let mut refusals = String::new();
        for adapter in adapters {
            let features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
            let descriptor = wgpu::DeviceDescriptor {
                label: Some("example"),
                required_features: features,
                ..Default::default()
            };
            match pollster::block_on(adapter.request_device(&descriptor)) {
                Ok((device, queue)) => return Ok(Self { info: adapter.get_info(), device, queue }),
                Err(error) => {
                    let name = adapter_name(&adapter.get_info());
                    refusals += &format!("{name} offers less than WebGPU asks for: {error}; ");
                }
            }
        }
        Err(refusals.trim_end_matches("; ").into())
    }

    /// Runs what is recorded, blocking on the device until it is done.
    pub fn run(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) -> Result<(), Failure> {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        record(&mut encoder);
        #[expect(clippy::disallowed_methods, reason = "the program owns the queue")]
        self.queue.submit([encoder.finish()]);
        #[expect(clippy::disallowed_methods, reason = "the program may block")]
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }

    pub fn name(&self) -> String {
        adapter_name(&self.info)
    }
}

/// Reads a texture of four bytes per pixel back, row 0 on top, blocking on the device. Its memory is
/// the caller's, not the renderer's.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u8>, Failure> {
    let row = u64::from(texture.width()) * 4;
    let padded = row.next_multiple_of(u64::from(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(padded as u32),
        rows_per_image: None,
    };
    let bytes = read_back(gpu, padded * u64::from(texture.height()), |encoder, buffer| {
        let target = wgpu::TexelCopyBufferInfo { buffer, layout };
        encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
    })?;
    let rows = bytes.chunks_exact(padded as usize);
    Ok(rows.flat_map(|padded| &padded[..row as usize]).copied().collect())
}

/// Reads a buffer that has the usage `COPY_SRC` back as words, blocking on the device.
pub fn read_words(gpu: &Gpu, source: &wgpu::Buffer) -> Result<Vec<u32>, Failure> {
    let bytes = read_back(gpu, source.size(), |encoder, buffer| {
        encoder.copy_buffer_to_buffer(source, 0, buffer, 0, source.size());
    })?;
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(bytes.chunks_exact(4).map(word).collect())
}

/// The bytes that `copy` records into a buffer of this size.
fn read_back(
    gpu: &Gpu,
    size: u64,
    copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
) -> Result<Vec<u8>, Failure> {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("example.read_back"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.run(|encoder| {
        copy(encoder, &buffer);
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., |_| {});
    })?;
    Ok(buffer.get_mapped_range(..)?.to_vec())
}

/// Middle value; the mean of the two middle ones for an even count, NaN for none.
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[n / 2],
        n => (values[n / 2 - 1] + values[n / 2]) / 2.0,
    }
}

/// Mean of the finite values, if there are any.
pub fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let finite: Vec<f64> = values.flatten().filter(|v| v.is_finite()).collect();
    (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / finite.len() as f64)
}

/// The values in the order in which they come first.
pub fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

/// The camera of a frame that looks at a volume's middle from a distance in world units, which may be too near to see
/// all of it; angles in degrees as for [`Camera::orbit`], `far` in radii of the volume's ball.
pub fn camera_at(
    volume: &CompressedVolume,
    [azimuth, elevation]: [f64; 2],
    distance: f64,
    fov: f64,
    size: [u32; 2],
    far: f64,
) -> Camera {
    let (center, radius) = volume.bounding_ball();
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    let level = elevation.cos();
    let away = [azimuth.sin() * level, elevation.sin(), azimuth.cos() * level];
    let eye = [0, 1, 2].map(|axis| center[axis] + distance * away[axis]);
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    let up = [0.0, 1.0, 0.0];
    Camera::perspective(eye, center, up, fov, aspect, 0.01 * radius, far * radius)
}

/// Width and height from `WIDTHxHEIGHT`, for command lines.
pub fn picture_size(text: &str) -> Result<[u32; 2], String> {
    let (width, height) = text.split_once('x').ok_or("expected WIDTHxHEIGHT")?;
    let edge = |text: &str| text.parse().map_err(|error| format!("{text}: {error}"));
    Ok([edge(width)?, edge(height)?])
}

/// Resident memory of this process in bytes, now and at its peak; `None` where the system does not
/// say.
pub fn resident_bytes() -> Option<[u64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let kilobytes = |name: &str| -> Option<u64> {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse().ok()
    };
    Some([kilobytes("VmRSS:")? * 1024, kilobytes("VmHWM:")? * 1024])
}

/// Lets the peak of [`resident_bytes`] start again from what is resident now, where the system
/// allows it.
pub fn reset_resident_peak() {
    // Elsewhere the peak stays that of the whole process.
    std::fs::write("/proc/self/clear_refs", "5").unwrap_or_default();
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
    pub open_depth_voxels: f32,
    pub blocks_used: u32,
    pub blocks_requested: u32,
    pub blocks_decoded: u32,
    pub blocks_evicted: u32,
    pub cpu_ms: f64,
    pub gpu_ms: Option<f64>,
    pub bytes: u64,
    pub peak_bytes: u64,
}

impl PassEntry {
    /// Heads of the columns of [`PassEntry::line`].
    pub const HEAD: &str = "pass  complete  decoded  active rays      ms      MB";

    /// One line of a table.
    pub fn line(&self) -> String {
        format!(
            "{:4} {:8.2}% {:8} {:12} {:7.0} {:7.1}",
            self.pass,
            self.completeness * 100.0,
            self.blocks_decoded,
            self.active_rays,
            self.ms,
            self.bytes as f64 / 1e6,
        )
    }

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
            open_depth_voxels: report.open_depth_voxels,
            blocks_used: report.blocks_used,
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
    /// Finished share of the rays that enter the volume, after the last pass.
    pub completeness: f64,
    /// Whether every pixel is final.
    pub complete: bool,
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
            completeness: passes.last().map_or(0.0, |p| p.completeness),
            complete: passes.last().is_some_and(|p| p.active_rays == 0),
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

pub fn write_json(folder: &Path, name: &str, value: &impl Serialize) -> Result<(), Failure> {
    write_file(&folder.join(name), serde_json::to_string_pretty(value)?.as_bytes())
}

pub fn write_png(path: &Path, capture: &Capture) -> Result<(), Failure> {
    let [width, height] = capture.size;
    let (color, format) = (image::ColorType::Rgba8, image::ImageFormat::Png);
    image::save_buffer_with_format(path, &capture.color, width, height, color, format)
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
