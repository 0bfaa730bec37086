//! The published network against reference pictures and against its twin.

#![cfg(feature = "published-network")]
#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use std::path::Path;

use gpu_primitives::kernel::KernelSource;
use gpu_primitives::memory::Ledger;
use gpu_testkit::compare::within_abs;
use gpu_testkit::gpu::{device, read_f32s, submit_and_wait};
use gpu_testkit::layout::check_kernel;
use infill::cpu::published::{Planes, Published as Twin};
use infill::published::{
    Published, PublishedBuffers, PublishedOptions, PublishedPicture, PublishedPlan,
    PublishedWeights,
};
use infill::wgpu;
use safetensors::SafeTensors;

/// Largest difference from the reference: sums in another order.
const TOLERANCE: f64 = 1e-4;
/// A file that `infill/training/reference.py` made from the published weights.
const VECTOR_VARIABLE: &str = "PUBLISHED_INFILL_VECTOR";

/// Frames and what the network makes of them.
struct Vector {
    weights: PublishedWeights,
    size: [u32; 2],
    color: Vec<[u8; 4]>,
    status: Vec<u8>,
    filled: Vec<f32>,
}

impl Vector {
    fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let tensor = |name| file.tensor(name).unwrap();
        let shape = tensor("color").shape().to_vec();
        Self {
            weights: PublishedWeights::from_safetensors(&bytes).unwrap(),
            size: [shape[2] as u32, shape[1] as u32],
            color: bytemuck::pod_collect_to_vec(tensor("color").data()),
            status: tensor("status").data().to_vec(),
            filled: bytemuck::pod_collect_to_vec(tensor("filled").data()),
        }
    }

    fn pixels(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }

    fn frames(&self) -> impl Iterator<Item = (&[[u8; 4]], &[u8])> {
        self.color.chunks(self.pixels()).zip(self.status.chunks(self.pixels()))
    }
}

fn committed() -> Vector {
    Vector::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/published.safetensors"))
}

/// A picture's textures and everything that fills it.
struct Gpu {
    device: wgpu::Device,
    queue: wgpu::Queue,
    stage: Published,
    color: wgpu::Texture,
    status: wgpu::Texture,
    buffers: PublishedBuffers,
    ledger: Ledger,
}

fn texture(device: &wgpu::Device, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

impl Gpu {
    fn new(size: [u32; 2], weights: &PublishedWeights, options: PublishedOptions) -> Self {
        let (device, queue) = device();
        let ledger = Ledger::new();
        let plan = PublishedPlan::new(size, &device.limits()).unwrap();
        let stage = Published::new(&device, options);
        let color = texture(&device, size, wgpu::TextureFormat::Rgba8Unorm);
        let status = texture(&device, size, wgpu::TextureFormat::R32Uint);
        let [color_view, status_view] =
            [&color, &status].map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()));
        let picture = PublishedPicture { color: &color_view, status: &status_view };
        let buffers = PublishedBuffers::new(&device, &ledger, &stage, &plan, weights, picture);
        assert_eq!(ledger.total(), plan.bytes());
        Self { device, queue, stage, color, status, buffers, ledger }
    }

    fn fill(&self, color: &[[u8; 4]], status: &[u8]) -> Vec<f32> {
        self.write(&self.color, bytemuck::cast_slice(color));
        let words: Vec<u32> = status.iter().map(|&s| u32::from(s)).collect();
        self.write(&self.status, bytemuck::cast_slice(&words));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.stage.record(&mut encoder, &self.buffers);
        submit_and_wait(&self.device, &self.queue, encoder);
        let output = read_f32s(&self.device, &self.queue, self.buffers.output());
        assert!(output.chunks(4).all(|pixel| pixel[3] == 1.0));
        output.chunks(4).flat_map(|pixel| pixel[..3].to_vec()).collect()
    }

    fn write(&self, texture: &wgpu::Texture, contents: &[u8]) {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * texture.width()),
            rows_per_image: None,
        };
        self.queue.write_texture(texture.as_image_copy(), contents, layout, texture.size());
    }

    fn clear(&self) {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.buffers.record_clear_state(&mut encoder);
        submit_and_wait(&self.device, &self.queue, encoder);
    }
}

/// Frame after frame as the reference has it.
fn check(vector: &Vector) {
    let gpu = Gpu::new(vector.size, &vector.weights, PublishedOptions::default());
    for ((color, status), filled) in vector.frames().zip(vector.filled.chunks(3 * vector.pixels()))
    {
        within_abs(&gpu.fill(color, status), filled, TOLERANCE).unwrap();
    }
}

#[test]
fn it_makes_the_pictures_of_pytorch() {
    check(&committed());
}

#[test]
#[ignore = "needs the published weights; infill/training/README.md says how"]
fn it_makes_the_pictures_of_onnx_runtime() {
    let path = std::env::var_os(VECTOR_VARIABLE);
    let path = path.unwrap_or_else(|| panic!("{VECTOR_VARIABLE} does not name a file"));
    check(&Vector::read(Path::new(&path)));
}

#[test]
fn a_changed_tensor_is_seen() {
    let vector = committed();
    for changed in
        ["enc0.0.weight", "enc3.1.bias", "dec2.0.weight", "rgb.bias", "down3.weight", "up0.bias"]
    {
        let weights = PublishedWeights::from_fn(|name, i| {
            let value = vector.weights.tensor(name)[i];
            if name == changed { 1.5 * value + 0.05 } else { value }
        });
        let gpu = Gpu::new(vector.size, &weights, PublishedOptions::default());
        let (color, status) = vector.frames().next().unwrap();
        let filled = &vector.filled[..3 * vector.pixels()];
        let found = within_abs(&gpu.fill(color, status), filled, TOLERANCE);
        assert!(found.is_err(), "{changed}");
    }
}

/// Pixels of no meaning, some of them unfinished.
fn noise(size: [u32; 2], seed: u32) -> (Vec<[u8; 4]>, Vec<u8>) {
    let pixels = size[0] * size[1];
    let hash = |i: u32| {
        (i ^ seed.wrapping_mul(0x9E37_79B9))
            .wrapping_mul(0x85EB_CA6B)
            .rotate_left(13)
            .wrapping_mul(0xC2B2_AE35)
    };
    let color = (0..pixels).map(|i| hash(i).to_le_bytes()).collect();
    let status = (0..pixels).map(|i| (hash(i + pixels) >> 20) as u8 % 3).collect();
    (color, status)
}

fn planes(size: [u32; 2], color: &[[u8; 4]], status: &[u8]) -> Planes {
    let padded = size.map(|s| s.next_multiple_of(8) as usize);
    Planes::from_fn(padded, 3, |c, x, y| {
        if x >= size[0] as usize || y >= size[1] as usize {
            return 0.0;
        }
        let pixel = x + size[0] as usize * y;
        if status[pixel] == 2 { [1.0, 0.0, 0.0][c] } else { f32::from(color[pixel][c]) / 255.0 }
    })
}

#[test]
fn sizes_that_are_no_multiple_of_8_are_padded_with_zeros() {
    let weights = committed().weights;
    for size in [[1, 1], [9, 8], [21, 13]] {
        let gpu = Gpu::new(size, &weights, PublishedOptions::default());
        let mut state = Twin::initial_state(size.map(|s| s.next_multiple_of(8) as usize));
        for frame in 0..2 {
            let (color, status) = noise(size, frame);
            let expected = Twin(&weights).fill(&planes(size, &color, &status), &mut state);
            let pixels =
                (0..size[0] * size[1]).map(|i| [i % size[0], i / size[0]].map(|p| p as usize));
            let expected: Vec<f32> =
                pixels.flat_map(|[x, y]| [0, 1, 2].map(|c| expected.at(c, x, y))).collect();
            within_abs(&gpu.fill(&color, &status), &expected, TOLERANCE).unwrap();
        }
    }
}

#[test]
fn a_cleared_state_is_that_of_a_first_frame() {
    let vector = committed();
    let gpu = Gpu::new(vector.size, &vector.weights, PublishedOptions::default());
    let (color, status) = vector.frames().next().unwrap();
    let first = gpu.fill(color, status);
    assert_ne!(gpu.fill(color, status), first, "the state does not matter");
    gpu.clear();
    assert_eq!(gpu.fill(color, status), first);
}

#[test]
fn pasted_pixels_keep_their_colour_and_the_others_their_filling() {
    let vector = committed();
    let plain = Gpu::new(vector.size, &vector.weights, PublishedOptions::default());
    let paste = Gpu::new(vector.size, &vector.weights, PublishedOptions { paste_finished: true });
    let (color, status) = vector.frames().next().unwrap();
    let (filled, pasted) = (plain.fill(color, status), paste.fill(color, status));
    for (pixel, &status) in status.iter().enumerate() {
        let expected = match status {
            2 => [0, 1, 2].map(|c| filled[3 * pixel + c]),
            _ => [0, 1, 2].map(|c| f32::from(color[pixel][c]) / 255.0),
        };
        within_abs(&pasted[3 * pixel..3 * pixel + 3], &expected, 1e-6).unwrap();
    }
}

#[test]
fn all_memory_goes_with_the_buffers() {
    let vector = committed();
    let gpu = Gpu::new(vector.size, &vector.weights, PublishedOptions::default());
    let Gpu { buffers, ledger, .. } = gpu;
    drop(buffers);
    assert_eq!(ledger.total(), 0);
}

fn sources() -> Vec<KernelSource> {
    let options = |paste_finished| PublishedOptions { paste_finished };
    [false, true].into_iter().flat_map(|paste| Published::sources(options(paste))).collect()
}

#[test]
fn shaders_are_valid_and_declare_what_is_bound() {
    for source in sources() {
        check_kernel(&source).unwrap();
    }
}

#[test]
fn files_without_all_tensors_are_refused() {
    assert!(PublishedWeights::from_safetensors(b"no").is_err());
    let tensor =
        safetensors::tensor::TensorView::new(safetensors::Dtype::F32, vec![1], &[0; 4]).unwrap();
    let bytes = safetensors::serialize([("rgb.weight", tensor)], None).unwrap();
    assert!(PublishedWeights::from_safetensors(&bytes).is_err());
}
