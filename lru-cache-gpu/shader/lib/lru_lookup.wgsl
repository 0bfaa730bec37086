// Looking up resident blocks without asking for any. The importing text declares
//   var<storage, read> lru_directory: array<u32>;
// A block that is not resident gives LRU_MISSING.

const LRU_MISSING: u32 = 0xffffffffu;

fn lru_lookup(block: u32) -> u32 {
    let entry = lru_directory[block];
    return select(LRU_MISSING, entry - 2u, entry >= 2u);
}
