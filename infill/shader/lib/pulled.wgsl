// What a pixel's surroundings say. The importing text declares `params` and
//   var<storage, read> pulled: array<vec4<u32>>;    quads of 2x2 pixels
#import quads
#import average

// Bilinear interpolation of the quads, clamped at the picture's edges.
fn pulled_pixel(pixel: vec2<u32>) -> Average {
    let size = (params.size + vec2<u32>(1u)) >> vec2<u32>(1u);
    let upper = (pixel + vec2<u32>(1u)) >> vec2<u32>(1u);
    let share = select(vec2<f32>(0.25), vec2<f32>(0.75), (pixel & vec2<u32>(1u)) == vec2<u32>(0u));
    let first = max(upper, vec2<u32>(1u)) - vec2<u32>(1u);
    let second = min(upper, size - vec2<u32>(1u));
    var sum = average_none();
    sum = average_plus(sum, average_unpack(pulled[quad_index(first)]), (1.0 - share.x) * (1.0 - share.y));
    sum = average_plus(
        sum, average_unpack(pulled[quad_index(vec2<u32>(second.x, first.y))]), share.x * (1.0 - share.y));
    sum = average_plus(
        sum, average_unpack(pulled[quad_index(vec2<u32>(first.x, second.y))]), (1.0 - share.x) * share.y);
    return average_plus(sum, average_unpack(pulled[quad_index(second)]), share.x * share.y);
}
