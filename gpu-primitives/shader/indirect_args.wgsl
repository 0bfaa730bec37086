#import indirect

struct IndirectArgsParams {
    count_word: u32,
    args_word: u32,
    sets: u32,
    max_count: u32,
    per_group: vec4<u32>,
}

@group(0) @binding(0) var<uniform> params: IndirectArgsParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> arguments: array<u32>;

@compute @workgroup_size(4)
fn indirect_args(@builtin(local_invocation_index) slot: u32) {
    if (slot >= params.sets) {
        return;
    }
    let count = min(counts[params.count_word], params.max_count);
    let groups = indirect_div_ceil(count, params.per_group[slot]);
    let folded = indirect_fold(groups);
    let first = params.args_word + 3u * slot;
    arguments[first] = folded.x;
    arguments[first + 1u] = folded.y;
    arguments[first + 2u] = folded.z;
}
