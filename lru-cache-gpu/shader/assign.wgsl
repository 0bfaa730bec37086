// Empties the request table and finds a slot for each requested block: one that was never used, or a
// victim's. What gets none may be asked for again. One invocation per request.
//
// Victims lose their block here but stay in their chains, which unlink.wgsl repairs.
#import lru_request
#import lru_service
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> victims: array<u32>; // slots before, blocks after
@group(0) @binding(4) var<storage, read_write> jobs: array<vec2<u32>>;

fn lru_params() -> LruParams {
    return params;
}

// Slot of victim `index`, which is asked for once and leaves its block in the list instead.
fn take_victim(index: u32) -> u32 {
    let slot = victims[index];
    victims[index] = atomicExchange(&lru_directory[lru_entry_index(slot) + LRU_BLOCK], 0u) - 1u;
    return slot;
}

// The slot for the request that is the `number`-th to need one, else LRU_MISSING.
fn slot_for(number: u32) -> u32 {
    let fresh = lru_fresh();
    if (number < fresh) {
        return atomicLoad(&lru_state[LRU_NEXT_FREE]) + number;
    }
    if (number < fresh + lru_found()) {
        return take_victim(number - fresh);
    }
    return LRU_MISSING;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index >= atomicLoad(&lru_state[LRU_REQUEST_COUNT])) {
        return;
    }
    let place = atomicLoad(&lru_state[lru_request_word(index)]);
    let block = atomicExchange(&lru_state[lru_table_word(place)], 0u) - 1u;
    if (lru_lookup(block) != LRU_MISSING) {
        return; // the leader has it already
    }
    var slot = LRU_MISSING;
    if (index < params.request_capacity) {
        let number = atomicAdd(&lru_state[LRU_TAKEN], 1u);
        slot = slot_for(number);
        if (slot != LRU_MISSING) {
            jobs[atomicLoad(&lru_state[LRU_JOB_COUNT]) + number] = vec2<u32>(block, slot);
        }
    }
    atomicAdd(&lru_state[LRU_DEFERRED_TOTAL], u32(slot == LRU_MISSING));
}
