// Four channels of a texel, as packed halves, and weights for them, two groups of four to a vector: a load costs some drivers as much
// for one number as for four. The importing text declares
//   var<storage, read> weights: array<vec4<u32>>;

fn conv_pack(v: vec4<f32>) -> vec2<u32> {
    return vec2<u32>(pack2x16float(v.xy), pack2x16float(v.zw));
}

fn conv_pack_pair(low: vec4<f32>, high: vec4<f32>) -> vec4<u32> {
    return vec4<u32>(conv_pack(low), conv_pack(high));
}

fn conv_unpack(words: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
}

fn conv_column(w: mat4x4<f32>, value: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(dot(w[0], value), dot(w[1], value), dot(w[2], value), dot(w[3], value));
}

// Four inputs of each of four outputs.
fn conv_matrix_of(low: vec4<u32>, high: vec4<u32>) -> mat4x4<f32> {
    return mat4x4<f32>(conv_unpack(low.xy), conv_unpack(low.zw), conv_unpack(high.xy), conv_unpack(high.zw));
}

fn conv_matrix(first: u32) -> mat4x4<f32> {
    return conv_matrix_of(weights[first], weights[first + 1u]);
}

// A group of biases, the first of which are at `first`.
fn conv_bias(first: u32, group: u32) -> vec4<f32> {
    let pair = weights[first + group / 2u];
    return conv_unpack(select(pair.xy, pair.zw, vec2<bool>((group & 1u) != 0u)));
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

// Of the four texels at (first, first), (second, first), (first, second), (second, second): eight channels.
struct ConvMixed {
    low: vec4<f32>,
    high: vec4<f32>,
}

fn conv_lerp(a: vec4<f32>, b: vec4<f32>, share: f32) -> vec4<f32> {
    return a * (1.0 - share) + b * share;
}

fn conv_mixed(a: vec4<u32>, b: vec4<u32>, c: vec4<u32>, d: vec4<u32>, share: vec2<f32>) -> ConvMixed {
    return ConvMixed(
        conv_lerp(
            conv_lerp(conv_unpack(a.xy), conv_unpack(b.xy), share.x),
            conv_lerp(conv_unpack(c.xy), conv_unpack(d.xy), share.x), share.y),
        conv_lerp(
            conv_lerp(conv_unpack(a.zw), conv_unpack(b.zw), share.x),
            conv_lerp(conv_unpack(c.zw), conv_unpack(d.zw), share.x), share.y),
    );
}
