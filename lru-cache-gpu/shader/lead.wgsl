// Opens the service of a round: gives the leader its blocks before anybody else and sizes the
// dispatches that follow. One invocation, which therefore changes the directory as it likes.
#import lru_request
#import lru_service
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

fn leader_block(index: u32) -> u32 {
    return atomicLoad(&lru_state[LRU_LEADER + index]);
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

// Takes the block out of a slot.
fn evict(slot: u32) {
    let old_block = atomicExchange(&lru_directory[lru_entry_index(slot) + LRU_BLOCK], 0u) - 1u;
    let head = lru_head_index(old_block);
    atomicStore(&lru_directory[head], lru_without_victims(atomicLoad(&lru_directory[head])));
    atomicAdd(&lru_state[LRU_EVICTED_TOTAL], 1u);
}

// A slot for a block of the leader; one that was never used, if there is any.
fn leader_slot() -> u32 {
    let next_free = atomicLoad(&lru_state[LRU_NEXT_FREE]);
    if (next_free < params.slots) {
        atomicStore(&lru_state[LRU_NEXT_FREE], next_free + 1u);
        return next_free;
    }
    let slot = leader_victim();
    evict(slot);
    return slot;
}

// Whether a block is in the request table; it may be even if a look-up finds it.
fn is_requested(block: u32) -> bool {
    var place = lru_hash(block) & (lru_table_places() - 1u);
    for (var probe = 0u; probe < LRU_PROBES; probe++) {
        let found = atomicLoad(&lru_state[lru_table_word(place)]);
        if (found == 0u || found == block + 1u) {
            return found != 0u;
        }
        place = lru_next_place(place, probe);
    }
    return false;
}

fn serve_leader() -> u32 {
    let count = min(atomicLoad(&lru_state[LRU_LEADER_COUNT]), min(LRU_LEADER_CAPACITY, params.slots));
    for (var i = 0u; i < count; i++) {
        let slot = lru_lookup(leader_block(i));
        if (slot != LRU_MISSING) {
            atomicStore(&lru_state[lru_stamp_word(slot)], LRU_PINNED);
        }
    }
    var served = 0u;
    for (var i = 0u; i < count; i++) {
        let block = leader_block(i);
        if (lru_lookup(block) == LRU_MISSING) {
            // What others requested, too, is counted with the list.
            atomicAdd(&lru_state[LRU_REQUESTED_TOTAL], u32(!is_requested(block)));
            let slot = leader_slot();
            lru_insert(block, slot, LRU_PINNED);
            jobs[served] = vec2<u32>(block, slot);
            served++;
        }
    }
    // Pinned slots become slots in use, which no search takes.
    let clock = atomicLoad(&lru_state[LRU_CLOCK]);
    for (var i = 0u; i < count; i++) {
        atomicStore(&lru_state[lru_stamp_word(lru_lookup(leader_block(i)))], clock);
    }
    return served;
}

// Arguments of a dispatch with one invocation for each of `count` things.
fn write_args(place: u32, count: u32) {
    let groups = indirect_fold(indirect_div_ceil(count, 64u));
    control[3u * place] = groups.x;
    control[3u * place + 1u] = groups.y;
    control[3u * place + 2u] = groups.z;
}

@compute @workgroup_size(1)
fn main() {
    let served = serve_leader();
    atomicStore(&lru_state[LRU_JOB_COUNT], served);
    write_args(0u, lru_window());                              // search
    write_args(1u, atomicLoad(&lru_state[LRU_REQUEST_COUNT])); // assign
    write_args(2u, lru_wanted());                              // unlink
    write_args(3u, lru_requests());                            // insert
}
