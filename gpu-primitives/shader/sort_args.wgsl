// Workgroups for the pairs that there are, and how many counts these workgroups have together.

#import sort

@group(0) @binding(0) var<uniform> params: SortParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read_write> arguments: array<u32>;

@compute @workgroup_size(1)
fn sort_args() {
    let groups = sort_groups(min(counts[params.count_word], params.max_count));
    let folded = indirect_fold(groups);
    arguments[0] = folded.x;
    arguments[1] = folded.y;
    arguments[2] = folded.z;
    arguments[3] = groups * SORT_DIGITS;
}
