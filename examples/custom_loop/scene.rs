//! What the host application shows: a mesh of its own and an isosurface, in one render pass.
//!
//! This file is what an application needs to embed the renderer; the loops around it, headless and
//! in a window, only bring a device, a colour target and the time.

use glam::Quat;
use progressive_iso::{
    Camera, CompressedVolume, DrawTarget, Frame, FrameOptions, PassReport, ProgressiveIsoRenderer,
    RendererOptions, wgpu,
};

use crate::mesh::{Mesh, torus};
use crate::support::{Failure, Gpu};

/// Passes that one frame of the host may take; more refine faster, fewer keep the frame short.
const PASSES_PER_FRAME: u32 = 2;

const MESH_COLOR: [f32; 3] = [0.9, 0.2, 0.05];

/// Of the colour attachment before anything is drawn, linear.
const BACKGROUND: wgpu::Color = wgpu::Color { r: 0.012, g: 0.016, b: 0.025, a: 1.0 };

/// The host's scene and the targets that depend on the picture's size.
pub struct Scene {
    renderer: ProgressiveIsoRenderer,
    mesh: Mesh,
    target: DrawTarget,
    depth: wgpu::TextureView,
    aspect: f64,
    /// The camera asked for last.
    wanted: Option<Camera>,
    /// The camera of the isosurface's pixels.
    shown: Camera,
}

impl Scene {
    /// A scene that draws into colour targets of this format and size.
    pub fn new(
        gpu: &Gpu,
        color_format: wgpu::TextureFormat,
        size: [u32; 2],
        budget_bytes: u64,
    ) -> Result<Self, Failure> {
        // The one description of the targets that both pipelines are made for. Depth is reversed:
        // 1 at the near plane and 0 infinitely far away, where floats are densest.
        let target = DrawTarget {
            color_format,
            depth_format: wgpu::TextureFormat::Depth32Float,
            depth_compare: wgpu::CompareFunction::Greater,
            sample_count: 1,
        };
        let volume = CompressedVolume::try_from(&volumes::brain())?;
        let (center, radius) = volume.bounding_ball();
        let options =
            RendererOptions { size, budget_bytes, draw_target: Some(target), ..Default::default() };
        let renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, volume, options)?;

        let link = [0.0, 0.28, 0.12].map(|share| share * radius as f32);
        let middle = [0, 1, 2].map(|axis| center[axis] as f32 + link[axis]);
        let tilt = Quat::from_rotation_y(1.1) * Quat::from_rotation_x(0.3);
        let ring = torus(middle, tilt, 0.4 * radius as f32, 0.04 * radius as f32, [96, 24]);
        let mesh = Mesh::new(&gpu.device, &target, &ring.0, &ring.1);

        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let shown = camera(center, radius, 0.0, aspect);
        let depth = depth_view(&gpu.device, &target, size);
        Ok(Self { renderer, mesh, target, depth, aspect, wanted: None, shown })
    }

    /// Follows the size of the colour target.
    #[cfg_attr(not(feature = "window"), allow(dead_code, reason = "only windows change size"))]
    pub fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) -> Result<(), Failure> {
        self.renderer.resize(&gpu.device, size)?;
        self.depth = depth_view(&gpu.device, &self.target, size);
        self.aspect = f64::from(size[0]) / f64::from(size[1]);
        Ok(())
    }

    /// Records one frame of the host: the camera at `degrees` around the volume, some passes of
    /// refinement, then the picture as far as it is known into `color`. Nothing here waits; the
    /// caller submits the encoder.
    pub fn record(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        color: &wgpu::TextureView,
        degrees: f64,
    ) -> Result<PassReport, Failure> {
        let (center, radius) = self.renderer.volume().bounding_ball();
        let wanted = camera(center, radius, degrees, self.aspect);
        if self.wanted != Some(wanted) {
            self.renderer.set_frame(&Frame {
                camera: wanted,
                isovalues: vec![volumes::BRAIN_ISOVALUE],
                options: FrameOptions::default(),
            })?;
            self.wanted = Some(wanted);
        }
        let mut report = self.renderer.poll_report();
        for _ in 0..PASSES_PER_FRAME {
            if report.complete() {
                break;
            }
            report = self.renderer.render_pass(&gpu.device, &gpu.queue)?;
            if !report.submitted {
                break; // The GPU is behind: show what there is.
            }
            // Only now do the renderer's pixels belong to the new camera.
            self.shown = wanted;
        }
        self.mesh.set_view(&gpu.queue, &self.shown, MESH_COLOR);

        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("host.frame"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(BACKGROUND),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.mesh.draw(&mut pass);
        self.renderer.draw(&mut pass)?;
        drop(pass);
        Ok(report)
    }
}

/// A camera at `degrees` around the vertical axis z of a ball, with reversed infinite depth.
fn camera(center: [f64; 3], radius: f64, degrees: f64, aspect: f64) -> Camera {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let away = [-sin, cos, 0.25].map(|share| share * radius * 1.9);
    let eye = [0, 1, 2].map(|axis| center[axis] + away[axis]);
    let near = 0.05 * radius;
    let mut camera =
        Camera::perspective(eye, center, [0.0, 0.0, 1.0], 40.0, aspect, near, 2.0 * near);
    // Clip-space z = near and w = distance, whatever the far plane was.
    camera.clip_from_view[2][2] = 0.0;
    camera.clip_from_view[3][2] = near;
    camera
}

fn depth_view(device: &wgpu::Device, target: &DrawTarget, size: [u32; 2]) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host.depth"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: target.sample_count,
        dimension: wgpu::TextureDimension::D2,
        format: target.depth_format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
