// The colour of every hole: that of unfinished pixels where there is no candidate. Finished pixels are not touched. A workgroup
// for every tile with holes.
#import sources
#import mix
#import holes
#import indirect
#ifdef NEIGHBOURS
#import pulled
#endif
#ifdef NETWORK
#import head
#endif

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read_write> tiles: array<atomic<u32>>;
@group(0) @binding(5) var color_out: texture_storage_2d<rgba8unorm, write>;
#ifdef COARSE_FIELD
@group(0) @binding(GUESSES_BINDING) var<storage, read> guesses: array<vec2<u32>>;
#endif
#ifdef HISTORY
@group(0) @binding(HISTORY_BINDING) var<storage, read> history_keys: array<u32>;
#endif
#ifdef NEIGHBOURS
@group(0) @binding(PULLED_BINDING) var<storage, read> pulled: array<vec4<u32>>;
#endif
#ifdef NETWORK
@group(0) @binding(NETWORK_BINDING) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(NETWORK_BINDING + 1u) var<storage, read> decoded: array<vec4<u32>>;
#endif

const LIST: u32 = 0u;
const LANES: u32 = 64u;

var<workgroup> filled_count: atomic<u32>;

fn neighbours(pixel: vec2<u32>, to_viewer: vec3<f32>) -> u32 {
#ifdef NEIGHBOURS
    let average = pulled_pixel(pixel);
    if (average.weight > 0.0) {
        let normal = shading_safe_normalize(average.normal, to_viewer);
        return candidate_pack(average.coverage / average.weight, normal, 0.0);
    }
#endif
    return CANDIDATE_NONE;
}

// What a loop over pixels reads of uniforms and weights, loaded once.
struct FillLoop {
    lines: FrameRays,
#ifdef NETWORK
    head: array<vec4<u32>, HEAD_VECTORS>,
#endif
}

fn fill_loop() -> FillLoop {
#ifdef NETWORK
    return FillLoop(frame_rays(frame), head_weights());
#else
    return FillLoop(frame_rays(frame));
#endif
}

fn hints(loaded: FillLoop, pixel: vec2<u32>, found: array<Candidate, 4>, to_viewer: vec3<f32>) -> MixHints {
#ifdef NETWORK
    let own = mat2x4<f32>(
        vec4<f32>(candidate_pair(found[0], to_viewer), candidate_pair(found[1], to_viewer)),
        vec4<f32>(candidate_pair(found[2], to_viewer), candidate_pair(found[3], to_viewer)));
    let network = head_outputs(loaded.head, pixel, own);
    return MixHints(network[0], network[1].xy, network[1].z);
#else
    // Loaded, so that the mixture is computed as with a network of zeros.
    return MixHints(vec4<f32>(params.none), vec2<f32>(params.none), params.none);
#endif
}

fn fill(loaded: FillLoop, pixel: vec2<u32>) -> bool {
    let ray = frame_ray_of(loaded.lines, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    let coarse = sources_coarse(pixel / 2u);
    let found = array<Candidate, 4>(
        candidate_unpack(neighbours(pixel, to_viewer)),
        candidate_unpack(coarse.x),
        candidate_unpack(coarse.y),
        candidate_unpack(sources_history(sources_key(pixel), ray, frame_number(frame, pixel))),
    );
    let mixed = mix_candidates(found, hints(loaded, pixel, found, to_viewer), to_viewer);
    var color = shading.unfinished;
    if (mixed.filled) {
        let coverage = select(mixed.coverage, step(0.5, mixed.coverage), params.crisp != 0u);
        let surface = vec4<f32>(shading_color(mixed.normal, to_viewer), 1.0);
        color = shading.background * (1.0 - coverage) + surface * coverage;
    }
    // An earlier pass may have filled the pixel with a candidate that has turned out to be wrong.
    textureStore(color_out, pixel, color);
    return mixed.filled;
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane == 0u) {
        atomicStore(&filled_count, 0u);
    }
    let index = indirect_linear_group(group, groups);
    let listed = index < atomicLoad(&tiles[LIST]);
    let word = infill_list_word(params, LIST, select(0u, index, listed));
    let corner = infill_tile_corner(params, atomicLoad(&tiles[word]));
    let count = holes_collect(corner, listed, lane);
    let loaded = fill_loop();
    var filled = 0u;
    for (var i = lane; i < count; i += LANES) {
        filled += u32(fill(loaded, corner + holes_place(i, count)));
    }
    atomicAdd(&filled_count, filled);
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&tiles[TILES_FILLED], atomicLoad(&filled_count));
    }
}
