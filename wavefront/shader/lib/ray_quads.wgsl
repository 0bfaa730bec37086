// A workgroup of 64 over rays, four of an invocation, whose numbers follow each other: 2x2 pixels. And a bit for each of them.

const QUAD_RAYS: u32 = 4u;

var<workgroup> quad_bits: array<atomic<u32>, 8>;

// Before a barrier.
fn quad_begin(lane: u32) {
    if (lane < 8u) {
        atomicStore(&quad_bits[lane], 0u);
    }
}

// Pixel i of those from `corner` on.
fn quad_pixel(corner: vec2<u32>, i: u32) -> vec2<u32> {
    return corner + vec2<u32>(i & 1u, i >> 1u);
}

fn quad_add(lane: u32, bits: u32) {
    atomicOr(&quad_bits[lane >> 3u], bits << (QUAD_RAYS * (lane & 7u)));
}

// Whether the invocation's rays are the first ones of a word of bits.
fn quad_leads(lane: u32) -> bool {
    return (lane & 7u) == 0u;
}

// The word, after a barrier.
fn quad_word(lane: u32) -> u32 {
    return atomicLoad(&quad_bits[lane >> 3u]);
}
