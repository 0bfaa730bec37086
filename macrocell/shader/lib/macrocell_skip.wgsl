// From any cell to the first cell, at or after it, that lies in an active block.
// The importing text supplies fn macrocell_mask(index: u32) -> vec2<u32>.
#import macrocell_grid

fn macrocell_bit(mask: vec2<u32>, position: vec3<i32>) -> bool {
    let bit = u32((position.x & 3) | ((position.y & 3) << 2u) | ((position.z & 3) << 4u));
    return ((select(mask.x, mask.y, bit >= 32u) >> (bit & 31u)) & 1u) != 0u;
}

// Edge length, as a power of two, of the largest box around the cell without active blocks; 0 if its block is active.
fn macrocell_empty_level(grid: MacrocellGrid, cell: vec3<i32>) -> u32 {
    let coarse = cell >> vec3<u32>(4u);
    if (grid.has_third_level != 0u) {
        let third = macrocell_mask(grid.coarse_count + macrocell_linear(cell >> vec3<u32>(6u), grid.third));
        if ((third.x | third.y) == 0u) {
            return 6u;
        }
        if (!macrocell_bit(third, coarse)) {
            return 4u;
        }
    }
    let mask = macrocell_mask(macrocell_linear(coarse, grid.coarse));
    if ((mask.x | mask.y) == 0u) {
        return 4u;
    }
    return select(2u, 0u, macrocell_bit(mask, cell >> vec3<u32>(2u)));
}

fn macrocell_inside(grid: MacrocellGrid, cell: vec3<i32>) -> bool {
    return all(cell >= vec3<i32>(0)) && all(cell <= grid.last_cell);
}

// Leaves the box of 2^level cells around the place.
fn macrocell_leave(grid: MacrocellGrid, ray: DdaRay, place: MacrocellPlace, level: u32) -> MacrocellPlace {
    let box = dda_box(place.cell, level, grid.last_cell);
    let event = dda_exit(ray, box);
    if (event.axis == DDA_START) {
        // Only a ray without direction stays for ever: it has nothing more to visit.
        return MacrocellPlace(event, vec3<i32>(-1));
    }
    return MacrocellPlace(event, dda_cell_after(ray, event, box));
}

// Advances to the first cell of an active block, or out of the volume.
fn macrocell_advance(grid: MacrocellGrid, ray: DdaRay, start: MacrocellPlace) -> MacrocellPlace {
    var place = start;
    while (macrocell_inside(grid, place.cell)) {
        let level = macrocell_empty_level(grid, place.cell);
        if (level == 0u) {
            break;
        }
        place = macrocell_leave(grid, ray, place, level);
    }
    return place;
}
