// A layer of the published network: a 3x3 convolution, zero beyond the edges, and its ReLU. A workgroup makes four
// channels of 8x8 texels.
#import published_layer

@group(0) @binding(0) var<uniform> layer: PublishedLayer;
// Per group of outputs and group of inputs 9 taps of 4 columns, one per input; then the biases.
@group(0) @binding(1) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> made: array<vec4<f32>>;
#ifdef PICTURE
@group(0) @binding(3) var color: texture_2d<f32>;
@group(0) @binding(4) var status: texture_2d<u32>;
#else
@group(0) @binding(3) var<storage, read> source: array<vec4<f32>>;
#endif
#ifdef ENLARGED
@group(0) @binding(4) var<storage, read> skip: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> state: array<vec4<f32>>;
#endif

#ifdef PICTURE
// How the published renderer shows pixels that are not known yet.
const UNFINISHED_COLOR: vec4<f32> = vec4<f32>(1.0, 0.0, 0.0, 0.0);
const STATUS_UNFINISHED: u32 = 2u;
#endif

fn input(texel: vec2<u32>, group: u32) -> vec4<f32> {
#ifdef PICTURE
    if (any(texel >= layer.picture)) {
        return vec4<f32>(0.0);
    }
    let shown = vec4<f32>(textureLoad(color, texel, 0).rgb, 0.0);
    return select(shown, UNFINISHED_COLOR, textureLoad(status, texel, 0).r == STATUS_UNFINISHED);
#else
#ifdef POOLED
    return source_pooled(texel, group);
#else
#ifdef ENLARGED
    if (group < layer.skip_inputs) {
        return skip[map_index(texel, group, layer.size)];
    }
    let low_group = group - layer.skip_inputs;
    if (low_group < layer.low_inputs) {
        return source_enlarged(texel, low_group);
    }
    return state[map_index(texel, low_group - layer.low_inputs, layer.size)];
#else
    return source[map_index(texel, group, layer.size)];
#endif
#endif
#endif
}

@compute @workgroup_size(8, 8)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = indirect_linear_group(group, groups);
    if (number >= layer.tiles * layer.outputs) {
        return;
    }
    let made_group = number / layer.tiles;
    let origin = tile_origin(number % layer.tiles);
    var sum = weights[layer.weights + 36u * layer.inputs * layer.outputs + made_group];
    for (var read_group = 0u; read_group < layer.inputs; read_group++) {
        for (var i = lane; i < TILE_TEXELS; i += LANES) {
            let texel = tile_texel(origin, i);
            tile[i] = vec4<f32>(0.0);
            if (all(texel < layer.size)) {
                tile[i] = input(texel, read_group);
            }
        }
        workgroupBarrier();
        var weight = layer.weights + 36u * (made_group * layer.inputs + read_group);
        for (var tap = 0u; tap < 9u; tap++) {
            let value = tile[tile_index(local.xy, tap)];
            sum += weights[weight] * value.x + weights[weight + 1u] * value.y
                + weights[weight + 2u] * value.z + weights[weight + 3u] * value.w;
            weight += 4u;
        }
        workgroupBarrier();
    }
    let texel = origin + local.xy;
    if (all(texel < layer.size)) {
        made[map_index(texel, made_group, layer.size)] = max(sum, vec4<f32>(0.0));
    }
}
