//! Streams written by the `zfp` program (see `data/generate.sh`), decoded on CPU and GPU exactly
//! as that program decodes them.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::gpu::{Cache, Gpu};
use common::{assert_same_bits, oracle_stream};
use zfp_gpu::StreamLayout;
use zfp_gpu::cpu::decode::decode_volume;
use zfp_rs::ZfpHeaderMask;

struct Vector {
    name: &'static str,
    layout: StreamLayout,
    stream: &'static [u8],
    decoded: Vec<f32>,
}

macro_rules! vector {
    ($name:literal, $dims:expr, $rate:expr, $first_bit:expr) => {{
        let bits_per_block = StreamLayout::bits_per_block_at_rate($rate).unwrap();
        let decoded: &[u8] = include_bytes!(concat!("data/", $name, ".out"));
        Vector {
            name: $name,
            layout: StreamLayout::new($dims, bits_per_block, $first_bit).unwrap(),
            stream: include_bytes!(concat!("data/", $name, ".zfp")),
            decoded: bytemuck::pod_collect_to_vec(decoded),
        }
    }};
}

fn vectors() -> [Vector; 8] {
    [
        vector!("smooth_r1", [13, 9, 6], 1.0, 0),
        vector!("smooth_r16_header", [13, 9, 6], 16.0, 96),
        vector!("noise_r2.3", [10, 11, 7], 2.3, 0),
        vector!("noise_r7.7_header", [10, 11, 7], 7.7, 96),
        vector!("noise_r33_header", [10, 11, 7], 33.125, 148),
        vector!("mixed_r0.2_header", [14, 13, 12], 0.2, 96),
        vector!("mixed_r4.7", [14, 13, 12], 4.7, 0),
        vector!("mixed_r20_header", [14, 13, 12], 20.0, 96),
    ]
}

#[test]
fn layouts_are_those_of_the_files() {
    for Vector { name, layout, stream, .. } in vectors() {
        // Builds of the program pad to words of 1 to 8 bytes.
        let padded = layout.stream_bytes()..layout.stream_bytes() + 8;
        assert!(padded.contains(&(stream.len() as u64)), "{name}");
        if layout.first_bit == 0 {
            continue;
        }
        let mut reader = oracle_stream(stream);
        let header = reader.read_header(ZfpHeaderMask::FULL).unwrap();
        assert_eq!(reader.read_pos(), layout.first_bit, "{name}");
        assert_eq!(header.config.unwrap().max_bits(), layout.bits_per_block, "{name}");
    }
}

#[test]
fn the_cpu_decodes_them_exactly() {
    for Vector { name, layout, stream, decoded } in vectors() {
        assert_same_bits(&decode_volume(stream, &layout), &decoded, name);
    }
}

#[test]
fn the_gpu_decodes_them_exactly() {
    let mut gpu = Gpu::new();
    for Vector { name, layout, stream, decoded } in vectors() {
        let payload = gpu.payload(&layout, stream, 128 << 20);
        let blocks = layout.block_count() as u32;
        let jobs: Vec<_> = (0..blocks).map(|block| [block, block]).collect();
        let cache = Cache::new(&gpu, 1, blocks).run(&gpu, &payload, &jobs, blocks);
        let [nx, ny, _] = layout.dims.map(|d| d as usize);
        let [bx, by, _] = layout.blocks().map(|b| b as usize);
        let sample = |i: usize| {
            let [x, y, z] = [i % nx, i / nx % ny, i / (nx * ny)];
            let block = x / 4 + bx * (y / 4 + by * (z / 4));
            cache[block * 64 + x % 4 + 4 * (y % 4) + 16 * (z % 4)]
        };
        let found: Vec<_> = (0..decoded.len()).map(sample).collect();
        assert_same_bits(&found, &decoded, name);
    }
}
