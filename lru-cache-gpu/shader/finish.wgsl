// Closes the service of a round: advances hand and clock, counts, and writes the arguments of the
// decode dispatch. One invocation.
#import lru_service
#import indirect

struct FinishParams {
    lru: LruParams,
    jobs_per_group: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: FinishParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> decode_args: array<u32>;

fn lru_params() -> LruParams {
    return params.lru;
}

// After a sweep over all slots in vain, one frame less is spared.
fn count_swept(window: u32) {
    let swept = min(atomicLoad(&lru_state[LRU_SWEPT]) + window, params.lru.slots);
    let frames = atomicLoad(&lru_state[LRU_SPARED_FRAMES]);
    if (swept == params.lru.slots && frames > 0u) {
        atomicStore(&lru_state[LRU_SPARED_FRAMES], frames - 1u);
        atomicStore(&lru_state[LRU_SWEPT], 0u);
    } else {
        atomicStore(&lru_state[LRU_SWEPT], swept);
    }
}

fn advance_hand() {
    let window = lru_window();
    if (window == 0u) {
        return;
    }
    let hand = (atomicLoad(&lru_state[LRU_HAND]) + window) % params.lru.slots;
    if (lru_found() < lru_wanted()) {
        count_swept(window);
    } else {
        atomicStore(&lru_state[LRU_SWEPT], 0u);
    }
    atomicStore(&lru_state[LRU_HAND], hand);
}

@compute @workgroup_size(1)
fn main() {
    let placed = lru_placed();
    let evicted = lru_evicted();
    let jobs = atomicLoad(&lru_state[LRU_JOB_COUNT]) + placed;
    advance_hand();
    atomicStore(&lru_state[LRU_JOB_COUNT], jobs);
    atomicAdd(&lru_state[LRU_REQUESTED_TOTAL], atomicLoad(&lru_state[LRU_REQUEST_COUNT]));
    atomicAdd(&lru_state[LRU_DECODED_TOTAL], jobs);
    atomicAdd(&lru_state[LRU_EVICTED_TOTAL], evicted);
    // Last, as everything above depends on them.
    atomicAdd(&lru_state[LRU_NEXT_FREE], placed - evicted);
    atomicStore(&lru_state[LRU_FOUND], 0u);
    atomicStore(&lru_state[LRU_TAKEN], 0u);
    atomicStore(&lru_state[LRU_REQUEST_COUNT], 0u);
    atomicStore(&lru_state[LRU_LEADER_COUNT], 0u);
    atomicAdd(&lru_state[LRU_CLOCK], 1u);
    let groups = indirect_fold((jobs + params.jobs_per_group - 1u) / params.jobs_per_group);
    decode_args[0] = groups.x;
    decode_args[1] = groups.y;
    decode_args[2] = groups.z;
}
