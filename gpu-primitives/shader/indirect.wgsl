// Dispatches of more workgroups than one dimension takes: equal rows, numbered row by row.

const INDIRECT_MAX_GROUPS: u32 = 65535u;

// Number of this workgroup; group is workgroup_id, groups is num_workgroups.
fn indirect_linear_group(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.x + groups.x * (group.y + groups.y * group.z);
}

// ceil(count / size) without overflow; size > 0.
fn indirect_div_ceil(count: u32, size: u32) -> u32 {
    return count / size + select(0u, 1u, count % size != 0u);
}

// Workgroups per dimension for this many workgroups; (0, 1, 1) for none.
fn indirect_fold(groups: u32) -> vec3<u32> {
    let rows = clamp(indirect_div_ceil(groups, INDIRECT_MAX_GROUPS), 1u, INDIRECT_MAX_GROUPS);
    let columns = min(indirect_div_ceil(groups, rows), INDIRECT_MAX_GROUPS);
    return vec3<u32>(columns, rows, 1u);
}
