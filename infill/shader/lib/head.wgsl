// What the network says about a hole, of its map at half of the resolution and the hole's own candidates. The importing
// text declares `params` and
//   var<storage, read> weights: array<vec4<u32>>;
//   var<storage, read> decoded: array<vec4<u32>>;
// and gives HIDDEN_WEIGHTS and HEAD_WEIGHTS, the layers' first vectors.
#import infill_params
#import conv_texel

// The map, interpolated at a pixel.
fn head_enlarged(pixel: vec2<u32>) -> ConvMixed {
    let size = params.padded / 2u;
    let place = conv_enlarged(vec2<i32>(pixel), size);
    let x = vec2<u32>(place.first.x, place.second.x);
    let y = vec2<u32>(place.first.y, place.second.y) * size.x;
    return conv_mixed(
        decoded[x.x + y.x], decoded[x.y + y.x], decoded[x.x + y.y], decoded[x.y + y.y], place.share);
}

// A group of the hidden layer's outputs.
fn head_hidden(group: u32, inputs: mat4x4<f32>) -> vec4<f32> {
    let first = HIDDEN_WEIGHTS + 8u * group;
    let sum = conv_bias(HIDDEN_WEIGHTS + 16u, group)
        + conv_column(conv_matrix(first), inputs[0]) + conv_column(conv_matrix(first + 2u), inputs[1])
        + conv_column(conv_matrix(first + 4u), inputs[2]) + conv_column(conv_matrix(first + 6u), inputs[3]);
    return max(sum, vec4<f32>(0.0));
}

// Logits of the candidates; residuals of coverage and N.V, then the doubt. `own`: coverage and coverage N.V of the candidates.
fn head_outputs(pixel: vec2<u32>, own: mat2x4<f32>) -> mat2x4<f32> {
    let enlarged = head_enlarged(pixel);
    let inputs = mat4x4<f32>(enlarged.low, enlarged.high, own[0], own[1]);
    let first = head_hidden(0u, inputs);
    let second = head_hidden(1u, inputs);
    return mat2x4<f32>(
        conv_bias(HEAD_WEIGHTS + 8u, 0u) + conv_column(conv_matrix(HEAD_WEIGHTS), first)
            + conv_column(conv_matrix(HEAD_WEIGHTS + 2u), second),
        conv_bias(HEAD_WEIGHTS + 8u, 1u) + conv_column(conv_matrix(HEAD_WEIGHTS + 4u), first)
            + conv_column(conv_matrix(HEAD_WEIGHTS + 6u), second),
    );
}
