// How long a walk may go on: all its rays together visit no more cells than the frame's bound. The importing
// text declares
//   var<storage, read_write> rays: array<atomic<u32>>;
//   var<uniform> frame: FrameParams;
#import frame

// Cells of a block on any ray: it crosses at most 3 planes between cells on each axis.
const WORK_BLOCK_CELLS: u32 = 10u;

// Cells that a ray visits between two counts, if the bound allows: few enough that what is not counted yet
// takes a small part of the bound, enough that counting costs nothing.
const WORK_LEAST_SHARE: u32 = 16u;

// Cells of this ray that are not counted yet.
var<private> work_cells: u32;
// Cells after which it counts them, and cells counted from which on a ray goes on in the next round. Until then
// the bound holds whatever the others do: each of them visits its share and a block before it looks again.
var<private> work_share: u32;
var<private> work_pool: u32;

fn work_begin(listed: u32) {
    let equal = max(frame.most_cells / listed, WORK_BLOCK_CELLS) - WORK_BLOCK_CELLS;
    work_share = min(equal, max(equal / 8u, WORK_LEAST_SHARE));
    work_pool = frame.most_cells - min(frame.most_cells, listed * (work_share + WORK_BLOCK_CELLS));
}

// Counts this ray's cells; all that were counted in this round.
fn work_count() -> u32 {
    let cells = work_cells;
    work_cells = 0u;
    return atomicAdd(&rays[RAYS_CELLS], cells) + cells;
}

// Whether the ray must stop in front of a block.
fn work_is_done() -> bool {
    if (work_cells <= work_share || work_count() <= work_pool) {
        return false;
    }
    atomicAdd(&rays[RAYS_CUT], 1u);
    return true;
}
