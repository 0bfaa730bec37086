// Layout of the cache's state: a header, then the stamp of every slot, the request list and the
// request table. The importing text declares
//   var<storage, read_write> lru_directory: array<atomic<u32>>;
//   var<storage, read_write> lru_state: array<atomic<u32>>;
//   fn lru_params() -> LruParams
#import lru_directory

// Words of the header.
const LRU_REQUEST_COUNT: u32 = 0u;  // requests of the running round, may exceed the capacity
const LRU_CLOCK: u32 = 1u;          // number of the running round, from 1
const LRU_HAND: u32 = 2u;           // slot at which the next search for victims starts
const LRU_FRAME_CLOCK: u32 = 3u;    // first round of the running frame
const LRU_PREVIOUS_FRAME_CLOCK: u32 = 4u; // first round of the frame before
const LRU_SPARED_FRAMES: u32 = 5u;  // frames whose slots are spared: 2, 1, or 0 for this round's only
const LRU_JOB_COUNT: u32 = 6u;      // blocks to decode in this round; the leader's until the service ends
const LRU_LEADER_COUNT: u32 = 7u;   // blocks that the leader needs
// Counters since creation.
const LRU_REQUESTED_TOTAL: u32 = 8u;
const LRU_DECODED_TOTAL: u32 = 9u;
const LRU_EVICTED_TOTAL: u32 = 10u;
const LRU_DEFERRED_TOTAL: u32 = 11u;
const LRU_USED_TOTAL: u32 = 12u;
const LRU_SWEPT: u32 = 13u;         // slots searched since a search last found enough victims
const LRU_NEXT_FREE: u32 = 14u;     // slots given away so far: those from here on were never used
const LRU_FOUND: u32 = 15u;         // victims found in this round, may exceed those wanted
const LRU_LEADER: u32 = 16u;        // the leader's blocks
const LRU_TAKEN: u32 = 24u;         // requests of this round that a slot was looked for
const LRU_HEADER: u32 = 25u;
const LRU_LEADER_CAPACITY: u32 = 8u;

// Stamp of a slot that the leader needs, while its round is served.
const LRU_PINNED: u32 = 0xffffffffu;

// Places of the request table that one block may take. At most about half of the table is taken, so
// a look ends after two places on average, and one request in 2^32 fails. With 8 places, one in 256
// would, and rays would wait a round longer for no good reason.
const LRU_PROBES: u32 = 32u;

// Round of the last use; 0 for a slot that was never used.
fn lru_stamp_word(slot: u32) -> u32 {
    return LRU_HEADER + slot;
}

// Places of the request table: the power of two from twice the request capacity on. The list is as
// long, so that it has room for whatever is in the table.
fn lru_table_places() -> u32 {
    return 1u << (32u - countLeadingZeros(2u * lru_params().request_capacity - 1u));
}

// Holds the place of a request in the table.
fn lru_request_word(index: u32) -> u32 {
    return LRU_HEADER + lru_params().slots + index;
}

// Holds a requested block + 1, or 0.
fn lru_table_word(place: u32) -> u32 {
    return LRU_HEADER + lru_params().slots + lru_table_places() + place;
}

// The place to look at after `probe` others: steps of 1, 2, 3 and so on.
fn lru_next_place(place: u32, probe: u32) -> u32 {
    return (place + probe + 1u) & (lru_table_places() - 1u);
}
