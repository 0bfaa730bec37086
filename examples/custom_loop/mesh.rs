//! A lit triangle mesh of the host application, with a pipeline of its own.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec4, Quat, Vec3};
use progressive_iso::{Camera, DrawTarget, wgpu};
use wgpu::util::DeviceExt as _;

/// One corner of a triangle, in world space.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Vertex {
    pub position: [f32; 3],
    pub normal: [f32; 3],
}

/// Uniform of `mesh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Params {
    clip_from_world: [[f32; 4]; 4],
    eye: [f32; 4],
    color: [f32; 4],
}

/// A mesh on the GPU.
#[derive(Debug)]
pub struct Mesh {
    pipeline: wgpu::RenderPipeline,
    params: wgpu::Buffer,
    bind: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
}

impl Mesh {
    /// Uploads the mesh; its pipeline draws into the same kind of target as the isosurface's.
    pub fn new(
        device: &wgpu::Device,
        target: &DrawTarget,
        vertices: &[Vertex],
        indices: &[u32],
    ) -> Self {
        let pipeline = pipeline(device, target);
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("host.mesh"),
                contents,
                usage,
            })
        };
        let params = buffer(
            bytemuck::bytes_of(&Params::zeroed()),
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        );
        let bind = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("host.mesh"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: params.as_entire_binding() }],
        });
        Self {
            pipeline,
            params,
            bind,
            vertices: buffer(bytemuck::cast_slice(vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(indices), wgpu::BufferUsages::INDEX),
            index_count: indices.len() as u32,
        }
    }

    /// Sets camera and colour (linear, 0 to 1) of everything submitted from now on.
    pub fn set_view(&self, queue: &wgpu::Queue, camera: &Camera, color: [f32; 3]) {
        let view_from_world = DMat4::from_cols_array_2d(&camera.view_from_world);
        let clip_from_view = DMat4::from_cols_array_2d(&camera.clip_from_view);
        let eye = view_from_world.inverse() * DVec4::W;
        let params = Params {
            clip_from_world: (clip_from_view * view_from_world).as_mat4().to_cols_array_2d(),
            eye: eye.as_vec4().to_array(),
            color: Vec3::from(color).extend(1.0).to_array(),
        };
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
    }

    /// Draws the mesh.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}

fn pipeline(device: &wgpu::Device, target: &DrawTarget) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("mesh.wgsl"));
    let encode = !target.color_format.is_srgb();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("host.mesh"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("mesh_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Vertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
            })],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: target.depth_format,
            depth_write_enabled: Some(true),
            depth_compare: Some(target.depth_compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: target.sample_count, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("mesh_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[("encode", f64::from(u8::from(encode)))],
                ..Default::default()
            },
            targets: &[Some(target.color_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A ring about `center`, whose axis is +z turned by `rotation`: `radius` to the middle of a tube of
/// radius `tube`.
pub fn torus(
    center: [f32; 3],
    rotation: Quat,
    radius: f32,
    tube: f32,
    segments: [u32; 2],
) -> (Vec<Vertex>, Vec<u32>) {
    let angle = |i: u32, n: u32| i as f32 / n as f32 * std::f32::consts::TAU;
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    let [around, across] = segments;
    for i in 0..around {
        let outwards = Vec3::new(angle(i, around).cos(), angle(i, around).sin(), 0.0);
        for j in 0..across {
            let (sin, cos) = angle(j, across).sin_cos();
            let normal = rotation * (outwards * cos + Vec3::Z * sin);
            let middle = Vec3::from(center) + rotation * (outwards * radius);
            let position = (middle + normal * tube).to_array();
            vertices.push(Vertex { position, normal: normal.to_array() });
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            indices.extend([0, 1, 2, 0, 2, 3].map(|k: usize| corners[k]));
        }
    }
    (vertices, indices)
}
