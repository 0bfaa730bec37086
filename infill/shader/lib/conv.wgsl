// 3x3 convolutions of a tile in a workgroup's memory. Channels go in groups of four, two groups to a vector. Sums are in f32. The
// importing text declares `params`, `tiles` and
//   var<storage, read> weights: array<vec4<u32>>;
//   var<storage, read_write> outputs: array<vec2<u32>>;
// and gives LIST, SCALE (pixels to a texel), LAYER, CONV_PAIRS (vectors of a texel's inputs) and
//   fn inputs_at(texel: vec2<u32>, size: vec2<u32>) -> array<vec4<u32>, CONV_PAIRS>, of a texel of a map of that size.
#import listed_tile
#import conv_texel

const CONV_LANES: u32 = 64u;

// Texels of a tile, and with those around it.
const CONV_EDGE: u32 = INFILL_TILE / SCALE;
const CONV_HALO: u32 = CONV_EDGE + 2u;

var<workgroup> conv_memory: array<vec4<u32>, CONV_PAIRS * CONV_HALO * CONV_HALO>;

struct ConvLayer {
    weights: u32,    // first vector
    groups_in: u32,  // of channels
    groups_out: u32,
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
// row. The weights: for every group of outputs, tap and group of inputs a vector of inputs for each of the
// outputs; behind all the biases.
fn conv_sums(place: vec2<u32>, group: u32) -> mat4x4<f32> {
    let groups = LAYER.groups_in;
    let pairs = CONV_PAIRS;
    let bias = conv_bias(LAYER.weights + 18u * groups * LAYER.groups_out, group);
    var sums = mat4x4<f32>(bias, bias, bias, bias);
    var row_weight = LAYER.weights + 18u * groups * group;
    var row = (place.x + CONV_HALO * place.y) * pairs;
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
        row += CONV_HALO * pairs;
        row_weight += 6u * groups;
    }
    return sums;
}

// A layer on a workgroup's tile, behind the activation. All invocations call it together.
fn conv_layer(tile: ListedTile, lane: u32) {
    let corner = tile.corner / SCALE;
    let size = params.padded / SCALE;
    for (var i = lane; i < CONV_HALO * CONV_HALO; i += CONV_LANES) {
        let texel = vec2<i32>(corner + vec2<u32>(i % CONV_HALO, i / CONV_HALO)) - vec2<i32>(1);
        var inputs = array<vec4<u32>, CONV_PAIRS>();
        if (all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(size))) {
            inputs = inputs_at(vec2<u32>(texel), size);
        }
        for (var pair = 0u; pair < CONV_PAIRS; pair++) {
            conv_memory[CONV_PAIRS * i + pair] = inputs[pair];
        }
    }
    workgroupBarrier();
    let strips = CONV_EDGE / CONV_STRIP;
    let stride = 2u * ((LAYER.groups_out + 1u) / 2u);
    for (var i = lane; i < strips * CONV_EDGE * LAYER.groups_out; i += CONV_LANES) {
        let group = i % LAYER.groups_out;
        let strip = i / LAYER.groups_out;
        let place = vec2<u32>(CONV_STRIP * (strip % strips), strip / strips);
        let sums = conv_sums(place, group);
        for (var k = 0u; k < CONV_STRIP; k++) {
            let texel = corner + place + vec2<u32>(k, 0u);
            if (tile.listed && all(texel < size)) {
                outputs[stride * (texel.x + size.x * texel.y) + group] =
                    conv_pack(max(sums[k], vec4<f32>(0.0)));
            }
        }
    }
}
