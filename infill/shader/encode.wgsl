// The network's first convolution, of the features, over the tiles within two tiles of holes.
#import sources
#import conv
#import shading
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
const HALO: u32 = INFILL_TILE + 2u;
const GROUPS: u32 = 4u;
const CONV_MEMORY: u32 = HALO * HALO * GROUPS;

// What the network reads at a pixel, in groups of four: finished, its coverage, coverage times N.V; the same two of every
// candidate; whether history has one; soft distances of coarse field, thin variant, neighbours, history.
fn features_at(pixel: vec2<u32>) -> array<vec4<f32>, 4> {
    let number = frame_number(frame, pixel);
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    if (!infill_is_hole(number)) {
        let normal = textureLoad(normals, pixel, 0).xyz;
        let c = select(0.0, 1.0, any(normal != vec3<f32>(0.0)));
        let cn = clamp(dot(normal, to_viewer), 0.0, 1.0);
        return array<vec4<f32>, 4>(
            vec4<f32>(1.0, c, cn, c), vec4<f32>(cn, c, cn, c), vec4<f32>(cn, 1.0, c, cn), vec4<f32>(0.0));
    }
    var found = sources_candidates(sources_guesses(pixel), pixel, ray, number);
    var cn = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        cn[i] = found[i].coverage * candidate_facing(found[i], to_viewer);
    }
    return array<vec4<f32>, 4>(
        vec4<f32>(0.0, 0.0, 0.0, found[0].coverage),
        vec4<f32>(cn.x, found[1].coverage, cn.y, found[2].coverage),
        vec4<f32>(cn.z, select(0.0, 1.0, found[3].valid), found[3].coverage, cn.w),
        vec4<f32>(found[1].soft_distance, found[2].soft_distance, found[0].soft_distance, found[3].soft_distance),
    );
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
    for (var i = lane; i < HALO * HALO; i += CONV_LANES) {
        let pixel = vec2<i32>(corner + vec2<u32>(i % HALO, i / HALO)) - vec2<i32>(1);
        var features = array<vec4<f32>, GROUPS>();
        if (infill_inside(params, pixel)) {
            features = features_at(vec2<u32>(pixel));
        }
        for (var channels = 0u; channels < GROUPS; channels++) {
            conv_memory[GROUPS * i + channels] = conv_pack(features[channels]);
        }
    }
    workgroupBarrier();
    let strips = conv_strips(INFILL_TILE);
    for (var i = lane; i < strips * INFILL_TILE; i += CONV_LANES) {
        let inside = vec2<u32>(CONV_STRIP * (i % strips), i / strips);
        let values = conv_outputs(ConvTexels(0u, HALO, GROUPS), inside, FIRST_WEIGHTS, 1u, 0u);
        let texel = corner + inside;
        // The maps are multiples of 4 texels wide.
        if (listed && all(texel < params.padded)) {
            let first = texel.x + params.padded.x * texel.y;
            for (var k = 0u; k < CONV_STRIP; k++) {
                outputs[first + k] = values[k];
            }
        }
    }
}
