// Using, asking for and reserving blocks from a walking ray. Needs what lru_state asks for.
#import lru_state

// Slot of a resident block, else LRU_MISSING.
fn lru_lookup(block: u32) -> u32 {
    let entry = atomicLoad(&lru_directory[block]);
    return select(LRU_MISSING, entry - LRU_FIRST_SLOT, entry >= LRU_FIRST_SLOT);
}

// Keeps the slot for the rest of this round and marks it as used, which counts once per round.
fn lru_touch(slot: u32) {
    let clock = atomicLoad(&lru_state[LRU_CLOCK]);
    if (atomicLoad(&lru_state[lru_stamp_word(slot)]) != clock
        && atomicExchange(&lru_state[lru_stamp_word(slot)], clock) != clock) {
        atomicAdd(&lru_state[LRU_USED_TOTAL], 1u);
    }
}

// Asks for an absent block, once however many rays ask. A request may fail (list full, or the weak
// exchange failed for no reason): a ray that needs the block asks again in the next round.
fn lru_request(block: u32) {
    if (atomicLoad(&lru_directory[block]) != LRU_ABSENT) {
        return;
    }
    if (!atomicCompareExchangeWeak(&lru_directory[block], LRU_ABSENT, LRU_REQUESTED).exchanged) {
        return;
    }
    let index = atomicAdd(&lru_state[LRU_REQUEST_COUNT], 1u);
    if (index < lru_params().request_capacity) {
        atomicStore(&lru_state[lru_request_word(index)], block);
    } else {
        atomicStore(&lru_directory[block], LRU_ABSENT);
    }
}

// Says what the leader, one ray chosen by the caller, needs next: at most LRU_LEADER_CAPACITY
// blocks, resident ones included. They are resident after the round, whatever else was asked for.
fn lru_lead(index: u32, block: u32) {
    atomicStore(&lru_state[LRU_LEADER + index], block);
    atomicStore(&lru_state[LRU_LEADER_COUNT], index + 1u);
}
