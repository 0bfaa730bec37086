// Requests what the active rays wait for, and what they may need next. One invocation per ray.
#import frame
#import indirect
#import macrocell_skip
#import first_block
#import block_need
#import block_request

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<u32>;
@group(0) @binding(2) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> lru_state: array<atomic<u32>>;

// Largest look-ahead of a ray.
const MOST_AHEAD: u32 = 64u;

fn lru_params() -> LruParams {
    return frame.lru;
}

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// Active blocks that a ray requests: twice as many after every round in which it went on and missed a
// block again, since the rays that take many rounds graze the surface. Not where slots are short: what is
// fetched ahead would take the place of what is needed.
fn look_ahead(misses: u32, least: u32) -> u32 {
    if (frame.look_ahead == 1u || lru_uses_count) {
        return least;
    }
    return min(least << (max(misses, 1u) - 1u), MOST_AHEAD);
}

// Requests what the ray needs in its block and in the next active blocks on its way, should it hold no hit.
// The oldest active ray leads: it is served whatever the others ask for.
fn request_ahead(grid: MacrocellGrid, ray: DdaRay, block: vec3<i32>, count: u32, leads: bool) {
    var place = macrocell_enter(grid, ray, block);
    for (var ahead = 0u; ahead < count; ahead++) {
        if (ahead > 0u) {
            place = macrocell_advance(grid, ray, macrocell_leave(grid, ray, place));
            if (!macrocell_inside(grid, place.block)) {
                return;
            }
        }
        let first = macrocell_first_cell(grid, ray, place);
        let need = block_need(ray, first, macrocell_box(grid, place.block));
        block_request(place.block, need, leads && ahead == 0u);
    }
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
    lru_begin_keeping();
    let id = rays[frame_list_word(frame, index)];
    let ray = frame_ray(frame, frame_pixel(frame, id)).ray;
    let grid = macrocell_active(frame.grid);
    // Rays that the round before had no room for have not started.
    let state = first_block_state(grid, ray, rays[RAYS_HEADER + id]);
    let least = frame.look_ahead + frame_zero(id);
    let count = look_ahead(frame_count(frame, state), least);
    request_ahead(grid, ray, frame_unpack(frame, state), count, index == 0u);
}
