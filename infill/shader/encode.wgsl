// The network's first convolution, of the features, over the tiles within two tiles of holes.
#import features
#import conv
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read> tiles: array<u32>;
@group(0) @binding(5) var<storage, read> candidates: array<u32>;
@group(0) @binding(6) var<storage, read> weights: array<vec2<u32>>;
@group(0) @binding(7) var<storage, read_write> outputs: array<vec2<u32>>;
@group(0) @binding(8) var normals: texture_2d<f32>;
#ifdef HISTORY
@group(0) @binding(9) var<storage, read> history_keys: array<u32>;
#endif

const LIST: u32 = 2u;

// The features of a texel are made once, for all four groups.
fn load_features(corner: vec2<u32>, lane: u32) {
    for (var i = lane; i < CONV_HALO * CONV_HALO; i += CONV_LANES) {
        let texel = vec2<i32>(corner + vec2<u32>(i % CONV_HALO, i / CONV_HALO)) - vec2<i32>(1);
        var features = array<vec4<f32>, 4>();
        if (infill_inside(params, texel)) {
            features = features_at(vec2<u32>(texel));
        }
        for (var group = 0u; group < CONV_IN; group++) {
            conv_tile[CONV_IN * i + group] = conv_pack(features[group]);
        }
    }
    workgroupBarrier();
}

fn conv_input(texel: vec2<i32>, group: u32) -> vec4<f32> {
    return vec4<f32>(0.0);
}

@compute @workgroup_size(CONV_LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    let listed = index < tiles[LIST];
    let corner = infill_tile_corner(params, tiles[infill_list_word(params, LIST, select(0u, index, listed))]);
    load_features(corner, lane);
    for (var i = lane; i < CONV_EDGE * CONV_EDGE; i += CONV_LANES) {
        let inside = vec2<u32>(i % CONV_EDGE, i / CONV_EDGE);
        let texel = corner + inside;
        if (listed && all(texel < params.padded)) {
            let value = max(conv_output(inside, 0u), vec4<f32>(0.0));
            outputs[texel.x + params.padded.x * texel.y] = conv_pack(value);
        }
    }
}
