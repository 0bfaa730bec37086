// The network from the quarters back to the halves, over the tiles with holes and their neighbours.
#import infill_params
#import conv
#import indirect

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> encoded: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> quarters: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 1u;
const SCALE: u32 = 2u; // pixels to a texel
const EDGE: u32 = INFILL_TILE / SCALE;
const HALO: u32 = EDGE + 2u;
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 5u, 2u);
const CONV_MEMORY: u32 = 3u * HALO * HALO;

// Two groups of the quarters, interpolated at a texel of the halves.
fn enlarged(place: ConvPlace, width: u32, pair: u32) -> vec4<u32> {
    let x = 2u * vec2<u32>(place.first.x, place.second.x) + vec2<u32>(pair);
    let y = 2u * vec2<u32>(place.first.y, place.second.y) * width;
    let mixed = conv_mixed(
        quarters[x.x + y.x], quarters[x.y + y.x], quarters[x.x + y.y], quarters[x.y + y.y], place.share);
    return conv_pack_pair(mixed.low, mixed.high);
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
    let corner = infill_tile_corner(params, tile) / SCALE;
    let size = params.padded / SCALE;
    for (var i = lane; i < HALO * HALO; i += CONV_LANES) {
        let texel = vec2<i32>(corner + vec2<u32>(i % HALO, i / HALO)) - vec2<i32>(1);
        let inside = conv_inside(texel, size);
        // Own channels, then those of the quarters.
        for (var pair = 0u; pair < 3u; pair++) {
            conv_memory[3u * i + pair] = vec4<u32>(0u);
        }
        if (inside) {
            let place = conv_enlarged(texel, size / 2u);
            conv_memory[3u * i] = encoded[u32(texel.x) + size.x * u32(texel.y)];
            conv_memory[3u * i + 1u] = enlarged(place, size.x / 2u, 0u);
            conv_memory[3u * i + 2u] = enlarged(place, size.x / 2u, 1u);
        }
    }
    workgroupBarrier();
    conv_tile(LAYER, ConvTile(corner, EDGE, size), listed, lane);
}
