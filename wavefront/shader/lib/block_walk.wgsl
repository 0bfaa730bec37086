// A ray's way through the dual cells of one block. The importing text supplies
// fn block_take(need: u32) -> bool, whether the samples of the needed blocks are at hand (bit 0 the
// block itself, bit n its plus-side neighbour n = x + 2y + 4z)
// and fn block_sample(x: i32, y: i32, z: i32) -> f32, the sample at 0 ..= 4 on each axis from the block's first.
#import cell
#import block_need

// Where a ray stands inside a block: `cell` was reached by `event`.
struct CellPlace {
    event: DdaEvent,
    cell: vec3<i32>,
}

struct BlockWalk {
    hit: bool,
    missing: bool,         // stopped at a cell with samples that are not at hand
    cells: u32,            // cells visited before `place`
    place: CellPlace,      // the hit's cell and how it was entered, or the first cell after the block
    exit: DdaEvent,        // where the ray leaves the hit's cell
    corners: CellCorners,  // of the hit's cell
    bernstein: vec4<f32>,
    bracket: CellBracket,
    inside_low: bool,
}

fn block_corners(cell: vec3<i32>, isovalue: f32) -> CellCorners {
    let l = cell & vec3<i32>(3);
    let low = vec4<f32>(
        block_sample(l.x, l.y, l.z), block_sample(l.x, l.y + 1, l.z),
        block_sample(l.x, l.y, l.z + 1), block_sample(l.x, l.y + 1, l.z + 1),
    );
    let high = vec4<f32>(
        block_sample(l.x + 1, l.y, l.z), block_sample(l.x + 1, l.y + 1, l.z),
        block_sample(l.x + 1, l.y, l.z + 1), block_sample(l.x + 1, l.y + 1, l.z + 1),
    );
    return CellCorners(low - vec4<f32>(isovalue), high - vec4<f32>(isovalue));
}

// Walks from `start` to the first crossing in `box`, to missing samples, or out of the box. The first
// `known` cells have no crossing.
fn block_walk(ray: DdaRay, start: CellPlace, box: DdaBox, isovalue: f32, known: u32) -> BlockWalk {
    var walk: BlockWalk;
    walk.place = start;
    while (all(walk.place.cell >= box.low) && all(walk.place.cell <= box.high)) {
        let cell = walk.place.cell;
        walk.exit = dda_cell_exit(ray, cell);
        if (walk.cells >= known) {
            if (!block_take(block_cell_need(cell))) {
                walk.missing = true;
                return walk;
            }
            walk.corners = block_corners(cell, isovalue);
            if (!cell_on_one_side(walk.corners)) {
                walk.bernstein = cell_bernstein(
                    walk.corners,
                    cell_entry(ray, walk.place.event, cell),
                    cell_exit(ray, walk.exit, cell),
                );
                // The neighbours compute these sides from the same four samples in the same way.
                walk.inside_low = walk.bernstein.x >= 0.0;
                walk.bracket = cell_first_crossing(
                    walk.bernstein, walk.inside_low, walk.bernstein.w >= 0.0);
                if (walk.bracket.found) {
                    walk.hit = true;
                    return walk;
                }
            }
        }
        walk.cells++;
        walk.place = CellPlace(walk.exit, block_next(ray, cell, walk.exit));
    }
    return walk;
}
