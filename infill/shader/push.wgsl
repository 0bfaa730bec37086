// Averages of the finished pixels, from 2x2 pixels to 16x16. A workgroup for every tile of LIST, an invocation for 2x2
// pixels.
#import tile_rays
#import average
#import listed_tile

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> params: InfillParams;
@group(0) @binding(2) var<storage, read> rays: array<u32>;
@group(0) @binding(3) var<storage, read> tiles: array<u32>;
@group(0) @binding(4) var<storage, read_write> averages: array<vec4<u32>>;
@group(0) @binding(5) var depth: texture_2d<f32>;
@group(0) @binding(6) var normals: texture_2d<f32>;

// Two vectors of each: a load costs some drivers as much for four numbers as for one.
var<workgroup> texels: array<vec4<f32>, 128>;

fn texel(index: u32) -> Average {
    let scalars = texels[2u * index];
    return Average(scalars.x, scalars.y, texels[2u * index + 1u].xyz, scalars.z);
}

fn keep_texel(index: u32, value: Average) {
    texels[2u * index] = vec4<f32>(value.weight, value.coverage, value.t, 0.0);
    texels[2u * index + 1u] = vec4<f32>(value.normal, 0.0);
}

// Of a finished pixel.
fn pixel_average(pixel: vec2<u32>, lines: FrameRays) -> Average {
    if (any(pixel >= params.size)) {
        return average_none();
    }
    let normal = textureLoad(normals, pixel, 0).xyz;
    if (all(normal == vec3<f32>(0.0))) {
        return Average(1.0, 0.0, vec3<f32>(0.0), 0.0);
    }
    let t = frame_t(frame, frame_ray_of(lines, pixel), textureLoad(depth, pixel, 0).x);
    return Average(1.0, 1.0, normal, t);
}

fn write(level: u32, texel: vec2<u32>, value: Average) {
    let width = (params.size + vec2<u32>((2u << level) - 1u)) >> vec2<u32>(level + 1u);
    if (all(texel < width)) {
        averages[params.levels[level] + texel.x + width.x * texel.y] = average_pack(value);
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let tile = listed_tile(group, groups);
    let own = frame_place(lane);
    let holes = tile_word(tile.corner, lane >> 3u) >> (4u * (lane & 7u));
    let lines = frame_rays(frame);
    var sum = average_none();
    for (var child = 0u; child < 4u; child++) {
        if (((holes >> child) & 1u) == 0u) {
            sum = average_plus(sum, pixel_average(tile.corner + 2u * own + frame_place(child), lines), 1.0);
        }
    }
    let first = average_limited(sum);
    keep_texel(lane, first);
    if (tile.listed) {
        write(0u, tile.corner / 2u + own, first);
    }
    // 8x8 texels become 4x4, 2x2, 1, each of four that follow each other.
    for (var level = 1u; level < 4u; level++) {
        workgroupBarrier();
        let is_texel = (lane << (2u * level)) < 64u;
        var next = average_none();
        if (is_texel) {
            for (var child = 0u; child < 4u; child++) {
                next = average_plus(next, texel(4u * lane + child), 1.0);
            }
            next = average_limited(next);
        }
        workgroupBarrier();
        if (is_texel) {
            keep_texel(lane, next);
            if (tile.listed) {
                write(level, (tile.corner >> vec2<u32>(level + 1u)) + own, next);
            }
        }
    }
}
