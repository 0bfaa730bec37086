// What the network says about a hole, of its map at half of the resolution and the hole's own candidates. The importing
// text declares `params` and
//   var<storage, read> weights: array<vec4<u32>>;
//   var<storage, read> decoded: array<vec4<u32>>;
// and gives HEAD_WEIGHTS, the first vector of the hidden layer, behind which the head lies.
#import infill_params
#import conv_texel

const HEAD_VECTORS: u32 = 26u;

// The map, interpolated at a pixel.
fn head_enlarged(pixel: vec2<u32>) -> ConvMixed {
    let size = params.padded / 2u;
    let place = conv_enlarged(vec2<i32>(pixel), size);
    let x = vec2<u32>(place.first.x, place.second.x);
    let y = vec2<u32>(place.first.y, place.second.y) * size.x;
    return conv_mixed(
        decoded[x.x + y.x], decoded[x.y + y.x], decoded[x.x + y.y], decoded[x.y + y.y], place.share);
}

// The layers' weights, which a loop over pixels loads before it begins: some drivers load what all lanes share for each of them.
fn head_weights() -> array<vec4<u32>, HEAD_VECTORS> {
    var loaded = array<vec4<u32>, HEAD_VECTORS>();
    for (var i = 0u; i < HEAD_VECTORS; i++) {
        loaded[i] = weights[HEAD_WEIGHTS + i];
    }
    return loaded;
}

// Four inputs of each of four outputs, times the inputs.
fn head_column(low: vec4<u32>, high: vec4<u32>, value: vec4<f32>) -> vec4<f32> {
    return conv_column(conv_matrix_of(low, high), value);
}

// Logits of the candidates; residuals of coverage and N.V, then the doubt. `own`: coverage and coverage N.V of the candidates.
fn head_outputs(w: array<vec4<u32>, HEAD_VECTORS>, pixel: vec2<u32>, own: mat2x4<f32>) -> mat2x4<f32> {
    let map = head_enlarged(pixel);
    let zero = vec4<f32>(0.0);
    let first = max(zero, conv_unpack(w[16].xy)
        + head_column(w[0], w[1], map.low) + head_column(w[2], w[3], map.high)
        + head_column(w[4], w[5], own[0]) + head_column(w[6], w[7], own[1]));
    let second = max(zero, conv_unpack(w[16].zw)
        + head_column(w[8], w[9], map.low) + head_column(w[10], w[11], map.high)
        + head_column(w[12], w[13], own[0]) + head_column(w[14], w[15], own[1]));
    return mat2x4<f32>(
        conv_unpack(w[25].xy) + head_column(w[17], w[18], first) + head_column(w[19], w[20], second),
        conv_unpack(w[25].zw) + head_column(w[21], w[22], first) + head_column(w[23], w[24], second),
    );
}
