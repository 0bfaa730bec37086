// The picture at half its resolution, for in-fill to work on: of 2x2 pixels one that is finished, or a hole where none is. One
// invocation for a pixel of the reduced picture; nothing where no ray is active.
#import infill_rays
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams; // of the reduced picture
@group(0) @binding(1) var<storage, read> rays: array<u32>; // of the picture
@group(0) @binding(2) var<storage, read> active_args: array<u32>; // from word 4 on
@group(0) @binding(3) var<storage, read_write> reduced: array<u32>;
@group(0) @binding(4) var color: texture_2d<f32>;
@group(0) @binding(5) var depth: texture_2d<f32>;
@group(0) @binding(6) var normals: texture_2d<f32>;
@group(0) @binding(7) var color_out: texture_storage_2d<rgba8unorm, write>;
@group(0) @binding(8) var depth_out: texture_storage_2d<r32float, write>;
@group(0) @binding(9) var normal_out: texture_storage_2d<rgba16float, write>;

const LANES: u32 = 64u;

var<workgroup> holes: array<atomic<u32>, 2>;

// A bit for each of four pixels that lies in the picture.
fn inside(corner: vec2<u32>, size: vec2<u32>) -> u32 {
    let next = vec2<u32>(corner + vec2<u32>(1u) < size);
    return 1u | (next.x << 1u) | (next.y << 2u) | ((next.x & next.y) << 3u);
}

// Copies what the picture has of one pixel.
fn copy_pixel(pixel: vec2<u32>, to: vec2<u32>) {
    textureStore(color_out, to, textureLoad(color, pixel, 0));
    textureStore(depth_out, to, vec4<f32>(textureLoad(depth, pixel, 0).x));
    textureStore(normal_out, to, textureLoad(normals, pixel, 0));
}

// Whether the reduced picture has a hole there.
fn reduce(number: u32, place: vec2<u32>) -> bool {
    let first = 4u * number;
    let word = rays[RAYS_HEADER + 4u * frame.ray_numbers + (first >> 5u)];
    let active_bits = (word >> (first & 31u)) & 15u;
    let finished = ~active_bits & inside(2u * place, textureDimensions(color));
    if (finished != 0u) {
        copy_pixel(2u * place + frame_place(firstTrailingBit(finished)), place);
        return false;
    }
    reduced[RAYS_HEADER + number] = rays[RAYS_HEADER + first];
    return true;
}

fn write_header() {
    for (var i = 0u; i < RAYS_HEADER; i++) {
        reduced[i] = rays[i];
    }
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane < 2u) {
        atomicStore(&holes[lane], 0u);
    }
    workgroupBarrier();
    let first = indirect_linear_group(group, groups) * LANES;
    let number = first + lane;
    let place = frame_pixel(frame, number);
    let is_pixel = number < frame.ray_numbers && all(place < vec2<u32>(frame.width, frame.height));
    if (is_pixel && active_args[4] > 0u) {
        if (reduce(number, place)) {
            atomicOr(&holes[lane >> 5u], 1u << (lane & 31u));
        }
    }
    workgroupBarrier();
    if (lane < 2u && first < frame.ray_numbers) {
        reduced[RAYS_HEADER + frame.ray_numbers + (first >> 5u) + lane] = atomicLoad(&holes[lane]);
    }
    if (number == 0u) {
        write_header();
    }
}
