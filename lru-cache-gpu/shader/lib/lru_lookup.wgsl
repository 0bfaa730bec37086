// Looking up resident blocks without asking for any. The importing text declares
//   var<storage, read> lru_directory: array<u32>;
//   fn lru_params() -> LruParams
#import lru_directory

// Slot of a resident block, else LRU_MISSING.
fn lru_lookup(block: u32) -> u32 {
    var link = lru_directory[lru_head_index(block)];
    while (link != 0u) {
        let entry = lru_entry_index(link - 1u);
        if (lru_directory[entry + LRU_BLOCK] == block + 1u) {
            return link - 1u;
        }
        link = lru_directory[entry + LRU_NEXT];
    }
    return LRU_MISSING;
}
