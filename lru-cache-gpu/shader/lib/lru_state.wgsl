// Layout of the cache's state: a header, then owner and stamp of every slot, then the request list.
// The importing text declares
//   var<storage, read_write> lru_directory: array<atomic<u32>>;  one entry per block
//   var<storage, read_write> lru_state: array<atomic<u32>>;
//   fn lru_params() -> LruParams
#import lru_params

// Words of the header; those not named are spare.
const LRU_REQUEST_COUNT: u32 = 0u;  // requests of the running round, may exceed the capacity
const LRU_CLOCK: u32 = 1u;          // number of the running round, from 1
const LRU_HAND: u32 = 2u;           // slot at which the next search for victims starts
const LRU_FRAME_CLOCK: u32 = 3u;    // first round of the running frame
const LRU_SPARE_FRAME: u32 = 4u;    // 1: slots used in this frame are spared; 0: only those used in this round
const LRU_SWEPT: u32 = 5u;          // slots searched in this frame without finding enough victims
const LRU_JOB_COUNT: u32 = 6u;      // blocks to decode in this round
const LRU_LEADER_COUNT: u32 = 7u;   // blocks that the leader needs
// Counters since creation.
const LRU_REQUESTED_TOTAL: u32 = 8u;
const LRU_DECODED_TOTAL: u32 = 9u;
const LRU_EVICTED_TOTAL: u32 = 10u;
const LRU_DEFERRED_TOTAL: u32 = 11u;
const LRU_USED_TOTAL: u32 = 12u;
const LRU_LEADER: u32 = 16u;        // the leader's blocks
const LRU_LEADER_CAPACITY: u32 = 8u;
const LRU_HEADER: u32 = 24u;

// Stamp of a slot that the leader needs, while its round is served.
const LRU_PINNED: u32 = 0xffffffffu;

// 0 for a free slot, otherwise its block + 1.
fn lru_owner_word(slot: u32) -> u32 {
    return LRU_HEADER + slot;
}

// Round of the last use; 0 for a free slot.
fn lru_stamp_word(slot: u32) -> u32 {
    return LRU_HEADER + lru_params().slots + slot;
}

fn lru_request_word(index: u32) -> u32 {
    return LRU_HEADER + 2u * lru_params().slots + index;
}

// Requests in the list.
fn lru_requests() -> u32 {
    return min(atomicLoad(&lru_state[LRU_REQUEST_COUNT]), lru_params().request_capacity);
}

// Whether every block has a slot of its own: block b takes slot b, and nothing is searched or evicted.
fn lru_holds_all() -> bool {
    return lru_params().slots >= arrayLength(&lru_directory);
}

// Slots last used before this round may be taken.
fn lru_spared_from() -> u32 {
    let spare_frame = atomicLoad(&lru_state[LRU_SPARE_FRAME]) != 0u;
    return atomicLoad(&lru_state[select(LRU_CLOCK, LRU_FRAME_CLOCK, spare_frame)]);
}

// Gives `slot` to `block`; whatever it held becomes absent.
fn lru_place(block: u32, slot: u32, stamp: u32) {
    let owner = atomicLoad(&lru_state[lru_owner_word(slot)]);
    if (owner != 0u) {
        atomicStore(&lru_directory[owner - 1u], LRU_ABSENT);
        atomicAdd(&lru_state[LRU_EVICTED_TOTAL], 1u);
    }
    atomicStore(&lru_state[lru_owner_word(slot)], block + 1u);
    atomicStore(&lru_state[lru_stamp_word(slot)], stamp);
    atomicStore(&lru_directory[block], slot + LRU_FIRST_SLOT);
}
