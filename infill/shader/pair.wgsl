// Two convolutions of a coarser level on the averages of 2x2 texels of the finer one, over the tiles within two tiles
// of holes. The first one's outputs never leave the workgroup's memory.
#import infill_params
#import conv
#import indirect

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> finer: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec2<u32>>;

const LIST: u32 = 2u;

// Texels of the tile, of the first convolution and of its inputs.
const EDGE: u32 = 16u >> LEVEL;
const MIDDLE: u32 = EDGE + 2u;
const OUTER: u32 = EDGE + 4u;
const CONV_MEMORY: u32 = OUTER * OUTER * GROUPS_IN + MIDDLE * MIDDLE * GROUPS_OUT;

fn pooled(texel: vec2<u32>, group: u32) -> vec4<f32> {
    let width = params.padded.x >> (LEVEL - 1u);
    let first = GROUPS_IN * (2u * texel.x + width * (2u * texel.y)) + group;
    let below = first + GROUPS_IN * width;
    let upper = conv_unpack(finer[first]) + conv_unpack(finer[first + GROUPS_IN]);
    let lower = conv_unpack(finer[below]) + conv_unpack(finer[below + GROUPS_IN]);
    return 0.25 * (upper + lower);
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
    let corner = vec2<i32>(infill_tile_corner(params, tile) >> vec2<u32>(LEVEL));
    let size = params.padded >> vec2<u32>(LEVEL);
    let inputs = ConvTexels(0u, OUTER, GROUPS_IN);
    let middle = ConvTexels(OUTER * OUTER * GROUPS_IN, MIDDLE, GROUPS_OUT);
    for (var i = lane; i < OUTER * OUTER * GROUPS_IN; i += CONV_LANES) {
        let place = i / GROUPS_IN;
        let texel = corner + vec2<i32>(vec2<u32>(place % OUTER, place / OUTER)) - vec2<i32>(2);
        var value = vec4<f32>(0.0);
        if (conv_inside(texel, size)) {
            value = pooled(vec2<u32>(texel), i % GROUPS_IN);
        }
        conv_memory[i] = conv_pack(value);
    }
    workgroupBarrier();
    let middle_strips = conv_strips(MIDDLE);
    for (var i = lane; i < middle_strips * MIDDLE * GROUPS_OUT; i += CONV_LANES) {
        let channels = i % GROUPS_OUT;
        let strip = i / GROUPS_OUT;
        let place = vec2<u32>(CONV_STRIP * (strip % middle_strips), strip / middle_strips);
        let values = conv_outputs(inputs, place, FIRST_WEIGHTS, GROUPS_OUT, channels);
        for (var k = 0u; k < CONV_STRIP; k++) {
            let texel = place + vec2<u32>(k, 0u);
            if (texel.x < MIDDLE) {
                let inside = conv_inside(corner + vec2<i32>(texel) - vec2<i32>(1), size);
                conv_memory[middle.first + GROUPS_OUT * (texel.x + MIDDLE * texel.y) + channels] =
                    select(vec2<u32>(0u), values[k], inside);
            }
        }
    }
    workgroupBarrier();
    let strips = conv_strips(EDGE);
    for (var i = lane; i < strips * EDGE * GROUPS_OUT; i += CONV_LANES) {
        let channels = i % GROUPS_OUT;
        let strip = i / GROUPS_OUT;
        let place = vec2<u32>(CONV_STRIP * (strip % strips), strip / strips);
        let values = conv_outputs(middle, place, SECOND_WEIGHTS, GROUPS_OUT, channels);
        for (var k = 0u; k < CONV_STRIP; k++) {
            let texel = vec2<u32>(corner) + place + vec2<u32>(k, 0u);
            if (listed && all(texel < size)) {
                outputs[GROUPS_OUT * (texel.x + size.x * texel.y) + channels] = values[k];
            }
        }
    }
}
