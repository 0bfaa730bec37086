// The candidates of a hole but that of history: neighbours, coarse field, its thin variant. The importing text declares
// `frame`, `shading`, `params`, `rays` and
//   var<storage, read> averages: array<vec4<u32>>;   with NEIGHBOURS
#import infill_params
#import infill_rays
#import candidate
#import shading
#ifdef NEIGHBOURS
#import pull
#endif
#ifdef COARSE_FIELD
#import march
#endif

// `share`: of the blocks' ranges, where the surface lies.
fn guesses(pixel: vec2<u32>, number: u32, inside: vec2<u32>, share: f32) -> vec3<u32> {
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    let t_low = infill_t_low(ray, number);
    var words = vec3<u32>(CANDIDATE_NONE);
#ifdef NEIGHBOURS
    let average = pull_pixel(inside);
    if (average.weight > 0.0) {
        var distance = 0.0;
#ifdef NETWORK
        // Only the network looks at it.
        distance = select(0.0, average.t / average.coverage - t_low, average.coverage > 0.0);
#endif
        let normal = shading_safe_normalize(average.normal, to_viewer);
        words.x = candidate_pack(average.coverage / average.weight, normal, distance);
    }
#endif
#ifdef COARSE_FIELD
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
