// Samples of a block and its plus-side neighbours straight from their slots, looked up when first
// needed. Needs lru_lookup, lru_user_word and lru_sample; the importing text declares
//   var<uniform> frame: FrameParams;
// and fn block_use(slot: u32), which is told of every slot looked up, and fn block_set_empty(bit: u32).
// The user words of a slot have a bit for each of the block's cells; it is 0 once a ray has found that
// cell on one side of the surface.
#import frame
#import lru_slots

var<private> block_position: vec3<i32>;
// Slots of the block (0) and of its plus-side neighbours x + 2y + 4z, and which of them are known.
var<private> block_slots: array<u32, 8>;
var<private> block_known: u32;
var<private> block_cells: vec2<u32>;

fn block_open(position: vec3<i32>) {
    block_position = position;
    block_known = 0u;
    block_cells = vec2<u32>(0xffffffffu);
    let slot = lru_lookup(block_neighbour(0u));
    if (slot != LRU_MISSING) {
        block_use(slot);
        block_slots[0] = slot;
        block_known = 1u;
        block_cells = vec2<u32>(lru_user_word(slot, 0u), lru_user_word(slot, 1u));
    }
}

fn block_cell_is_empty(bit: u32) -> bool {
    return ((select(block_cells.x, block_cells.y, bit >= 32u) >> (bit & 31u)) & 1u) == 0u;
}

// Number of neighbour i of the block.
fn block_neighbour(i: u32) -> u32 {
    let offset = vec3<i32>(vec3<u32>(i & 1u, (i >> 1u) & 1u, i >> 2u));
    return macrocell_linear(block_position + offset, frame.grid.blocks);
}

// Looks up the needed blocks, a bit for each; false when one is not resident.
fn block_take(need: u32) -> bool {
    var unknown = need & ~block_known;
    while (unknown != 0u) {
        let i = countTrailingZeros(unknown);
        let slot = lru_lookup(block_neighbour(i));
        if (slot == LRU_MISSING) {
            return false;
        }
        block_use(slot);
        block_slots[i] = slot;
        block_known |= 1u << i;
        unknown &= unknown - 1u;
    }
    return true;
}

fn block_sample(x: i32, y: i32, z: i32) -> f32 {
    let slot = block_slots[(x >> 2u) | ((y >> 2u) << 1u) | ((z >> 2u) << 2u)];
    return lru_sample(slot, u32((x & 3) | ((y & 3) << 2u) | ((z & 3) << 4u)));
}
