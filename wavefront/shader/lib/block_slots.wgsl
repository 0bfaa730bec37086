// Samples of a block and its plus-side neighbours straight from their slots. Needs lru_sample.
#import lru_slots

// Slots of the block (0) and of its plus-side neighbours x + 2y + 4z.
var<private> block_slots: array<u32, 8>;

fn block_sample(x: i32, y: i32, z: i32) -> f32 {
    let slot = block_slots[(x >> 2u) | ((y >> 2u) << 1u) | ((z >> 2u) << 2u)];
    return lru_sample(slot, u32((x & 3) | ((y & 3) << 2u) | ((z & 3) << 4u)));
}
