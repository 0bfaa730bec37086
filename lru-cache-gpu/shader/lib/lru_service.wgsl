// What the kernels of the service share. Needs what lru_state asks for.
#import lru_state

// Top bit of a head whose chain has its victims taken out in this round.
const LRU_UNLINKING: u32 = 0x80000000u;

// Requests served in this round.
fn lru_requests() -> u32 {
    return min(atomicLoad(&lru_state[LRU_REQUEST_COUNT]), lru_params().request_capacity);
}

// How many of them get slots that were never used. The kernels after the leader's see the same
// numbers until the service ends.
fn lru_fresh() -> u32 {
    return min(lru_requests(), lru_params().slots - atomicLoad(&lru_state[LRU_NEXT_FREE]));
}

// Victims that the others need.
fn lru_wanted() -> u32 {
    return lru_requests() - lru_fresh();
}

// Slots that the search looks at: about twice the victims wanted, and twice as many after each search
// that found too few, so that a sweep in vain takes few rounds.
fn lru_window() -> u32 {
    let wanted = lru_wanted();
    let window = max(2u * wanted + 256u, atomicLoad(&lru_state[LRU_SWEPT]));
    return select(min(window, lru_params().slots), 0u, wanted == 0u);
}

// Victims that the search put into its list.
fn lru_found() -> u32 {
    return min(atomicLoad(&lru_state[LRU_FOUND]), lru_wanted());
}

// Requests that got a slot, once all have looked for one.
fn lru_placed() -> u32 {
    return min(atomicLoad(&lru_state[LRU_TAKEN]), lru_fresh() + lru_found());
}

// Victims that lose their block to a request.
fn lru_evicted() -> u32 {
    let placed = lru_placed();
    return placed - min(placed, lru_fresh());
}

// Slots last used before this round may be taken.
fn lru_spared_from() -> u32 {
    let frames = atomicLoad(&lru_state[LRU_SPARED_FRAMES]);
    if (frames == 2u) {
        return atomicLoad(&lru_state[LRU_PREVIOUS_FRAME_CLOCK]);
    }
    return atomicLoad(&lru_state[select(LRU_CLOCK, LRU_FRAME_CLOCK, frames == 1u)]);
}

// First link of the chain that begins with `first` once the slots without a block are taken out. No
// other invocation may walk or change the chain meanwhile.
fn lru_without_victims(first: u32) -> u32 {
    var new_first = first;
    var last_kept = 0u;
    var link = first;
    while (link != 0u) {
        let entry = lru_entry_index(link - 1u);
        let next = atomicLoad(&lru_directory[entry + LRU_NEXT]);
        if (atomicLoad(&lru_directory[entry + LRU_BLOCK]) != 0u) {
            last_kept = link;
        } else if (last_kept == 0u) {
            new_first = next;
        } else {
            atomicStore(&lru_directory[lru_entry_index(last_kept - 1u) + LRU_NEXT], next);
        }
        link = next;
    }
    return new_first;
}

// Gives a slot, which is in no chain, to a block. Any number of invocations may do so at a time, for
// different slots, if none walks a chain.
fn lru_insert(block: u32, slot: u32, stamp: u32) {
    let entry = lru_entry_index(slot);
    atomicStore(&lru_directory[entry + LRU_BLOCK], block + 1u);
    atomicStore(&lru_state[lru_stamp_word(slot)], stamp);
    let first = atomicExchange(&lru_directory[lru_head_index(block)], slot + 1u);
    atomicStore(&lru_directory[entry + LRU_NEXT], first & ~LRU_UNLINKING);
}
