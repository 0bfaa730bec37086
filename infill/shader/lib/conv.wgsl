// 3x3 convolutions of a tile in a workgroup's memory. Channels go in groups of four, two groups to a vector. Sums are in f32. The
// importing text gives CONV_MEMORY (vectors) and declares
//   var<storage, read> weights: array<vec4<u32>>;
//   var<storage, read_write> outputs: array<vec2<u32>>;
#import conv_texel

const CONV_LANES: u32 = 64u;

var<workgroup> conv_memory: array<vec4<u32>, CONV_MEMORY>;

struct ConvLayer {
    weights: u32,    // first vector
    groups_in: u32,  // of channels
    groups_out: u32,
}

// Part of a map.
struct ConvTile {
    corner: vec2<u32>, // first texel
    edge: u32,         // texels, a multiple of CONV_STRIP
    size: vec2<u32>,   // of the map, in texels
}

// Texels in a row that an invocation makes together: each weight is unpacked once for all of them.
const CONV_STRIP: u32 = 4u;

// Adds a row of taps for a group of inputs, six texels of them.
fn conv_row(
    sums: mat4x4<f32>, first: u32, groups: u32,
    v0: vec4<f32>, v1: vec4<f32>, v2: vec4<f32>, v3: vec4<f32>, v4: vec4<f32>, v5: vec4<f32>) -> mat4x4<f32> {
    let left = conv_matrix(first);
    let middle = conv_matrix(first + 2u * groups);
    let right = conv_matrix(first + 4u * groups);
    return mat4x4<f32>(
        sums[0] + conv_column(left, v0) + conv_column(middle, v1) + conv_column(right, v2),
        sums[1] + conv_column(left, v1) + conv_column(middle, v2) + conv_column(right, v3),
        sums[2] + conv_column(left, v2) + conv_column(middle, v3) + conv_column(right, v4),
        sums[3] + conv_column(left, v3) + conv_column(middle, v4) + conv_column(right, v5),
    );
}

// Four outputs for a strip of texels, the first of which has its 3x3 inputs from `place` on, before the activation. The inputs lie row by
// row, `width` texels in each. The weights: for every group of outputs, tap and group of inputs a vector of inputs for each of the
// outputs; behind all the biases.
fn conv_sums(layer: ConvLayer, width: u32, place: vec2<u32>, group: u32) -> mat4x4<f32> {
    let groups = layer.groups_in;
    let pairs = (groups + 1u) / 2u;
    let bias = conv_bias(layer.weights + 18u * groups * layer.groups_out, group);
    var sums = mat4x4<f32>(bias, bias, bias, bias);
    var row_weight = layer.weights + 18u * groups * group;
    var row = (place.x + width * place.y) * pairs;
    for (var y = 0u; y < 3u; y++) {
        for (var pair = 0u; pair < pairs; pair++) {
            let v0 = conv_memory[row + pair];
            let v1 = conv_memory[row + pair + pairs];
            let v2 = conv_memory[row + pair + 2u * pairs];
            let v3 = conv_memory[row + pair + 3u * pairs];
            let v4 = conv_memory[row + pair + 4u * pairs];
            let v5 = conv_memory[row + pair + 5u * pairs];
            let first = row_weight + 4u * pair;
            sums = conv_row(
                sums, first, groups,
                conv_unpack(v0.xy), conv_unpack(v1.xy), conv_unpack(v2.xy),
                conv_unpack(v3.xy), conv_unpack(v4.xy), conv_unpack(v5.xy));
            if (2u * pair + 1u < groups) {
                sums = conv_row(
                    sums, first + 2u, groups,
                    conv_unpack(v0.zw), conv_unpack(v1.zw), conv_unpack(v2.zw),
                    conv_unpack(v3.zw), conv_unpack(v4.zw), conv_unpack(v5.zw));
            }
        }
        row += width * pairs;
        row_weight += 6u * groups;
    }
    return sums;
}

// All of a tile's outputs behind the activation, kept if it is `listed`, from its inputs and those around it.
fn conv_tile(layer: ConvLayer, tile: ConvTile, listed: bool, lane: u32) {
    let strips = tile.edge / CONV_STRIP;
    let stride = 2u * ((layer.groups_out + 1u) / 2u);
    for (var i = lane; i < strips * tile.edge * layer.groups_out; i += CONV_LANES) {
        let group = i % layer.groups_out;
        let strip = i / layer.groups_out;
        let place = vec2<u32>(CONV_STRIP * (strip % strips), strip / strips);
        let sums = conv_sums(layer, tile.edge + 2u, place, group);
        for (var k = 0u; k < CONV_STRIP; k++) {
            let texel = tile.corner + place + vec2<u32>(k, 0u);
            if (listed && all(texel < tile.size)) {
                outputs[stride * (texel.x + tile.size.x * texel.y) + group] =
                    conv_pack(max(sums[k], vec4<f32>(0.0)));
            }
        }
    }
}

fn conv_inside(texel: vec2<i32>, map_size: vec2<u32>) -> bool {
    return all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(map_size));
}
