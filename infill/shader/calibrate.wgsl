// Where in the blocks' ranges the surface lies: the share of the isovalue between the interpolated ends, summed over
// finished hits near holes. A workgroup for every tile with holes and its neighbours, an invocation for one of 2x2 pixels.
#import infill_params
#import infill_rays
#import coarse_field
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> params: InfillParams;
@group(0) @binding(2) var<storage, read> rays: array<u32>;
@group(0) @binding(3) var<storage, read_write> tiles: array<atomic<u32>>;
@group(0) @binding(4) var depth: texture_2d<f32>;
@group(0) @binding(5) var normals: texture_2d<f32>;

const LIST: u32 = 1u;
const NO_SHARE: u32 = 0xffffffffu;

var<workgroup> shares: atomic<u32>;
var<workgroup> samples: atomic<u32>;

// The share at a pixel in steps of 1 / TILES_SHARE_STEPS, or NO_SHARE.
fn pixel_share(pixel: vec2<u32>) -> u32 {
    if (any(pixel >= params.size) || infill_is_hole(frame_number(frame, pixel))) {
        return NO_SHARE;
    }
    if (all(textureLoad(normals, pixel, 0).xyz == vec3<f32>(0.0))) {
        return NO_SHARE;
    }
    let frame_ray = frame_ray(frame, pixel);
    let t = frame_t(frame, frame_ray, textureLoad(depth, pixel, 0).x);
    let ends = coarse_ends(coarse_at(frame_ray.ray.origin + t * frame_ray.ray.direction));
    if (!(ends.y > ends.x)) {
        return NO_SHARE;
    }
    let share = clamp((frame.isovalue - ends.x) / (ends.y - ends.x), 0.0, 1.0);
    return u32(share * TILES_SHARE_STEPS + 0.5);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    let listed = index < atomicLoad(&tiles[LIST]);
    let word = infill_list_word(params, LIST, select(0u, index, listed));
    let corner = infill_tile_corner(params, atomicLoad(&tiles[word]));
    let share = pixel_share(corner + 2u * vec2<u32>(lane & 7u, lane >> 3u));
    if (listed && share != NO_SHARE) {
        atomicAdd(&shares, share);
        atomicAdd(&samples, 1u);
    }
    workgroupBarrier();
    if (lane == 0u && atomicLoad(&samples) > 0u) {
        atomicAdd(&tiles[TILES_SHARES], atomicLoad(&shares));
        atomicAdd(&tiles[TILES_SAMPLES], atomicLoad(&samples));
    }
}
