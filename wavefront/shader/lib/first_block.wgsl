// Where rays start. The importing text supplies fn macrocell_mask(index: u32) -> vec2<u32> and declares
//   var<uniform> frame: FrameParams;
#import frame
#import macrocell_skip

// The state of an active ray, if it has not started that of one that waits in the block where it enters the box of the
// active blocks. So rays that are not cast have no state to be made.
fn first_block_state(grid: MacrocellGrid, ray: DdaRay, state: u32) -> u32 {
    if (state != RAY_DONE) {
        return state;
    }
    let box = DdaBox(4 * grid.first_block, grid.last_cell);
    let cell = dda_cell_after(ray, dda_entry(ray, box), box, dda_first_cells(ray, box));
    return RAY_ACTIVE | frame_pack_count(frame, frame.first_misses) | frame_pack(frame, cell >> vec3<u32>(2u));
}
