// Puts the finished pixels into the caller's picture: a triangle over the whole viewport, colour and
// depth of the nearest pixel; pixels without a hit are left alone.

struct DrawParams {
    // Clip-space z and w are affine in view depth with coefficients affine in (x, y) of clip space:
    // z = z0.x + z0.y x + z0.z y + depth (z1.x + z1.y x + z1.z y), and likewise w.
    z0: vec4<f32>,
    z1: vec4<f32>,
    w0: vec4<f32>,
    w1: vec4<f32>,
    depth_none: f32,
    linear_color: u32, // 1: the target encodes to sRGB itself
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: DrawParams;
@group(0) @binding(1) var color_in: texture_2d<f32>;
@group(0) @binding(2) var depth_in: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) clip: vec2<f32>,
}

@vertex
fn draw_vertex(@builtin(vertex_index) index: u32) -> Corner {
    let clip = vec2<f32>(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return Corner(vec4<f32>(clip, 0.0, 1.0), clip);
}

struct Fragment {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

fn linear_from_srgb(c: vec3<f32>) -> vec3<f32> {
    let low = c / 12.92;
    let high = pow((c + vec3<f32>(0.055)) / 1.055, vec3<f32>(2.4));
    return select(high, low, c <= vec3<f32>(0.04045));
}

@fragment
fn draw_fragment(corner: Corner) -> Fragment {
    let size = textureDimensions(color_in);
    let share = vec2<f32>(0.5 + 0.5 * corner.clip.x, 0.5 - 0.5 * corner.clip.y);
    let last = vec2<i32>(size) - vec2<i32>(1);
    let pixel = clamp(vec2<i32>(floor(share * vec2<f32>(size))), vec2<i32>(0), last);
    let view_depth = textureLoad(depth_in, pixel, 0).x;
    if (view_depth >= params.depth_none) {
        discard;
    }
    // The depth belongs to the ray through the pixel's centre.
    let centre = (vec2<f32>(pixel) + vec2<f32>(0.5)) / vec2<f32>(size);
    let xy = vec3<f32>(1.0, 2.0 * centre.x - 1.0, 1.0 - 2.0 * centre.y);
    let z = dot(params.z0.xyz, xy) + view_depth * dot(params.z1.xyz, xy);
    let w = dot(params.w0.xyz, xy) + view_depth * dot(params.w1.xyz, xy);
    let depth = z / w;
    if (depth < 0.0 || depth > 1.0) {
        discard;
    }
    var color = textureLoad(color_in, pixel, 0);
    if (params.linear_color != 0u) {
        color = vec4<f32>(linear_from_srgb(color.rgb), color.a);
    }
    return Fragment(color, depth);
}
