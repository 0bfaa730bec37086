//! Drawing the finished pixels into the caller's render pass.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgpu;

use crate::frame::FrameView;
use crate::outputs::{DEPTH_NONE, OutputTextures};

const SHADER: &str = include_str!("../shader/draw.wgsl");

/// The caller's targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawTarget {
    /// Format of the colour attachment; formats ending in Srgb get linear values.
    pub color_format: wgpu::TextureFormat,
    /// Format of the depth attachment.
    pub depth_format: wgpu::TextureFormat,
    /// How the caller compares depths: `Less`, or `Greater` with reversed depth.
    pub depth_compare: wgpu::CompareFunction,
    /// Samples per pixel of both attachments.
    pub sample_count: u32,
}

impl Default for DrawTarget {
    fn default() -> Self {
        Self {
            color_format: wgpu::TextureFormat::Rgba8Unorm,
            depth_format: wgpu::TextureFormat::Depth32Float,
            depth_compare: wgpu::CompareFunction::Less,
            sample_count: 1,
        }
    }
}

/// Uniform of `shader/draw.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct DrawParams {
    pub(crate) rows: [[f32; 4]; 4],
    pub(crate) depth_none: f32,
    pub(crate) linear_color: u32,
    pub(crate) pad: [u32; 2],
}

/// The pipeline for one kind of target.
#[derive(Debug)]
pub struct Draw {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    linear_color: bool,
}

/// What drawing one picture needs.
#[derive(Debug)]
pub struct DrawBuffers {
    params: Buffer,
    bind: wgpu::BindGroup,
}

impl Draw {
    /// Makes the pipeline.
    pub fn new(device: &wgpu::Device, target: &DrawTarget) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("wavefront.draw"),
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let texture = |binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let params = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: wgpu::BufferSize::new(DrawBuffers::BYTES),
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("wavefront.draw"),
            entries: &[params, texture(1), texture(2)],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("wavefront.draw"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("wavefront.draw"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("draw_vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: target.depth_format,
                depth_write_enabled: Some(true),
                depth_compare: Some(target.depth_compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: target.sample_count,
                ..wgpu::MultisampleState::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("draw_fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target.color_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, layout, linear_color: target.color_format.is_srgb() }
    }

    /// Records the parameters of a frame into the buffers; needed once per frame.
    pub fn record_params(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &DrawBuffers,
        view: &FrameView,
    ) {
        let params = DrawParams {
            rows: view.clip_rows(),
            depth_none: DEPTH_NONE,
            linear_color: self.linear_color.into(),
            pad: [0; 2],
        };
        upload.write(device, encoder, &buffers.params, 0, bytemuck::bytes_of(&params));
    }

    /// Draws the pixels that show a surface, with the depth that the frame's camera gives them,
    /// into the viewport of `pass`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, buffers: &DrawBuffers) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &buffers.bind, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl DrawBuffers {
    /// Bytes allocated.
    pub const BYTES: u64 = size_of::<DrawParams>() as u64;

    /// Binds one picture's textures; `None` without a depth texture.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        draw: &Draw,
        textures: &OutputTextures,
    ) -> Option<Self> {
        let depth = textures.depth_view()?;
        let params = ledger.buffer(
            device,
            Category::Params,
            &wgpu::BufferDescriptor {
                label: Some("wavefront.draw.params"),
                size: Self::BYTES,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            },
        );
        let entries = [
            params.as_entire_binding(),
            wgpu::BindingResource::TextureView(textures.color_view()),
            wgpu::BindingResource::TextureView(depth),
        ];
        let entries: Vec<_> = (0u32..)
            .zip(entries)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("wavefront.draw"),
            layout: &draw.layout,
            entries: &entries,
        });
        Some(Self { params, bind })
    }
}
