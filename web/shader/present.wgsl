// From the renderer's pictures to the canvas.

// Whether unfinished pixels keep what was shown there before.
override KEEP_LAST: bool;

// progressive_iso::PixelStatus::Unfinished.
const UNFINISHED = 2u;

@group(0) @binding(0) var newest: texture_2d<f32>;
@group(0) @binding(1) var status: texture_2d<u32>;
@group(0) @binding(2) var shown: texture_2d<f32>;
@group(0) @binding(3) var linear: sampler;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

// One triangle that covers the target.
@vertex
fn cover(@builtin(vertex_index) corner: u32) -> Corner {
    let uv = vec2f(vec2u((corner << 1u) & 2u, corner & 2u));
    return Corner(vec4f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.0, 1.0), uv);
}

// The newest picture's pixels, over those shown before.
@fragment
fn take(corner: Corner) -> @location(0) vec4f {
    let pixel = vec2u(corner.position.xy);
    if KEEP_LAST && textureLoad(status, pixel, 0).x == UNFINISHED {
        discard;
    }
    return textureLoad(newest, pixel, 0);
}

// What is shown, in the target's size.
@fragment
fn stretch(corner: Corner) -> @location(0) vec4f {
    return textureSampleLevel(shown, linear, corner.uv, 0.0);
}
