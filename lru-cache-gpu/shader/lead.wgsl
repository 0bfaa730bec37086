// Opens the service of a round: gives the leader its blocks before anybody else and says how many
// slots the search for victims looks at. One invocation.
#import lru_state
#import indirect

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> jobs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> control: array<u32>;

// Slots that the leader's search looks at for one that nobody needs.
const POLITE_STEPS: u32 = 64u;

fn lru_params() -> LruParams {
    return params;
}

fn leader_entry(index: u32) -> u32 {
    return atomicLoad(&lru_directory[atomicLoad(&lru_state[LRU_LEADER + index])]);
}

// How reluctantly the leader takes a slot, 3: never.
fn reluctance(slot: u32, spared_from: u32, clock: u32) -> u32 {
    let stamp = atomicLoad(&lru_state[lru_stamp_word(slot)]);
    if (stamp < spared_from) {
        return 0u;
    }
    if (stamp < clock) {
        return 1u;
    }
    return select(2u, 3u, stamp == LRU_PINNED);
}

// A slot that the leader does not need: the best among the next ones after the hand. There is one
// because the leader needs no more blocks than there are slots.
fn leader_victim() -> u32 {
    let clock = atomicLoad(&lru_state[LRU_CLOCK]);
    let spared_from = lru_spared_from();
    var slot = atomicLoad(&lru_state[LRU_HAND]) % params.slots;
    var best = slot;
    var best_reluctance = 3u;
    for (var step = 1u; step <= params.slots; step++) {
        let found = reluctance(slot, spared_from, clock);
        if (found < best_reluctance) {
            best = slot;
            best_reluctance = found;
        }
        if (best_reluctance == 0u || (step >= POLITE_STEPS && best_reluctance < 3u)) {
            break;
        }
        slot = (slot + 1u) % params.slots;
    }
    atomicStore(&lru_state[LRU_HAND], (best + 1u) % params.slots);
    return best;
}

fn serve_leader() -> u32 {
    let count = min(atomicLoad(&lru_state[LRU_LEADER_COUNT]), min(LRU_LEADER_CAPACITY, params.slots));
    for (var i = 0u; i < count; i++) {
        let entry = leader_entry(i);
        if (entry >= LRU_FIRST_SLOT) {
            atomicStore(&lru_state[lru_stamp_word(entry - LRU_FIRST_SLOT)], LRU_PINNED);
        }
    }
    var served = 0u;
    for (var i = 0u; i < count; i++) {
        let entry = leader_entry(i);
        if (entry < LRU_FIRST_SLOT) {
            // What others requested, too, is counted with the list.
            atomicAdd(&lru_state[LRU_REQUESTED_TOTAL], u32(entry == LRU_ABSENT));
            let block = atomicLoad(&lru_state[LRU_LEADER + i]);
            var slot = block;
            if (!lru_holds_all()) {
                slot = leader_victim();
            }
            lru_place(block, slot, LRU_PINNED);
            jobs[served] = vec2<u32>(block, slot);
            served++;
        }
    }
    let clock = atomicLoad(&lru_state[LRU_CLOCK]);
    for (var i = 0u; i < count; i++) {
        atomicStore(&lru_state[lru_stamp_word(leader_entry(i) - LRU_FIRST_SLOT)], clock);
    }
    return served;
}

@compute @workgroup_size(1)
fn main() {
    let served = serve_leader();
    atomicStore(&lru_state[LRU_JOB_COUNT], served);
    let requests = lru_requests();
    let search_nothing = requests == 0u || lru_holds_all();
    let window = select(min(2u * requests + 256u, params.window_capacity), 0u, search_nothing);
    let search = indirect_fold((window + 63u) / 64u);
    let assign = indirect_fold((requests + 63u) / 64u);
    control[0] = search.x;
    control[1] = search.y;
    control[2] = search.z;
    control[3] = window;
    control[4] = assign.x;
    control[5] = assign.y;
    control[6] = assign.z;
}
