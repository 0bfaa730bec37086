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

// A layer's four outputs for the 3x3 texels from `place` on, before the activation. Its weights: for every group of
// outputs, tap and group of inputs a vector of inputs for each of the outputs; behind all the biases.
fn conv_sums(texels: ConvTexels, place: vec2<u32>, layer: u32, outputs: u32, group: u32) -> vec4<f32> {
    var sum = conv_weight(layer + 36u * texels.groups * outputs + group);
    var weight = layer + 36u * texels.groups * group;
    for (var tap = 0u; tap < 9u; tap++) {
        let at = place + vec2<u32>(tap % 3u, tap / 3u);
        let first = texels.first + (at.x + texels.width * at.y) * texels.groups;
        for (var i = 0u; i < texels.groups; i++) {
            let value = conv_unpack(conv_memory[first + i]);
            sum += vec4<f32>(
                dot(conv_weight(weight), value),
                dot(conv_weight(weight + 1u), value),
                dot(conv_weight(weight + 2u), value),
                dot(conv_weight(weight + 3u), value),
            );
            weight += 4u;
        }
    }
    return sum;
}

// The same behind the activation, as halves.
fn conv_output(texels: ConvTexels, place: vec2<u32>, layer: u32, outputs: u32, group: u32) -> vec2<u32> {
    return conv_pack(max(conv_sums(texels, place, layer, outputs, group), vec4<f32>(0.0)));
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
