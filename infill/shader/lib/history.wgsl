// The hits of the previous frame: keys whose upper half is the depth behind the ray's entry into the volume, whose lower
// half is the normal, inverted, so that the greatest is that of the nearest hit and 0 is none.
#import candidate
#import infill_rays

const HISTORY_DEPTH_STEPS: f32 = 65534.0; // over the volume's diagonal
const HISTORY_SLACK: f32 = 1.0;           // voxels; a hit stands for a whole pixel of another picture

fn history_key(behind: f32, normal: vec3<f32>) -> u32 {
    let depth = u32(clamp(behind / params.diagonal, 0.0, 1.0) * HISTORY_DEPTH_STEPS + 0.5);
    return ~((depth << 16u) | (candidate_pack_normal(normal) >> 16u));
}

// The candidate's word; none where the ray would have found the hit already.
fn history_candidate(ray: DdaRay, inverted_key: u32, t_low: f32) -> u32 {
    if (inverted_key == 0u) {
        return CANDIDATE_NONE;
    }
    let key = ~inverted_key;
    let behind = f32(key >> 16u) * (params.diagonal / HISTORY_DEPTH_STEPS);
    let distance = dda_entry(ray, infill_volume()).t + behind - t_low;
    if (distance < -HISTORY_SLACK) {
        return CANDIDATE_NONE;
    }
    return candidate_pack(1.0, candidate_unpack_normal(key << 16u), distance);
}
