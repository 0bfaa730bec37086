//! Twin of the indirect arguments.

/// Workgroups per dimension, see [`crate::indirect::fold`].
#[must_use]
pub fn fold(groups: u64) -> [u32; 3] {
    crate::indirect::fold_rows(groups)
}

/// Arguments for `count` elements with `per_group` of them in a workgroup (0 counts as 1).
#[must_use]
pub fn args(count: u32, per_group: u32) -> [u32; 3] {
    fold(u64::from(count.div_ceil(per_group.max(1))))
}
