//! Streams too large to allocate: a shader of its own supplies words from a formula instead of a
//! buffer and decodes blocks whose bit addresses need more than 32 bits.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::assert_same_bits;
use common::gpu::Gpu;
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgsl::{Module, compose};
use gpu_testkit::gpu::{buffer_with, read_f32s, sentinel_buffer, submit_and_wait};
use zfp_gpu::cpu::decode::decode_words;
use zfp_gpu::wgsl::{BLOCK, GROUP};

const SHADER: Module = Module {
    name: "formula",
    source: "
#import zfp_group
@group(0) @binding(0) var<uniform> page: ZfpPage;
@group(0) @binding(1) var<storage, read> blocks: array<u32>;
@group(0) @binding(2) var<storage, read_write> samples: array<f32>;

fn zfp_word(index: u32) -> u32 {
    var word = index * 0x9e3779b9u;
    word ^= word >> 16u;
    word *= 0x85ebca6bu;
    return word ^ (word >> 13u);
}

@compute @workgroup_size(ZFP_GROUP_LANES)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        zfp_group_read(lane, zfp_locate(page, blocks[group.x]), page.bits_per_block);
    } else if lane < ZFP_GROUP_BLOCKS {
        zfp_group_leave_out(lane);
    }
    workgroupBarrier();
    zfp_group_invert(lane);
    if lane < 16u {
        let row = zfp_group_row(0u, lane);
        for (var i = 0u; i < 4u; i++) {
            samples[group.x * 64u + lane * 4u + i] = row[i];
        }
    }
}
",
};

fn word(index: u64) -> u32 {
    let word = u32::try_from(index).unwrap().wrapping_mul(0x9e37_79b9);
    let word = (word ^ word >> 16).wrapping_mul(0x85eb_ca6b);
    word ^ word >> 13
}

/// Header bits of the block at `bit` give a magnitude that a load would accept.
fn is_plausible(bit: u64) -> bool {
    let window = u64::from(word(bit / 32)) | u64::from(word(bit / 32 + 1)) << 32;
    let header = window >> (bit % 32) & 0x1ff;
    header & 1 == 0 || header >> 1 <= 250
}

#[test]
fn blocks_beyond_32_bit_addresses_equal_the_cpu() {
    let gpu = Gpu::new();
    let source = KernelSource {
        label: "test.formula",
        wgsl: compose(SHADER, &[BLOCK, GROUP], &[]).unwrap(),
        entry_point: "main",
        bindings: vec![
            Binding::Uniform { bytes: 16 },
            Binding::StorageRead { min_bytes: 4 },
            Binding::StorageReadWrite { min_bytes: 4 },
        ],
    };
    let kernel = source.kernel(&gpu.device);
    for (bits_per_block, first_bit, last_block) in [
        (31_u32, 20_u32, u32::MAX - 1),
        (9, 31, u32::MAX - 1),
        (300, 0, 450_000_000),
        (1999, 5, 68_000_000),
        (2120, 20, 64_000_000),
    ] {
        assert!(u64::from(last_block) * u64::from(bits_per_block) > 1 << 35);
        let bit = |block: u32| u64::from(block) * u64::from(bits_per_block) + u64::from(first_bit);
        let plausible = |&block: &u32| is_plausible(bit(block));
        let blocks: Vec<u32> = (0..=last_block).rev().filter(plausible).take(200).collect();
        let uniform = [0, last_block + 1, bits_per_block, first_bit];
        let uniform =
            buffer_with(&gpu.device, bytemuck::bytes_of(&uniform), wgpu::BufferUsages::UNIFORM);
        let list = gpu.storage(&blocks);
        let samples = sentinel_buffer(&gpu.device, 200 * 256, 0x7e57_7e57);
        let resources =
            [uniform.as_entire_binding(), list.as_entire_binding(), samples.as_entire_binding()];
        let bind = kernel.bind(&gpu.device, "test.formula", &resources);
        let mut encoder = gpu.encoder();
        kernel.dispatch(&mut encoder.begin_compute_pass(&Default::default()), &bind, 200);
        submit_and_wait(&gpu.device, &gpu.queue, encoder);
        let found = read_f32s(&gpu.device, &gpu.queue, &samples);
        for (&block, found) in blocks.iter().zip(found.chunks_exact(64)) {
            let expected = decode_words(word, bit(block), bits_per_block);
            assert_same_bits(found, &expected, &format!("{bits_per_block} bits, block {block}"));
        }
    }
}
