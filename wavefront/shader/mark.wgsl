// Keeps or requests the samples that the pairs need: those of the block and of its plus-side
// neighbours. The oldest ray's next block leads.
#import frame
#import indirect
#import lru_request
#import pairs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> pairs: array<u32>;
@group(0) @binding(2) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> lru_state: array<atomic<u32>>;

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
    var led = 0u;
    for (var i = 0u; i < 8u; i++) {
        let neighbour = position + vec3<i32>(vec3<u32>(i & 1u, (i >> 1u) & 1u, i >> 2u));
        if (all(vec3<u32>(neighbour) < frame.grid.blocks)) {
            let block = macrocell_linear(neighbour, frame.grid.blocks);
            let slot = lru_lookup(block);
            if (slot != LRU_MISSING) {
                lru_touch(slot);
            } else if (index != 0u) {
                lru_request(block);
            }
            if (index == 0u) {
                lru_lead(led, block);
                led++;
            }
        }
    }
}
