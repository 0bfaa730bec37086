// The kernels around the two ways of grouping.

#import indirect

#ifdef GROUPING_BOUNDS
@group(0) @binding(0) var<storage, read> counts: array<u32>;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> ends: array<u32>;
#else
@group(0) @binding(0) var<storage, read> counts: array<u32>;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> ends: array<atomic<u32>>;
#ifdef GROUPING_SCATTER
@group(0) @binding(3) var<storage, read> values: array<u32>;
@group(0) @binding(4) var<storage, read_write> grouped: array<u32>;
#endif
#endif

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    let count = counts[0];
    if (index >= count) {
        return;
    }
    let key = keys[index];
#ifdef GROUPING_BOUNDS
    // After the sort: the end of every group that has pairs.
    if (index + 1u == count || keys[min(index + 1u, count - 1u)] != key) {
        ends[key] = index + 1u;
    }
#else
#ifdef GROUPING_SCATTER
    // Before, where each group begins; after all pairs are placed, where it ends.
    grouped[atomicAdd(&ends[key], 1u)] = values[index];
#else
    atomicAdd(&ends[key], 1u);
#endif
#endif
}
