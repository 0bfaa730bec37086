// Sizes of the nested grids and places in them.
#import dda

struct MacrocellGrid {
    blocks: vec3<u32>,
    coarse_count: u32,
    coarse: vec3<u32>,
    has_third_level: u32,
    third: vec3<u32>,
    active_box: u32,        // where the active box follows the masks
    last_cell: vec3<i32>,   // dims - 2, or that of the active box
    pad0: u32,
    first_block: vec3<i32>, // 0, or that of the active box
    pad1: u32,
}

// Where a walk stands: `block` was reached by `event`. Block planes are a subset of all planes, so the
// walk from block to block needs no cells; macrocell_first_cell gives one where it is wanted.
struct MacrocellPlace {
    event: DdaEvent,
    block: vec3<i32>,
}

fn macrocell_linear(position: vec3<i32>, size: vec3<u32>) -> u32 {
    return u32(position.x) + size.x * (u32(position.y) + size.y * u32(position.z));
}

// Whether the block has dual cells of the grid.
fn macrocell_inside(grid: MacrocellGrid, block: vec3<i32>) -> bool {
    return all(block * 4 <= grid.last_cell) && all(block >= grid.first_block);
}

// The block's dual cells.
fn macrocell_box(grid: MacrocellGrid, block: vec3<i32>) -> DdaBox {
    return dda_box(block * 4, 2u, grid.last_cell);
}

// The first of the block's dual cells on the ray's way.
fn macrocell_first_cell(grid: MacrocellGrid, ray: DdaRay, place: MacrocellPlace) -> vec3<i32> {
    let box = macrocell_box(grid, place.block);
    return dda_cell_after(ray, place.event, box, dda_first_cells(ray, box));
}

// The place where the ray enters the block, which it does somewhere.
fn macrocell_enter(grid: MacrocellGrid, ray: DdaRay, block: vec3<i32>) -> MacrocellPlace {
    return MacrocellPlace(dda_entry(ray, macrocell_box(grid, block)), block);
}

// The place after `event`, which leads out of the block.
fn macrocell_step(ray: DdaRay, block: vec3<i32>, event: DdaEvent) -> MacrocellPlace {
    // Only a ray without direction stays for ever: it has nothing more to visit.
    let next = block + dda_step_on(event.axis, ray.step);
    return MacrocellPlace(event, select(next, vec3<i32>(-1), event.axis == DDA_START));
}

// Leaves the block.
fn macrocell_leave(grid: MacrocellGrid, ray: DdaRay, place: MacrocellPlace) -> MacrocellPlace {
    let planes = min((place.block + ray.ahead) * 4, grid.last_cell + vec3<i32>(1));
    return macrocell_step(ray, place.block, dda_first(dda_planes_t(ray, planes)));
}
