// The third level's masks: bit x + 4y + 16z of a group of 4^3 coarse cells is set iff that coarse
// cell has an active block. They follow the coarse masks in the same buffer. One invocation per group.

#import indirect

struct ThirdLevelParams {
    coarse: vec3<u32>,
    coarse_count: u32,
    third: vec3<u32>,
    third_count: u32,
}

@group(0) @binding(0) var<uniform> params: ThirdLevelParams;
@group(0) @binding(1) var<storage, read_write> masks: array<vec2<u32>>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index >= params.third_count) {
        return;
    }
    let size = params.third;
    let origin = 4u * vec3<u32>(index % size.x, (index / size.x) % size.y, index / (size.x * size.y));
    var mask = vec2<u32>(0u, 0u);
    for (var bit = 0u; bit < 64u; bit++) {
        let coarse = origin + vec3<u32>(bit & 3u, (bit >> 2u) & 3u, bit >> 4u);
        if (all(coarse < params.coarse)) {
            let below = masks[coarse.x + params.coarse.x * (coarse.y + params.coarse.y * coarse.z)];
            if ((below.x | below.y) != 0u) {
                if (bit < 32u) {
                    mask.x |= 1u << bit;
                } else {
                    mask.y |= 1u << (bit - 32u);
                }
            }
        }
    }
    masks[params.coarse_count + index] = mask;
}
