//! Pictures of samples that are all resident from the start: no stream, no cache service.

use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, Kernel, KernelSource};
use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgsl::{Module, compose_fixed};
use gpu_testkit::gpu;
use lru_cache_gpu::{CacheBuffers, CachePlan, Service};
use macrocell::Grid;
use macrocell::cpu::ranges;
use macrocell::cpu::skip::Masks;
use wavefront::{
    Camera, Counters, FrameParams, FrameView, LookAhead, OutputTextures, Outputs, RayBuffers, Rays,
    RunAhead, SampleLayout, Samples, Scene, Shading, ShadingParams, Strategy, WavefrontPlan, wgpu,
};

/// Width of all pictures: rows of 4-byte pixels are then aligned for copies.
pub(crate) const WIDTH: u32 = 64;

/// Samples of a volume, x fastest.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) dims: [u32; 3],
    pub(crate) samples: Vec<f32>,
}

impl Field {
    pub(crate) fn new(dims: [u32; 3], value: impl Fn([u32; 3]) -> f32) -> Self {
        let mut samples = Vec::new();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    samples.push(value([x, y, z]));
                }
            }
        }
        Self { dims, samples }
    }

    pub(crate) fn grid(&self) -> Grid {
        Grid::new(self.dims)
    }

    pub(crate) fn at(&self, p: [i32; 3]) -> f32 {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let [x, y, z] = p.map(|v| v as usize);
        self.samples[x + nx * (y + ny * z)]
    }

    pub(crate) fn masks(&self, isovalue: f32) -> Masks {
        let grid = self.grid();
        ranges::activate(&grid, &ranges::build(&grid, &self.samples), isovalue)
    }

    /// Every block active.
    pub(crate) fn all_active(&self) -> Masks {
        let words = self.masks(0.0).words.len();
        Masks { words: vec![u64::MAX; words] }
    }

    /// Samples block by block; those outside the volume come from `padding`.
    fn blocks(&self, padding: &dyn Fn(usize) -> f32) -> Vec<f32> {
        let grid = self.grid();
        let [bx, by, bz] = grid.blocks();
        let mut all = Vec::new();
        for block in
            (0..bz).flat_map(|z| (0..by).flat_map(move |y| (0..bx).map(move |x| [x, y, z])))
        {
            for n in 0..64u32 {
                let p = [block[0] * 4 + n % 4, block[1] * 4 + n / 4 % 4, block[2] * 4 + n / 16];
                let inside = (0..3).all(|a| p[a] < self.dims[a]);
                let value = if inside { self.at(p.map(|v| v as i32)) } else { padding(all.len()) };
                all.push(value);
            }
        }
        all
    }
}

/// What is drawn.
pub(crate) struct Shot<'a> {
    pub(crate) field: &'a Field,
    pub(crate) isovalue: f32,
    pub(crate) camera: Camera,
    pub(crate) height: u32,
}

impl Shot<'_> {
    pub(crate) fn view(&self) -> FrameView {
        let identity = glam::DMat4::IDENTITY.to_cols_array_2d();
        FrameView::new(&self.camera, [WIDTH, self.height], identity, self.field.dims).unwrap()
    }
}

/// Words of the pictures, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Picture {
    pub(crate) color: Vec<u32>,
    pub(crate) depth: Vec<u32>,
    pub(crate) normal: Vec<u32>,
    pub(crate) status: Vec<u32>,
    /// What the GPU was given.
    pub(crate) start_depth: f64,
}

impl Picture {
    pub(crate) fn hits(&self) -> usize {
        self.status.iter().filter(|&&s| s == 1).count()
    }

    /// Depth where there is a hit.
    pub(crate) fn depth(&self, pixel: usize) -> Option<f32> {
        (self.status[pixel] == 1).then(|| f32::from_bits(self.depth[pixel]))
    }
}

pub(crate) struct Stage {
    device: wgpu::Device,
    queue: wgpu::Queue,
    store: Kernel,
    service: Service,
    rays: Rays,
    run_ahead: RunAhead,
}

const OUTPUTS: Outputs = Outputs { depth: true, normal: true, status: true };

impl Stage {
    pub(crate) fn new() -> Self {
        let (device, queue) = gpu::device();
        let store = Module { name: "store", source: include_str!("store.wgsl") };
        let store = KernelSource {
            label: "test.store",
            wgsl: compose_fixed(store, &[indirect::MODULE], &[]),
            entry_point: "main",
            bindings: vec![
                Binding::StorageRead { min_bytes: 4 },
                Binding::StorageReadWrite { min_bytes: 4 },
            ],
        }
        .kernel(&device);
        let service = Service::new(&device);
        let rays = Rays::new(&device, OUTPUTS, SampleLayout::cached(1));
        let run_ahead = RunAhead::new(&device, SampleLayout::cached(1));
        Self { device, queue, store, service, rays, run_ahead }
    }

    fn store(&self, encoder: &mut wgpu::CommandEncoder, target: &wgpu::Buffer, words: &[u32]) {
        let input = self.buffer(words);
        let bind = self.store.bind(
            &self.device,
            "test.store",
            &[input.as_entire_binding(), target.as_entire_binding()],
        );
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        self.store.dispatch(&mut pass, &bind, (words.len() as u64).div_ceil(64));
    }

    fn buffer(&self, words: &[u32]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE;
        gpu::buffer_with(&self.device, bytemuck::cast_slice(words), usage)
    }

    /// Parameters of a shot's frame, for the twin.
    pub(crate) fn params(&self, shot: &Shot<'_>) -> FrameParams {
        let plan = self.cache_plan(shot.field);
        shot.view().params(shot.field.grid(), plan.params(), shot.isovalue, LookAhead::NONE)
    }

    fn cache_plan(&self, field: &Field) -> CachePlan {
        CachePlan::fit(field.grid().block_count(), 1 << 30, &wgpu::Limits::default()).unwrap()
    }

    pub(crate) fn render(&self, shot: &Shot<'_>) -> Picture {
        self.render_with(shot, &shot.field.masks(shot.isovalue), &|_| 0.0)
    }

    /// One round with everything resident, given masks and padded samples.
    pub(crate) fn render_with(
        &self,
        shot: &Shot<'_>,
        masks: &Masks,
        padding: &dyn Fn(usize) -> f32,
    ) -> Picture {
        let (picture, rounds) = self.render_within(shot, masks, padding, u32::MAX);
        assert_eq!(rounds.len(), 1, "one round finishes every ray");
        picture
    }

    /// Rounds until every ray is finished, whose walks visit at most `most_cells`, and the counters after each.
    pub(crate) fn render_within(
        &self,
        shot: &Shot<'_>,
        masks: &Masks,
        padding: &dyn Fn(usize) -> f32,
        most_cells: u32,
    ) -> (Picture, Vec<Counters>) {
        let (device, ledger) = (&self.device, Ledger::new());
        let plan = self.cache_plan(shot.field);
        let blocks = shot.field.grid().block_count() as u32;
        assert_eq!(plan.slots(), u64::from(blocks), "everything is resident");
        let cache = CacheBuffers::new(device, &ledger, &self.service, &plan, 64);
        let size = [WIDTH, shot.height];
        let wavefront = WavefrontPlan::new(size, OUTPUTS, &device.limits()).unwrap();
        let textures = OutputTextures::new(device, &ledger, OUTPUTS, size);
        let words: Vec<u32> = masks
            .buffer(&shot.field.grid())
            .iter()
            .flat_map(|&w| [w as u32, (w >> 32) as u32])
            .collect();
        let masks = self.buffer(&words);
        let samples = Samples::Cached(&cache);
        let rays =
            RayBuffers::new(device, &ledger, &self.rays, &wavefront, &masks, samples, &textures);
        let scene = Scene { rays: &rays, masks: &masks, samples };
        let rounds = self.run_ahead.bind(device, &ledger, scene).unwrap();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let samples: Vec<u32> =
            shot.field.blocks(padding).iter().map(|value| value.to_bits()).collect();
        self.store(&mut encoder, &cache.slots()[0], &samples);
        let mut twin = lru_cache_gpu::cpu::Cache::new(&plan);
        (0..blocks).for_each(|block| twin.insert(block, block));
        self.store(&mut encoder, cache.directory(), &twin.directory);
        let view = shot.view();
        let params = self.params(shot).with_most_cells(most_cells);
        let identity = glam::DMat4::IDENTITY.to_cols_array_2d();
        let shading = ShadingParams::new(&Shading::default(), identity);
        let mut upload = UploadRing::new(&ledger, "test", 1024);
        let uniforms = (&params, &shading);
        self.rays.record_start(device, &mut encoder, &mut upload, &rays, &textures, uniforms, None);
        rounds.record_start(&mut encoder, &self.rays, &rays);
        let mut counters = Vec::new();
        while counters.last().is_none_or(|counters: &Counters| counters.active > 0) {
            rounds.record_round(&mut encoder, &self.rays, &rays, &mut |_| {});
            let next = wgpu::CommandEncoderDescriptor::default();
            let next = device.create_command_encoder(&next);
            gpu::submit_and_wait(device, &self.queue, std::mem::replace(&mut encoder, next));
            let bytes = gpu::read_buffer(device, &self.queue, rays.rays());
            let (offset, length) = Counters::BYTES;
            let counted = &bytes[offset as usize..][..length as usize];
            counters.push(bytemuck::pod_read_unaligned(counted));
        }
        let picture = Picture {
            color: self.read(textures.color(), 1),
            depth: self.read(textures.depth().unwrap(), 1),
            normal: self.read(textures.normal().unwrap(), 2),
            status: self.read(textures.status().unwrap(), 1),
            start_depth: view.start_depth(),
        };
        (picture, counters)
    }

    fn read(&self, texture: &wgpu::Texture, words: u32) -> Vec<u32> {
        let row = WIDTH * words * 4;
        let buffer =
            gpu::sentinel_buffer(&self.device, u64::from(row * texture.height()), 0xDEAD_BEEF);
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        gpu::submit_and_wait(&self.device, &self.queue, encoder);
        gpu::read_u32s(&self.device, &self.queue, &buffer)
    }
}

/// Looks at the centre from a direction, the volume fitted to the picture.
pub(crate) fn orbit(dims: [u32; 3], azimuth: f64, elevation: f64, height: u32) -> Camera {
    let extent = dims.map(|n| f64::from(n) - 1.0);
    let radius = 0.5 * extent.iter().map(|e| e * e).sum::<f64>().sqrt();
    let aspect = f64::from(WIDTH) / f64::from(height);
    Camera::orbit(extent.map(|e| 0.5 * e), radius, azimuth, elevation, 35.0, aspect)
}

/// A wide view from `eye` towards `target`, in voxels.
pub(crate) fn look(eye: [f64; 3], target: [f64; 3], height: u32) -> Camera {
    let aspect = f64::from(WIDTH) / f64::from(height);
    Camera::perspective(eye, target, [0.0, 1.0, 0.0], 70.0, aspect, 1e-3, 1e3)
}

/// A parallel view along an axis: the pixels' centres are `1 / per_voxel` voxels apart and the
/// picture's centre lies at `center`.
pub(crate) fn along_axis(
    axis: usize,
    center: [f64; 3],
    per_voxel: f64,
    backwards: bool,
    height: u32,
) -> Camera {
    let mut eye = center;
    eye[axis] += if backwards { -500.0 } else { 500.0 };
    let up = if axis == 1 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] };
    let aspect = f64::from(WIDTH) / f64::from(height);
    Camera::orthographic(eye, center, up, f64::from(height) / per_voxel, aspect, 1.0, 1000.0)
}
