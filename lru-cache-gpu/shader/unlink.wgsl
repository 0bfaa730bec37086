// Takes the victims out of their chains. One invocation per victim.
//
// Several victims may be in one chain, and two invocations must not change it at a time. The first one
// to set the top bit of the chain's head takes all victims out, the others leave the chain alone:
// - exactly one invocation finds the bit unset, because nobody unsets it in this dispatch. Were it
//   unset here, a late invocation would walk the chain again, with no promise that it sees all of the
//   first one's changes;
// - the victims of a chain are recognised by their missing block, so whoever takes them out needs to
//   know no more than the head, which is that of the victims' old blocks;
// - an entry is in one chain only, so different chains do not meet.
// Nobody waits. insert.wgsl unsets the bits.
#import lru_service
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> victims: array<u32>; // their old blocks

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
    if (index >= lru_evicted()) {
        return;
    }
    let head = lru_head_index(victims[index]);
    let first = atomicOr(&lru_directory[head], LRU_UNLINKING);
    if ((first & LRU_UNLINKING) == 0u) {
        atomicStore(&lru_directory[head], lru_without_victims(first) | LRU_UNLINKING);
    }
}
