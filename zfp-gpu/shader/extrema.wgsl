// Least and greatest samples of the blocks of a region, in eight classes, one invocation per block.

#import indirect
#import zfp_block

struct ExtremaParams {
    // First block of the region, in block coordinates; w: unused.
    origin: vec4<u32>,
    // Blocks of the region per axis; w: number of them.
    size: vec4<u32>,
    // Samples of the volume per axis; w: unused.
    dims: vec4<u32>,
}

@group(0) @binding(0) var<uniform> page: ZfpPage;
@group(0) @binding(1) var<uniform> params: ExtremaParams;
@group(0) @binding(2) var<storage, read> payload: array<u32>;
// (min, max) of kind c of the region's block e at element e * 8 + c.
@group(0) @binding(3) var<storage, read_write> extrema: array<vec2<f32>>;

const EXTREMA_LARGEST: f32 = 3.40282346638528859812e38f;

fn zfp_word(index: u32) -> u32 {
    return payload[index];
}

@compute @workgroup_size(BLOCKS_PER_GROUP)
fn block_extrema(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let element = indirect_linear_group(group, groups) * BLOCKS_PER_GROUP + lane;
    if element >= min(params.size.w, arrayLength(&extrema) / 8u) {
        return;
    }
    let row = element / params.size.x;
    let local = vec3<u32>(element % params.size.x, row % params.size.y, row / params.size.y);
    let blocks = (params.dims.xyz - 1u) / 4u + 1u;
    // Written so that origins near the largest u32 do not wrap into the volume.
    if any(params.origin.xyz >= blocks) || any(local >= blocks - params.origin.xyz) {
        return;
    }
    let position = params.origin.xyz + local;
    let block = position.x + blocks.x * (position.y + blocks.y * position.z) - page.first_block;
    if block >= page.blocks {
        return;
    }
    var integers: array<i32, 64>;
    let scale = zfp_decode_block(zfp_locate(page, block), page.bits_per_block, &integers);
    let extent = min(params.dims.xyz - 4u * position, vec3<u32>(4u));

    var found: array<vec2<f32>, 8>;
    for (var kind = 0u; kind < 8u; kind++) {
        found[kind] = vec2<f32>(EXTREMA_LARGEST, -EXTREMA_LARGEST);
    }
    for (var i = 0u; i < 64u; i++) {
        let at = vec3<u32>(i & 3u, (i >> 2u) & 3u, i >> 4u);
        if any(at >= extent) {
            continue;
        }
        let value = zfp_value(integers[i], scale);
        let zero = vec3<u32>(at == vec3<u32>(0u));
        let faces = zero.x | (zero.y << 1u) | (zero.z << 2u);
        for (var kind = 0u; kind < 8u; kind++) {
            if (kind & ~faces) == 0u {
                found[kind] = vec2<f32>(min(found[kind].x, value), max(found[kind].y, value));
            }
        }
    }
    for (var kind = 0u; kind < 8u; kind++) {
        extrema[element * 8u + kind] = found[kind];
    }
}
