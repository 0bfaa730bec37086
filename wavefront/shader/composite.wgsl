// Puts every active ray's pairs together, nearest first: the first hit counts, and a ray waits where
// samples are missing.
#import frame
#import indirect
#import pairs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<u32>;
@group(0) @binding(2) var<storage, read_write> pairs: array<u32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index >= rays[RAYS_LISTED]) {
        return;
    }
    let count = pairs[PAIRS_SPECULATION];
    for (var k = 0u; k < count; k++) {
        let pair = pairs[PAIRS_HEADER + index * count + k];
        if (pair == PAIR_NONE) {
            return; // done, or waiting behind the last pair: the state says so already
        }
        let status = pair & PAIR_STATUS;
        if (status != PAIR_READY) {
            let state = select(RAY_ACTIVE, RAY_HIT, status == PAIR_HIT);
            let id = rays[frame_list_word(frame, index)];
            let block = frame_block_position(frame, pair & PAIR_BLOCK);
            rays[RAYS_HEADER + id] = state | frame_pack(frame, block);
            return;
        }
    }
}
