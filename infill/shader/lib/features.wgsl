// What the network reads at a pixel: finished, its coverage, coverage times N.V; the same two of every candidate;
// whether history has one; soft distances of coarse field, thin variant, neighbours, history.
// The importing text declares `params`, `frame`, `shading`, `rays` and
//   var<storage, read> candidates: array<u32>;
//   var<storage, read> history_keys: array<u32>;   with HISTORY
//   var normals: texture_2d<f32>;
#import infill_params
#import history
#import shading

// The candidates of a hole: neighbours, coarse field, its thin variant, history.
fn features_candidates(pixel: vec2<u32>, ray: DdaRay, number: u32) -> array<Candidate, 4> {
    let index = infill_pixel_index(params, pixel);
    var history = CANDIDATE_NONE;
#ifdef HISTORY
    let key = history_keys[index];
    if (key != 0u) {
        history = history_candidate(ray, key, infill_t_low(ray, number));
    }
#endif
    return array<Candidate, 4>(
        candidate_unpack(candidates[3u * index]),
        candidate_unpack(candidates[3u * index + 1u]),
        candidate_unpack(candidates[3u * index + 2u]),
        candidate_unpack(history),
    );
}

// All of them, in groups of four.
fn features_at(pixel: vec2<u32>) -> array<vec4<f32>, 4> {
    let number = frame_number(frame, pixel);
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    if (!infill_is_hole(number)) {
        let normal = textureLoad(normals, pixel, 0).xyz;
        let c = select(0.0, 1.0, any(normal != vec3<f32>(0.0)));
        let cn = clamp(dot(normal, to_viewer), 0.0, 1.0);
        return array<vec4<f32>, 4>(
            vec4<f32>(1.0, c, cn, c), vec4<f32>(cn, c, cn, c), vec4<f32>(cn, 1.0, c, cn), vec4<f32>(0.0));
    }
    var found = features_candidates(pixel, ray, number);
    var cn = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        cn[i] = found[i].coverage * candidate_facing(found[i], to_viewer);
    }
    return array<vec4<f32>, 4>(
        vec4<f32>(0.0, 0.0, 0.0, found[0].coverage),
        vec4<f32>(cn.x, found[1].coverage, cn.y, found[2].coverage),
        vec4<f32>(cn.z, select(0.0, 1.0, found[3].valid), found[3].coverage, cn.w),
        vec4<f32>(found[1].soft_distance, found[2].soft_distance, found[0].soft_distance, found[3].soft_distance),
    );
}
