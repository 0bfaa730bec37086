// Using, asking for and reserving blocks from a walking ray. Needs what lru_state asks for.
#import lru_keep

// Slot of a resident block, else LRU_MISSING.
fn lru_lookup(block: u32) -> u32 {
    var link = atomicLoad(&lru_directory[lru_head_index(block)]);
    while (link != 0u) {
        let entry = lru_entry_index(link - 1u);
        if (atomicLoad(&lru_directory[entry + LRU_BLOCK]) == block + 1u) {
            return link - 1u;
        }
        link = atomicLoad(&lru_directory[entry + LRU_NEXT]);
    }
    return LRU_MISSING;
}

// Asks for a block that a look-up did not find, once however many rays ask: the first one puts it into
// the request table. All try a block's places in the same order, and what a place holds stays until
// the round is served. So a block stands in one place at most: whoever put it further on saw every
// place before that taken by another block.
//
// A request may fail: all places taken, the list full, or the weak exchange failed for no reason. Going
// on after such a failure could put the block into two places, and trying for ever would rely on
// others. Nobody waits: a ray that needs the block asks again in the next round.
fn lru_request(block: u32) {
    var place = lru_hash(block) & (lru_table_places() - 1u);
    for (var probe = 0u; probe < LRU_PROBES; probe++) {
        let word = lru_table_word(place);
        var found = atomicLoad(&lru_state[word]);
        if (found == 0u) {
            if (atomicLoad(&lru_state[LRU_REQUEST_COUNT]) >= lru_params().request_capacity) {
                return;
            }
            let claim = atomicCompareExchangeWeak(&lru_state[word], 0u, block + 1u);
            if (claim.exchanged) {
                let index = atomicAdd(&lru_state[LRU_REQUEST_COUNT], 1u);
                atomicStore(&lru_state[lru_request_word(index)], place);
                return;
            }
            found = claim.old_value;
        }
        if (found == 0u || found == block + 1u) {
            return;
        }
        place = lru_next_place(place, probe);
    }
}

// Says what the leader, one ray chosen by the caller, needs next: at most LRU_LEADER_CAPACITY
// blocks, resident ones included. They are resident after the round, whatever else was asked for.
fn lru_lead(index: u32, block: u32) {
    atomicStore(&lru_state[LRU_LEADER + index], block);
    atomicStore(&lru_state[LRU_LEADER_COUNT], index + 1u);
}
