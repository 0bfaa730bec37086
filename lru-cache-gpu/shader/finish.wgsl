// Closes the service of a round: advances hand and clock, counts, and writes the arguments of the
// decode dispatch. One invocation.
#import lru_state
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
@group(0) @binding(3) var<storage, read> control: array<u32>;
@group(0) @binding(4) var<storage, read> victims: array<u32>;
@group(0) @binding(5) var<storage, read> victim_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> decode_args: array<u32>;

fn lru_params() -> LruParams {
    return params.lru;
}

// Once every slot was searched in vain, slots used in earlier rounds of this frame may go too.
fn advance_hand(requests: u32) {
    let slots = params.lru.slots;
    let window = control[3];
    let found = select(victim_count[0], 0u, window == 0u);
    if (found >= requests && requests > 0u) {
        atomicStore(&lru_state[LRU_HAND], (victims[requests - 1u] + 1u) % slots);
        return;
    }
    atomicStore(&lru_state[LRU_HAND], (atomicLoad(&lru_state[LRU_HAND]) + window) % slots);
    let swept = min(atomicLoad(&lru_state[LRU_SWEPT]) + window, slots);
    atomicStore(&lru_state[LRU_SWEPT], swept);
    if (swept >= slots) {
        atomicStore(&lru_state[LRU_SPARE_FRAME], 0u);
    }
}

@compute @workgroup_size(1)
fn main() {
    let requests = lru_requests();
    let jobs = atomicLoad(&lru_state[LRU_JOB_COUNT]);
    advance_hand(requests);
    atomicAdd(&lru_state[LRU_REQUESTED_TOTAL], requests);
    atomicAdd(&lru_state[LRU_DECODED_TOTAL], jobs);
    atomicStore(&lru_state[LRU_REQUEST_COUNT], 0u);
    atomicStore(&lru_state[LRU_LEADER_COUNT], 0u);
    atomicAdd(&lru_state[LRU_CLOCK], 1u);
    let groups = indirect_fold((jobs + params.jobs_per_group - 1u) / params.jobs_per_group);
    decode_args[0] = groups.x;
    decode_args[1] = groups.y;
    decode_args[2] = groups.z;
}
