// Every active ray's next active blocks, in order, and where it goes on after them.
#import frame
#import indirect
#import macrocell_skip
#import first_block
#import pairs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<u32>;
@group(0) @binding(2) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> pairs: array<u32>;

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// The ray's state before the first pair is composited: the block after its last pair, or done.
fn advance(grid: MacrocellGrid, ray: DdaRay, first_block: vec3<i32>, first_pair: u32, count: u32) -> u32 {
    var place = macrocell_advance(
        grid, ray, macrocell_enter(grid, ray, first_block));
    for (var k = 0u; k < count; k++) {
        if (!macrocell_inside(grid, place.block)) {
            pairs[PAIRS_HEADER + first_pair + k] = PAIR_NONE;
            continue;
        }
        let block = macrocell_linear(place.block, grid.blocks);
        pairs[PAIRS_HEADER + first_pair + k] = PAIR_WAITS | block;
        place = macrocell_advance(
            grid, ray, macrocell_leave(grid, ray, place));
    }
    if (!macrocell_inside(grid, place.block)) {
        return RAY_DONE;
    }
    return RAY_ACTIVE | frame_pack(frame, place.block);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index >= rays[RAYS_LISTED]) {
        return;
    }
    let id = rays[frame_list_word(frame, index)];
    let ray = frame_ray(frame, frame_pixel(frame, id)).ray;
    let grid = macrocell_active(frame.grid);
    let block = frame_unpack(frame, first_block_state(grid, ray, rays[RAYS_HEADER + id]));
#ifdef EMPTY_SPACE_STEP
    rays[RAYS_HEADER + id] = advance(grid, ray, block, 0u, 0u);
#else
    let count = pairs[PAIRS_SPECULATION];
    rays[RAYS_HEADER + id] = advance(grid, ray, block, index * count, count);
#endif
}
