// Marking slots as used. The importing text declares
//   var<storage, read_write> lru_state: array<atomic<u32>>;
//   fn lru_params() -> LruParams
#import lru_state

// Keeps the slot for the rest of this round and marks it as used, which counts once per round.
fn lru_touch(slot: u32) {
    let clock = atomicLoad(&lru_state[LRU_CLOCK]);
    if (atomicLoad(&lru_state[lru_stamp_word(slot)]) != clock
        && atomicExchange(&lru_state[lru_stamp_word(slot)], clock) != clock) {
        atomicAdd(&lru_state[LRU_USED_TOTAL], 1u);
    }
}

// Whether uses count for lru_keep in this invocation.
var<private> lru_uses_count: bool;

// To be called before lru_keep. As long as a quarter of the slots has never been used, nothing will be evicted in
// this round, and most caches stay that empty: what was used when does not matter.
fn lru_begin_keeping() {
    let slots = lru_params().slots;
    lru_uses_count = atomicLoad(&lru_state[LRU_NEXT_FREE]) + slots / 4u >= slots;
}

// Like lru_touch where slots are short.
fn lru_keep(slot: u32) {
    if (lru_uses_count) {
        lru_touch(slot);
    }
}
