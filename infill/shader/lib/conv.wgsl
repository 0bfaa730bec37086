// 3x3 convolutions in a workgroup's memory. Channels go in groups of four, as packed halves; sums are in f32. The
// importing text gives CONV_MEMORY (vectors of four halves) and
//   var<storage, read> weights: array<vec2<u32>>;

const CONV_LANES: u32 = 64u;

var<workgroup> conv_memory: array<vec2<u32>, CONV_MEMORY>;

// Texels in the workgroup's memory, row by row.
struct ConvTexels {
    first: u32,  // vector
    width: u32,  // texels in a row
    groups: u32, // of channels
}

fn conv_pack(v: vec4<f32>) -> vec2<u32> {
    return vec2<u32>(pack2x16float(v.xy), pack2x16float(v.zw));
}

fn conv_unpack(words: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
}

fn conv_weight(index: u32) -> vec4<f32> {
    return conv_unpack(weights[index]);
}

fn conv_inside(texel: vec2<i32>, map_size: vec2<u32>) -> bool {
    return all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(map_size));
}

// Texels in a row that an invocation makes together: each weight is unpacked once for all of them.
const CONV_STRIP: u32 = 4u;

// Strips of a row of `width` texels; the last one may reach beyond its end.
fn conv_strips(width: u32) -> u32 {
    return (width + CONV_STRIP - 1u) / CONV_STRIP;
}

fn conv_value(index: u32) -> vec4<f32> {
    return conv_unpack(conv_memory[min(index, CONV_MEMORY - 1u)]);
}

fn conv_column(w: mat4x4<f32>, value: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(dot(w[0], value), dot(w[1], value), dot(w[2], value), dot(w[3], value));
}

fn conv_matrix(first: u32) -> mat4x4<f32> {
    return mat4x4<f32>(
        conv_weight(first), conv_weight(first + 1u), conv_weight(first + 2u), conv_weight(first + 3u));
}

// A layer's four outputs for a strip of texels, the first of which has its 3x3 inputs from `place` on, before the
// activation. Its weights: for every group of outputs, tap and group of inputs a vector of inputs for each of the
// outputs; behind all the biases.
fn conv_sums(texels: ConvTexels, place: vec2<u32>, layer: u32, outputs: u32, group: u32) -> mat4x4<f32> {
    let bias = conv_weight(layer + 36u * texels.groups * outputs + group);
    var a = bias;
    var b = bias;
    var c = bias;
    var d = bias;
    let groups = texels.groups;
    var row_weight = layer + 36u * groups * group;
    var row = texels.first + (place.x + texels.width * place.y) * groups;
    for (var y = 0u; y < 3u; y++) {
        for (var i = 0u; i < groups; i++) {
            let first = row + i;
            let v0 = conv_value(first);
            let v1 = conv_value(first + groups);
            let v2 = conv_value(first + 2u * groups);
            let v3 = conv_value(first + 3u * groups);
            let v4 = conv_value(first + 4u * groups);
            let v5 = conv_value(first + 5u * groups);
            let left = conv_matrix(row_weight + 4u * i);
            a += conv_column(left, v0);
            b += conv_column(left, v1);
            c += conv_column(left, v2);
            d += conv_column(left, v3);
            let middle = conv_matrix(row_weight + 4u * (groups + i));
            a += conv_column(middle, v1);
            b += conv_column(middle, v2);
            c += conv_column(middle, v3);
            d += conv_column(middle, v4);
            let right = conv_matrix(row_weight + 4u * (2u * groups + i));
            a += conv_column(right, v2);
            b += conv_column(right, v3);
            c += conv_column(right, v4);
            d += conv_column(right, v5);
        }
        row += texels.width * groups;
        row_weight += 12u * groups;
    }
    return mat4x4<f32>(a, b, c, d);
}

// The same behind the activation, as halves.
fn conv_outputs(
    texels: ConvTexels, place: vec2<u32>, layer: u32, outputs: u32, group: u32) -> array<vec2<u32>, CONV_STRIP> {
    let sums = conv_sums(texels, place, layer, outputs, group);
    let zero = vec4<f32>(0.0);
    return array<vec2<u32>, CONV_STRIP>(
        conv_pack(max(sums[0], zero)), conv_pack(max(sums[1], zero)),
        conv_pack(max(sums[2], zero)), conv_pack(max(sums[3], zero)));
}

// Bilinear interpolation at twice the size, clamped at the edges: where, and how much of the second texel.
struct ConvPlace {
    first: vec2<u32>,
    second: vec2<u32>,
    share: vec2<f32>,
}

fn conv_enlarged(finer: vec2<i32>, map_size: vec2<u32>) -> ConvPlace {
    let upper = (finer + vec2<i32>(1)) >> vec2<u32>(1u);
    let share = select(vec2<f32>(0.25), vec2<f32>(0.75), (finer & vec2<i32>(1)) == vec2<i32>(0));
    let first = max(upper - vec2<i32>(1), vec2<i32>(0));
    return ConvPlace(vec2<u32>(first), vec2<u32>(min(upper, vec2<i32>(map_size) - vec2<i32>(1))), share);
}

// Of the four texels at (first, first), (second, first), (first, second), (second, second).
fn conv_mixed(a: vec2<u32>, b: vec2<u32>, c: vec2<u32>, d: vec2<u32>, share: vec2<f32>) -> vec4<f32> {
    let upper = conv_unpack(a) * (1.0 - share.x) + conv_unpack(b) * share.x;
    let lower = conv_unpack(c) * (1.0 - share.x) + conv_unpack(d) * share.x;
    return upper * (1.0 - share.y) + lower * share.y;
}
