// How often each digit occurs in each workgroup's keys, all workgroups of a digit side by side, so
// that the exclusive sums over everything say where each workgroup's pairs of a digit go.

#import sort

@group(0) @binding(0) var<uniform> params: SortParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read> source_keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;

// Starts as zeros, as all workgroup memory.
var<workgroup> sort_occurrences: array<atomic<u32>, SORT_DIGITS>;

@compute @workgroup_size(SCAN_LANES)
fn sort_count(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups_of_dispatch: vec3<u32>,
) {
    let group = indirect_linear_group(group_id, groups_of_dispatch);
    let length = min(counts[params.count_word], params.max_count);
    let groups = sort_groups(length);
    let first = (group * SCAN_LANES + lane) * SCAN_ITEMS;

    // Groups too many of a folded dispatch have no pairs.
    if (group < groups) {
        // Equal digits in a row cost one addition: neighbouring rays often meet the same block.
        var digit = 0u;
        var run = 0u;
        for (var item = 0u; item < SCAN_ITEMS; item++) {
            let index = first + item;
            if (index < length) {
                let next = sort_digit(params, source_keys[index]);
                if (next != digit && run > 0u) {
                    atomicAdd(&sort_occurrences[digit], run);
                    run = 0u;
                }
                digit = next;
                run += 1u;
            }
        }
        if (run > 0u) {
            atomicAdd(&sort_occurrences[digit], run);
        }
    }
    workgroupBarrier();
    if (lane < SORT_DIGITS && group < groups) {
        sums[lane * groups + group] = atomicLoad(&sort_occurrences[lane]);
    }
}
