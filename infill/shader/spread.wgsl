// The colours of the reduced picture in the holes of the picture: between the middles of its pixels, which are 2x2 of the picture's.
// One invocation for a pixel of the reduced picture.
#import infill_params
#import infill_rays
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams; // of the reduced picture
@group(0) @binding(1) var<uniform> params: InfillParams;
@group(0) @binding(2) var<storage, read> rays: array<u32>; // of the picture
@group(0) @binding(3) var<storage, read> gate: array<u32>; // no workgroup where the picture is not filled
@group(0) @binding(4) var color: texture_2d<f32>; // reduced
@group(0) @binding(5) var color_out: texture_storage_2d<rgba8unorm, write>;

// Colour of the reduced picture, clamped at its edges.
fn reduced_color(place: vec2<i32>) -> vec4<f32> {
    let size = vec2<i32>(params.size);
    return textureLoad(color, clamp(place, vec2<i32>(0), size - vec2<i32>(1)), 0);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = indirect_linear_group(group, groups) * 64u + lane;
    let place = frame_pixel(frame, number);
    if (number >= frame.ray_numbers || any(place >= params.size) || gate[0] == 0u) {
        return;
    }
    let first = 4u * number;
    let word = rays[RAYS_HEADER + 4u * frame.ray_numbers + (first >> 5u)];
    let holes = (word >> (first & 31u)) & 15u;
    if (holes == 0u) {
        return;
    }
    let own = reduced_color(vec2<i32>(place));
    for (var child = 0u; child < 4u; child++) {
        if (((holes >> child) & 1u) != 0u) {
            let cell = frame_place(child);
            let side = 2 * vec2<i32>(cell) - vec2<i32>(1);
            let beside = reduced_color(vec2<i32>(place) + vec2<i32>(side.x, 0));
            let below = reduced_color(vec2<i32>(place) + vec2<i32>(0, side.y));
            let across = reduced_color(vec2<i32>(place) + side);
            let mixed = 0.5625 * own + 0.1875 * (beside + below) + 0.0625 * across;
            textureStore(color_out, 2u * place + cell, select(mixed, own, params.crisp != 0u));
        }
    }
}
