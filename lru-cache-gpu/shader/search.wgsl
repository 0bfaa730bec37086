// Lists victims among the next slots after the hand: those whose last use lies before what is spared.
// Which of them, if there are more than wanted, and in which order is open; no result depends on it.
// One invocation per slot.
#import lru_service
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> victims: array<u32>;

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
    if (index >= lru_window()) {
        return;
    }
    // Both are at most the number of slots, which is far below 2^31.
    let slot = (atomicLoad(&lru_state[LRU_HAND]) + index) % params.slots;
    let never_used = slot >= atomicLoad(&lru_state[LRU_NEXT_FREE]);
    if (never_used || atomicLoad(&lru_state[lru_stamp_word(slot)]) >= lru_spared_from()) {
        return;
    }
    let wanted = lru_wanted();
    // The first look keeps most of a large window away from the counter.
    if (atomicLoad(&lru_state[LRU_FOUND]) < wanted) {
        let number = atomicAdd(&lru_state[LRU_FOUND], 1u);
        if (number < wanted) {
            victims[number] = slot;
        }
    }
}
