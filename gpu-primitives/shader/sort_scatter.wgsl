// Moves the pairs to their places: where the workgroup's pairs of a digit go, plus the pair's rank
// among them.

#import sort

@group(0) @binding(0) var<uniform> params: SortParams;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read> source_keys: array<u32>;
@group(0) @binding(3) var<storage, read> source_values: array<u32>;
@group(0) @binding(4) var<storage, read> sums: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_keys: array<u32>;
@group(0) @binding(6) var<storage, read_write> sorted_values: array<u32>;

const SORT_HALF: u32 = SORT_DIGITS / 2u;

// Per digit and lane: occurrences of the digit in the lane's keys, then their sums over the digits
// and lanes before, of which only differences within a digit matter. Two digits to a word, those of
// the upper half in the high 16 bits: a workgroup has fewer than 65536 pairs. Starts as zeros, as
// all workgroup memory.
var<workgroup> sort_ranks: array<u32, SORT_HALF * SCAN_LANES>;
// What to add to such a sum for a place among all pairs, per digit.
var<workgroup> sort_starts: array<u32, SORT_DIGITS>;

fn sort_word(digit: u32, lane: u32) -> u32 {
    return (digit % SORT_HALF) * SCAN_LANES + lane;
}

fn sort_half_shift(digit: u32) -> u32 {
    return 16u * (digit / SORT_HALF);
}

fn sort_rank(digit: u32, lane: u32) -> u32 {
    return (sort_ranks[sort_word(digit, lane)] >> sort_half_shift(digit)) & 0xFFFFu;
}

// Occurrences become exclusive sums, digit by digit and lane by lane. All invocations call this.
fn sort_sum_ranks(lane: u32) {
    let first = lane * SORT_HALF;
    var own = 0u;
    for (var i = 0u; i < SORT_HALF; i++) {
        own += sort_ranks[first + i];
    }
    let sum = scan_group(lane, own);
    var before = sum.before;
    for (var i = 0u; i < SORT_HALF; i++) {
        let word = sort_ranks[first + i];
        sort_ranks[first + i] = before;
        before += word;
    }
}

@compute @workgroup_size(SCAN_LANES)
fn sort_scatter(
    @builtin(local_invocation_index) lane: u32,
    @builtin(workgroup_id) group_id: vec3<u32>,
    @builtin(num_workgroups) groups_of_dispatch: vec3<u32>,
) {
    let group = indirect_linear_group(group_id, groups_of_dispatch);
    let full_length = min(counts[params.count_word], params.max_count);
    let groups = sort_groups(full_length);
    // Groups too many of a folded dispatch have no pairs.
    let active_group = group < groups;
    let length = select(0u, full_length, active_group);
    let first = (group * SCAN_LANES + lane) * SCAN_ITEMS;

    var keys: array<u32, SCAN_ITEMS>;
    // Rank of each key among the lane's own keys with the same digit.
    var own_ranks: array<u32, SCAN_ITEMS>;
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        if (first + item < length) {
            keys[item] = source_keys[first + item];
            let digit = sort_digit(params, keys[item]);
            own_ranks[item] = sort_rank(digit, lane);
            sort_ranks[sort_word(digit, lane)] += 1u << sort_half_shift(digit);
        }
    }
    workgroupBarrier();
    sort_sum_ranks(lane);
    workgroupBarrier();
    if (lane < SORT_DIGITS && active_group) {
        sort_starts[lane] = sums[lane * groups + group] - sort_rank(lane, 0u);
    }
    workgroupBarrier();
    for (var item = 0u; item < SCAN_ITEMS; item++) {
        if (first + item < length) {
            let digit = sort_digit(params, keys[item]);
            let to = sort_starts[digit] + sort_rank(digit, lane) + own_ranks[item];
            sorted_keys[to] = keys[item];
            sorted_values[to] = source_values[first + item];
        }
    }
}
