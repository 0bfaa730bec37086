// Sizes of the cache.

struct LruParams {
    slots: u32,
    slots_per_page: u32,
    request_capacity: u32, // requests served in one round
    heads: u32,            // chains of the directory, a power of two
}

// What a look-up gives for a block that is not resident.
const LRU_MISSING: u32 = 0xffffffffu;
