// Which blocks hold the samples of a block's dual cells, a bit for each: bit 0 the block itself, bit n its
// plus-side neighbour n = x + 2y + 4z.
#import macrocell_grid

// Blocks that a dual cell's samples lie in.
fn block_cell_need(cell: vec3<i32>) -> u32 {
    let upper = (cell & vec3<i32>(3)) == vec3<i32>(3);
    var need = 1u;
    need |= select(0u, need << 1u, upper.x);
    need |= select(0u, need << 2u, upper.y);
    need |= select(0u, need << 4u, upper.z);
    return need;
}

// Blocks that the samples lie in of all cells that the ray visits in `box` from `start` on.
fn block_need(ray: DdaRay, start: vec3<i32>, box: DdaBox) -> u32 {
    var need = 0u;
    var cell = start;
    while (all(cell >= box.low) && all(cell <= box.high)) {
        need |= block_cell_need(cell);
        cell = block_next(ray, cell, dda_cell_exit(ray, cell));
    }
    return need;
}

fn block_next(ray: DdaRay, cell: vec3<i32>, exit: DdaEvent) -> vec3<i32> {
    return cell + dda_step_on(exit.axis, ray.step);
}
