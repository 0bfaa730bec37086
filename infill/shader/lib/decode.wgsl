// The network from the coarser levels back to a tile's pixels. The importing text declares `params` and
//   var<storage, read> encoded: array<vec2<u32>>;   outputs of the first convolution
//   var<storage, read> halves: array<vec2<u32>>;    those of the level of half the size
//   var<storage, read> quarters: array<vec2<u32>>;
// and gives HALF_WEIGHTS, LAST_WEIGHTS and HEAD_WEIGHTS, the layers' first vectors.
#import infill_params
#import conv

// Texels of the tile's halves, with those that its pixels and the pixels around it interpolate, and the inputs of those.
const DECODE_HALVES: u32 = INFILL_TILE / 2u + 2u;
const DECODE_OUTER: u32 = DECODE_HALVES + 2u;
const DECODE_PIXELS: u32 = INFILL_TILE + 2u;

const DECODE_OWN: u32 = 2u;      // groups of the halves
const DECODE_QUARTERS: u32 = 3u; // groups of the quarters
const DECODE_JOINED: u32 = DECODE_OWN + DECODE_QUARTERS;
const DECODE_LAST: u32 = 1u + DECODE_OWN;

// Inputs of the halves, and later those of the pixels; behind them the halves.
const DECODE_SHARED: u32 = DECODE_PIXELS * DECODE_PIXELS * DECODE_LAST;
const CONV_MEMORY: u32 = DECODE_SHARED + DECODE_HALVES * DECODE_HALVES * DECODE_OWN;

// Own channels, then those of the quarters.
fn decode_joined(texel: vec2<i32>, group: u32) -> vec2<u32> {
    let size = params.padded >> vec2<u32>(1u);
    if (group < DECODE_OWN) {
        return halves[DECODE_OWN * (u32(texel.x) + size.x * u32(texel.y)) + group];
    }
    let coarser = size >> vec2<u32>(1u);
    let place = conv_enlarged(texel, coarser);
    let x = vec2<u32>(place.first.x, place.second.x);
    let y = vec2<u32>(place.first.y, place.second.y) * coarser.x;
    let channels = group - DECODE_OWN;
    return conv_pack(conv_mixed(
        quarters[DECODE_QUARTERS * (x.x + y.x) + channels],
        quarters[DECODE_QUARTERS * (x.y + y.x) + channels],
        quarters[DECODE_QUARTERS * (x.x + y.y) + channels],
        quarters[DECODE_QUARTERS * (x.y + y.y) + channels],
        place.share,
    ));
}

// The halves around the tile, which begin one before its first.
fn decode_halves(corner: vec2<u32>, lane: u32) {
    let size = params.padded >> vec2<u32>(1u);
    let first = vec2<i32>(corner / 2u) - vec2<i32>(1);
    for (var i = lane; i < DECODE_OUTER * DECODE_OUTER * DECODE_JOINED; i += CONV_LANES) {
        let place = i / DECODE_JOINED;
        let texel = first + vec2<i32>(vec2<u32>(place % DECODE_OUTER, place / DECODE_OUTER)) - vec2<i32>(1);
        var value = vec2<u32>(0u);
        if (conv_inside(texel, size)) {
            value = decode_joined(texel, i % DECODE_JOINED);
        }
        conv_memory[i] = value;
    }
    workgroupBarrier();
    let inputs = ConvTexels(0u, DECODE_OUTER, DECODE_JOINED);
    let strips = conv_strips(DECODE_HALVES);
    for (var i = lane; i < strips * DECODE_HALVES * DECODE_OWN; i += CONV_LANES) {
        let channels = i % DECODE_OWN;
        let strip = i / DECODE_OWN;
        let inside = vec2<u32>(CONV_STRIP * (strip % strips), strip / strips);
        let values = conv_outputs(inputs, inside, HALF_WEIGHTS, DECODE_OWN, channels);
        for (var k = 0u; k < CONV_STRIP; k++) {
            let x = inside.x + k;
            if (x < DECODE_HALVES) {
                conv_memory[DECODE_SHARED + DECODE_OWN * (x + DECODE_HALVES * inside.y) + channels] = values[k];
            }
        }
    }
    workgroupBarrier();
}

// A group of the halves, interpolated at a pixel.
fn decode_enlarged(pixel: vec2<i32>, corner: vec2<u32>, group: u32) -> vec2<u32> {
    let place = conv_enlarged(pixel, params.padded >> vec2<u32>(1u));
    let first = corner / 2u;
    // One more: the halves begin one before the tile.
    let x = vec2<u32>(place.first.x, place.second.x) + vec2<u32>(1u) - vec2<u32>(first.x);
    let y = (vec2<u32>(place.first.y, place.second.y) + vec2<u32>(1u) - vec2<u32>(first.y)) * DECODE_HALVES;
    return conv_pack(conv_mixed(
        conv_memory[DECODE_SHARED + DECODE_OWN * (x.x + y.x) + group],
        conv_memory[DECODE_SHARED + DECODE_OWN * (x.y + y.x) + group],
        conv_memory[DECODE_SHARED + DECODE_OWN * (x.x + y.y) + group],
        conv_memory[DECODE_SHARED + DECODE_OWN * (x.y + y.y) + group],
        place.share,
    ));
}

// Fills the workgroup's memory with the inputs of the tile's last convolution. All invocations call it together.
fn decode_tile(corner: vec2<u32>, lane: u32) {
    decode_halves(corner, lane);
    for (var i = lane; i < DECODE_SHARED; i += CONV_LANES) {
        let place = i / DECODE_LAST;
        let group = i % DECODE_LAST;
        let pixel = vec2<i32>(corner + vec2<u32>(place % DECODE_PIXELS, place / DECODE_PIXELS)) - vec2<i32>(1);
        var value = vec2<u32>(0u);
        if (conv_inside(pixel, params.padded)) {
            if (group == 0u) {
                value = encoded[u32(pixel.x) + params.padded.x * u32(pixel.y)];
            } else {
                value = decode_enlarged(pixel, corner, group - 1u);
            }
        }
        conv_memory[i] = value;
    }
    workgroupBarrier();
}

// The last convolution at a strip of the tile's pixels.
fn decode_strip(inside: vec2<u32>) -> array<vec2<u32>, CONV_STRIP> {
    return conv_outputs(ConvTexels(0u, DECODE_PIXELS, DECODE_LAST), inside, LAST_WEIGHTS, 1u, 0u);
}

// What the network says about a pixel with these outputs of the last convolution: four logits, then two residuals.
// The head's weights: a vector for each of them, then two of biases.
fn decode_head(words: vec2<u32>) -> array<vec4<f32>, 2> {
    let value = conv_unpack(words);
    let logits = conv_weight(HEAD_WEIGHTS + 6u) + vec4<f32>(
        dot(conv_weight(HEAD_WEIGHTS), value),
        dot(conv_weight(HEAD_WEIGHTS + 1u), value),
        dot(conv_weight(HEAD_WEIGHTS + 2u), value),
        dot(conv_weight(HEAD_WEIGHTS + 3u), value),
    );
    let residuals = conv_weight(HEAD_WEIGHTS + 7u) + vec4<f32>(
        dot(conv_weight(HEAD_WEIGHTS + 4u), value),
        dot(conv_weight(HEAD_WEIGHTS + 5u), value),
        0.0,
        0.0,
    );
    return array<vec4<f32>, 2>(logits, residuals);
}
