// Unfinished rays through the coarse field.
#import coarse_field

const MARCH_FIRST_STEP: f32 = 2.0;          // voxels: half a block
const MARCH_STEP_GROWTH: f32 = 0.0078125;   // per voxel from the start
const MARCH_MOST_STEPS: u32 = 512u;         // farther than any volume that can be rendered is deep

// First crossings of the field at a share of the blocks' ranges (x) and of the one that favours thin features (y): halfway to
// the end on the side that the ray looks for.
struct March {
    hit: vec2<bool>,
    t: vec2<f32>,
    shares: vec2<f32>, // of the blocks' ranges: what the two fields are
}

fn march_at(ray: DdaRay, t: f32) -> CoarseSample {
    return coarse_at(ray.origin + t * ray.direction);
}

// From t_low on. The side on which the ray starts is that of the first field where it enters the volume; up to t_low it
// has not changed sides.
fn march(ray: DdaRay, volume: DdaBox, t_low: f32, isovalue: f32, share: f32, most_steps: u32) -> March {
    let entry = dda_entry(ray, volume).t;
    let exit = dda_exit(ray, volume).t;
    let inside = coarse_values(coarse_ends(march_at(ray, entry)), vec2<f32>(share)).x >= isovalue;
    let shares = vec2<f32>(share, 0.5 * (share + select(1.0, 0.0, inside)));
    var march = March(vec2<bool>(false), vec2<f32>(0.0), shares);
    var t = t_low;
    var before = t_low;
    var values_before = vec2<f32>(0.0);
    for (var step = 0u; step < most_steps; step++) {
        let values = coarse_values(coarse_ends(march_at(ray, t)), shares) - vec2<f32>(isovalue);
        let crossed = (values >= vec2<f32>(0.0)) != vec2<bool>(inside);
        let found = crossed & !march.hit;
        // The first sample lies behind no other: the crossing is where the ray waits.
        let s = select(values_before / (values_before - values), vec2<f32>(1.0), vec2<bool>(step == 0u));
        march.t = select(march.t, vec2<f32>(before) + s * (t - before), found);
        march.hit = march.hit | crossed;
        if (t >= exit || all(march.hit)) {
            break;
        }
        before = t;
        values_before = values;
        t = min(t + MARCH_FIRST_STEP + MARCH_STEP_GROWTH * (t - t_low), exit);
    }
    return march;
}
