//! The loop without a window: as many frames as asked for, some of them kept as picture files.

use std::path::Path;

use progressive_iso::wgpu;

use crate::scene::Scene;
use crate::support::{Failure, Gpu};
use crate::{Arguments, orbit_degrees};

/// Rows of 640 pixels are a multiple of 256 bytes, as copies to buffers ask for.
const SIZE: [u32; 2] = [640, 480];

const FRAMES: u32 = 48;

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    std::fs::create_dir_all(&arguments.out)?;
    let gpu = Gpu::new(arguments.adapter.as_deref())?;
    println!("adapter  {}", gpu.name());
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let mut scene = Scene::new(&gpu, format, SIZE, arguments.budget << 20)?;
    let color = color_texture(&gpu.device, format);
    let view = color.create_view(&wgpu::TextureViewDescriptor::default());

    println!("frame  degrees  loaded  unfinished rays complete");
    let frames = arguments.frames.unwrap_or(FRAMES);
    let mut before = None;
    for frame in 0..frames {
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("host.frame") });
        let degrees = orbit_degrees(frame);
        let report = scene.record(&gpu, &mut encoder, &view, degrees)?;
        let submission = gpu.queue.submit([encoder.finish()]);

        let loaded = report.loaded * 100.0;
        let rays = if report.pass > 0 { report.active_rays.to_string() } else { "-".into() };
        println!("{frame:5} {degrees:8.1} {loaded:6.0}% {rays:16} {:8}", report.complete());
        if frame % arguments.every == 0 || frame + 1 == frames {
            write_picture(&gpu, &color, &arguments.out.join(format!("frame_{frame:03}.png")))?;
        }
        // A window's display would hold the loop back; here, the frame before must be done.
        if let Some(submission) = before.replace(submission) {
            gpu.device
                .poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })?;
        }
    }
    println!("pictures are in {}", arguments.out.display());
    Ok(())
}

fn color_texture(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host.color"),
        size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// Reads the colour target back, which waits for the GPU, and writes it to a file.
fn write_picture(gpu: &Gpu, color: &wgpu::Texture, path: &Path) -> Result<(), Failure> {
    let [width, height] = SIZE;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("host.picture"),
        size: u64::from(width) * u64::from(height) * 4,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("host.picture") });
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(width * 4),
        rows_per_image: None,
    };
    encoder.copy_texture_to_buffer(
        color.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        color.size(),
    );
    encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., |_| {});
    gpu.queue.submit([encoder.finish()]);
    gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
    let pixels = buffer.get_mapped_range(..)?;
    let (kind, format) = (image::ColorType::Rgba8, image::ImageFormat::Png);
    image::save_buffer_with_format(path, &pixels, width, height, kind, format)
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}
