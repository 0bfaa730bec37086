// What the coarse field says about every quad of 2x2 pixels with holes, by a ray through the first one: its candidate and that of its thin
// variant. A workgroup for every tile with holes.
#import march
#import candidate
#import shading
#import quads
#import tile_rays
#import listed_tile

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read> tiles: array<u32>;
@group(0) @binding(5) var<storage, read_write> guesses: array<vec2<u32>>;

const LIST: u32 = 0u;

var<workgroup> words: array<u32, INFILL_TILE_WORDS>;
// Quads with holes, one after the other, so that no lane is without one while others march: number in the tile, holes above.
var<workgroup> collected: array<u32, 64>;

// A bit for every quad with holes of a word of 8x4 pixels, the lowest of its four.
fn quads_of(word: u32) -> u32 {
    return (word | (word >> 1u) | (word >> 2u) | (word >> 3u)) & 0x11111111u;
}

// Collects the tile's quads with holes, none unless it is `listed`; their number. All 64 invocations call it together.
fn collect(corner: vec2<u32>, listed: bool, lane: u32) -> u32 {
    if (lane < INFILL_TILE_WORDS) {
        words[lane] = select(0u, tile_word(corner, lane), listed);
    }
    workgroupBarrier();
    let own = lane >> 3u;
    let shift = 4u * (lane & 7u);
    var count = 0u;
    var before = countOneBits(quads_of(words[own]) & ((1u << shift) - 1u));
    for (var i = 0u; i < INFILL_TILE_WORDS; i++) {
        let quads = countOneBits(quads_of(words[i]));
        count += quads;
        before += select(0u, quads, i < own);
    }
    let holes = (words[own] >> shift) & 15u;
    if (holes != 0u) {
        collected[before] = lane | (holes << 8u);
    }
    workgroupBarrier();
    return count;
}

fn guess(pixel: vec2<u32>, share: f32) -> vec2<u32> {
    let number = frame_number(frame, pixel);
    let ray = frame_ray(frame, pixel).ray;
    let to_viewer = shading_to_viewer(ray.direction);
    let t_low = infill_t_low(ray, number);
    let most_steps = MARCH_MOST_STEPS + frame_zero(number);
    let march = march(ray, infill_volume(), t_low, frame.isovalue, share, most_steps);
    var words = vec2<u32>(candidate_pack(0.0, vec3<f32>(0.0), 0.0));
    if (march.hit.x) {
        let gradient = coarse_gradient(march_at(ray, march.t.x), march.shares.x);
        words.x = candidate_pack(1.0, shading_normal(gradient, to_viewer), march.t.x - t_low);
    }
    if (march.hit.y) {
        let gradient = coarse_gradient(march_at(ray, march.t.y), march.shares.y);
        words.y = candidate_pack(1.0, shading_normal(gradient, to_viewer), march.t.y - t_low);
    }
    return words;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let tile = listed_tile(group, groups);
    if (lane >= collect(tile.corner, tile.listed, lane)) {
        return;
    }
    let quad = tile.corner / 2u + frame_place(collected[lane] & 255u);
    let pixel = 2u * quad + quad_first_hole(collected[lane] >> 8u);
    let share = infill_share(tiles[TILES_SHARES], tiles[TILES_SAMPLES]);
    guesses[quad_index(quad)] = guess(pixel, share);
}
