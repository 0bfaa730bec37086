// One round of the active rays: each walks through everything that is resident and stops at a hit, at
// the volume's end, or at the first block with missing samples, which it requests.
#import frame
#import indirect
#import macrocell_skip
#import lru_request
#import block_samples
#import block_walk

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<u32>;
@group(0) @binding(2) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read> lru_slots_0: array<f32>;
#ifdef LRU_PAGES_2
@group(0) @binding(6) var<storage, read> lru_slots_1: array<f32>;
#endif
#ifdef LRU_PAGES_3
@group(0) @binding(7) var<storage, read> lru_slots_2: array<f32>;
#endif
#ifdef LRU_PAGES_4
@group(0) @binding(8) var<storage, read> lru_slots_3: array<f32>;
#endif

// Largest look-ahead of a ray.
const MOST_AHEAD: u32 = 64u;

fn lru_params() -> LruParams {
    return frame.lru;
}

fn lru_slots_per_page() -> u32 {
    return frame.lru.slots_per_page;
}

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

fn block_use(slot: u32) {
    lru_keep(slot);
}

// Keeps or requests the needed samples of the opened block. The oldest active ray leads: it is served
// whatever the others ask for.
fn request(need: u32, leads: bool) {
    var led = 0u;
    for (var rest = need; rest != 0u; rest &= rest - 1u) {
        let block = block_neighbour(countTrailingZeros(rest));
        let slot = lru_lookup(block);
        if (slot != LRU_MISSING) {
            lru_keep(slot);
        } else if (!leads) {
            lru_request(block);
        }
        if (leads) {
            lru_lead(led, block);
            led++;
        }
    }
}

// Requests what the ray needs from its place on: in the block there, and in the next active blocks
// on its way, should it hold no hit.
fn request_ahead(grid: MacrocellGrid, ray: DdaRay, start: MacrocellPlace, look_ahead: u32, leads: bool) {
    var place = start;
    for (var ahead = 0u; ahead < look_ahead; ahead++) {
        if (ahead > 0u) {
            place = macrocell_advance(grid, ray, macrocell_leave(grid, ray, place));
            if (!macrocell_inside(grid, place.block)) {
                return;
            }
        }
        block_open(place.block);
        let first = macrocell_first_cell(grid, ray, place);
        let need = block_need(ray, first, macrocell_box(grid, place.block));
        request(need, leads && ahead == 0u);
    }
}

// Active blocks that a ray requests in this round: twice as many after every round in which it went on and
// missed a block again, since the rays that take many rounds graze the surface.
fn look_ahead(misses: u32, most: u32) -> u32 {
    if (frame.look_ahead == 1u) {
        return most;
    }
    return min(most << misses, MOST_AHEAD);
}

// The ray's new state.
fn walk(grid: MacrocellGrid, ray: DdaRay, state: u32, most: u32, leads: bool) -> u32 {
    let first = frame_unpack(frame, state);
    var place = macrocell_advance(grid, ray, macrocell_enter(grid, ray, first));
    while (macrocell_inside(grid, place.block)) {
        block_open(place.block);
        let box = macrocell_box(grid, place.block);
        let start = CellPlace(place.event, macrocell_first_cell(grid, ray, place));
        let result = block_walk(ray, start, box, frame.isovalue, 0u);
        if (result.hit) {
            return RAY_HIT | frame_pack_count(frame, result.cells) | frame_pack(frame, place.block);
        }
        if (result.missing) {
            let before = frame_count(frame, state);
            let misses = min(before + u32(any(place.block != first)), RAY_MOST_MISSES);
            request_ahead(grid, ray, place, look_ahead(before, most), leads);
            return RAY_ACTIVE | frame_pack_count(frame, misses) | frame_pack(frame, place.block);
        }
        place = macrocell_advance(
            grid, ray, macrocell_step(ray, place.block, result.place.event));
    }
    return RAY_DONE;
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
    let state = rays[RAYS_HEADER + id];
    let most = frame.look_ahead + frame_zero(id);
    rays[RAYS_HEADER + id] = walk(frame_grid(frame, id), ray, state, most, index == 0u);
}
