// One round of the active rays: each walks through everything that is resident and stops at a hit, at
// the volume's end, or at the first block with missing samples, which it requests.
#import frame
#import indirect
#import macrocell_skip
#import lru_request
#import block_slots
#import block_walk

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<u32>;
@group(0) @binding(2) var<storage, read> active_rays: array<u32>;
@group(0) @binding(3) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read> lru_slots_0: array<f32>;
#ifdef LRU_PAGES_2
@group(0) @binding(7) var<storage, read> lru_slots_1: array<f32>;
#endif
#ifdef LRU_PAGES_3
@group(0) @binding(8) var<storage, read> lru_slots_2: array<f32>;
#endif

fn lru_params() -> LruParams {
    return frame.lru;
}

fn lru_slots_per_page() -> u32 {
    return frame.lru.slots_per_page;
}

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

fn neighbour(block: vec3<i32>, index: u32) -> u32 {
    let offset = vec3<i32>(vec3<u32>(index & 1u, (index >> 1u) & 1u, index >> 2u));
    return macrocell_linear(block + offset, frame.grid.blocks);
}

// Fills block_slots with the needed blocks' slots and keeps them; false when one is missing.
fn take_slots(block: vec3<i32>, need: u32) -> bool {
    var complete = true;
    for (var i = 0u; i < 8u; i++) {
        if (((need >> i) & 1u) != 0u) {
            let slot = lru_lookup(neighbour(block, i));
            block_slots[i] = slot;
            if (slot == LRU_MISSING) {
                complete = false;
            } else {
                lru_touch(slot);
            }
        }
    }
    return complete;
}

// The oldest active ray leads: it is served whatever the others ask for.
fn request_missing(block: vec3<i32>, need: u32, leads: bool) {
    var led = 0u;
    for (var i = 0u; i < 8u; i++) {
        if (((need >> i) & 1u) != 0u) {
            if (leads) {
                lru_lead(led, neighbour(block, i));
                led++;
            } else if (block_slots[i] == LRU_MISSING) {
                lru_request(neighbour(block, i));
            }
        }
    }
}

// Requests what the ray will need in the next active blocks on its way, should they hold no hit.
fn look_ahead(ray: DdaRay, start: MacrocellPlace) {
    var place = start;
    for (var ahead = 1u; ahead < frame.look_ahead; ahead++) {
        place = macrocell_advance(frame.grid, ray, macrocell_leave(frame.grid, ray, place, 2u));
        if (!macrocell_inside(frame.grid, place.cell)) {
            return;
        }
        let block = place.cell >> vec3<u32>(2u);
        let need = block_need(ray, place, dda_box(place.cell, 2u, frame.grid.last_cell));
        if (!take_slots(block, need)) {
            request_missing(block, need, false);
        }
    }
}

// The ray's new state.
fn walk(ray: DdaRay, first_block: vec3<i32>, leads: bool) -> u32 {
    let first_box = dda_box(first_block * 4, 2u, frame.grid.last_cell);
    let entry = dda_entry(ray, first_box);
    var place = MacrocellPlace(entry, dda_cell_after(ray, entry, first_box));
    loop {
        place = macrocell_advance(frame.grid, ray, place);
        if (!macrocell_inside(frame.grid, place.cell)) {
            return RAY_DONE;
        }
        let block = place.cell >> vec3<u32>(2u);
        let box = dda_box(place.cell, 2u, frame.grid.last_cell);
        let need = block_need(ray, place, box);
        if (!take_slots(block, need)) {
            request_missing(block, need, leads);
            look_ahead(ray, place);
            return RAY_ACTIVE | macrocell_linear(block, frame.grid.blocks);
        }
        let result = block_walk(ray, place, box, frame.isovalue);
        if (result.hit) {
            return RAY_HIT | macrocell_linear(block, frame.grid.blocks);
        }
        place = result.place;
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
    if (index >= rays[RAYS_ACTIVE]) {
        return;
    }
    let id = active_rays[index];
    let ray = frame_ray(frame, frame_pixel(frame, id)).ray;
    let block = frame_block_position(frame, rays[RAYS_HEADER + id] & RAY_BLOCK);
    rays[RAYS_HEADER + id] = walk(ray, block, index == 0u);
}
