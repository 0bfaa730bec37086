//! Twin of the sort.

/// The pairs in order of the lowest `key_bits` bits of their keys, pairs that agree in these in
/// the order they came in; the shorter slice decides the length.
#[must_use]
pub fn sort(keys: &[u32], values: &[u32], key_bits: u32) -> (Vec<u32>, Vec<u32>) {
    let mask = 1u32.checked_shl(key_bits).map_or(u32::MAX, |bound| bound - 1);
    let mut pairs: Vec<(u32, u32)> = keys.iter().copied().zip(values.iter().copied()).collect();
    pairs.sort_by_key(|&(key, _)| key & mask);
    pairs.into_iter().unzip()
}
