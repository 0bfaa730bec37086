// The mixture of a hole's candidates. The importing text gives the logarithms of their weights without a network,
// PRIOR_NEIGHBOURS, PRIOR_COARSE, PRIOR_COARSE_THIN, PRIOR_HISTORY, and how much less neighbours that disagree weigh, DOUBT.
#import candidate
#import shading

struct Mix {
    filled: bool, // false without any candidate
    coverage: f32,
    normal: vec3<f32>,
}

// What the network says about a pixel.
struct MixHints {
    logits: vec4<f32>,
    residuals: vec2<f32>, // of coverage and N.V
    doubt: f32, // the same for every pixel
}

// Some unit vector perpendicular to a unit vector.
fn mix_perpendicular(v: vec3<f32>) -> vec3<f32> {
    let other = select(vec3<f32>(0.0, -v.z, v.y), vec3<f32>(-v.y, v.x, 0.0), abs(v.z) < 0.9);
    return shading_safe_normalize(other, vec3<f32>(1.0, 0.0, 0.0));
}

fn mix_candidates(found: array<Candidate, 4>, hints: MixHints, to_viewer: vec3<f32>) -> Mix {
    var candidates = found;
    var logits = vec4<f32>(PRIOR_NEIGHBOURS, PRIOR_COARSE, PRIOR_COARSE_THIN, PRIOR_HISTORY) + hints.logits;
    let share = candidates[0].coverage;
    logits.x -= (DOUBT + hints.doubt) * 4.0 * share * (1.0 - share);
    var most = -3.0e38;
    for (var i = 0u; i < 4u; i++) {
        if (candidates[i].valid) {
            most = max(most, logits[i]);
        }
    }
    var total = 0.0;
    var coverage = 0.0;
    var facing = 0.0;
    var normal = vec3<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        if (candidates[i].valid) {
            let weight = exp(logits[i] - most);
            let covered = weight * candidates[i].coverage;
            total += weight;
            coverage += covered;
            facing += covered * candidate_facing(candidates[i], to_viewer);
            normal += covered * candidates[i].normal;
        }
    }
    if (total == 0.0) {
        return Mix(false, 0.0, to_viewer);
    }
    let mean = select(0.5, facing / coverage, coverage > 0.0);
    let tilted = clamp(mean + hints.residuals.y, 0.0, 1.0);
    // Of the normal only the direction around the view axis stays.
    let across = normal - dot(normal, to_viewer) * to_viewer;
    var side = mix_perpendicular(to_viewer);
    if (dot(across, across) > 1.0e-12) {
        side = shading_safe_normalize(across, side);
    }
    let shaded = tilted * to_viewer + sqrt(max(1.0 - tilted * tilted, 0.0)) * side;
    return Mix(true, clamp(coverage / total + hints.residuals.x, 0.0, 1.0), shaded);
}
