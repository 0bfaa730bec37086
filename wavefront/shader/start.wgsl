// Starts a frame: a bit for every ray that may hit something. The pictures, unfinished everywhere, get their background where
// no ray has anything to hit, unless they have its colour already. With RESUME, the frame goes on from a preview: rays
// that this has finished get no bit.
#import frame
#import indirect
#import macrocell_skip
#import outputs
#import ray_words

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> masks: array<vec2<u32>>;
#ifdef RESUME
@group(0) @binding(4) var<storage, read> preview: array<u32>; // the preview's rays
#endif

// A tile of pixels: those of eight words that follow each other, unless the picture is tiny.
const TILE: u32 = 16u;
const TILE_WORDS: u32 = 8u;

// Voxels inside a box: rays that are rounded differently from one another are not as far apart. A crossing's error is below
// 2^-4 voxels while rays that meet the volume start within 2^16 voxels of it: eight roundings of 2^-24.
const MARGIN: i32 = 1;

var<workgroup> entered: atomic<u32>;
// For the corners of a workgroup's tiles, four of each, whether their rays meet what is inside the box.
var<workgroup> corners_inside: array<u32, 32>;

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// Whether the ray has a part inside the box, which may be empty.
fn meets(ray: DdaRay, box: DdaBox) -> bool {
    return all(box.low <= box.high) && dda_meets(ray, box);
}

// Whether the ray in a corner of a tile meets what is inside the box.
fn corner_inside(first_pixel: vec2<u32>, corner: u32, box: DdaBox) -> bool {
    let pixel = first_pixel + (TILE - 1u) * vec2<u32>(corner & 1u, corner >> 1u);
    // `&`, since lavapipe compiles a kernel anew in every frame if a uniform alone decides a branch.
    let is_tile = (frame.ray_level > 0u) & (pixel.x < frame.width) & (pixel.y < frame.height);
    let inside = DdaBox(box.low + vec3<i32>(MARGIN), box.high - vec3<i32>(MARGIN));
    return is_tile && meets(frame_ray(frame, pixel).ray, inside);
}

// Whether the rays in all four corners of a word's tile meet what is inside the box: then all of its rays meet the box,
// since what a convex body covers of a picture is convex.
fn tile_inside(lane: u32) -> bool {
    let first = lane / TILE_WORDS * 4u;
    return (corners_inside[first] & corners_inside[first + 1u] & corners_inside[first + 2u]
        & corners_inside[first + 3u]) != 0u;
}

// Starts a ray: (enters the volume, may hit something), 1 for yes.
fn start(pixel: vec2<u32>, lines: FrameRays, volume: DdaBox, box: DdaBox) -> vec2<u32> {
    let ray = frame_ray_of(lines, pixel).ray;
    // Whatever meets a part of the volume meets all of it.
    if (meets(ray, box)) {
        return vec2<u32>(1u);
    }
    if (pixel.x < shading.start_columns) {
        outputs_write_background(pixel);
    } else {
        outputs_write_background_status(pixel);
    }
    return vec2<u32>(u32(meets(ray, volume)), 0u);
}

#ifdef RESUME
// A word's bits without those of rays that the preview has finished.
fn without_finished(number: u32, bits: u32) -> u32 {
    let shift = 2u * frame.preview_level;
    let first = number >> shift;
    let word = preview[RAYS_HEADER + (frame.ray_numbers >> shift) + (first >> 5u)] >> (first & 31u);
    // Of every fourth ray or of every 16th.
    let fourths = frame_spread_bits(vec2<u32>(frame_spread_bits(vec2<u32>(word & 255u)).x)).x;
    let waiting = select(fourths, (word & 1u) | ((word & 2u) << 15u), frame.preview_level == 2u);
    return bits & (waiting | ~frame_preview_bits(frame.preview_level));
}
#endif

fn write_header(box: DdaBox) {
    atomicStore(&rays[RAYS_ACTIVE], 1u);
    atomicStore(&rays[RAYS_LISTED], 1u); // the first list is to be made
    for (var axis = 0u; axis < 3u; axis++) {
        atomicStore(&rays[RAYS_BOX + axis], bitcast<u32>(box.low[axis]));
        atomicStore(&rays[RAYS_BOX + 3u + axis], bitcast<u32>(box.high[axis]));
    }
}

// Whether there is anything to do for a word's pixels: rays that may meet the volume, or something to write.
fn may_start(corner: vec2<u32>) -> bool {
#ifdef OUTPUT_STATUS
    return true;
#else
#ifdef RESUME
    // Beside the volume, colours between its pixels and the background's may be left from the preview.
    let margin = 4u;
    let low = max(corner, vec2<u32>(margin)) - vec2<u32>(margin);
    return frame_may_meet(frame, low, vec2<u32>(8u, 4u) + vec2<u32>(2u * margin));
#else
    // `|`, as above.
    return (shading.start_columns > 0u) | frame_may_meet(frame, corner, vec2<u32>(8u, 4u));
#endif
#endif
}

// Starts the rays of a word: (how many enter the volume, bits of those that may hit something).
fn start_word(number: u32, box: DdaBox, zero: u32) -> vec2<u32> {
    let volume = DdaBox(vec3<i32>(0), frame.grid.last_cell + vec3<i32>(i32(zero)));
    let corner = frame_pixel(frame, number);
    if (!may_start(corner)) {
        return vec2<u32>(0u);
    }
    let lines = frame_rays(frame);
    let size = vec2<u32>(frame.width, frame.height);
    var counts = vec2<u32>(0u);
    for (var i = 0u; i < WORD_RAYS + zero; i++) {
        let pixel = word_pixel(corner, i);
        if (all(pixel < size)) {
            let started = start(pixel, lines, volume, box);
            counts += vec2<u32>(started.x, started.y << i);
        }
    }
    return counts;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let first_word = indirect_linear_group(group, groups) * 64u;
    let zero = frame_zero(atomicLoad(&rays[RAYS_HITS]));
    let grid = macrocell_active(frame.grid);
    let box = DdaBox(4 * grid.first_block, grid.last_cell);
    if (lane == 0u) {
        atomicStore(&entered, 0u);
    }
    if (lane < 32u) {
        let first_pixel = frame_pixel(frame, (first_word + lane / 4u * TILE_WORDS) * WORD_RAYS);
        corners_inside[lane] = u32(corner_inside(first_pixel, lane & 3u, box));
    }
    workgroupBarrier();
    let number = (first_word + lane) * WORD_RAYS;
    if (number < frame.ray_numbers) {
        var counts = vec2<u32>(WORD_RAYS, 0xffffffffu);
        if (!tile_inside(lane)) {
            counts = start_word(number, box, zero);
        }
#ifdef RESUME
        counts.y = without_finished(number, counts.y);
#endif
        atomicStore(&rays[frame_active_word(frame, number)], counts.y);
        atomicAdd(&entered, counts.x);
    }
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_ENTERED], atomicLoad(&entered));
        if (first_word == 0u) {
            write_header(box);
        }
    }
}
