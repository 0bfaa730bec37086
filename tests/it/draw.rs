//! Drawing into the caller's pass: the surface and the caller's meshes hide each other, with normal
//! and reversed depth, also where the target encodes to sRGB itself.

use gpu_testkit::gpu;
use progressive_iso::{Camera, Capture, DrawTarget, PixelStatus, RendererOptions, wgpu};

use crate::support::{Gpu, Scene, options};

const SIZE: [u32; 2] = [128, 96];
const RADIUS: f64 = 12.0;
const CLEAR: [u8; 4] = [0, 0, 255, 255];
const MESH: [u8; 4] = [0, 255, 0, 255];

/// The plane z = 0 of view space moved to a view depth, over the whole picture.
const MESH_SHADER: &str = "
@group(0) @binding(0) var<uniform> depth: vec4<f32>;
@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, depth.x, 1.0);
}
@fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(0.0, 1.0, 0.0, 1.0); }
";

fn sphere() -> Scene {
    let mut scene = Scene::generated("sphere", [37, 37, 37], 16.0);
    scene.isovalue = RADIUS as f32;
    scene
}

/// The same view with depth 1 at the near plane and 0 at the far one.
fn reversed(camera: Camera) -> Camera {
    let mut clip_from_view = camera.clip_from_view;
    for column in &mut clip_from_view {
        column[2] = column[3] - column[2];
    }
    Camera { clip_from_view, ..camera }
}

/// Depth-buffer value of the points at a view depth.
fn buffer_depth(camera: &Camera, view_depth: f64) -> f64 {
    let m = &camera.clip_from_view;
    let row = |r: usize| m[3][r] - m[2][r] * view_depth;
    row(2) / row(3)
}

struct Painted {
    color: Vec<[u8; 4]>,
    surface: Capture,
}

/// The surface and a plane at `plane_depth`, in either order.
fn paint(camera: Camera, target: DrawTarget, plane_depth: f64, plane_first: bool) -> Painted {
    let gpu = Gpu::new();
    let scene = sphere();
    let mut renderer =
        gpu.renderer(&scene, RendererOptions { draw_target: Some(target), ..options(SIZE) });
    let surface = gpu.finish(&mut renderer, &scene.frame(camera));
    let (device, queue) = (&gpu.device, &gpu.queue);
    let texture = |format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    };
    let color = texture(target.color_format, wgpu::TextureUsages::COPY_SRC);
    let depth = texture(target.depth_format, wgpu::TextureUsages::empty());
    let (color_view, depth_view) =
        (color.create_view(&Default::default()), depth.create_view(&Default::default()));
    let mesh = Mesh::new(device, &target, buffer_depth(&camera, plane_depth) as f32);
    let mut encoder = device.create_command_encoder(&Default::default());
    let far = if target.depth_compare == wgpu::CompareFunction::Greater { 0.0 } else { 1.0 };
    {
        let [r, g, b, a] = CLEAR.map(|v| f64::from(v) / 255.0);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color_view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(far),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        if plane_first {
            mesh.draw(&mut pass);
        }
        renderer.draw(&mut pass).unwrap();
        if !plane_first {
            mesh.draw(&mut pass);
        }
    }
    let bytes = u64::from(SIZE[0] * SIZE[1] * 4);
    let buffer = gpu::sentinel_buffer(device, bytes, 0xDEAD_BEEF);
    encoder.copy_texture_to_buffer(
        color.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(SIZE[0] * 4),
                rows_per_image: None,
            },
        },
        color.size(),
    );
    gpu::submit_and_wait(device, queue, encoder);
    let color = gpu::read_buffer(device, queue, &buffer);
    Painted { color: color.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect(), surface }
}

struct Mesh {
    pipeline: wgpu::RenderPipeline,
    bind: wgpu::BindGroup,
}

impl Mesh {
    fn new(device: &wgpu::Device, target: &DrawTarget, depth: f32) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(MESH_SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: target.depth_format,
                depth_write_enabled: Some(true),
                depth_compare: Some(target.depth_compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[Some(target.color_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let words = [depth, 0.0, 0.0, 0.0];
        let uniform =
            gpu::buffer_with(device, bytemuck::cast_slice(&words), wgpu::BufferUsages::UNIFORM);
        let bind = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        Self { pipeline, bind }
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Every pixel shows what is nearer; returns how many show the surface and the plane.
fn check(painted: &Painted, plane_depth: f64, tolerance: i32) -> Result<[usize; 2], String> {
    let depths = painted.surface.depth.as_ref().unwrap();
    let status = painted.surface.status.as_ref().unwrap();
    let mut counts = [0, 0];
    for (i, found) in painted.color.iter().enumerate() {
        let surface = [0, 1, 2, 3].map(|c| painted.surface.color[4 * i + c]);
        let near = status[i] == PixelStatus::Hit && f64::from(depths[i]) < plane_depth;
        // Within the depth buffer's resolution either may win.
        let tie =
            status[i] == PixelStatus::Hit && (f64::from(depths[i]) - plane_depth).abs() < 1e-2;
        let expected = if near { surface } else { MESH };
        let close = |a: &[u8; 4], b: &[u8; 4]| {
            (0..4).all(|c| (i32::from(a[c]) - i32::from(b[c])).abs() <= tolerance)
        };
        counts[usize::from(!near)] += 1;
        if !close(found, &expected) && !(tie && (close(found, &surface) || close(found, &MESH))) {
            return Err(format!(
                "pixel {i} shows {found:?}, expected {expected:?}; depth {} against {plane_depth}",
                depths[i]
            ));
        }
    }
    Ok(counts)
}

fn target(color_format: wgpu::TextureFormat, reversed: bool) -> DrawTarget {
    use wgpu::CompareFunction::{Greater, Less};
    let depth_compare = if reversed { Greater } else { Less };
    DrawTarget { color_format, depth_compare, ..DrawTarget::default() }
}

#[test]
fn surface_and_mesh_hide_each_other() {
    use wgpu::TextureFormat::{Rgba8Unorm, Rgba8UnormSrgb};
    let scene = sphere();
    let center = scene.at([0.5; 3]);
    let eye = [center[0], center[1], center[2] + 60.0];
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let up = [0.0, 1.0, 0.0];
    let perspective = Camera::perspective(eye, center, up, 30.0, aspect, 20.0, 120.0);
    let parallel = Camera::orthographic(eye, center, up, 40.0, aspect, 20.0, 120.0);
    // A plane in front of the centre cuts a cap off the sphere.
    let plane_depth = 60.0 - 5.0;
    for (camera, color_format, reverse, plane_first) in [
        (perspective, Rgba8Unorm, false, true),
        (perspective, Rgba8Unorm, true, false),
        (perspective, Rgba8UnormSrgb, true, true),
        (parallel, Rgba8Unorm, false, false),
        (parallel, Rgba8UnormSrgb, true, true),
    ] {
        let camera = if reverse { reversed(camera) } else { camera };
        let painted = paint(camera, target(color_format, reverse), plane_depth, plane_first);
        // The way to linear light and back rounds.
        let tolerance = if color_format == Rgba8UnormSrgb { 1 } else { 0 };
        let case = format!("{color_format:?}, reversed: {reverse}, plane first: {plane_first}");
        let [surface, mesh] = check(&painted, plane_depth, tolerance)
            .unwrap_or_else(|problem| panic!("{case}: {problem}"));
        let hits = painted.surface.status.iter().flatten().filter(|s| **s == PixelStatus::Hit);
        assert!(surface > 500 && mesh > 2000 && hits.count() > surface + 200, "{case}");
    }
}

#[test]
fn planes_before_and_behind_everything() {
    let scene = sphere();
    let center = scene.at([0.5; 3]);
    let eye = [center[0] + 60.0, center[1], center[2]];
    let camera = Camera::perspective(eye, center, [0.0, 1.0, 0.0], 30.0, 4.0 / 3.0, 20.0, 120.0);
    let target = target(wgpu::TextureFormat::Rgba8Unorm, false);
    let behind = paint(camera, target, 100.0, true);
    let [surface, _] = check(&behind, 100.0, 0).unwrap();
    let hits = behind.surface.status.iter().flatten().filter(|s| **s == PixelStatus::Hit).count();
    assert_eq!(surface, hits);
    let before = paint(camera, target, 30.0, false);
    assert_eq!(check(&before, 30.0, 0).unwrap()[0], 0);
    // The check sees one wrong pixel on either side.
    for (mut painted, depth) in [(behind, 100.0), (before, 30.0)] {
        painted.color[SIZE[0] as usize * 48 + 64][1] ^= 0x40;
        assert!(check(&painted, depth, 1).is_err());
    }
}
