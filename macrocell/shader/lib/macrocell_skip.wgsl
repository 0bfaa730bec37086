// From any block to the first active block at or after it.
// The importing text supplies fn macrocell_mask(index: u32) -> vec2<u32>.
#import macrocell_grid

// The part of the grid outside of which no block is active. All of it comes from memory.
fn macrocell_active(grid: MacrocellGrid) -> MacrocellGrid {
    let box = grid.active_box;
    let words = vec4<u32>(macrocell_mask(box), macrocell_mask(box + 1u));
    var part = grid;
    part.first_block = bitcast<vec3<i32>>(words.xyz);
    part.has_third_level = words.w;
    part.last_cell = bitcast<vec3<i32>>(vec3<u32>(macrocell_mask(box + 2u), macrocell_mask(box + 3u).x));
    return part;
}

fn macrocell_bit(mask: vec2<u32>, position: vec3<i32>) -> bool {
    let bit = u32((position.x & 3) | ((position.y & 3) << 2u) | ((position.z & 3) << 4u));
    return ((select(mask.x, mask.y, bit >= 32u) >> (bit & 31u)) & 1u) != 0u;
}

// The mask of the coarse cell that the walk is in: one load serves up to 64 blocks.
var<private> macrocell_known: u32 = 0xffffffffu;
var<private> macrocell_known_mask: vec2<u32>;

// Edge length, as a power of two, of the largest box around the block without active blocks; 0 if it
// is active itself.
fn macrocell_empty_level(grid: MacrocellGrid, block: vec3<i32>) -> u32 {
    let index = macrocell_linear(block >> vec3<u32>(2u), grid.coarse);
    if (index != macrocell_known) {
        macrocell_known = index;
        macrocell_known_mask = macrocell_mask(index);
    }
    if (macrocell_bit(macrocell_known_mask, block)) {
        return 0u;
    }
    if ((macrocell_known_mask.x | macrocell_known_mask.y) != 0u) {
        return 2u;
    }
    if (grid.has_third_level != 0u) {
        let third = macrocell_mask(
            grid.coarse_count + macrocell_linear(block >> vec3<u32>(4u), grid.third));
        if ((third.x | third.y) == 0u) {
            return 6u;
        }
    }
    return 4u;
}

// Leaves the box of 2^level cells on each axis around the block.
fn macrocell_leave_box(
    grid: MacrocellGrid,
    ray: DdaRay,
    place: MacrocellPlace,
    level: u32,
) -> MacrocellPlace {
    let box = dda_box(place.block * 4, level, grid.last_cell);
    let event = dda_exit(ray, box);
    if (event.axis == DDA_START) {
        return MacrocellPlace(event, vec3<i32>(-1));
    }
    let own = select(box.low - vec3<i32>(1), box.high + vec3<i32>(1), ray.step > vec3<i32>(0));
    let cell = dda_cell_after(ray, event, box, own);
    // The volume may end inside a block.
    let ends = any(cell > grid.last_cell);
    return MacrocellPlace(event, select(cell >> vec3<u32>(2u), vec3<i32>(-1), ends));
}

// Advances to the first active block, or out of the volume.
fn macrocell_advance(grid: MacrocellGrid, ray: DdaRay, start: MacrocellPlace) -> MacrocellPlace {
    var place = start;
    while (macrocell_inside(grid, place.block)) {
        let level = macrocell_empty_level(grid, place.block);
        if (level == 0u) {
            break;
        }
        if (level == 2u) {
            place = macrocell_leave(grid, ray, place);
        } else {
            place = macrocell_leave_box(grid, ray, place, level);
        }
    }
    return place;
}
