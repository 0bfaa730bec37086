// What the surroundings say about a tile's pixels: the averages, spread from the coarsest level down. The importing
// text declares `params` and
//   var<storage, read> averages: array<vec4<u32>>;
#import infill_params
#import average

// A level's texels in a tile and one more on every side: 10x10, 6x6, 4x4, 3x3.
const PULL_TEXELS: u32 = 161u;

// As halves: a load costs some drivers as much for one number as for four.
var<workgroup> pull_texels: array<vec4<u32>, PULL_TEXELS>;

fn pull_edge(level: u32) -> u32 {
    return (8u >> level) + 2u;
}

fn pull_first(level: u32) -> u32 {
    return select(select(select(0u, 100u, level > 0u), 136u, level > 1u), 152u, level > 2u);
}

// A level's texel, clamped to the picture.
fn pull_load(level: u32, texel: vec2<i32>) -> Average {
    let size = (params.size + vec2<u32>((2u << level) - 1u)) >> vec2<u32>(level + 1u);
    let clamped = vec2<u32>(clamp(texel, vec2<i32>(0), vec2<i32>(size) - vec2<i32>(1)));
    return average_unpack(averages[params.levels[level] + clamped.x + size.x * clamped.y]);
}

// Bilinear interpolation of a level in the middle of a texel of the next finer one, which is (column, row) from the
// tile's first one. Clamped at the picture's edges as the loads are: a texel beyond the edge holds that at the edge.
fn pull_interpolated(level: u32, finer: vec2<i32>) -> Average {
    let upper = (finer + vec2<i32>(1)) >> vec2<u32>(1u);
    let share = select(vec2<f32>(0.25), vec2<f32>(0.75), (finer & vec2<i32>(1)) == vec2<i32>(0));
    let edge = pull_edge(level);
    // The first texel held is the one before the tile.
    let first = pull_first(level) + u32(upper.x) + edge * u32(upper.y);
    var sum = average_none();
    sum = average_plus(sum, average_unpack(pull_texels[first]), (1.0 - share.x) * (1.0 - share.y));
    sum = average_plus(sum, average_unpack(pull_texels[first + 1u]), share.x * (1.0 - share.y));
    sum = average_plus(sum, average_unpack(pull_texels[first + edge]), (1.0 - share.x) * share.y);
    return average_plus(sum, average_unpack(pull_texels[first + edge + 1u]), share.x * share.y);
}

// Fills the workgroup's memory for a tile. All 64 invocations call it together.
fn pull_tile(corner: vec2<u32>, lane: u32) {
    for (var up = 0u; up < 4u; up++) {
        let level = 3u - up;
        let edge = pull_edge(level);
        for (var i = lane; i < edge * edge; i += 64u) {
            // Exact for so few texels; an integer division is slow.
            let row = u32((f32(i) + 0.5) / f32(edge));
            let place = vec2<i32>(vec2<u32>(i - row * edge, row)) - vec2<i32>(1);
            let texel = vec2<i32>(corner >> vec2<u32>(level + 1u)) + place;
            var value = pull_load(level, texel);
            if (level < 3u) {
                let size = (params.size + vec2<u32>((2u << level) - 1u)) >> vec2<u32>(level + 1u);
                // At the edge of the picture the last texel takes part once more.
                let clamped = clamp(texel, vec2<i32>(0), vec2<i32>(size) - vec2<i32>(1));
                let inside = clamped - vec2<i32>(corner >> vec2<u32>(level + 1u));
                value = average_plus(value, pull_interpolated(level + 1u, inside), 1.0 - value.weight);
            }
            pull_texels[pull_first(level) + i] = average_pack(value);
        }
        workgroupBarrier();
    }
}

// What the surroundings say about a pixel of the tile.
fn pull_pixel(inside: vec2<u32>) -> Average {
    return pull_interpolated(0u, vec2<i32>(inside));
}
