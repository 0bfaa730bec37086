// Samples of a volume that is resident as a whole: block b in slot b. Needs lru_sample; the importing
// text declares
//   var<uniform> frame: FrameParams;
//   var<storage, read_write> cells: array<atomic<u32>>;  two words per block
// A bit of `cells` is set once a ray has found that cell of the block on one side of the surface.
#import frame
#import lru_slots

var<private> block_index: u32;
var<private> block_empty: vec2<u32>;

fn block_open(position: vec3<i32>) {
    block_index = macrocell_linear(position, frame.grid.blocks);
    block_empty = vec2<u32>(
        atomicLoad(&cells[2u * block_index]), atomicLoad(&cells[2u * block_index + 1u]));
}

fn block_take(need: u32) -> bool {
    return true;
}

fn block_sample(x: i32, y: i32, z: i32) -> f32 {
    let size = frame.grid.blocks;
    let slot = block_index + u32(x >> 2u) + size.x * (u32(y >> 2u) + size.y * u32(z >> 2u));
    return lru_sample(slot, u32((x & 3) | ((y & 3) << 2u) | ((z & 3) << 4u)));
}

fn block_cell_is_empty(bit: u32) -> bool {
    return ((select(block_empty.x, block_empty.y, bit >= 32u) >> (bit & 31u)) & 1u) != 0u;
}

fn block_set_empty(bit: u32) {
    atomicOr(&cells[2u * block_index + (bit >> 5u)], 1u << (bit & 31u));
}
