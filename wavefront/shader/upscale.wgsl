// A preview becomes a picture: its pixels are every step-th of the picture's, as they are; the others, which stay unfinished, get colours
// between theirs. The pictures are unfinished everywhere, with the background's colour. One invocation for a ray of the preview.
#import frame
#import indirect
#import output_textures
#import shading

struct UpscaleParams {
    size: vec2<u32>, // of the picture
    step: u32,
    crisp: u32,      // 1: colours of the preview's pixels, no mixtures
}

@group(0) @binding(0) var<uniform> frame: FrameParams; // the preview's
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: UpscaleParams;
@group(0) @binding(PREVIEW_COLOR_BINDING) var color: texture_2d<f32>;
#ifdef OUTPUT_DEPTH
@group(0) @binding(PREVIEW_DEPTH_BINDING) var depth: texture_2d<f32>;
#endif
#ifdef OUTPUT_NORMAL
@group(0) @binding(PREVIEW_NORMAL_BINDING) var normals: texture_2d<f32>;
#endif
#ifdef OUTPUT_STATUS
@group(0) @binding(PREVIEW_STATUS_BINDING) var statuses: texture_2d<u32>;
#endif

// What the preview's own pixel has beside its colour.
fn write_own(place: vec2<u32>, pixel: vec2<u32>) {
#ifdef OUTPUT_DEPTH
    textureStore(depth_out, pixel, vec4<f32>(textureLoad(depth, place, 0).x));
#endif
#ifdef OUTPUT_NORMAL
    textureStore(normal_out, pixel, textureLoad(normals, place, 0));
#endif
#ifdef OUTPUT_STATUS
    textureStore(status_out, pixel, vec4<u32>(textureLoad(statuses, place, 0).x));
#endif
}

// Whether a pixel of the preview, or one that follows it, may be anything but background.
fn may_differ(place: vec2<u32>) -> bool {
#ifdef OUTPUT_STATUS
    return true;
#else
    return frame_may_meet(frame, place, vec2<u32>(2u));
#endif
}

// As the pictures hold them.
fn packed(colors: mat4x4<f32>) -> vec4<u32> {
    return vec4<u32>(
        pack4x8unorm(colors[0]), pack4x8unorm(colors[1]), pack4x8unorm(colors[2]), pack4x8unorm(colors[3]));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = indirect_linear_group(group, groups) * 64u + lane;
    let size = vec2<u32>(frame.width, frame.height);
    let place = frame_pixel(frame, number);
    if (number >= frame.ray_numbers || any(place >= size)) {
        return;
    }
    let pixel = params.step * place;
    if (!may_differ(place)) {
        return;
    }
    write_own(place, pixel);
    let next = min(place + vec2<u32>(1u), size - vec2<u32>(1u));
    let corners = mat4x4<f32>(
        textureLoad(color, place, 0), textureLoad(color, vec2<u32>(next.x, place.y), 0),
        textureLoad(color, vec2<u32>(place.x, next.y), 0), textureLoad(color, next, 0));
    if (all(packed(corners) == vec4<u32>(pack4x8unorm(shading.background)))) {
        return;
    }
    let cells = params.step * params.step + frame_zero(u32(corners[0].x));
    for (var i = 0u; i < cells; i++) {
        let cell = frame_place(i);
        let shares = select(vec2<f32>(cell) / f32(params.step), vec2<f32>(0.0), params.crisp != 0u);
        let upper = corners[0] + shares.x * (corners[1] - corners[0]);
        let lower = corners[2] + shares.x * (corners[3] - corners[2]);
        if (all(pixel + cell < params.size)) {
            textureStore(color_out, pixel + cell, upper + shares.y * (lower - upper));
        }
    }
}
