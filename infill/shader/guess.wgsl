// The candidates of every hole but that of history: neighbours, coarse field, its thin variant. A workgroup for
// every tile with holes.
#import infill_params
#import infill_rays
#import candidate
#import shading
#import indirect
#ifdef NEIGHBOURS
#import pull
#endif
#ifdef COARSE_FIELD
#import march
#endif

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read> tiles: array<u32>;
@group(0) @binding(5) var<storage, read_write> candidates: array<u32>;
#ifdef NEIGHBOURS
@group(0) @binding(AVERAGES_BINDING) var<storage, read> averages: array<vec4<u32>>;
#endif

const LIST: u32 = 0u;

fn guess(pixel: vec2<u32>, number: u32, inside: vec2<u32>) -> vec3<u32> {
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    let t_low = infill_t_low(ray, number);
    var words = vec3<u32>(CANDIDATE_NONE);
#ifdef NEIGHBOURS
    let average = pull_pixel(inside);
    if (average.weight > 0.0) {
        let distance = select(0.0, average.t / average.coverage - t_low, average.coverage > 0.0);
        let normal = shading_safe_normalize(average.normal, to_viewer);
        words.x = candidate_pack(average.coverage / average.weight, normal, distance);
    }
#endif
#ifdef COARSE_FIELD
    let share = infill_share(tiles[TILES_SHARES], tiles[TILES_SAMPLES]);
    let most_steps = MARCH_MOST_STEPS + frame_zero(number);
    let march = march(ray, infill_volume(), t_low, frame.isovalue, share, most_steps);
    let miss = candidate_pack(0.0, vec3<f32>(0.0), 0.0);
    words.y = miss;
    words.z = miss;
    if (march.hit.x) {
        let gradient = coarse_gradient(march_at(ray, march.t.x), march.shares.x);
        words.y = candidate_pack(1.0, shading_normal(gradient, to_viewer), march.t.x - t_low);
    }
    if (march.hit.y) {
        let gradient = coarse_gradient(march_at(ray, march.t.y), march.shares.y);
        words.z = candidate_pack(1.0, shading_normal(gradient, to_viewer), march.t.y - t_low);
    }
#endif
    return words;
}

// The tile's holes, so that no lane is without one while others work.
var<workgroup> holes: array<u32, INFILL_TILE * INFILL_TILE>;
var<workgroup> hole_count: atomic<u32>;

fn collect_holes(corner: vec2<u32>, lane: u32) {
    for (var i = lane; i < INFILL_TILE * INFILL_TILE; i += 64u) {
        let pixel = corner + vec2<u32>(i % INFILL_TILE, i / INFILL_TILE);
        if (all(pixel < params.size) && infill_is_hole(frame_number(frame, pixel))) {
            holes[atomicAdd(&hole_count, 1u)] = i;
        }
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    let listed = index < tiles[LIST];
    let corner = infill_tile_corner(params, tiles[infill_list_word(params, LIST, select(0u, index, listed))]);
    if (lane == 0u) {
        atomicStore(&hole_count, 0u);
    }
    workgroupBarrier();
    if (listed) {
        collect_holes(corner, lane);
    }
    workgroupBarrier();
#ifdef NEIGHBOURS
    pull_tile(corner, lane);
#endif
    let count = atomicLoad(&hole_count);
    for (var i = lane; i < count; i += 64u) {
        let inside = vec2<u32>(holes[i] % INFILL_TILE, holes[i] / INFILL_TILE);
        let pixel = corner + inside;
        let words = guess(pixel, frame_number(frame, pixel), inside);
        let first = 3u * infill_pixel_index(params, pixel);
        candidates[first] = words.x;
        candidates[first + 1u] = words.y;
        candidates[first + 2u] = words.z;
    }
}
