//! A program that embeds the renderer with nothing but the facade and brings its own stream.

use std::error::Error;
use std::sync::Arc;

use progressive_iso::{
    Camera, CompressedVolume, DrawTarget, Frame, FrameOptions, PassReport, ProgressiveIsoRenderer,
    RendererOptions, TraversalStrategy, wgpu,
};

/// Renders passes until the picture is complete, while the application does other things.
fn refine(
    renderer: &mut ProgressiveIsoRenderer,
    device: &wgpu::Device,
    queue: &wgpu::Queue,
) -> Result<PassReport, progressive_iso::Error> {
    loop {
        let report = renderer.render_pass(device, queue)?;
        if report.complete() {
            return Ok(report);
        }
        // A window would present here; the poll lets the reports of finished passes come in.
        if device.poll(wgpu::PollType::Poll).is_err() {
            return Ok(report);
        }
        std::thread::yield_now();
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;

    // 8 bits per voxel for 4x4x4 blocks; blocks of zeros decode as zeros.
    let (dims, bits_per_block) = ([32, 32, 32], 8 * 64);
    let stream: Vec<u8> = vec![0; 8 * 8 * 8 * bits_per_block as usize / 8];
    let volume = CompressedVolume::new(dims, bits_per_block, 0, Arc::new(stream))?;
    let (center, radius) = volume.bounding_ball();
    let options = RendererOptions {
        size: [64, 64],
        budget_bytes: 16 << 20,
        draw_target: Some(DrawTarget::default()),
        strategy: TraversalStrategy::RunAhead,
        ..Default::default()
    };
    let mut renderer = ProgressiveIsoRenderer::new(&device, &queue, volume, options)?;
    renderer.set_frame(&Frame {
        camera: Camera::orbit(center, radius, 30.0, 20.0, 40.0, 1.0),
        isovalues: vec![0.5],
        options: FrameOptions::default(),
    })?;
    let report = refine(&mut renderer, &device, &queue)?;
    println!("complete after pass {} with {} hits", report.pass, report.hits);
    Ok(())
}
