// The colour of every hole: that of unfinished pixels where there is no candidate. Finished pixels are not touched. With the network: its last
// convolution and its head. A workgroup for every tile with holes.
#import features
#import mix
#import indirect
#ifdef NETWORK
#import conv
#endif

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read_write> tiles: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read> candidates: array<u32>;
@group(0) @binding(6) var normals: texture_2d<f32>;
@group(0) @binding(7) var color_out: texture_storage_2d<rgba8unorm, write>;
#ifdef HISTORY
@group(0) @binding(HISTORY_BINDING) var<storage, read> history_keys: array<u32>;
#endif
#ifdef NETWORK
@group(0) @binding(NETWORK_BINDING) var<storage, read> weights: array<vec2<u32>>;
@group(0) @binding(NETWORK_BINDING + 1u) var<storage, read> encoded: array<vec2<u32>>;
@group(0) @binding(NETWORK_BINDING + 2u) var<storage, read> coarser: array<vec2<u32>>;
#endif

const LIST: u32 = 0u;
const LANES: u32 = 64u;

var<workgroup> filled_count: atomic<u32>;

#ifdef NETWORK
// The first convolution's channels, then two groups of the coarser level.
fn conv_input(texel: vec2<i32>, group: u32) -> vec4<f32> {
    if (group == 0u) {
        return conv_unpack(encoded[u32(texel.x) + params.padded.x * u32(texel.y)]);
    }
    let size = params.padded >> vec2<u32>(1u);
    let place = conv_enlarged(texel, size);
    let x = vec2<u32>(vec2<i32>(place.first.x, place.second.x));
    let y = vec2<u32>(vec2<i32>(place.first.y, place.second.y)) * size.x;
    let a = conv_unpack(coarser[2u * (x.x + y.x) + group - 1u]);
    let b = conv_unpack(coarser[2u * (x.y + y.x) + group - 1u]);
    let c = conv_unpack(coarser[2u * (x.x + y.y) + group - 1u]);
    let d = conv_unpack(coarser[2u * (x.y + y.y) + group - 1u]);
    let upper = a * (1.0 - place.share.x) + b * place.share.x;
    let lower = c * (1.0 - place.share.x) + d * place.share.x;
    return upper * (1.0 - place.share.y) + lower * place.share.y;
}

// The head: vectors of weights, four for logits, two for residuals, then two of biases.
fn head(value: vec4<f32>) -> MixHints {
    let logits = conv_weight(HEAD_WEIGHTS + 6u) + vec4<f32>(
        dot(conv_weight(HEAD_WEIGHTS), value),
        dot(conv_weight(HEAD_WEIGHTS + 1u), value),
        dot(conv_weight(HEAD_WEIGHTS + 2u), value),
        dot(conv_weight(HEAD_WEIGHTS + 3u), value),
    );
    let residuals = conv_weight(HEAD_WEIGHTS + 7u).xy
        + vec2<f32>(dot(conv_weight(HEAD_WEIGHTS + 4u), value), dot(conv_weight(HEAD_WEIGHTS + 5u), value));
    return MixHints(logits, residuals);
}
#endif

fn hints(inside: vec2<u32>) -> MixHints {
#ifdef NETWORK
    // Through halves as every map.
    return head(conv_unpack(conv_pack(max(conv_output(inside, 0u), vec4<f32>(0.0)))));
#else
    // Loaded, so that the mixture is computed as with a network of zeros.
    return MixHints(vec4<f32>(params.none), vec2<f32>(params.none));
#endif
}

fn fill(pixel: vec2<u32>, number: u32, inside: vec2<u32>) -> bool {
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    let mixed = mix_candidates(features_candidates(pixel, ray, number), hints(inside), to_viewer);
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
    workgroupBarrier();
    let index = indirect_linear_group(group, groups);
    let listed = index < atomicLoad(&tiles[LIST]);
    let word = infill_list_word(params, LIST, select(0u, index, listed));
    let corner = infill_tile_corner(params, atomicLoad(&tiles[word]));
#ifdef NETWORK
    conv_load(corner, params.padded, lane);
#endif
    for (var i = lane; i < INFILL_TILE * INFILL_TILE; i += LANES) {
        let inside = vec2<u32>(i % INFILL_TILE, i / INFILL_TILE);
        let pixel = corner + inside;
        let number = frame_number(frame, pixel);
        if (listed && all(pixel < params.size) && infill_is_hole(number)) {
            if (fill(pixel, number, inside)) {
                atomicAdd(&filled_count, 1u);
            }
        }
    }
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&tiles[TILES_FILLED], atomicLoad(&filled_count));
    }
}
