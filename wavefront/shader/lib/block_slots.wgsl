// Samples of a block and its plus-side neighbours straight from their slots, looked up when first
// needed. Needs lru_lookup and lru_sample; the importing text declares
//   var<uniform> frame: FrameParams;
// and fn block_use(slot: u32), which is told of every slot looked up.
#import frame
#import lru_slots

var<private> block_position: vec3<i32>;
// Slots of the block (0) and of its plus-side neighbours x + 2y + 4z, and which of them are known.
var<private> block_slots: array<u32, 8>;
var<private> block_known: u32;

fn block_open(position: vec3<i32>) {
    block_position = position;
    block_known = 0u;
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
