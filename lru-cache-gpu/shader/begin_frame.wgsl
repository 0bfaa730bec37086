// A new camera or isovalue: slots used from now on are spared first, then those of the frame before.
// One invocation.
#import lru_state

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;

fn lru_params() -> LruParams {
    return params;
}

// No slot was used before round 1, so that sparing from there on spares all: do not sweep for that.
fn spared_frames(previous: u32, frame: u32) -> u32 {
    return select(select(0u, 1u, frame > 1u), 2u, previous > 1u);
}

@compute @workgroup_size(1)
fn main() {
    let clock = max(atomicLoad(&lru_state[LRU_CLOCK]), 1u);
    let frame = atomicLoad(&lru_state[LRU_FRAME_CLOCK]);
    atomicStore(&lru_state[LRU_CLOCK], clock);
    // A frame without a round is none.
    if (frame != clock) {
        atomicStore(&lru_state[LRU_PREVIOUS_FRAME_CLOCK], frame);
        atomicStore(&lru_state[LRU_FRAME_CLOCK], clock);
    }
    let previous = atomicLoad(&lru_state[LRU_PREVIOUS_FRAME_CLOCK]);
    atomicStore(&lru_state[LRU_SPARED_FRAMES], spared_frames(previous, clock));
    atomicStore(&lru_state[LRU_SWEPT], 0u);
}
