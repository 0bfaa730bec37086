// Kernels over words of 32 bits, one for each of as many rays, whose numbers follow each other: 8x4 pixels.
#import frame

const WORD_RAYS: u32 = 32u;
const WORD_COLUMNS: u32 = 8u;

// Ray i of those from a word's first pixel, `corner`, on.
fn word_pixel(corner: vec2<u32>, i: u32) -> vec2<u32> {
    return corner + frame_place(i);
}

// The bits of the four rays in a column of a word's pixels.
fn word_bits(rays: vec4<bool>, column: u32) -> u32 {
    let bits = select(vec4<u32>(0u), vec4<u32>(1u, 1u << 2u, 1u << 8u, 1u << 10u), rays);
    return (bits.x | bits.y | bits.z | bits.w) << frame_spread_bits(vec2<u32>(column)).x;
}
