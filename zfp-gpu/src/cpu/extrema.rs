//! CPU twin of `shader/extrema.wgsl`.

use super::decode::decode_block;
use crate::stream::StreamLayout;

/// Floats per block: (min, max) of eight classes of samples.
pub const FLOATS_PER_BLOCK: usize = 16;

/// Extrema of block `block` (block coordinates, inside the volume): (min, max) of class `c` at
/// `2c`. Class 0 holds all samples inside the volume; bit 0 of `c` keeps only samples with local
/// x = 0, bit 1 those with y = 0, bit 2 those with z = 0.
pub fn block_extrema(
    stream: &[u8],
    layout: &StreamLayout,
    block: [u32; 3],
) -> [f32; FLOATS_PER_BLOCK] {
    let [bx, by, _] = layout.blocks().map(u64::from);
    let [x0, y0, z0] = block.map(u64::from);
    let values = decode_block(stream, layout, x0 + bx * (y0 + by * z0));
    let extent: [u32; 3] =
        std::array::from_fn(|axis| layout.dims[axis].saturating_sub(block[axis] * 4).min(4));
    let mut extrema = [[f32::MAX, f32::MIN]; 8];
    for z in 0..extent[2] {
        for y in 0..extent[1] {
            for x in 0..extent[0] {
                let value = values[(x + 4 * y + 16 * z) as usize];
                let on = u32::from(x == 0) | u32::from(y == 0) << 1 | u32::from(z == 0) << 2;
                for class in 0..8 {
                    if class & !on == 0 {
                        let [least, most] = extrema[class as usize];
                        extrema[class as usize] = [least.min(value), most.max(value)];
                    }
                }
            }
        }
    }
    let mut flat = [0.0; FLOATS_PER_BLOCK];
    for (pair, [least, most]) in flat.chunks_exact_mut(2).zip(extrema) {
        pair.copy_from_slice(&[least, most]);
    }
    flat
}

/// Extrema of a region of blocks into `output`: block (x, y, z) of the region at
/// `16 * (x + size_x * (y + size_y * z))`. Blocks outside the volume leave their floats untouched,
/// and so do blocks beyond the end of `output`.
pub fn region_extrema(
    stream: &[u8],
    layout: &StreamLayout,
    origin: [u32; 3],
    size: [u32; 3],
    output: &mut [f32],
) {
    let blocks = layout.blocks();
    let mut elements = output.chunks_exact_mut(FLOATS_PER_BLOCK);
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let Some(element) = elements.next() else { return };
                // Saturated coordinates are outside any volume.
                let block =
                    [(0, x), (1, y), (2, z)].map(|(axis, i)| origin[axis].saturating_add(i));
                if (0..3).all(|axis| block[axis] < blocks[axis]) {
                    element.copy_from_slice(&block_extrema(stream, layout, block));
                }
            }
        }
    }
}
