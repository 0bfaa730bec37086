// Looking up resident blocks without asking for any. The importing text declares
//   var<storage, read> lru_directory: array<u32>;
#import lru_params

// Slot of a resident block, else LRU_MISSING.
fn lru_lookup(block: u32) -> u32 {
    let entry = lru_directory[block];
    return select(LRU_MISSING, entry - LRU_FIRST_SLOT, entry >= LRU_FIRST_SLOT);
}
