// Requests, for every ray that waits, what it needs to walk to where the coarse field is crossed, so that a guess
// becomes a hit in the next rounds. One invocation per listed ray, after the strategy's own requests.
#import infill_params
#import infill_rays
#import macrocell_skip
#import first_block
#import block_need
#import block_request
#import march
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> params: InfillParams;
@group(0) @binding(2) var<storage, read> rays: array<u32>;
@group(0) @binding(3) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> lru_state: array<atomic<u32>>;

// Of a block's range: what the pictures say of it is summed when they are filled, not before a round.
const MIDPOINT: f32 = 0.5;
// Active blocks of a ray that are requested at a time.
const MOST_BLOCKS: u32 = 16u;

fn lru_params() -> LruParams {
    return frame.lru;
}

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// The active blocks from where the ray waits to where it crosses the coarse field.
fn guide(grid: MacrocellGrid, ray: DdaRay, first: vec3<i32>, t_end: f32, most_blocks: u32) {
    var place = macrocell_enter(grid, ray, first);
    for (var count = 0u; count < most_blocks; count++) {
        place = macrocell_advance(grid, ray, place);
        if (!macrocell_inside(grid, place.block) || place.event.t > t_end) {
            return;
        }
        let cell = macrocell_first_cell(grid, ray, place);
        let need = block_need(ray, cell, macrocell_box(grid, place.block));
        block_request(place.block, need, false);
        place = macrocell_leave(grid, ray, place);
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
    let number = rays[frame_list_word(frame, index)];
    lru_begin_keeping();
    // Where slots are short, what is fetched ahead would take the place of what is needed.
    if (lru_uses_count || !infill_is_hole(number)) {
        return;
    }
    let zero = frame_zero(number);
    let ray = frame_ray(frame, frame_pixel(frame, number)).ray;
    let t_low = infill_t_low(ray, number);
    let march = march(ray, infill_volume(), t_low, frame.isovalue, MIDPOINT, MARCH_MOST_STEPS + zero);
    if (any(march.hit)) {
        let grid = macrocell_active(frame.grid);
        let state = first_block_state(grid, ray, rays[RAYS_HEADER + number]);
        guide(grid, ray, frame_unpack(frame, state), select(march.t.y, march.t.x, march.hit.x), MOST_BLOCKS + zero);
    }
}
