// The network from the halves to the quarters: a convolution of averages of 2x2 texels, over the tiles within two tiles of holes.
#import conv

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> encoded: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 2u;
const SCALE: u32 = 4u; // pixels to a texel
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 2u, 3u);
const CONV_PAIRS: u32 = 1u;

fn inputs_at(texel: vec2<u32>, size: vec2<u32>) -> array<vec4<u32>, CONV_PAIRS> {
    let width = 2u * size.x;
    let first = 2u * (texel.x + width * texel.y);
    let a = encoded[first];
    let b = encoded[first + 1u];
    let c = encoded[first + width];
    let d = encoded[first + width + 1u];
    return array<vec4<u32>, CONV_PAIRS>(conv_pack_pair(
        0.25 * ((conv_unpack(a.xy) + conv_unpack(b.xy)) + (conv_unpack(c.xy) + conv_unpack(d.xy))),
        0.25 * ((conv_unpack(a.zw) + conv_unpack(b.zw)) + (conv_unpack(c.zw) + conv_unpack(d.zw))),
    ));
}


@compute @workgroup_size(CONV_LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    conv_layer(listed_tile(group, groups), lane);
}
