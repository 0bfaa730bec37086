//! Reading pictures back, without blocking.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use gpu_primitives::memory::{Buffer, Category, Ledger};
use wavefront::{DEPTH_NONE, OutputTextures, PixelStatus, WavefrontPlan};

use crate::wgpu;

/// Row lengths in buffers are multiples of this.
const ROW_ALIGNMENT: u64 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64;

/// Pictures on the CPU, row 0 on top.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Capture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Four bytes per pixel: red, green, blue (sRGB-encoded), alpha.
    pub color: Vec<u8>,
    /// Distance along the view axis in world units, +inf without a surface.
    pub depth: Option<Vec<f32>>,
    /// Unit world-space normal towards the viewer, 0 without a surface.
    pub normal: Option<Vec<[f32; 3]>>,
    /// What each pixel shows.
    pub status: Option<Vec<PixelStatus>>,
}

/// A capture on its way. Poll the device, then ask [`PendingCapture::try_take`].
#[derive(Debug)]
pub struct PendingCapture {
    size: [u32; 2],
    pictures: Vec<Picture>,
}

#[derive(Debug)]
struct Picture {
    kind: Kind,
    row_bytes: u64,
    buffer: Buffer,
    state: Arc<AtomicU8>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Color,
    Depth,
    Normal,
    Status,
}

/// What a staging buffer ends with until the GPU has filled it: a submission that is refused leaves it
/// there and the buffer is mapped all the same.
const NOT_RUN: u32 = 1;
const STAMP_BYTES: u64 = size_of::<u32>() as u64;

const WAITING: u8 = 0;
const MAPPED: u8 = 1;
const LOST: u8 = 2;

fn padded_row(width: u32, bytes_per_pixel: u64) -> u64 {
    (u64::from(width) * bytes_per_pixel).next_multiple_of(ROW_ALIGNMENT)
}

/// Bytes of all staging buffers of one capture.
pub(crate) fn bytes(plan: &WavefrontPlan) -> u64 {
    let ([width, height], outputs) = (plan.size(), plan.outputs());
    let sizes = [(true, 4), (outputs.depth, 4), (outputs.normal, 8), (outputs.status, 4)];
    let there = sizes.iter().filter(|(has, _)| *has);
    there.map(|&(_, bytes)| padded_row(width, bytes) * u64::from(height) + STAMP_BYTES).sum()
}

/// A staging buffer that says that it is not filled.
fn staging(device: &wgpu::Device, ledger: &Ledger, bytes: u64) -> Buffer {
    let desc = wgpu::BufferDescriptor {
        label: Some("progressive-iso.capture"),
        size: bytes + STAMP_BYTES,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: true,
    };
    let buffer = ledger.buffer(device, Category::Readback, &desc);
    match buffer.get_mapped_range_mut(bytes..) {
        Ok(mut view) => view.copy_from_slice(&NOT_RUN.to_le_bytes()),
        Err(error) => tracing::warn!(%error, "a new buffer is not mapped"),
    }
    buffer.unmap();
    buffer
}

impl PendingCapture {
    /// Records copies of all pictures; they are mapped when the encoder's submission is done.
    pub(crate) fn record(
        device: &wgpu::Device,
        ledger: &Ledger,
        encoder: &mut wgpu::CommandEncoder,
        textures: &OutputTextures,
    ) -> Self {
        let size = [textures.color().width(), textures.color().height()];
        let sources = [
            (Kind::Color, Some(textures.color())),
            (Kind::Depth, textures.depth()),
            (Kind::Normal, textures.normal()),
            (Kind::Status, textures.status()),
        ];
        let pictures = sources
            .into_iter()
            .filter_map(|(kind, texture)| Some((kind, texture?)))
            .map(|(kind, texture)| Picture::record(device, ledger, encoder, kind, texture))
            .collect();
        Self { size, pictures }
    }

    /// The pictures, once the GPU has delivered them; `None` before. Gives them once.
    ///
    /// A device that is lost or refuses the submission delivers nothing.
    pub fn try_take(&mut self) -> Option<Capture> {
        let ready = |p: &Picture| p.state.load(Ordering::Acquire) == MAPPED;
        if self.pictures.is_empty() || !self.pictures.iter().all(ready) {
            return None;
        }
        let mut capture =
            Capture { size: self.size, color: Vec::new(), depth: None, normal: None, status: None };
        let delivered = self.pictures.iter().map(|picture| picture.pixels(self.size));
        let delivered = delivered.collect::<Option<Vec<_>>>()?;
        for (picture, bytes) in std::mem::take(&mut self.pictures).iter().zip(delivered) {
            match picture.kind {
                Kind::Color => capture.color = bytes,
                Kind::Depth => capture.depth = Some(depths(&bytes)),
                Kind::Normal => capture.normal = Some(normals(&bytes)),
                Kind::Status => capture.status = Some(statuses(&bytes)),
            }
        }
        Some(capture)
    }

    /// Whether the device refused to deliver.
    pub fn is_lost(&self) -> bool {
        self.pictures.iter().any(|p| p.state.load(Ordering::Acquire) == LOST)
    }
}

impl Picture {
    fn record(
        device: &wgpu::Device,
        ledger: &Ledger,
        encoder: &mut wgpu::CommandEncoder,
        kind: Kind,
        texture: &wgpu::Texture,
    ) -> Self {
        let pixel = u64::from(texture.format().block_copy_size(None).unwrap_or(4));
        let row_bytes = padded_row(texture.width(), pixel);
        let bytes = row_bytes * u64::from(texture.height());
        let buffer = staging(device, ledger, bytes);
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes as u32),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        encoder.clear_buffer(&buffer, bytes, None);
        let state = Arc::new(AtomicU8::new(WAITING));
        let seen = Arc::clone(&state);
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., move |result| {
            let outcome = if result.is_ok() { MAPPED } else { LOST };
            seen.store(outcome, Ordering::Release);
        });
        Self { kind, row_bytes, buffer, state }
    }

    /// The rows without padding.
    fn pixels(&self, size: [u32; 2]) -> Option<Vec<u8>> {
        let view = self.buffer.get_mapped_range(..).ok()?;
        let (rows, stamp) = view.split_at(view.len().checked_sub(STAMP_BYTES as usize)?);
        if stamp == NOT_RUN.to_le_bytes() {
            self.state.store(LOST, Ordering::Release);
            return None;
        }
        let pixel = match self.kind {
            Kind::Normal => 8,
            _ => 4,
        };
        let row = size[0] as usize * pixel;
        let mut bytes = Vec::with_capacity(row * size[1] as usize);
        for padded in rows.chunks_exact(self.row_bytes as usize) {
            bytes.extend_from_slice(&padded[..row]);
        }
        Some(bytes)
    }
}

fn words(bytes: &[u8]) -> impl Iterator<Item = u32> + '_ {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

fn depths(bytes: &[u8]) -> Vec<f32> {
    words(bytes)
        .map(f32::from_bits)
        .map(|depth| if depth >= DEPTH_NONE { f32::INFINITY } else { depth })
        .collect()
}

fn normals(bytes: &[u8]) -> Vec<[f32; 3]> {
    let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
    bytes.chunks_exact(8).map(|b| [half(&b[0..]), half(&b[2..]), half(&b[4..])]).collect()
}

fn statuses(bytes: &[u8]) -> Vec<PixelStatus> {
    words(bytes)
        .map(|word| match word {
            0 => PixelStatus::Background,
            1 => PixelStatus::Hit,
            _ => PixelStatus::Unfinished,
        })
        .collect()
}
