// Order-preserving compaction: numbers of kept elements per group, and, once these are scanned,
// the kept values themselves.

#import indirect
#import scan_group

struct CompactParams {
    // Index of the count within its binding.
    count_word: u32,
    max_count: u32,
}

@group(0) @binding(0) var<uniform> params: CompactParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read> kept_flags: array<u32>;
#ifdef COMPACT_SCATTER
@group(0) @binding(3) var<storage, read> sums: array<u32>;
@group(0) @binding(4) var<storage, read> source_values: array<u32>;
@group(0) @binding(5) var<storage, read_write> kept_values: array<u32>;
#else
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;
#endif

fn compact_length() -> u32 {
    return min(counts[params.count_word], params.max_count);
}

fn compact_kept(index: u32, length: u32) -> bool {
    return index < length && kept_flags[min(index, length - 1u)] != 0u;
}

@compute @workgroup_size(SCAN_LANES)
#ifdef COMPACT_SCATTER
fn compact_scatter(
#else
fn compact_count(
#endif
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let group = indirect_linear_group(group_id, groups);
    // Groups too many of a folded dispatch have no elements.
    let full_length = compact_length();
    let active_group = group < indirect_div_ceil(full_length, SCAN_LANES * SCAN_ITEMS);
    let length = select(0u, full_length, active_group);
    let first = (group * SCAN_LANES + lane) * SCAN_ITEMS;

    var own = 0u;
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        own += select(0u, 1u, compact_kept(first + item, length));
    }
    let sum = scan_group(lane, own);
#ifdef COMPACT_SCATTER
    if (own == 0u) {
        return;
    }
    var to = sums[group] + sum.before;
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        if (compact_kept(first + item, length)) {
            kept_values[to] = source_values[first + item];
            to += 1u;
        }
    }
#else
    if (lane == 0u && active_group) {
        sums[group] = sum.total;
    }
#endif
}
