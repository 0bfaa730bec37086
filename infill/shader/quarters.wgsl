// The network's second convolution at a quarter of the resolution, over the tiles with holes and their neighbours.
#import infill_params
#import conv
#import indirect

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read> inputs: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 1u;
const SCALE: u32 = 4u; // pixels to a texel
const EDGE: u32 = INFILL_TILE / SCALE;
const HALO: u32 = EDGE + 2u;
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 3u, 3u);
const CONV_MEMORY: u32 = 2u * HALO * HALO;

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
        for (var pair = 0u; pair < 2u; pair++) {
            conv_memory[2u * i + pair] = vec4<u32>(0u);
            if (inside) {
                conv_memory[2u * i + pair] = inputs[2u * (u32(texel.x) + size.x * u32(texel.y)) + pair];
            }
        }
    }
    workgroupBarrier();
    conv_tile(LAYER, ConvTile(corner, EDGE, size), listed, lane);
}
