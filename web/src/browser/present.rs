//! From the renderer's pictures to the canvas: `shader/present.wgsl`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use progressive_iso::{OutputTextures, wgpu};

use super::gpu::Gpu;
use crate::session::BACKGROUND;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Keeps what is shown, so that a frame's early passes go over the last frame and nothing flashes.
#[derive(Debug)]
pub(super) struct Presenter {
    shown: wgpu::Texture,
    /// Of a frame at work: unfinished pixels keep what was there.
    take_finished: wgpu::RenderPipeline,
    /// Of a frame that rests.
    take_all: wgpu::RenderPipeline,
    /// To the picture of another size.
    stretch: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    canvas: Option<Canvas>,
}

/// How the canvas is presented to.
#[derive(Debug)]
struct Canvas {
    configuration: wgpu::SurfaceConfiguration,
    stretch: wgpu::RenderPipeline,
}

/// What is shown, on its way to main memory.
#[derive(Debug)]
pub(super) struct Copy {
    size: [u32; 2],
    row_bytes: u32,
    buffer: wgpu::Buffer,
    is_mapped: Arc<AtomicBool>,
}

impl Presenter {
    pub(super) fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let shader = wgpu::include_wgsl!("../../shader/present.wgsl");
        let module = gpu.device.create_shader_module(shader);
        let make = |fragment, constants: &[(&str, f64)], format| {
            pipeline(&gpu.device, &module, fragment, constants, format)
        };
        let canvas = gpu.surface.as_ref().and_then(|surface| {
            let configuration = surface.get_default_config(&gpu.adapter, size[0], size[1])?;
            let stretch = make("stretch", &[], configuration.format);
            Some(Canvas { configuration, stretch })
        });
        let presenter = Self {
            shown: texture(&gpu.device, size),
            take_finished: make("take", &[("KEEP_LAST", 1.0)], FORMAT),
            take_all: make("take", &[("KEEP_LAST", 0.0)], FORMAT),
            stretch: make("stretch", &[], FORMAT),
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("web.present"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            canvas,
        };
        let mut encoder = gpu.encoder();
        let [r, g, b, a] = BACKGROUND.map(f64::from);
        let background = wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a });
        draw(&mut encoder, &view(&presenter.shown), background, None);
        gpu.submit(encoder);
        presenter.configure(gpu);
        presenter
    }

    fn configure(&self, gpu: &Gpu) {
        if let (Some(surface), Some(canvas)) = (&gpu.surface, &self.canvas) {
            surface.configure(&gpu.device, &canvas.configuration);
        }
    }

    pub(super) fn size(&self) -> [u32; 2] {
        [self.shown.width(), self.shown.height()]
    }

    /// Goes to another size; what is shown is stretched until there is something newer.
    pub(super) fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) {
        let stretched = texture(&gpu.device, size);
        let mut encoder = gpu.encoder();
        let bind = self.bind_shown(&gpu.device, &self.stretch);
        let load = wgpu::LoadOp::Load;
        draw(&mut encoder, &view(&stretched), load, Some((&self.stretch, &bind)));
        gpu.submit(encoder);
        self.shown = stretched;
        if let Some(canvas) = &mut self.canvas {
            [canvas.configuration.width, canvas.configuration.height] = size;
        }
        self.configure(gpu);
    }

    /// Records taking over a picture of the size that is shown.
    pub(super) fn record_take(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        pictures: &OutputTextures,
        all: bool,
    ) {
        let pipeline = if all { &self.take_all } else { &self.take_finished };
        let Some(status) = pictures.status() else { return };
        let bind = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("web.take"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(pictures.color_view())),
                entry(1, wgpu::BindingResource::TextureView(&view(status))),
            ],
        });
        draw(encoder, &view(&self.shown), wgpu::LoadOp::Load, Some((pipeline, &bind)));
    }

    /// Presents what is shown.
    pub(super) fn present(&self, gpu: &Gpu) {
        let (Some(surface), Some(canvas)) = (&gpu.surface, &self.canvas) else { return };
        let target = match surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(target)
            | wgpu::CurrentSurfaceTexture::Suboptimal(target) => target,
            // The next picture tries again.
            _ => return self.configure(gpu),
        };
        let mut encoder = gpu.encoder();
        let bind = self.bind_shown(&gpu.device, &canvas.stretch);
        let load = wgpu::LoadOp::Load;
        draw(&mut encoder, &view(&target.texture), load, Some((&canvas.stretch, &bind)));
        gpu.submit(encoder);
        gpu.queue.present(target);
    }

    fn bind_shown(
        &self,
        device: &wgpu::Device,
        pipeline: &wgpu::RenderPipeline,
    ) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("web.stretch"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                entry(2, wgpu::BindingResource::TextureView(&view(&self.shown))),
                entry(3, wgpu::BindingResource::Sampler(&self.sampler)),
            ],
        })
    }

    /// Reads what is shown back.
    pub(super) fn copy(&self, gpu: &Gpu) -> Copy {
        let [width, height] = self.size();
        let row_bytes = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("web.copy"),
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row_bytes),
            rows_per_image: None,
        };
        let mut encoder = gpu.encoder();
        encoder.copy_texture_to_buffer(
            self.shown.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            self.shown.size(),
        );
        let is_mapped = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&is_mapped);
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Read, .., move |result| {
            seen.store(result.is_ok(), Ordering::Release);
        });
        gpu.submit(encoder);
        Copy { size: [width, height], row_bytes, buffer, is_mapped }
    }
}

impl Copy {
    /// Size and pixels, four bytes each, once they are here.
    pub(super) fn pixels(&self) -> Option<([u32; 2], Vec<u8>)> {
        if !self.is_mapped.load(Ordering::Acquire) {
            return None;
        }
        let view = self.buffer.get_mapped_range(..).ok()?;
        let row = 4 * self.size[0] as usize;
        let rows = view.chunks_exact(self.row_bytes as usize);
        Some((self.size, rows.flat_map(|padded| &padded[..row]).copied().collect()))
    }
}

fn texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("web.shown"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    fragment: &str,
    constants: &[(&str, f64)],
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("web.present"),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("cover"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                ..Default::default()
            },
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Records a pass over the whole target.
fn draw(
    encoder: &mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    what: Option<(&wgpu::RenderPipeline, &wgpu::BindGroup)>,
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("web.present"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    });
    if let Some((pipeline, bind)) = what {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, bind, &[]);
        pass.draw(0..3, 0..1);
    }
}
