// One frame's camera and grids, and the rays they make.
#import macrocell_grid
#import lru_params

struct FrameParams {
    // Start of the ray through the image's centre, in index space, and its change per pixel.
    origin: vec3<f32>,
    isovalue: f32,
    origin_dx: vec3<f32>,
    width: u32,
    origin_dy: vec3<f32>,
    height: u32,
    // Index-space direction per unit of view depth at the image's centre, and its change per pixel.
    direction: vec3<f32>,
    start_depth: f32, // view depth of the rays' start, in world units
    direction_dx: vec3<f32>,
    look_ahead: u32, // RunAhead: active blocks that a stopped ray requests, the missing one included
    direction_dy: vec3<f32>,
    ray_numbers: u32,   // a multiple of 64; those outside the picture have no ray
    ray_level: u32,     // edge of the squares of the rays' order, as a power of two of tiles
    ray_columns: u32,   // squares in a row
    list_capacity: u32, // rays that the active list holds
    first_misses: u32,  // of every ray: more look-ahead from the start
    // Bits of a block's x and of its x and y in a ray's state, and of the whole position.
    shift_y: u32,
    shift_z: u32,
    shift_misses: u32,
    most_cells: u32, // RunAhead: cells that one walk of all listed rays visits
    middle: vec2<f32>,  // of the whole picture, in its pixels, less what the rays are moved from their middles
    step: f32,          // of its pixels from one ray to the next
    preview_level: u32, // log2 of the step of a preview that the frame goes on from, 0 for none
    volume_low: vec2<u32>, // pixels outside of which no ray meets the volume: the first ones
    volume_end: vec2<u32>, // and those after the last ones
    grid: MacrocellGrid,
    lru: LruParams,
}

struct FrameRay {
    ray: DdaRay,         // unit direction: t is in voxels
    depth_per_voxel: f32, // view depth in world units gained per voxel along the ray
}

// What a pixel's ray is made of, for loops over pixels: lavapipe loads a uniform as if every lane had its own.
struct FrameRays {
    middle: vec2<f32>,
    step: f32,
    origin: vec3<f32>,
    origin_dx: vec3<f32>,
    origin_dy: vec3<f32>,
    direction: vec3<f32>,
    direction_dx: vec3<f32>,
    direction_dy: vec3<f32>,
}

fn frame_rays(frame: FrameParams) -> FrameRays {
    return FrameRays(
        frame.middle, frame.step, frame.origin, frame.origin_dx, frame.origin_dy,
        frame.direction, frame.direction_dx, frame.direction_dy);
}

fn frame_ray_of(rays: FrameRays, pixel: vec2<u32>) -> FrameRay {
    let offset = rays.step * vec2<f32>(pixel) + vec2<f32>(0.5) - rays.middle;
    let origin = rays.origin + offset.x * rays.origin_dx + offset.y * rays.origin_dy;
    let direction = rays.direction + offset.x * rays.direction_dx + offset.y * rays.direction_dy;
    let depth_per_voxel = 1.0 / length(direction);
    return FrameRay(dda_ray(origin, direction * depth_per_voxel), depth_per_voxel);
}

fn frame_ray(frame: FrameParams, pixel: vec2<u32>) -> FrameRay {
    return frame_ray_of(frame_rays(frame), pixel);
}

// Where a ray has a view depth in world units, in voxels.
fn frame_t(frame: FrameParams, frame_ray: FrameRay, view_depth: f32) -> f32 {
    return (view_depth - frame.start_depth) / frame_ray.depth_per_voxel;
}

// Zero, for any number below 2^31 that comes from memory. Mesa's lavapipe compiles a kernel anew whenever its uniforms change if a loop
// ends at a value made of uniforms alone; with this zero added it is not.
fn frame_zero(loaded: u32) -> u32 {
    return loaded >> 31u;
}

// Status of a ray in the two upper bits of its state; the lower ones hold its block, those between them
// a count.
const RAY_DONE: u32 = 0u;            // final, without a hit; between rounds, the whole state of an active ray that has not started
const RAY_HIT: u32 = 0x40000000u;    // has a hit in its block, not shaded yet
const RAY_ACTIVE: u32 = 0x80000000u; // waits for its block
const RAY_SHADED: u32 = 0xc0000000u; // final, with a hit
const RAY_STATUS: u32 = 0xc0000000u;
const RAY_MOST_MISSES: u32 = 6u; // more would look too far ahead

// A block's position in a ray's state. Without a division, which is slow.
fn frame_pack(frame: FrameParams, block: vec3<i32>) -> u32 {
    return u32(block.x) | (u32(block.y) << frame.shift_y) | (u32(block.z) << frame.shift_z);
}

fn frame_unpack(frame: FrameParams, state: u32) -> vec3<i32> {
    let ends = vec3<u32>(frame.shift_y, frame.shift_z, frame.shift_misses);
    let place = vec3<u32>(state) & ((vec3<u32>(1u) << ends) - vec3<u32>(1u));
    return vec3<i32>(place >> vec3<u32>(0u, frame.shift_y, frame.shift_z));
}

// The number above the position, which has `30 - shift_misses` bits: of an active ray its misses, of a hit the
// cells of the block before it that have none.
fn frame_count(frame: FrameParams, state: u32) -> u32 {
    return (state & ~RAY_STATUS) >> frame.shift_misses;
}

// A state's count, as much of it as there are bits for.
fn frame_pack_count(frame: FrameParams, count: u32) -> u32 {
    let most = (1u << (30u - frame.shift_misses)) - 1u;
    return min(count, most) << frame.shift_misses;
}

// The rays' buffer: these words, a state for every number, a bit for every number whose ray is active,
// and the active list: the numbers of the first active rays.
const RAYS_ACTIVE: u32 = 0u;   // active rays
const RAYS_ENTERED: u32 = 1u;  // rays that enter the volume
const RAYS_HITS: u32 = 2u;     // hits shaded so far
const RAYS_LISTED: u32 = 3u;   // length of the active list
const RAYS_LISTS: u32 = 4u;    // lists made so far in the frame; none is made when no ray is active
const RAYS_CELLS: u32 = 5u;      // RunAhead: cells that the walk since the last list visited
const RAYS_MOST_CELLS: u32 = 6u; // the most of any walk of the frame
const RAYS_CUT: u32 = 7u;        // walks of a ray, so far in the frame, that the bound ended
const RAYS_OPEN_NOW: u32 = 8u; // RAYS_OPEN of the round that is going on
const RAYS_OPEN: u32 = 9u;     // f32 bits: most voxels in which an active ray's first hit may still lie
const RAYS_MASKED: u32 = 10u;  // whether the sampling mask says which active rays are listed
const RAYS_SAMPLED: u32 = 11u; // pixels of the mask
const RAYS_BOX: u32 = 12u;     // first and last cells of the box of the active blocks, three words each
const RAYS_HEADER: u32 = 18u;

// The word that holds the active bit of a ray, which is its number's lowest five bits.
fn frame_active_word(frame: FrameParams, ray: u32) -> u32 {
    return RAYS_HEADER + frame.ray_numbers + (ray >> 5u);
}

fn frame_list_word(frame: FrameParams, index: u32) -> u32 {
    return RAYS_HEADER + frame.ray_numbers + frame.ray_numbers / 32u + index;
}

// Whether any of the pixels from `corner` on, `size` of them, may have a ray that meets the volume.
fn frame_may_meet(frame: FrameParams, corner: vec2<u32>, size: vec2<u32>) -> bool {
    return all(corner < frame.volume_end) && all(corner + size > frame.volume_low);
}

// Of a word's rays, those that a preview has.
fn frame_preview_bits(preview_level: u32) -> u32 {
    return select(select(0u, 0x11111111u, preview_level == 1u), 0x00010001u, preview_level == 2u);
}

// Bits 0, 2, 4, .. of both components, put together.
fn frame_even_bits(code: vec2<u32>) -> vec2<u32> {
    var v = code & vec2<u32>(0x55555555u);
    v = (v | (v >> vec2<u32>(1u))) & vec2<u32>(0x33333333u);
    v = (v | (v >> vec2<u32>(2u))) & vec2<u32>(0x0f0f0f0fu);
    return (v | (v >> vec2<u32>(4u))) & vec2<u32>(0x00ff00ffu);
}

// The place of a ray in its square, or of one of as many rays as a smaller square has, by the number there.
fn frame_place(number: u32) -> vec2<u32> {
    return frame_even_bits(vec2<u32>(number, number >> 1u));
}

// The pixel of a ray; outside the picture for numbers that have no ray.
fn frame_pixel(frame: FrameParams, ray: u32) -> vec2<u32> {
    let bits = 2u * (3u + frame.ray_level);
    let square = ray >> bits;
    let code = ray & ((1u << bits) - 1u);
    // Exact for the fewer than 2^20 squares that there can be; an integer division is slow.
    let row = u32((f32(square) + 0.5) / f32(frame.ray_columns));
    let corner = vec2<u32>(square - row * frame.ray_columns, row);
    return corner * (8u << frame.ray_level) + frame_place(code);
}

// A number below 2^16 with a zero after each of its bits, of both components.
fn frame_spread_bits(number: vec2<u32>) -> vec2<u32> {
    var v = (number | (number << vec2<u32>(8u))) & vec2<u32>(0x00ff00ffu);
    v = (v | (v << vec2<u32>(4u))) & vec2<u32>(0x0f0f0f0fu);
    v = (v | (v << vec2<u32>(2u))) & vec2<u32>(0x33333333u);
    return (v | (v << vec2<u32>(1u))) & vec2<u32>(0x55555555u);
}

// The ray of a pixel of the picture: the inverse of frame_pixel.
fn frame_number(frame: FrameParams, pixel: vec2<u32>) -> u32 {
    let shift = 3u + frame.ray_level;
    let square = pixel >> vec2<u32>(shift);
    let bits = frame_spread_bits(pixel & vec2<u32>((1u << shift) - 1u));
    return ((square.y * frame.ray_columns + square.x) << (2u * shift)) | bits.x | (bits.y << 1u);
}

fn frame_block_position(frame: FrameParams, block: u32) -> vec3<i32> {
    let size = frame.grid.blocks;
    return vec3<i32>(vec3<u32>(block % size.x, (block / size.x) % size.y, block / (size.x * size.y)));
}
