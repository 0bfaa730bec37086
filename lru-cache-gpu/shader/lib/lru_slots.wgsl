// Samples of resident blocks. The importing text declares lru_slots_0 and, with the constants
// LRU_PAGES_2 to LRU_PAGES_4, lru_slots_1 to lru_slots_3, each
//   var<storage, read> lru_slots_0: array<f32>;
// and fn lru_slots_per_page() -> u32.

// Sample x + 4y + 16z of the block in `slot`.
fn lru_sample(slot: u32, offset: u32) -> f32 {
#ifdef LRU_PAGES_2
    // A power of two where there is more than one page.
    let per_page = lru_slots_per_page();
    let page = slot >> countTrailingZeros(per_page);
    let index = (slot & (per_page - 1u)) * 64u + offset;
    if (page == 0u) {
        return lru_slots_0[index];
    }
#ifdef LRU_PAGES_3
    if (page == 2u) {
        return lru_slots_2[index];
    }
#endif
#ifdef LRU_PAGES_4
    if (page == 3u) {
        return lru_slots_3[index];
    }
#endif
    return lru_slots_1[index];
#else
    return lru_slots_0[slot * 64u + offset];
#endif
}
