// The colour of every hole: that of unfinished pixels where there is no candidate. Finished pixels are not touched.
// With the network: its way back from the coarser levels. Without: the candidates, too. A workgroup for every tile with
// holes.
#import sources
#import mix
#import indirect
#ifdef NETWORK
#import decode
#else
#import guesses
#import holes
#endif

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read_write> tiles: array<atomic<u32>>;
@group(0) @binding(5) var color_out: texture_storage_2d<rgba8unorm, write>;
#ifdef HISTORY
@group(0) @binding(HISTORY_BINDING) var<storage, read> history_keys: array<u32>;
#endif
#ifdef NETWORK
@group(0) @binding(NETWORK_BINDING) var<storage, read> candidates: array<u32>;
@group(0) @binding(NETWORK_BINDING + 1u) var<storage, read> weights: array<vec2<u32>>;
@group(0) @binding(NETWORK_BINDING + 2u) var<storage, read> encoded: array<vec2<u32>>;
@group(0) @binding(NETWORK_BINDING + 3u) var<storage, read> halves: array<vec2<u32>>;
@group(0) @binding(NETWORK_BINDING + 4u) var<storage, read> quarters: array<vec2<u32>>;
#endif
#ifdef NEIGHBOURS
@group(0) @binding(AVERAGES_BINDING) var<storage, read> averages: array<vec4<u32>>;
#endif

const LIST: u32 = 0u;
const LANES: u32 = 64u;

var<workgroup> filled_count: atomic<u32>;

fn hints(words: vec2<u32>) -> MixHints {
#ifdef NETWORK
    let network = decode_head(words);
    return MixHints(network[0], network[1].xy, network[1].z);
#else
    // Loaded, so that the mixture is computed as with a network of zeros.
    return MixHints(vec4<f32>(params.none), vec2<f32>(params.none), params.none);
#endif
}

// `words`: what the network has for the pixel.
fn fill(pixel: vec2<u32>, number: u32, guesses: vec3<u32>, words: vec2<u32>) -> bool {
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    let mixed = mix_candidates(sources_candidates(guesses, pixel, ray, number), hints(words), to_viewer);
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

#ifdef NETWORK
fn fill_tile(corner: vec2<u32>, listed: bool, lane: u32) {
    decode_tile(corner, lane);
    let strips = conv_strips(INFILL_TILE);
    var filled = 0u;
    for (var i = lane; i < strips * INFILL_TILE; i += LANES) {
        let inside = vec2<u32>(CONV_STRIP * (i % strips), i / strips);
        var words = decode_strip(inside);
        for (var k = 0u; k < CONV_STRIP; k++) {
            let pixel = corner + inside + vec2<u32>(k, 0u);
            let number = frame_number(frame, pixel);
            if (listed && all(pixel < params.size) && infill_is_hole(number)) {
                filled += u32(fill(pixel, number, sources_guesses(pixel), words[k]));
            }
        }
    }
    atomicAdd(&filled_count, filled);
}
#else
fn fill_tile(corner: vec2<u32>, listed: bool, lane: u32) {
    let count = holes_collect(corner, listed, lane);
#ifdef NEIGHBOURS
    pull_tile(corner, lane);
#endif
    let share = infill_share(atomicLoad(&tiles[TILES_SHARES]), atomicLoad(&tiles[TILES_SAMPLES]));
    var filled = 0u;
    for (var i = lane; i < count; i += LANES) {
        let inside = holes_place(i, count);
        let pixel = corner + inside;
        let number = frame_number(frame, pixel);
        filled += u32(fill(pixel, number, guesses(pixel, number, inside, share), vec2<u32>(0u)));
    }
    atomicAdd(&filled_count, filled);
}
#endif

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane == 0u) {
        atomicStore(&filled_count, 0u);
    }
    workgroupBarrier();
    let index = indirect_linear_group(group, groups);
    let listed = index < atomicLoad(&tiles[LIST]);
    let word = infill_list_word(params, LIST, select(0u, index, listed));
    let corner = infill_tile_corner(params, atomicLoad(&tiles[word]));
    fill_tile(corner, listed, lane);
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&tiles[TILES_FILLED], atomicLoad(&filled_count));
    }
}
