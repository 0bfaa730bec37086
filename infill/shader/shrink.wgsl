// The network from the halves to the quarters: a convolution of averages of 2x2 texels, over the tiles within two tiles of holes.
#import infill_params
#import conv
#import indirect

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> encoded: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 2u;
const SCALE: u32 = 4u; // pixels to a texel
const EDGE: u32 = INFILL_TILE / SCALE;
const HALO: u32 = EDGE + 2u;
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 2u, 3u);
const CONV_MEMORY: u32 = HALO * HALO;

fn pooled(texel: vec2<u32>, width: u32) -> vec4<u32> {
    let first = 2u * (texel.x + width * texel.y);
    let a = encoded[first];
    let b = encoded[first + 1u];
    let c = encoded[first + width];
    let d = encoded[first + width + 1u];
    return conv_pack_pair(
        0.25 * ((conv_unpack(a.xy) + conv_unpack(b.xy)) + (conv_unpack(c.xy) + conv_unpack(d.xy))),
        0.25 * ((conv_unpack(a.zw) + conv_unpack(b.zw)) + (conv_unpack(c.zw) + conv_unpack(d.zw))),
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
    let tile = tiles[infill_list_word(params, LIST, select(0u, index, listed))];
    let corner = infill_tile_corner(params, tile) / SCALE;
    let size = params.padded / SCALE;
    for (var i = lane; i < HALO * HALO; i += CONV_LANES) {
        let texel = vec2<i32>(corner + vec2<u32>(i % HALO, i / HALO)) - vec2<i32>(1);
        let inside = conv_inside(texel, size);
        conv_memory[i] = vec4<u32>(0u);
        if (inside) {
            conv_memory[i] = pooled(vec2<u32>(texel), 2u * size.x);
        }
    }
    workgroupBarrier();
    conv_tile(LAYER, ConvTile(corner, EDGE, size), listed, lane);
}
