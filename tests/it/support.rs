//! What the tests share: a device, scenes, cameras, pictures.

use gpu_testkit::gpu;
use progressive_iso::{
    Camera, Capture, CompressedVolume, Frame, FrameOptions, Outputs, PixelStatus,
    ProgressiveIsoRenderer, RendererOptions, Residency, Shading, wgpu,
};
use volume_io::ZfpVolume;

/// Every picture beside the colour.
pub(crate) const ALL_OUTPUTS: Outputs = Outputs { depth: true, normal: true, status: true };

/// Colours that 8 bits hold exactly.
pub(crate) const BACKGROUND: [u8; 4] = [51, 102, 153, 255];
pub(crate) const UNFINISHED: [u8; 4] = [255, 0, 204, 255];

pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
}

impl Gpu {
    /// A device with WebGPU's default limits and no features.
    pub(crate) fn new() -> Self {
        let (device, queue) = gpu::device();
        Self { device, queue }
    }

    pub(crate) fn with_limits(limits: wgpu::Limits) -> Self {
        let (device, queue) = gpu::device_with(wgpu::Features::empty(), limits);
        Self { device, queue }
    }

    pub(crate) fn renderer(
        &self,
        scene: &Scene,
        options: RendererOptions,
    ) -> ProgressiveIsoRenderer {
        let volume = scene.compressed();
        ProgressiveIsoRenderer::new(&self.device, &self.queue, volume, options).unwrap()
    }

    /// The finished picture of a fresh renderer.
    pub(crate) fn render(&self, scene: &Scene, options: RendererOptions, frame: &Frame) -> Capture {
        let mut renderer = self.renderer(scene, options);
        self.finish(&mut renderer, frame)
    }

    /// The finished picture of a new frame.
    pub(crate) fn finish(&self, renderer: &mut ProgressiveIsoRenderer, frame: &Frame) -> Capture {
        renderer.set_frame(frame).unwrap();
        let report = renderer.render_to_completion(&self.device, &self.queue, |_, _| true).unwrap();
        assert!(report.complete());
        renderer.capture_blocking(&self.device, &self.queue).unwrap()
    }
}

/// A volume in its place.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    pub(crate) volume: ZfpVolume,
    pub(crate) world_from_index: [[f64; 4]; 4],
    pub(crate) isovalue: f32,
}

impl Scene {
    /// A generator's volume at `rate` bits per voxel, voxel (i, j, k) at world position (i, j, k).
    pub(crate) fn generated(name: &str, dims: [u32; 3], rate: f64) -> Self {
        let field = volumes::by_name(name, dims).unwrap();
        let volume = volumes::generate(&*field, dims, rate).unwrap();
        let world_from_index = CompressedVolume::placed([1.0; 3], [0.0; 3]);
        Self { volume, world_from_index, isovalue: field.suggested_isovalue() as f32 }
    }

    /// The same volume elsewhere.
    pub(crate) fn placed(self, world_from_index: [[f64; 4]; 4]) -> Self {
        Self { world_from_index, ..self }
    }

    pub(crate) fn compressed(&self) -> CompressedVolume {
        let mut volume = CompressedVolume::try_from(&self.volume).unwrap();
        volume.world_from_index = self.world_from_index;
        volume
    }

    /// World position of an index-space position.
    pub(crate) fn world(&self, p: [f64; 3]) -> [f64; 3] {
        let m = &self.world_from_index;
        [0, 1, 2].map(|r| m[0][r] * p[0] + m[1][r] * p[1] + m[2][r] * p[2] + m[3][r])
    }

    /// World position at shares of the volume's extent, 0 to 1 on each axis.
    pub(crate) fn at(&self, share: [f64; 3]) -> [f64; 3] {
        let dims = self.volume.dims;
        self.world([0, 1, 2].map(|a| share[a] * (f64::from(dims[a]) - 1.0)))
    }

    /// The volume fitted to the frame.
    pub(crate) fn orbit(&self, azimuth: f64, elevation: f64, size: [u32; 2]) -> Camera {
        let (center, radius) = self.compressed().bounding_ball();
        Camera::orbit(center, radius * 0.8, azimuth, elevation, 40.0, aspect(size))
    }

    /// A parallel projection from an oblique direction.
    pub(crate) fn orthographic(&self, away: [f64; 3], size: [u32; 2]) -> Camera {
        let (center, radius) = self.compressed().bounding_ball();
        let length = away.iter().map(|x| x * x).sum::<f64>().sqrt();
        let eye = [0, 1, 2].map(|a| center[a] + 2.0 * radius * away[a] / length);
        let up = [0.0, 1.0, 0.0];
        Camera::orthographic(
            eye,
            center,
            up,
            1.5 * radius,
            aspect(size),
            0.5 * radius,
            4.0 * radius,
        )
    }

    /// A wide view from one place to another, both as shares of the extent.
    pub(crate) fn looking(&self, eye: [f64; 3], target: [f64; 3], size: [u32; 2]) -> Camera {
        let (_, radius) = self.compressed().bounding_ball();
        let (near, far) = (1e-3 * radius, 4.0 * radius);
        let (eye, target) = (self.at(eye), self.at(target));
        Camera::perspective(eye, target, [0.1, 1.0, 0.2], 75.0, aspect(size), near, far)
    }

    pub(crate) fn frame(&self, camera: Camera) -> Frame {
        frame(camera, self.isovalue)
    }
}

pub(crate) fn aspect(size: [u32; 2]) -> f64 {
    f64::from(size[0]) / f64::from(size[1])
}

pub(crate) fn shading() -> Shading {
    let exact = |c: [u8; 4]| c.map(|v| f32::from(v) / 255.0);
    Shading { background: exact(BACKGROUND), unfinished: exact(UNFINISHED), ..Shading::default() }
}

pub(crate) fn frame(camera: Camera, isovalue: f32) -> Frame {
    // A round in every pass, so that passes count rounds.
    let options =
        FrameOptions { shading: shading(), rounds_per_pass: 1, ..FrameOptions::default() };
    Frame { camera, isovalues: vec![isovalue], options }
}

/// All pictures in 256 MiB.
pub(crate) fn options(size: [u32; 2]) -> RendererOptions {
    RendererOptions {
        size,
        outputs: ALL_OUTPUTS,
        capture: true,
        // Volumes are small here: they would all be resident.
        residency: Residency::Cached,
        ..RendererOptions::default()
    }
}

pub(crate) fn hit_count(capture: &Capture) -> usize {
    capture.status.iter().flatten().filter(|&&s| s == PixelStatus::Hit).count()
}
