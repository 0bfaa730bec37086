// A new camera or isovalue: slots used from now on are spared first. One invocation.
#import lru_state

@group(0) @binding(0) var<uniform> params: LruParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;

fn lru_params() -> LruParams {
    return params;
}

@compute @workgroup_size(1)
fn main() {
    let clock = max(atomicLoad(&lru_state[LRU_CLOCK]), 1u);
    atomicStore(&lru_state[LRU_CLOCK], clock);
    atomicStore(&lru_state[LRU_FRAME_CLOCK], clock);
    atomicStore(&lru_state[LRU_SPARE_FRAME], 1u);
    atomicStore(&lru_state[LRU_SWEPT], 0u);
}
