// Plays a list of uses of a cache: one invocation for all in order, or one invocation each.
#import lru_request

struct ScriptParams {
    lru: LruParams,
    ops: u32,
    in_order: u32,
    leader_blocks: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: ScriptParams;
@group(0) @binding(1) var<storage, read_write> lru_directory: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> lru_state: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> script: array<u32>;
@group(0) @binding(4) var<storage, read_write> slots_found: array<u32>;

const OP_USE: u32 = 0u;
const OP_REQUEST: u32 = 1u;
const OP_TOUCH: u32 = 2u;
const OP_REQUEST_BLINDLY: u32 = 4u;

fn lru_params() -> LruParams {
    return params.lru;
}

fn play(index: u32) {
    let kind = script[8u + index] >> 29u;
    let block = script[8u + index] & 0x1fffffffu;
    let slot = lru_lookup(block);
    slots_found[index] = slot;
    let missing = slot == LRU_MISSING;
    if (!missing && (kind == OP_USE || kind == OP_TOUCH)) {
        lru_touch(slot);
    }
    if ((missing && (kind == OP_USE || kind == OP_REQUEST)) || kind == OP_REQUEST_BLINDLY) {
        lru_request(block);
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x == 0u) {
        for (var i = 0u; i < params.leader_blocks; i++) {
            lru_lead(i, script[i]);
        }
    }
    if (params.in_order == 0u && id.x < params.ops) {
        play(id.x);
    }
    if (params.in_order != 0u && id.x == 0u) {
        for (var i = 0u; i < params.ops; i++) {
            play(i);
        }
    }
}
