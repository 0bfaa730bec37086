// The network's first convolution, of the features of quads of 2x2 pixels, over the tiles within two tiles of holes.
#import sources
#import average
#import conv
#import shading

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read> tiles: array<u32>;
@group(0) @binding(5) var<storage, read> known: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> outputs: array<vec2<u32>>;
#ifdef COARSE_FIELD
@group(0) @binding(GUESSES_BINDING) var<storage, read> guesses: array<vec2<u32>>;
#endif
#ifdef HISTORY
@group(0) @binding(HISTORY_BINDING) var<storage, read> history_keys: array<u32>;
#endif

const LIST: u32 = 2u;
const SCALE: u32 = 2u; // a texel is a quad
const LAYER: ConvLayer = ConvLayer(WEIGHTS, 4u, 2u);
const CONV_PAIRS: u32 = 2u;

// What is said about a quad beside its finished pixels.
struct Guessed {
    neighbours: vec2<f32>,
    coarse: vec2<f32>,
    thin: vec2<f32>,
    history: vec2<f32>,
    has_history: f32,
    distances: vec4<f32>, // soft, of coarse field, its thin variant, neighbours, history
}

// The nearest of the hits of the previous frame in the holes of a quad: its key.
fn nearest_key(quad: vec2<u32>, holes: u32) -> u32 {
    var key = 0u;
    for (var child = 0u; child < 4u; child++) {
        if (((holes >> child) & 1u) != 0u) {
            key = max(key, sources_key(2u * quad + frame_place(child)));
        }
    }
    return key;
}

fn guessed(quad: vec2<u32>, holes: u32, average: Average, ray: DdaRay, to_viewer: vec3<f32>) -> Guessed {
    let number = frame_number(frame, 2u * quad + quad_first_hole(holes));
    let words = sources_coarse(quad);
    let coarse = candidate_unpack(words.x);
    let thin = candidate_unpack(words.y);
    let history = candidate_unpack(sources_history(nearest_key(quad, holes), ray, number));
    var found = Guessed(
        vec2<f32>(0.0), candidate_pair(coarse, to_viewer), candidate_pair(thin, to_viewer),
        candidate_pair(history, to_viewer),
        select(0.0, 1.0, history.valid),
        vec4<f32>(coarse.soft_distance, thin.soft_distance, 0.0, history.soft_distance));
#ifdef NEIGHBOURS
    if (average.coverage > 0.0) {
        let normal = shading_safe_normalize(average.normal, to_viewer);
        let coverage = average.coverage / average.weight;
        found.neighbours = coverage * vec2<f32>(1.0, clamp(dot(normal, to_viewer), 0.0, 1.0));
        found.distances.z = candidate_soft_distance(average.t / average.coverage - infill_t_low(ray, number));
    }
#endif
    return found;
}

// What the network reads of a quad, in groups of four: the share that is finished, that times its coverage and coverage N.V; the same
// two of every candidate for what is holes; whether history has one; soft distances.
fn features_at(quad: vec2<u32>) -> array<vec4<f32>, 4> {
    let holes = quad_holes(quad);
    let inside = min(params.size - 2u * quad, vec2<u32>(2u));
    let hole_share = 0.25 * f32(countOneBits(holes));
    let done = 0.25 * f32(inside.x * inside.y) - hole_share;
    let ray = frame_ray(frame, 2u * quad + quad_first_hole(holes)).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    // Of the finished pixels, if there are any.
    let average = average_unpack(known[quad_index(quad)]);
    let mean = vec2<f32>(average.coverage, clamp(dot(average.normal, to_viewer), 0.0, 1.0));
    let finished = select(vec2<f32>(0.0), mean, done > 0.0);
    let own = done * finished;
    if (holes == 0u) {
        return array<vec4<f32>, 4>(
            vec4<f32>(done, own, finished.x), vec4<f32>(finished.y, own, own.x),
            vec4<f32>(own.y, done, own), vec4<f32>(0.0));
    }
    let guess = guessed(quad, holes, average, ray, to_viewer);
    let near = select(guess.neighbours, finished, done > 0.0);
    let coarse = own + hole_share * guess.coarse;
    let thin = own + hole_share * guess.thin;
    let history = own + hole_share * guess.history;
    return array<vec4<f32>, 4>(
        vec4<f32>(done, own, near.x),
        vec4<f32>(near.y, coarse, thin.x),
        vec4<f32>(thin.y, done + hole_share * guess.has_history, history),
        hole_share * guess.distances,
    );
}

// Nothing where the map is padded beyond the picture.
fn inputs_at(quad: vec2<u32>, size: vec2<u32>) -> array<vec4<u32>, CONV_PAIRS> {
    var features = array<vec4<f32>, 4>();
    if (all(2u * quad < params.size)) {
        features = features_at(quad);
    }
    return array<vec4<u32>, CONV_PAIRS>(
        conv_pack_pair(features[0], features[1]), conv_pack_pair(features[2], features[3]));
}

@compute @workgroup_size(CONV_LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    conv_layer(listed_tile(group, groups), lane);
}
