//! The cache of a renderer between passes: the directory maps every resident block to one slot, and that slot
//! holds the block's samples as the CPU decodes them (P8).

use std::collections::HashSet;

use gpu_testkit::gpu;
use lru_cache_gpu::cpu::Cache;
use proptest::prelude::*;
use wavefront::Samples;
use zfp_gpu::cpu::decode::decode_block;

use super::{Phase, ProgressiveIsoRenderer};
use crate::{Camera, CompressedVolume, Frame, FrameOptions, RendererOptions, Residency, wgpu};

const SIZE: [u32; 2] = [48, 32];
const DIMS: [u32; 3] = [33, 30, 27];
const SLOTS: u64 = 96;

/// Directory and samples of all slots.
struct Slots {
    cache: Cache,
    samples: Vec<f32>,
}

impl Slots {
    /// None while the volume is loading.
    fn read(
        renderer: &ProgressiveIsoRenderer,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Option<Self> {
        let Phase::Rendering(rendering) = &renderer.phase else { return None };
        let Samples::Cached(buffers) = rendering.samples.samples() else { return None };
        let mut cache = Cache::new(buffers.plan());
        cache.directory = gpu::read_u32s(device, queue, buffers.directory());
        cache.state = gpu::read_u32s(device, queue, buffers.state());
        let pages = buffers.slots().iter();
        let samples = pages.flat_map(|page| gpu::read_f32s(device, queue, page)).collect();
        Some(Self { cache, samples })
    }

    /// Number of resident blocks, or what is wrong with one.
    fn check(&self, volume: &CompressedVolume) -> Result<usize, String> {
        let stream = volume.read(0, u64::MAX);
        let mut resident = HashSet::new();
        for slot in 0..self.cache.slots() {
            let Some(block) = self.cache.owner(slot) else { continue };
            if !resident.insert(block) {
                return Err(format!("block {block} has two slots"));
            }
            if self.cache.lookup(block) != Some(slot) {
                return Err(format!("block {block} is not found in slot {slot}"));
            }
            let decoded = decode_block(&stream, volume.layout(), block.into());
            let held = &self.samples[64 * slot as usize..][..64];
            let differs = |i: &usize| held[*i].to_bits() != decoded[*i].to_bits();
            if let Some(i) = (0..64).find(differs) {
                let (found, expected) = (held[i], decoded[i]);
                return Err(format!(
                    "slot {slot}, sample {i} of block {block}: {found}, expected {expected}"
                ));
            }
        }
        Ok(resident.len())
    }
}

fn turbulence() -> (CompressedVolume, f32) {
    let field = volumes::by_name("turbulence", DIMS).unwrap();
    let stream = volumes::generate(&*field, DIMS, 4.0).unwrap();
    (CompressedVolume::try_from(&stream).unwrap(), field.suggested_isovalue() as f32)
}

fn renderer(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    volume: &CompressedVolume,
) -> ProgressiveIsoRenderer {
    let options = RendererOptions {
        size: SIZE,
        residency: Residency::Cached,
        most_slots: Some(SLOTS),
        ..Default::default()
    };
    ProgressiveIsoRenderer::new(device, queue, volume.clone(), options).unwrap()
}

fn frame(volume: &CompressedVolume, angles: [f64; 2], isovalue: f32, look_ahead: u32) -> Frame {
    let (center, radius) = volume.bounding_ball();
    let camera = Camera::orbit(center, 0.9 * radius, angles[0], angles[1], 45.0, 1.5);
    let options = FrameOptions { rounds_per_pass: 2, look_ahead, ..Default::default() };
    Frame { camera, isovalues: vec![isovalue], options }
}

proptest! {
    #![proptest_config(gpu_testkit::property(4))]

    #[test]
    fn slots_hold_what_the_directory_says(
        views in prop::collection::vec((0.0..360.0, -80.0..80.0, -0.2f32..0.2, 1..5u32), 3..6),
    ) {
        let (device, queue) = gpu::device();
        let (volume, suggested) = turbulence();
        let mut renderer = renderer(&device, &queue, &volume);
        let (mut most, mut evicted) = (0, 0);
        for (azimuth, elevation, offset, look_ahead) in views {
            let frame = frame(&volume, [azimuth, elevation], suggested + offset, look_ahead);
            renderer.set_frame(&frame).unwrap();
            let mut problem = None;
            let last = renderer.render_to_completion(&device, &queue, |renderer, _| {
                match Slots::read(renderer, &device, &queue).map(|slots| slots.check(&volume)) {
                    Some(Ok(resident)) => most = most.max(resident),
                    Some(Err(error)) => problem = Some(error),
                    None => {}
                }
                problem.is_none()
            });
            prop_assert_eq!(problem, None);
            evicted += last.unwrap().blocks_evicted;
        }
        prop_assert!(most as u64 == SLOTS && evicted > 0, "{} resident, {} evicted", most, evicted);
    }
}

#[test]
fn wrong_slots_are_noticed() {
    let (device, queue) = gpu::device();
    let (volume, isovalue) = turbulence();
    let mut renderer = renderer(&device, &queue, &volume);
    renderer.set_frame(&frame(&volume, [30.0, 20.0], isovalue, 2)).unwrap();
    renderer.render_to_completion(&device, &queue, |_, _| true).unwrap();
    let read = || Slots::read(&renderer, &device, &queue).unwrap();
    let resident = read().check(&volume).unwrap();
    assert!(resident > 10, "{resident}");

    let mut slots = read();
    let owned = (0..slots.cache.slots()).filter(|&slot| slots.cache.owner(slot).is_some());
    let [first, second] = owned.take(2).collect::<Vec<_>>()[..] else { panic!("two slots") };
    // The next number up: one bit of one sample.
    let sample = &mut slots.samples[64 * second as usize + 63];
    *sample = f32::from_bits(sample.to_bits() ^ 1);
    slots.check(&volume).unwrap_err();

    let mut slots = read();
    let [a, b] = [first, second].map(|slot| 64 * slot as usize);
    for i in 0..64 {
        slots.samples.swap(a + i, b + i);
    }
    slots.check(&volume).unwrap_err();

    let mut slots = read();
    let block = slots.cache.owner(first).unwrap();
    let unlinked = slots.cache.lookup(block).unwrap();
    let words = slots.cache.directory.iter_mut();
    // Whatever leads to the slot, a head or another slot, leads past it.
    words.filter(|word| **word == unlinked + 1).for_each(|word| *word = 0);
    slots.check(&volume).unwrap_err();
}
