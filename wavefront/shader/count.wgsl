// Finds the pairs whose samples are all resident now and counts them per slot.
#import frame
#import indirect
#import lru_lookup
#import pairs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> pairs: array<u32>;
@group(0) @binding(2) var<storage, read> lru_directory: array<u32>;
@group(0) @binding(3) var<storage, read_write> slot_counts: array<atomic<u32>>;

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
    if (pair == PAIR_NONE) {
        return;
    }
    let position = frame_block_position(frame, pair & PAIR_BLOCK);
    for (var i = 0u; i < 8u; i++) {
        let neighbour = position + vec3<i32>(vec3<u32>(i & 1u, (i >> 1u) & 1u, i >> 2u));
        if (all(vec3<u32>(neighbour) < frame.grid.blocks)
            && lru_lookup(macrocell_linear(neighbour, frame.grid.blocks)) == LRU_MISSING) {
            return;
        }
    }
    pairs[PAIRS_HEADER + index] = PAIR_READY | (pair & PAIR_BLOCK);
    atomicAdd(&slot_counts[lru_lookup(pair & PAIR_BLOCK)], 1u);
}
