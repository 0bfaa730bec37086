// From any block to the first active block at or after it.
// The importing text supplies fn macrocell_mask(index: u32) -> vec2<u32>.
#import macrocell_grid

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

// Whether the block has dual cells. What lies outside the volume has none.
fn macrocell_inside(grid: MacrocellGrid, block: vec3<i32>) -> bool {
    return all(block >= vec3<i32>(0)) && all(block * 4 <= grid.last_cell);
}

// The block's dual cells.
fn macrocell_box(grid: MacrocellGrid, block: vec3<i32>) -> DdaBox {
    return dda_box(block * 4, 2u, grid.last_cell);
}

// The first of the block's dual cells on the ray's way.
fn macrocell_first_cell(grid: MacrocellGrid, ray: DdaRay, place: MacrocellPlace) -> vec3<i32> {
    return dda_cell_after(ray, place.event, macrocell_box(grid, place.block));
}

// The place where the ray enters the block, which it does somewhere.
fn macrocell_enter(grid: MacrocellGrid, ray: DdaRay, block: vec3<i32>) -> MacrocellPlace {
    return MacrocellPlace(dda_entry(ray, macrocell_box(grid, block)), block);
}

// The place after `event`, which leads out of the block.
fn macrocell_step(ray: DdaRay, block: vec3<i32>, event: DdaEvent) -> MacrocellPlace {
    if (event.axis == DDA_START) {
        // Only a ray without direction stays for ever: it has nothing more to visit.
        return MacrocellPlace(event, vec3<i32>(-1));
    }
    let step = select(vec3<i32>(1), vec3<i32>(-1), ray.direction < vec3<f32>(0.0));
    return MacrocellPlace(event, block + select(vec3<i32>(0), step, dda_on_axis(event.axis)));
}

// Leaves the block.
fn macrocell_leave(grid: MacrocellGrid, ray: DdaRay, place: MacrocellPlace) -> MacrocellPlace {
    return macrocell_step(ray, place.block, dda_exit(ray, macrocell_box(grid, place.block)));
}

// Advances to the first active block, or out of the volume.
fn macrocell_advance(grid: MacrocellGrid, ray: DdaRay, start: MacrocellPlace) -> MacrocellPlace {
    var place = start;
    while (macrocell_inside(grid, place.block)) {
        let level = macrocell_empty_level(grid, place.block);
        if (level == 0u) {
            break;
        }
        let box = dda_box(place.block * 4, level, grid.last_cell);
        let event = dda_exit(ray, box);
        if (level == 2u || event.axis == DDA_START) {
            place = macrocell_step(ray, place.block, event);
        } else {
            let cell = dda_cell_after(ray, event, box);
            // The volume may end inside a block.
            let ends = any(cell > grid.last_cell);
            place = MacrocellPlace(event, select(cell >> vec3<u32>(2u), vec3<i32>(-1), ends));
        }
    }
    return place;
}
