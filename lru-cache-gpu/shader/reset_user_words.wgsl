// Forgets what the cache's user keeps with the blocks. One invocation per slot.
#import lru_directory
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<u32>;

fn lru_params() -> LruParams {
    return params;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let slot = indirect_linear_group(group, groups) * 64u + lane;
    if (slot < params.slots) {
        lru_directory[lru_user_index(slot, 0u)] = LRU_NO_USER;
        lru_directory[lru_user_index(slot, 1u)] = LRU_NO_USER;
    }
}
