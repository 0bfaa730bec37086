// Gives the victims' slots to the requested blocks; what gets none may be asked for again.
#import lru_state
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> victims: array<u32>;
@group(0) @binding(4) var<storage, read> victim_count: array<u32>;
@group(0) @binding(5) var<storage, read_write> jobs: array<vec2<u32>>;

fn lru_params() -> LruParams {
    return params;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index >= lru_requests()) {
        return;
    }
    let block = atomicLoad(&lru_state[lru_request_word(index)]);
    if (atomicLoad(&lru_directory[block]) != LRU_REQUESTED) {
        return; // the leader has it already
    }
    var slot = block;
    if (!lru_holds_all()) {
        if (index >= victim_count[0]) {
            atomicStore(&lru_directory[block], LRU_ABSENT);
            atomicAdd(&lru_state[LRU_DEFERRED_TOTAL], 1u);
            return;
        }
        slot = victims[index];
    }
    lru_place(block, slot, atomicLoad(&lru_state[LRU_CLOCK]));
    jobs[atomicAdd(&lru_state[LRU_JOB_COUNT], 1u)] = vec2<u32>(block, slot);
}
