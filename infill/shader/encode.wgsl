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
const HALO: u32 = INFILL_TILE + 2u;
const GROUPS: u32 = 4u;
const CONV_MEMORY: u32 = HALO * HALO * GROUPS;

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
