// The sampling mask of a pass: a bit for every ray that may be cast, kept from pass to pass of a frame.
#import frame
#import indirect
#import ray_words

struct SamplingParams {
    gaze: vec2<f32>, // in shares of width and height
    share_per_pixel: vec2<f32>,
    falloff: f32, // half the inverse of the fovea's variance; 0 for no fovea
    base_density: f32,
    slice: u32, // word of the first rank of the frame's slice
    draws: u32, // passes that have drawn after this one; 0 for all rays
    lattice_level: u32, // log2 of the pixels from one ray of a lattice that is cast in any case to the next; 0 for none
    pad0: u32,
}

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> sampling: SamplingParams;
@group(0) @binding(2) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> tiles: array<u32>; // two ranks a word
@group(0) @binding(4) var<storage, read_write> sampling_mask: array<u32>;

var<workgroup> added: atomic<u32>;

// What exp(-falloff r^2) is the product of for both axes.
fn fovea(pixel: vec4<u32>, axis: u32) -> vec4<f32> {
    let r = (vec4<f32>(pixel) + vec4<f32>(0.5)) * sampling.share_per_pixel[axis] - vec4<f32>(sampling.gaze[axis]);
    return select(vec4<f32>(0.0), exp(-sampling.falloff * (r * r)), vec4<bool>(sampling.falloff > 0.0));
}

// Which of four pixels with these ranks the pass draws.
fn is_drawn(ranks: vec4<u32>, fovea: vec4<f32>) -> vec4<bool> {
    // Probability that one pass does not draw them.
    var left = (1.0 - sampling.base_density) * (vec4<f32>(1.0) - fovea);
    if (sampling.draws > 1u) {
        left = pow(max(left, vec4<f32>(1e-30)), vec4<f32>(f32(sampling.draws)));
    }
    // (rank + 0.5) / TILE_RANKS < 1 - left, without losing digits of a small `left`.
    let above = vec4<f32>(vec4<u32>(TILE_RANKS) - ranks) - vec4<f32>(0.5);
    return (above > f32(TILE_RANKS) * left) | vec4<bool>(sampling.draws == 0u);
}

// Bits of a word's rays that the pass draws or the lattice has, none of them outside the picture.
fn draw_word(number: u32, zero: u32) -> u32 {
    let corner = frame_pixel(frame, number);
    let rows = vec4<u32>(corner.y) + vec4<u32>(0u, 1u, 2u, 3u);
    let is_inside = rows < vec4<u32>(frame.height);
    let row_fovea = fovea(rows, 1u);
    let row_words = vec4<u32>(sampling.slice) + (TILE_EDGE / 2u) * (rows % vec4<u32>(TILE_EDGE));
    // The lattice has rows 0 and 2 and all even columns, or row 0 and columns 0 and 4.
    let level = sampling.lattice_level;
    let lattice_rows = vec4<bool>(level > 0u, false, level == 1u, false);
    var bits = 0u;
    for (var column = 0u; column < WORD_COLUMNS + zero; column += 2u) {
        let columns = vec2<u32>(corner.x + column) + vec2<u32>(0u, 1u);
        let column_fovea = fovea(columns.xyxy, 0u);
        let words = row_words + vec4<u32>(columns.x % TILE_EDGE / 2u);
        let ranks = vec4<u32>(tiles[words.x], tiles[words.y], tiles[words.z], tiles[words.w]);
        let lattice = lattice_rows & vec4<bool>(level == 1u || column % 4u == 0u);
        let even = lattice | is_drawn(ranks & vec4<u32>(0xffffu), row_fovea * column_fovea.x);
        let odd = is_drawn(ranks >> vec4<u32>(16u), row_fovea * column_fovea.y);
        bits |= word_bits(even & is_inside & vec4<bool>(columns.x < frame.width), column);
        bits |= word_bits(odd & is_inside & vec4<bool>(columns.y < frame.width), column + 1u);
    }
    return bits;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane == 0u) {
        atomicStore(&added, 0u);
    }
    workgroupBarrier();
    let word = indirect_linear_group(group, groups) * 64u + lane;
    if (word * WORD_RAYS < frame.ray_numbers) {
        let before = sampling_mask[word];
        let zero = frame_zero(atomicLoad(&rays[RAYS_HITS]));
        let now = before | draw_word(word * WORD_RAYS, zero);
        sampling_mask[word] = now;
        atomicAdd(&added, countOneBits(now ^ before));
    }
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_SAMPLED], atomicLoad(&added));
        if (word == 0u) {
            atomicStore(&rays[RAYS_MASKED], 1u);
            atomicStore(&rays[RAYS_LISTED], 1u); // the list is to be made again
        }
    }
}
