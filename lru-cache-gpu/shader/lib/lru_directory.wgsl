// Layout of the directory, a hash table with a chain of slots for every head: first the heads, then
// two words for each slot. A link is 0 at a chain's end, otherwise a slot + 1; a head is the first
// link of its chain. The importing text declares
//   fn lru_params() -> LruParams
#import lru_params

// Words of a slot's entry.
const LRU_BLOCK: u32 = 0u; // block + 1; 0 for a slot without a block
const LRU_NEXT: u32 = 1u;  // link to the next slot of the chain
const LRU_ENTRY_WORDS: u32 = 2u;

// MurmurHash3's finalizer: blocks that are neighbours on any axis fall anywhere.
fn lru_hash(block: u32) -> u32 {
    var h = block;
    h ^= h >> 16u;
    h *= 0x85ebca6bu;
    h ^= h >> 13u;
    h *= 0xc2b2ae35u;
    return h ^ (h >> 16u);
}

// Index of the head of a block's chain.
fn lru_head_index(block: u32) -> u32 {
    return lru_hash(block) & (lru_params().heads - 1u);
}

// Index of the first word of a slot's entry.
fn lru_entry_index(slot: u32) -> u32 {
    return lru_params().heads + LRU_ENTRY_WORDS * slot;
}
