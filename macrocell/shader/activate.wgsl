// Active masks for one isovalue: bit x + 4y + 16z of a coarse cell's 64-bit mask is set iff the
// quantised range of that block may contain the isovalue. One workgroup per coarse cell.

#import macrocell_quantise
#import indirect

struct ActivateParams {
    page_first: u32,
    page_count: u32,
    isovalue: f32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> params: ActivateParams;
@group(0) @binding(1) var<storage, read> coarse_ranges: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read> codes: array<u32>;
@group(0) @binding(3) var<storage, read_write> masks: array<vec2<u32>>;

var<workgroup> bits: array<atomic<u32>, 2>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane < 2u) {
        atomicStore(&bits[lane], 0u);
    }
    workgroupBarrier();
    let index = indirect_linear_group(group, groups);
    if (index < params.page_count) {
        let range = coarse_ranges[params.page_first + index];
        if (range.x < params.isovalue && params.isovalue <= range.y) {
            let code = (codes[index * 32u + lane / 2u] >> ((lane & 1u) * 16u)) & 0xffffu;
            let iso = macrocell_code(params.isovalue, range.x, macrocell_scale(range.x, range.y));
            if ((code & 255u) <= iso && iso <= (code >> 8u)) {
                atomicOr(&bits[lane >> 5u], 1u << (lane & 31u));
            }
        }
    }
    workgroupBarrier();
    if (lane == 0u && index < params.page_count) {
        masks[params.page_first + index] = vec2<u32>(atomicLoad(&bits[0]), atomicLoad(&bits[1]));
    }
}
