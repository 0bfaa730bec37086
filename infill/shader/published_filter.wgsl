// A filter of the published network: every texel's own 3x3 kernel, predicted from its features, over a picture; on the
// way up with a tenth tap on the picture of the way down. A workgroup makes 8x8 texels.
#import published_layer

@group(0) @binding(0) var<uniform> layer: PublishedLayer;
// Per feature 12 taps, the last of them unused; then 12 biases.
@group(0) @binding(1) var<storage, read> weights: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> made: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> features: array<vec4<f32>>;
#ifdef POOLED
@group(0) @binding(4) var<storage, read> source: array<vec4<f32>>;
#endif
#ifdef ENLARGED
@group(0) @binding(4) var<storage, read> source: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> same_level: array<vec4<f32>>;
#endif
#ifdef PASTE
@group(0) @binding(6) var color: texture_2d<f32>;
@group(0) @binding(7) var status: texture_2d<u32>;

const STATUS_UNFINISHED: u32 = 2u;
#endif

// Added to the features before kernels are predicted from them, and to the filled picture, so that no kernel is 0/0.
const FLOOR: f32 = 1.0e-7;


fn feature_taps(at: u32, value: f32) -> mat3x4<f32> {
    return mat3x4<f32>(weights[at], weights[at + 1u], weights[at + 2u]) * value;
}

// The kernel of a texel: squares that add up to 1.
fn kernel(texel: vec2<u32>) -> mat3x4<f32> {
    let bias = layer.weights + 12u * layer.inputs;
    var taps = mat3x4<f32>(weights[bias], weights[bias + 1u], weights[bias + 2u]);
    for (var group = 0u; group < layer.inputs; group++) {
        let value = features[map_index(texel, group, layer.size)] + FLOOR;
        let at = layer.weights + 12u * group;
        taps += feature_taps(at, value.x) + feature_taps(at + 3u, value.y)
            + feature_taps(at + 6u, value.z) + feature_taps(at + 9u, value.w);
    }
    let squares = mat3x4<f32>(taps[0] * taps[0], taps[1] * taps[1], taps[2] * taps[2]);
    let total = dot(squares[0] + squares[1] + squares[2], vec4<f32>(1.0));
    return squares * (1.0 / max(total, 1.0e-30));
}

#ifdef COLORS
// The colours that the features of this texel give.
fn colors(texel: vec2<u32>) -> vec4<f32> {
    let value = features[map_index(texel, 0u, layer.size)];
    let at = layer.rgb_weights;
    let sum = weights[at + 4u] + weights[at] * value.x + weights[at + 1u] * value.y
        + weights[at + 2u] * value.z + weights[at + 3u] * value.w;
    return max(sum, vec4<f32>(0.0));
}
#endif

fn input(texel: vec2<u32>) -> vec4<f32> {
#ifdef COLORS
    return colors(texel);
#else
#ifdef POOLED
    return source_pooled(texel, 0u);
#else
    return source_enlarged(texel, 0u);
#endif
#endif
}

fn write(texel: vec2<u32>, filtered: vec4<f32>) {
#ifdef OUTPUT
    if (any(texel >= layer.picture)) {
        return;
    }
    var shown = vec4<f32>(filtered.rgb + FLOOR, 1.0);
#ifdef PASTE
    if (textureLoad(status, texel, 0).r != STATUS_UNFINISHED) {
        shown = vec4<f32>(textureLoad(color, texel, 0).rgb, 1.0);
    }
#endif
    made[map_index(texel, 0u, layer.picture)] = shown;
#else
    made[map_index(texel, 0u, layer.size)] = filtered;
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
    if (number >= layer.tiles) {
        return;
    }
    let origin = tile_origin(number);
    for (var i = lane; i < TILE_TEXELS; i += LANES) {
        let texel = tile_texel(origin, i);
        tile[i] = vec4<f32>(0.0);
        if (all(texel < layer.size)) {
            tile[i] = input(texel);
        }
    }
    workgroupBarrier();
    let texel = origin + local.xy;
    if (any(texel >= layer.size)) {
        return;
    }
    let taps = kernel(texel);
    let upper = tile_index(local.xy, 0u);
    let middle = upper + TILE_READ;
    let lower = middle + TILE_READ;
    var sum = taps[0].x * tile[upper] + taps[0].y * tile[upper + 1u] + taps[0].z * tile[upper + 2u];
    sum += taps[0].w * tile[middle] + taps[1].x * tile[middle + 1u] + taps[1].y * tile[middle + 2u];
    sum += taps[1].z * tile[lower] + taps[1].w * tile[lower + 1u] + taps[2].x * tile[lower + 2u];
#ifdef ENLARGED
    sum += taps[2].y * same_level[map_index(texel, 0u, layer.size)];
#endif
    write(texel, sum);
}
