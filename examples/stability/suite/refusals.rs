//! Values that are refused: the only right answer is the typed error.

use progressive_iso::{Error, Frame, FrameOptions, ProgressiveIsoRenderer, RendererOptions, wgpu};

use super::case::{Case, Volume};
use super::row::{Failure, Row};
use super::views;

const DIMS: [u32; 3] = [8, 8, 8];

fn samples_with(value: f32) -> Vec<f32> {
    let mut samples: Vec<f32> = (0..512u16).map(f32::from).collect();
    samples[100] = value;
    samples
}

/// Samples that volume-io does not take, isovalues that a frame does not take.
pub fn measure(device: &wgpu::Device, queue: &wgpu::Queue) -> Row {
    let mut row = Row::new("scale", "refused: NaN, infinity, 2^123 and more");
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let found = volume_io::encode(&samples_with(value), DIMS, 8.0);
        if !matches!(found, Err(volume_io::Error::NonFinite { .. })) {
            row.problem(|| format!("sample {value}: {found:?}"));
        }
    }
    for value in [2f32.powi(123), -2f32.powi(127)] {
        let found = volume_io::encode(&samples_with(value), DIMS, 8.0);
        if !matches!(found, Err(volume_io::Error::TooLarge { .. })) {
            row.problem(|| format!("sample {value}: {found:?}"));
        }
    }
    if let Err(problem) = isovalues(device, queue, &mut row) {
        row.problem(|| problem.to_string());
    }
    row.finish()
}

fn isovalues(device: &wgpu::Device, queue: &wgpu::Queue, row: &mut Row) -> Result<(), Failure> {
    let volume: Volume = Case::new("scale", "ramp", DIMS, |[x, ..]| x).volume()?;
    let view = views::orbit(&volume, [10.0, 20.0], 40.0, [16, 16]);
    let options = RendererOptions { size: view.size, ..RendererOptions::default() };
    let mut renderer =
        ProgressiveIsoRenderer::new(device, queue, volume.compressed.clone(), options)?;
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 2f32.powi(125), -2f32.powi(126)] {
        let isovalues = vec![value];
        let frame = Frame { camera: view.camera, isovalues, options: FrameOptions::default() };
        let found = renderer.set_frame(&frame);
        if !matches!(found, Err(Error::Isovalue { .. })) {
            row.problem(|| format!("isovalue {value}: {found:?}"));
        }
    }
    Ok(())
}
