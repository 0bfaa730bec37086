// Sizes of the nested grids and places in them.
#import dda

struct MacrocellGrid {
    blocks: vec3<u32>,
    coarse_count: u32,
    coarse: vec3<u32>,
    has_third_level: u32,
    third: vec3<u32>,
    pad0: u32,
    last_cell: vec3<i32>, // dims - 2
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
