// The network from the quarters back to the halves, over the tiles with holes and their neighbours.
#import conv

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> encoded: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> quarters: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 1u;
const SCALE: u32 = 2u; // pixels to a texel
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 5u, 2u);
const CONV_PAIRS: u32 = 3u;

// Two groups of the quarters, interpolated at a texel of the halves.
fn enlarged(place: ConvPlace, width: u32, pair: u32) -> vec4<u32> {
    let x = 2u * vec2<u32>(place.first.x, place.second.x) + vec2<u32>(pair);
    let y = 2u * vec2<u32>(place.first.y, place.second.y) * width;
    let mixed = conv_mixed(
        quarters[x.x + y.x], quarters[x.y + y.x], quarters[x.x + y.y], quarters[x.y + y.y], place.share);
    return conv_pack_pair(mixed.low, mixed.high);
}

// Own channels, then those of the quarters.
fn inputs_at(texel: vec2<u32>, size: vec2<u32>) -> array<vec4<u32>, CONV_PAIRS> {
    let place = conv_enlarged(vec2<i32>(texel), size / 2u);
    return array<vec4<u32>, CONV_PAIRS>(
        encoded[texel.x + size.x * texel.y],
        enlarged(place, size.x / 2u, 0u),
        enlarged(place, size.x / 2u, 1u),
    );
}

@compute @workgroup_size(CONV_LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    conv_layer(listed_tile(group, groups), lane);
}
