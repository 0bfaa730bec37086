// Puts the requested blocks with their slots into the directory. One invocation per new block.
//
// A new entry becomes the first of its chain by one exchange of the head and then points to what was
// first before; until that is written the chain is broken, but nobody walks one in this dispatch.
// The bits that unlink.wgsl left in the heads are unset at any time between: links ignore them.
#import lru_service
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> victims: array<u32>; // their old blocks
@group(0) @binding(4) var<storage, read> jobs: array<vec2<u32>>;

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
    if (index < lru_evicted()) {
        atomicAnd(&lru_directory[lru_head_index(victims[index])], ~LRU_UNLINKING);
    }
    if (index < lru_placed()) {
        let job = jobs[atomicLoad(&lru_state[LRU_JOB_COUNT]) + index];
        lru_insert(job.x, job.y, atomicLoad(&lru_state[LRU_CLOCK]));
    }
}
