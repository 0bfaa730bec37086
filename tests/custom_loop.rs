//! A host's mesh and the isosurface in one render pass: which of them is in front, the depth that
//! is left, sRGB targets, several samples per pixel, and pixels that are not known yet.
//!
//! The volume is a ball, the mesh a tilted rectangle through it, both known in closed form; the
//! mesh and its pipeline are those of the example `custom_loop`.

#![allow(clippy::unwrap_used, reason = "a failing test says where")]
#![allow(clippy::disallowed_methods, reason = "the test is the host that submits and writes")]
#![allow(unreachable_pub, dead_code, reason = "the example uses all of its mesh module")]

#[path = "../examples/custom_loop/mesh.rs"]
mod mesh;

use glam::{DMat4, DVec3};
use gpu_testkit::gpu::{device, read_buffer, submit_and_wait};
use mesh::{Mesh, Vertex};
use progressive_iso::{
    Camera, CompressedVolume, DrawTarget, Frame, FrameOptions, Outputs, PixelStatus,
    ProgressiveIsoRenderer, RendererOptions, Residency, Shading, wgpu,
};
use volumes::SphereDistance;
use wgpu::{CompareFunction, TextureFormat};

/// Rows are a multiple of 256 bytes, as copies to buffers ask for.
const SIZE: [u32; 2] = [128, 96];
const DIMS: [u32; 3] = [32; 3];
const CENTER: f64 = 15.5;
const RADIUS: f64 = 10.0;
/// Corners of the rectangle, counter-clockwise: tilted, through a point beside the ball's centre.
const CORNERS: [DVec3; 4] = [
    DVec3::new(-4.0, 2.0, 14.0),
    DVec3::new(35.0, 2.0, 28.0),
    DVec3::new(35.0, 24.0, 28.0),
    DVec3::new(-4.0, 24.0, 14.0),
];
const BLUE: wgpu::Color = wgpu::Color { r: 0.0, g: 0.0, b: 1.0, a: 1.0 };

/// What a pixel should or does show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Background,
    Mesh,
    Ball,
}

/// The colours make the three easy to tell apart, however they are lit.
fn seen(pixel: [u8; 4]) -> Seen {
    match pixel {
        [0, 0, 255, 255] => Seen::Background,
        [r, 0, 0, 255] if r > 0 => Seen::Mesh,
        [0, g, 0, 255] if g > 0 => Seen::Ball,
        _ => panic!("no one's colour: {pixel:?}"),
    }
}

fn camera(reversed: bool) -> Camera {
    let (eye, aspect) = ([30.0, 24.0, 62.0], f64::from(SIZE[0]) / f64::from(SIZE[1]));
    let up = [0.0, 1.0, 0.0];
    let mut camera = Camera::perspective(eye, [CENTER; 3], up, 36.0, aspect, 5.0, 200.0);
    if reversed {
        camera.clip_from_view[2][2] = 0.0;
        camera.clip_from_view[3][2] = 5.0;
    }
    camera
}

/// World-space eye and direction of the ray through a point of the picture, in pixels.
fn ray(camera: &Camera, pixel: [f64; 2]) -> (DVec3, DVec3) {
    let world_from_view = DMat4::from_cols_array_2d(&camera.view_from_world).inverse();
    let [x, y] = [0, 1].map(|i| 2.0 * pixel[i] / f64::from(SIZE[i]) - 1.0);
    let scale = camera.clip_from_view;
    // One unit of length along the view axis, so that the ray's parameter is the view depth.
    let direction = DVec3::new(x / scale[0][0], -y / scale[1][1], -1.0);
    (world_from_view.transform_point3(DVec3::ZERO), world_from_view.transform_vector3(direction))
}

fn hit_ball((eye, direction): (DVec3, DVec3)) -> Option<f64> {
    let (a, from) = (direction.length_squared(), eye - DVec3::splat(CENTER));
    let half_b = from.dot(direction);
    let discriminant = half_b * half_b - a * (from.length_squared() - RADIUS * RADIUS);
    (discriminant > 0.0).then(|| (-half_b - discriminant.sqrt()) / a)
}

fn hit_mesh((eye, direction): (DVec3, DVec3)) -> Option<f64> {
    let (u, v) = (CORNERS[1] - CORNERS[0], CORNERS[3] - CORNERS[0]);
    let normal = u.cross(v);
    let t = (CORNERS[0] - eye).dot(normal) / direction.dot(normal);
    let at = eye + t * direction - CORNERS[0];
    let inside = |axis: DVec3| (0.0..1.0).contains(&(at.dot(axis) / axis.length_squared()));
    (inside(u) && inside(v)).then_some(t)
}

/// What the ray sees first, what it would see behind that, and at what view depth.
fn nearest(camera: &Camera, pixel: [f64; 2]) -> (Seen, Seen, f64) {
    let ray = ray(camera, pixel);
    match (hit_ball(ray), hit_mesh(ray)) {
        (None, None) => (Seen::Background, Seen::Background, f64::INFINITY),
        (Some(ball), None) => (Seen::Ball, Seen::Background, ball),
        (None, Some(mesh)) => (Seen::Mesh, Seen::Background, mesh),
        (Some(ball), Some(mesh)) if ball < mesh => (Seen::Ball, Seen::Mesh, ball),
        (Some(_), Some(mesh)) => (Seen::Mesh, Seen::Ball, mesh),
    }
}

/// The answer for a whole pixel, `None` where its neighbourhood (1.5 pixels around) disagrees.
fn expected(camera: &Camera, x: u32, y: u32) -> Option<(Seen, Seen, f64)> {
    let middle = [f64::from(x) + 0.5, f64::from(y) + 0.5];
    let answer = nearest(camera, middle);
    let around = [-1.5, 0.0, 1.5];
    let agrees = around.into_iter().all(|dy| {
        around.into_iter().all(|dx| {
            let near = nearest(camera, [middle[0] + dx, middle[1] + dy]);
            (near.0, near.1) == (answer.0, answer.1)
        })
    });
    agrees.then_some(answer)
}

/// The host: a renderer of the ball and the rectangle, and targets of one kind.
struct Host {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: ProgressiveIsoRenderer,
    mesh: Mesh,
    target: DrawTarget,
}

/// Colour and, with one sample per pixel, depth of a picture.
struct Picture {
    color: Vec<[u8; 4]>,
    depth: Option<Vec<f32>>,
}

fn target(
    color_format: TextureFormat,
    depth_compare: CompareFunction,
    sample_count: u32,
) -> DrawTarget {
    DrawTarget {
        color_format,
        depth_format: TextureFormat::Depth32Float,
        depth_compare,
        sample_count,
    }
}

impl Host {
    /// `mesh_compare` differs from the target's only to prove that the test would notice.
    fn new(target: DrawTarget, mesh_compare: CompareFunction) -> Self {
        let (device, queue) = device();
        let ball = SphereDistance { centre: [CENTER; 3], radius: RADIUS };
        let volume = volumes::generate(&ball, DIMS, 16.0).unwrap();
        let volume = CompressedVolume::try_from(&volume).unwrap();
        let options = RendererOptions {
            size: SIZE,
            budget_bytes: 16 << 20,
            outputs: Outputs { status: true, ..Default::default() },
            draw_target: Some(target),
            capture: true,
            // A resident volume has no pictures with finished and unfinished pixels.
            residency: Residency::Cached,
            ..Default::default()
        };
        let mut renderer = ProgressiveIsoRenderer::new(&device, &queue, volume, options).unwrap();
        let camera = camera(target.depth_compare == CompareFunction::Greater);
        let frame = Frame {
            camera,
            isovalues: vec![RADIUS as f32],
            options: FrameOptions {
                shading: Shading {
                    base_color: [0.0, 1.0, 0.0],
                    specular: 0.0,
                    background: [1.0; 4],
                    unfinished: [1.0; 4],
                    ..Default::default()
                },
                ..Default::default()
            },
        };
        renderer.set_frame(&frame).unwrap();

        let normal = (CORNERS[1] - CORNERS[0]).cross(CORNERS[3] - CORNERS[0]).normalize();
        let vertices = CORNERS.map(|corner| Vertex {
            position: corner.as_vec3().to_array(),
            normal: normal.as_vec3().to_array(),
        });
        let mesh_target = DrawTarget { depth_compare: mesh_compare, ..target };
        let mesh = Mesh::new(&device, &mesh_target, &vertices, &[0, 1, 2, 0, 2, 3]);
        mesh.set_view(&queue, &camera, [1.0, 0.0, 0.0]);
        Self { device, queue, renderer, mesh, target }
    }

    fn matching(target: DrawTarget) -> Self {
        Self::new(target, target.depth_compare)
    }

    fn complete(mut self) -> Self {
        let (device, queue) = (&self.device, &self.queue);
        let report = self.renderer.render_to_completion(device, queue, |_, _| true).unwrap();
        assert!(report.complete() && report.hits > 0);
        self
    }

    fn texture(&self, format: TextureFormat, sample_count: u32) -> wgpu::Texture {
        let copied = if sample_count == 1 {
            wgpu::TextureUsages::COPY_SRC
        } else {
            wgpu::TextureUsages::empty()
        };
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("host.target"),
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | copied,
            view_formats: &[],
        })
    }

    fn read<T: bytemuck::Pod>(&self, texture: &wgpu::Texture) -> Vec<T> {
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("host.copy"),
            size: u64::from(SIZE[0] * SIZE[1] * 4),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(SIZE[0] * 4),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            texture.size(),
        );
        submit_and_wait(&self.device, &self.queue, encoder);
        bytemuck::pod_collect_to_vec(&read_buffer(&self.device, &self.queue, &buffer))
    }

    /// One frame of the host, with or without each of the two.
    fn picture(&self, with_mesh: bool, with_ball: bool) -> Picture {
        let DrawTarget { color_format, depth_format, depth_compare, sample_count } = self.target;
        let color = self.texture(color_format, sample_count);
        let resolved = (sample_count > 1).then(|| self.texture(color_format, 1));
        let depth = self.texture(depth_format, sample_count);
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let (color_view, depth_view) = (view(&color), view(&depth));
        let resolved_view = resolved.as_ref().map(view);
        let far = if depth_compare == CompareFunction::Greater { 0.0 } else { 1.0 };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("host.frame"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color_view,
                depth_slice: None,
                resolve_target: resolved_view.as_ref(),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(BLUE),
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
        // The order must not matter, so the mesh comes last here and first in the example.
        if with_ball {
            self.renderer.draw(&mut pass).unwrap();
        }
        if with_mesh {
            self.mesh.draw(&mut pass);
        }
        drop(pass);
        submit_and_wait(&self.device, &self.queue, encoder);
        let depth = (sample_count == 1).then(|| self.read(&depth));
        Picture { color: self.read(resolved.as_ref().unwrap_or(&color)), depth }
    }
}

/// The first pixel that shows something else than the geometry says, among those that are clear.
fn wrong_pixel(camera: &Camera, picture: &Picture) -> Option<String> {
    let mut clear = 0;
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let Some((expected, behind, view_depth)) = expected(camera, x, y) else { continue };
            clear += 1;
            let index = (y * SIZE[0] + x) as usize;
            let found = seen(picture.color[index]);
            if found != expected {
                return Some(format!("({x}, {y}): {found:?}, not {expected:?} before {behind:?}"));
            }
            let scale = camera.clip_from_view;
            let (z, w) = (scale[3][2] - scale[2][2] * view_depth, view_depth);
            let depth =
                if expected == Seen::Background { f64::from(scale[2][2] != 0.0) } else { z / w };
            if let Some(depths) = &picture.depth {
                let found = f64::from(depths[index]);
                // A tenth of a voxel: the ball is reconstructed from samples.
                let tolerance = if expected == Seen::Background {
                    0.0
                } else {
                    (scale[3][2] * 0.1 / (w * w)).abs()
                };
                if (found - depth).abs() > tolerance {
                    return Some(format!("({x}, {y}): depth {found}, not {depth} of {expected:?}"));
                }
            }
        }
    }
    assert!(clear > 9000, "only {clear} pixels are clear");
    None
}

/// The scene tests something only if either hides the other in many pixels.
#[test]
fn the_scene_has_every_kind_of_occlusion() {
    let camera = camera(false);
    let mut counts = [0; 4];
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            match expected(&camera, x, y) {
                Some((Seen::Mesh, Seen::Ball, _)) => counts[0] += 1,
                Some((Seen::Ball, Seen::Mesh, _)) => counts[1] += 1,
                Some((Seen::Mesh, Seen::Background, _)) => counts[2] += 1,
                Some((Seen::Background, ..)) => counts[3] += 1,
                _ => {}
            }
        }
    }
    assert!(counts.iter().all(|&count| count > 300), "{counts:?}");
}

#[test]
fn mesh_and_isosurface_occlude_each_other() {
    for compare in [CompareFunction::Less, CompareFunction::Greater] {
        for samples in [1, 4] {
            let host = Host::matching(target(TextureFormat::Rgba8Unorm, compare, samples));
            let picture = host.complete().picture(true, true);
            let wrong = wrong_pixel(&camera(compare == CompareFunction::Greater), &picture);
            assert_eq!(wrong, None, "{compare:?}, {samples} samples");
        }
    }
}

#[test]
fn a_mesh_that_ignores_depth_is_noticed() {
    let target = target(TextureFormat::Rgba8Unorm, CompareFunction::Less, 1);
    let picture = Host::new(target, CompareFunction::Always).complete().picture(true, true);
    let wrong = wrong_pixel(&camera(false), &picture).unwrap();
    assert!(wrong.contains("Mesh, not Ball before Mesh"), "{wrong}");
    let host = Host::matching(target).complete();
    let wrong = wrong_pixel(&camera(true), &host.picture(true, true)).unwrap();
    assert!(wrong.contains("depth"), "{wrong}");
}

#[test]
fn srgb_targets_show_the_same_as_others() {
    let [linear, srgb] = [TextureFormat::Rgba8Unorm, TextureFormat::Rgba8UnormSrgb].map(|format| {
        Host::matching(target(format, CompareFunction::Less, 1)).complete().picture(true, true)
    });
    let mut largest = 0;
    for (a, b) in linear.color.iter().zip(&srgb.color) {
        let difference = [0, 1, 2, 3].map(|i| a[i].abs_diff(b[i])).into_iter().max().unwrap();
        largest = largest.max(difference);
    }
    // Both are rounded to 8 bits of the same sRGB value, one of them by the target's own conversion.
    assert!(largest <= 1, "sRGB and linear targets differ by {largest}");
    assert_eq!(linear.depth, srgb.depth);
    let shades: std::collections::BTreeSet<u8> =
        linear.color.iter().map(|pixel| pixel[1]).collect();
    assert!(shades.len() > 30, "only {} shades of the surface", shades.len());
}

/// Unfinished pixels leave what the host has drawn alone, those that are finished are drawn.
#[test]
fn pixels_that_are_not_known_yet_are_the_hosts() {
    let target = target(TextureFormat::Rgba8Unorm, CompareFunction::Less, 1);
    let mut host = Host::matching(target);
    let before = host.picture(true, true);
    let without = host.picture(true, false);
    assert_eq!(before.color, without.color, "before the first pass");
    assert_eq!(before.depth, without.depth, "before the first pass");
    let mut mixed = false;
    for _ in 0..256 {
        host.renderer.render_pass(&host.device, &host.queue).unwrap();
        let capture = host.renderer.capture_blocking(&host.device, &host.queue).unwrap();
        let ball_depth = host.picture(false, true).depth.unwrap();
        let found = host.picture(true, true);
        let mut counts = [0; 2];
        for (index, status) in capture.status.unwrap().into_iter().enumerate() {
            let drawn = status == PixelStatus::Hit
                && ball_depth[index] < without.depth.as_ref().unwrap()[index];
            let expected = if drawn {
                capture.color[4 * index..][..4].try_into().unwrap()
            } else {
                without.color[index]
            };
            assert_eq!(found.color[index], expected, "pixel {index}, {status:?}, drawn {drawn}");
            counts[0] += u32::from(status == PixelStatus::Unfinished);
            counts[1] += u32::from(drawn);
        }
        mixed |= counts.iter().all(|&count| count > 100);
        if host.renderer.poll_report().complete() {
            assert!(mixed, "no picture with finished and unfinished pixels");
            return;
        }
    }
    panic!("256 passes did not finish the picture");
}

#[test]
fn drawing_must_be_planned() {
    let (device, queue) = device();
    let volume = volumes::generate(&SphereDistance::new([8; 3]), [8; 3], 8.0).unwrap();
    let volume = CompressedVolume::try_from(&volume).unwrap();
    let options = RendererOptions { size: [16, 16], budget_bytes: 16 << 20, ..Default::default() };
    let renderer = ProgressiveIsoRenderer::new(&device, &queue, volume, options).unwrap();
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host.target"),
        size: wgpu::Extent3d { width: 16, height: 16, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let view = texture.create_view(&Default::default());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    });
    assert_eq!(renderer.draw(&mut pass), Err(progressive_iso::Error::DrawNotPlanned));
}
