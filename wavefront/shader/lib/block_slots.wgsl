// Samples of a block and its plus-side neighbours straight from their slots, looked up when first
// needed. Needs lru_lookup and lru_sample; the importing text declares
//   var<uniform> frame: FrameParams;
// and fn block_use(slot: u32), which is told of every slot looked up.
#import frame
#import lru_slots

var<private> block_position: vec3<i32> = vec3<i32>(-16);
// Slots of the block (0) and of its plus-side neighbours x + 2y + 4z, and which of them are known.
var<private> block_slots: array<u32, 8>;
var<private> block_known: u32;

fn block_open(position: vec3<i32>) {
    block_move_slots(position - block_position);
    block_position = position;
}

// What is known of a block's neighbourhood holds for the half that the next block shares with it: a ray mostly
// goes from one block to the next.
fn block_move_slots(step: vec3<i32>) {
    let size = abs(step);
    if (size.x + size.y + size.z != 1) {
        block_known = 0u;
        return;
    }
    // Neighbours i without and i | bit with the step's axis; those without are `half`.
    let bit = select(select(1u, 2u, size.y == 1), 4u, size.z == 1);
    let half = select(select(0x55u, 0x33u, size.y == 1), 0x0fu, size.z == 1);
    let forth = step.x + step.y + step.z > 0;
    for (var rest = half; rest != 0u; rest &= rest - 1u) {
        let i = countTrailingZeros(rest);
        if (forth) {
            block_slots[i] = block_slots[i | bit];
        } else {
            block_slots[i | bit] = block_slots[i];
        }
    }
    block_known = select((block_known & half) << bit, (block_known >> bit) & half, forth);
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
