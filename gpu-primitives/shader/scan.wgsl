// Exclusive sums within groups of SCAN_LANES * SCAN_ITEMS elements, in place, and the groups' totals.

#import indirect
#import scan_group

struct ScanParams {
    // Index of the count within its binding.
    count_word: u32,
    max_count: u32,
    // This level has ceil(count / 2^shift) elements.
    shift: u32,
}

@group(0) @binding(0) var<uniform> params: ScanParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> data: array<u32>;
#ifdef SCAN_ADD
@group(0) @binding(3) var<storage, read> sums: array<u32>;
#else
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;
#endif

fn scan_length() -> u32 {
    let count = min(counts[params.count_word], params.max_count);
    return indirect_div_ceil(count, 1u << params.shift);
}

#ifdef SCAN_ADD
// Adds the sum of the groups before to every element of a group.
@compute @workgroup_size(SCAN_LANES)
fn scan_add(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let length = scan_length();
    let group = indirect_linear_group(group_id, groups);
    if (group >= indirect_div_ceil(length, SCAN_LANES * SCAN_ITEMS)) {
        return;
    }
    let before = sums[group];
    let first = group * SCAN_LANES * SCAN_ITEMS + lane;
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        let index = first + item * SCAN_LANES;
        if (index < length) {
            data[index] += before;
        }
    }
}
#else
@compute @workgroup_size(SCAN_LANES)
fn scan_local(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let length = scan_length();
    let group = indirect_linear_group(group_id, groups);
    // The last row of a folded dispatch may have groups too many, whose numbers wrap at most to a
    // range that is empty here.
    let active_group = group < indirect_div_ceil(length, SCAN_LANES * SCAN_ITEMS);
    let first = (group * SCAN_LANES + lane) * SCAN_ITEMS;

    var values: array<u32, SCAN_ITEMS>;
    var own = 0u;
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        let index = first + item;
        if (active_group && index < length) {
            values[item] = data[index];
        }
        own += values[item];
    }

    let sum = scan_group(lane, own);

    var before = sum.before;
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        let index = first + item;
        if (active_group && index < length) {
            data[index] = before;
        }
        before += values[item];
    }
    // The only group of an empty scan reports its total of 0.
    if (lane == 0u && (active_group || group == 0u)) {
        sums[group] = sum.total;
    }
}
#endif
