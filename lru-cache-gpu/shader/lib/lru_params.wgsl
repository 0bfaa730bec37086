// Sizes of the cache and the entries of its directory.

struct LruParams {
    slots: u32,
    slots_per_page: u32,
    request_capacity: u32,
    window_capacity: u32,
}

// Directory entries: absent, requested, or a slot + LRU_FIRST_SLOT.
const LRU_ABSENT: u32 = 0u;
const LRU_REQUESTED: u32 = 1u;
const LRU_FIRST_SLOT: u32 = 2u;

// What a look-up gives for a block that is not resident.
const LRU_MISSING: u32 = 0xffffffffu;
