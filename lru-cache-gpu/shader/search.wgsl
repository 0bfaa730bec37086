// Marks the victims among the next slots after the hand: free slots, and those whose last use lies
// before this frame or, when the frame alone fills the cache, before this round.
#import lru_state
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> control: array<u32>;
@group(0) @binding(4) var<storage, read_write> is_victim: array<u32>;
@group(0) @binding(5) var<storage, read_write> searched: array<u32>;

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
    if (index >= control[3]) {
        return;
    }
    // The hand is below 2^31 and the window no longer than the number of slots.
    let slot = (atomicLoad(&lru_state[LRU_HAND]) + index) % params.slots;
    let stamp = atomicLoad(&lru_state[lru_stamp_word(slot)]);
    is_victim[index] = select(0u, 1u, stamp < lru_spared_from());
    searched[index] = slot;
}
