// What the kernels of the sort share: digits of keys, and pairs per workgroup.

#import indirect
#import scan_group

const SORT_DIGITS: u32 = 16u;
const SORT_PAIRS: u32 = SCAN_LANES * SCAN_ITEMS;

struct SortParams {
    // Index of the count within its binding.
    count_word: u32,
    max_count: u32,
    // Where the digit of this pass lies in the keys.
    shift: u32,
    mask: u32,
}

fn sort_digit(params: SortParams, key: u32) -> u32 {
    return (key >> params.shift) & params.mask;
}

fn sort_groups(length: u32) -> u32 {
    return indirect_div_ceil(length, SORT_PAIRS);
}
