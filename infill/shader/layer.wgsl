// A convolution of the network's coarser levels, with its ReLU, over the tiles of a list.
#import infill_params
#import conv
#import indirect

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> inputs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec2<u32>>;
#ifdef JOINED
@group(0) @binding(5) var<storage, read> coarser: array<vec2<u32>>;
#endif

// Size of the map at this level: 1 for halves, 2 for quarters.
fn map_size(level: u32) -> vec2<u32> {
    return params.padded >> vec2<u32>(level);
}

fn texel_of(map: vec2<u32>, texel: vec2<u32>, groups: u32) -> u32 {
    return groups * (texel.x + map.x * texel.y);
}

fn conv_input(texel: vec2<i32>, group: u32) -> vec4<f32> {
    let own = vec2<u32>(texel);
#ifdef POOLED
    // The average of 2x2 texels of the finer level.
    let finer = map_size(LEVEL - 1u);
    let first = texel_of(finer, 2u * own, CONV_IN) + group;
    let below = first + CONV_IN * finer.x;
    let upper = conv_unpack(inputs[first]) + conv_unpack(inputs[first + CONV_IN]);
    let lower = conv_unpack(inputs[below]) + conv_unpack(inputs[below + CONV_IN]);
    return 0.25 * (upper + lower);
#else
#ifdef JOINED
    // Own channels, then those of the coarser level.
    if (group >= OWN_GROUPS) {
        let size = map_size(LEVEL + 1u);
        let groups = CONV_IN - OWN_GROUPS;
        let place = conv_enlarged(texel, size);
        let x = vec2<i32>(place.first.x, place.second.x);
        let y = vec2<i32>(place.first.y, place.second.y);
        let a = conv_unpack(coarser[texel_of(size, vec2<u32>(vec2<i32>(x.x, y.x)), groups) + group - OWN_GROUPS]);
        let b = conv_unpack(coarser[texel_of(size, vec2<u32>(vec2<i32>(x.y, y.x)), groups) + group - OWN_GROUPS]);
        let c = conv_unpack(coarser[texel_of(size, vec2<u32>(vec2<i32>(x.x, y.y)), groups) + group - OWN_GROUPS]);
        let d = conv_unpack(coarser[texel_of(size, vec2<u32>(vec2<i32>(x.y, y.y)), groups) + group - OWN_GROUPS]);
        let upper = a * (1.0 - place.share.x) + b * place.share.x;
        let lower = c * (1.0 - place.share.x) + d * place.share.x;
        return upper * (1.0 - place.share.y) + lower * place.share.y;
    }
    return conv_unpack(inputs[texel_of(map_size(LEVEL), own, OWN_GROUPS) + group]);
#else
    return conv_unpack(inputs[texel_of(map_size(LEVEL), own, CONV_IN) + group]);
#endif
#endif
}

@compute @workgroup_size(CONV_LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    let listed = index < tiles[LIST];
    let tile = tiles[infill_list_word(params, LIST, select(0u, index, listed))];
    let corner = infill_tile_corner(params, tile) >> vec2<u32>(LEVEL);
    let size = map_size(LEVEL);
    conv_load(corner, size, lane);
    for (var i = lane; i < CONV_EDGE * CONV_EDGE * CONV_OUT; i += CONV_LANES) {
        let output = i % CONV_OUT;
        let place = i / CONV_OUT;
        let inside = vec2<u32>(place % CONV_EDGE, place / CONV_EDGE);
        let texel = corner + inside;
        if (listed && all(texel < size)) {
            let value = max(conv_output(inside, output), vec4<f32>(0.0));
            outputs[texel_of(size, texel, CONV_OUT) + output] = conv_pack(value);
        }
    }
}
