// The averages spread over the holes, from the coarsest level down to the quads of 2x2 pixels. A workgroup for every tile of LIST, an
// invocation for a quad.
#import average
#import listed_tile

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read> tiles: array<u32>;
@group(0) @binding(2) var<storage, read> averages: array<vec4<u32>>;
@group(0) @binding(3) var<storage, read_write> pulled: array<vec4<u32>>;

// Texels in a tile and one more on every side of the levels above the finest: 6x6, 4x4, 3x3.
const TEXELS: u32 = 61u;

// As halves: a load costs some drivers as much for one number as for four.
var<workgroup> texels: array<vec4<u32>, TEXELS>;

fn edge_of(level: u32) -> u32 {
    return (8u >> level) + 2u;
}

fn first_of(level: u32) -> u32 {
    return select(select(0u, 36u, level > 1u), 52u, level > 2u);
}

fn size_of(level: u32) -> vec2<u32> {
    return (params.size + vec2<u32>((2u << level) - 1u)) >> vec2<u32>(level + 1u);
}

// Bilinear interpolation of a level in the middle of a texel of the next finer one, which is (column, row) from the
// tile's first one. Clamped at the picture's edges as the loads are: a texel beyond the edge holds that at the edge.
fn interpolated(level: u32, finer: vec2<i32>) -> Average {
    let upper = (finer + vec2<i32>(1)) >> vec2<u32>(1u);
    let share = select(vec2<f32>(0.25), vec2<f32>(0.75), (finer & vec2<i32>(1)) == vec2<i32>(0));
    let edge = edge_of(level);
    // The first texel held is the one before the tile.
    let first = first_of(level) + u32(upper.x) + edge * u32(upper.y);
    var sum = average_none();
    sum = average_plus(sum, average_unpack(texels[first]), (1.0 - share.x) * (1.0 - share.y));
    sum = average_plus(sum, average_unpack(texels[first + 1u]), share.x * (1.0 - share.y));
    sum = average_plus(sum, average_unpack(texels[first + edge]), (1.0 - share.x) * share.y);
    return average_plus(sum, average_unpack(texels[first + edge + 1u]), share.x * share.y);
}

// A level's texel, clamped to the picture, with what the next coarser level adds.
fn spread(level: u32, corner: vec2<u32>, place: vec2<i32>) -> Average {
    let first = vec2<i32>(corner >> vec2<u32>(level + 1u));
    let size = size_of(level);
    let texel = clamp(first + place, vec2<i32>(0), vec2<i32>(size) - vec2<i32>(1));
    let value = average_unpack(averages[params.levels[level] + u32(texel.x) + size.x * u32(texel.y)]);
    if (level == 3u) {
        return value;
    }
    return average_plus(value, interpolated(level + 1u, texel - first), 1.0 - value.weight);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let tile = listed_tile(group, groups);
    for (var level = 3u; level > 0u; level--) {
        let edge = edge_of(level);
        if (lane < edge * edge) {
            // Exact for so few texels; an integer division is slow.
            let row = u32((f32(lane) + 0.5) / f32(edge));
            let place = vec2<i32>(vec2<u32>(lane - row * edge, row)) - vec2<i32>(1);
            texels[first_of(level) + lane] = average_pack(spread(level, tile.corner, place));
        }
        workgroupBarrier();
    }
    let place = vec2<u32>(lane & 7u, lane >> 3u);
    let quad = tile.corner / 2u + place;
    let size = size_of(0u);
    if (tile.listed && all(quad < size)) {
        pulled[quad.x + size.x * quad.y] = average_pack(spread(0u, tile.corner, vec2<i32>(place)));
    }
}
