// Groups the ready pairs by slot: slot_ends holds where each slot's group begins and, when all pairs
// are placed, where it ends.
#import frame
#import indirect
#import lru_lookup
#import pairs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> pairs: array<u32>;
@group(0) @binding(2) var<storage, read> lru_directory: array<u32>;
@group(0) @binding(3) var<storage, read_write> slot_ends: array<atomic<u32>>;

fn lru_params() -> LruParams {
    return frame.lru;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index >= pairs[PAIRS_COUNT]) {
        return;
    }
    let pair = pairs[PAIRS_HEADER + index];
    if ((pair & PAIR_STATUS) == PAIR_READY) {
        let place = atomicAdd(&slot_ends[lru_lookup(pair & PAIR_BLOCK)], 1u);
        pairs[PAIRS_HEADER + pairs[PAIRS_CAPACITY] + place] = index;
    }
}
