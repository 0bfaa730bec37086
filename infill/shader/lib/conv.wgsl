// A 3x3 convolution over a tile, zero beyond the edges of the map. Channels go in groups of four, as packed halves;
// sums are in f32. The importing text gives CONV_EDGE (texels on the edge of a tile), CONV_IN and CONV_OUT (groups of
// channels), CONV_WEIGHTS (the layer's first vector), and
//   fn conv_input(texel: vec2<i32>, group: u32) -> vec4<f32>
//   var<storage, read> weights: array<vec2<u32>>;

const CONV_LANES: u32 = 64u;
const CONV_HALO: u32 = CONV_EDGE + 2u;

var<workgroup> conv_tile: array<vec2<u32>, CONV_HALO * CONV_HALO * CONV_IN>;

fn conv_pack(v: vec4<f32>) -> vec2<u32> {
    return vec2<u32>(pack2x16float(v.xy), pack2x16float(v.zw));
}

fn conv_unpack(words: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
}

// Brings the inputs of the tile at `corner` into the workgroup's memory. All invocations call it together.
fn conv_load(corner: vec2<u32>, map_size: vec2<u32>, lane: u32) {
    for (var i = lane; i < CONV_HALO * CONV_HALO * CONV_IN; i += CONV_LANES) {
        let texel_number = i / CONV_IN;
        let place = vec2<u32>(texel_number % CONV_HALO, texel_number / CONV_HALO);
        let texel = vec2<i32>(corner + place) - vec2<i32>(1);
        var value = vec4<f32>(0.0);
        if (all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(map_size))) {
            value = conv_input(texel, i % CONV_IN);
        }
        conv_tile[i] = conv_pack(value);
    }
    workgroupBarrier();
}

fn conv_weight(index: u32) -> vec4<f32> {
    return conv_unpack(weights[index]);
}

// Four outputs of the texel at `inside` in the tile, before the ReLU. The weights of a group of outputs: for every
// tap and group of inputs a vector for each of the outputs; behind all groups the biases.
fn conv_output(inside: vec2<u32>, group: u32) -> vec4<f32> {
    var sum = conv_weight(CONV_WEIGHTS + 36u * CONV_IN * CONV_OUT + group);
    var weight = CONV_WEIGHTS + 36u * CONV_IN * group;
    for (var tap = 0u; tap < 9u; tap++) {
        let place = inside + vec2<u32>(tap % 3u, tap / 3u);
        let first = (place.x + CONV_HALO * place.y) * CONV_IN;
        for (var i = 0u; i < CONV_IN; i++) {
            let value = conv_unpack(conv_tile[first + i]);
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

// Bilinear interpolation at twice the size, clamped at the edges: where, and how much of the second texel.
struct ConvPlace {
    first: vec2<i32>,
    second: vec2<i32>,
    share: vec2<f32>,
}

fn conv_enlarged(finer: vec2<i32>, map_size: vec2<u32>) -> ConvPlace {
    let upper = (finer + vec2<i32>(1)) >> vec2<u32>(1u);
    let share = select(vec2<f32>(0.25), vec2<f32>(0.75), (finer & vec2<i32>(1)) == vec2<i32>(0));
    let first = max(upper - vec2<i32>(1), vec2<i32>(0));
    return ConvPlace(first, min(upper, vec2<i32>(map_size) - vec2<i32>(1)), share);
}
