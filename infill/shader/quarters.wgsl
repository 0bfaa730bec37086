// The network's second convolution at a quarter of the resolution, over the tiles with holes and their neighbours.
#import conv

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> inputs: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 1u;
const SCALE: u32 = 4u; // pixels to a texel
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 3u, 3u);
const CONV_PAIRS: u32 = 2u;

fn inputs_at(texel: vec2<u32>, size: vec2<u32>) -> array<vec4<u32>, CONV_PAIRS> {
    let first = 2u * (texel.x + size.x * texel.y);
    return array<vec4<u32>, CONV_PAIRS>(inputs[first], inputs[first + 1u]);
}

@compute @workgroup_size(CONV_LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    conv_layer(listed_tile(group, groups), lane);
}
