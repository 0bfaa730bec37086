// The sampling mask of a pass: a bit for every ray that may be cast, kept from pass to pass of a frame.
#import frame
#import indirect
#import ray_quads

struct SamplingParams {
    gaze: vec2<f32>, // in shares of width and height
    share_per_pixel: vec2<f32>,
    falloff: f32, // half the inverse of the fovea's variance; 0 for no fovea
    base_density: f32,
    slice: u32, // word of the first rank of the frame's slice
    draws: u32, // passes that have drawn after this one; 0 for all rays
}

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> sampling: SamplingParams;
@group(0) @binding(2) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> tiles: array<u32>; // two ranks a word
@group(0) @binding(4) var<storage, read_write> sampling_mask: array<u32>;

var<workgroup> added: atomic<u32>;

fn tile_rank(pixel: vec2<u32>) -> u32 {
    let place = pixel.x % TILE_EDGE + TILE_EDGE * (pixel.y % TILE_EDGE);
    return (tiles[sampling.slice + place / 2u] >> (16u * (place & 1u))) & 0xffffu;
}

// Probability that a pass does not draw the pixel.
fn not_drawn(pixel: vec2<u32>) -> f32 {
    let r = (vec2<f32>(pixel) + vec2<f32>(0.5)) * sampling.share_per_pixel - sampling.gaze;
    let fovea = select(0.0, exp(-sampling.falloff * dot(r, r)), sampling.falloff > 0.0);
    return (1.0 - sampling.base_density) * (1.0 - fovea);
}

fn is_drawn(pixel: vec2<u32>) -> bool {
    var left = not_drawn(pixel);
    if (sampling.draws > 1u) {
        left = pow(max(left, 1e-30), f32(sampling.draws));
    }
    // (rank + 0.5) / TILE_RANKS < 1 - left, without losing digits of a small `left`.
    let above = f32(TILE_RANKS - tile_rank(pixel)) - 0.5;
    return sampling.draws == 0u || above > f32(TILE_RANKS) * left;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    quad_begin(lane);
    if (lane == 0u) {
        atomicStore(&added, 0u);
    }
    workgroupBarrier();
    let first = (indirect_linear_group(group, groups) * 64u + lane) * QUAD_RAYS;
    let corner = frame_pixel(frame, first);
    var bits = 0u;
    for (var i = 0u; i < QUAD_RAYS; i++) {
        let pixel = quad_pixel(corner, i);
        let inside = first < frame.ray_numbers && pixel.x < frame.width && pixel.y < frame.height;
        bits |= select(0u, 1u << i, inside && is_drawn(pixel));
    }
    quad_add(lane, bits);
    workgroupBarrier();
    if (quad_leads(lane) && first < frame.ray_numbers) {
        let before = sampling_mask[first >> 5u];
        let now = before | quad_word(lane);
        sampling_mask[first >> 5u] = now;
        atomicAdd(&added, countOneBits(now ^ before));
    }
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_SAMPLED], atomicLoad(&added));
        if (first == 0u) {
            atomicStore(&rays[RAYS_MASKED], 1u);
            atomicStore(&rays[RAYS_LISTED], 1u); // the list is to be made again
        }
    }
}
