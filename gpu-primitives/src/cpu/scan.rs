//! Twin of the scan.

/// Replaces `data` by its exclusive prefix sums and gives the total, both modulo 2^32.
pub fn exclusive_scan(data: &mut [u32]) -> u32 {
    let mut sum = 0u32;
    for value in data {
        let next = sum.wrapping_add(*value);
        *value = sum;
        sum = next;
    }
    sum
}
