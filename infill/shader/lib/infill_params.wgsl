// Sizes of a picture's in-fill, and where its scratch memory holds what.

struct InfillParams {
    size: vec2<u32>,      // pixels
    tiles: vec2<u32>,     // tiles of 16x16 pixels
    levels: vec4<u32>,    // first texels of the levels of averages, from 2x2 pixels on
    padded: vec2<u32>,    // pixels of the network's maps: multiples of 4
    coarse_per_page: u32, // coarse cells on a page of range codes
    crisp: u32,           // 1: coverage is rounded to 0 or 1
    diagonal: f32,        // of the volume, in voxels
    none: f32,            // 0, which no compiler knows
    complete: f32,        // share of the rays that enter the volume from which on the picture is filled
    pad0: u32,
}

const INFILL_TILE: u32 = 16u; // pixels

// The tiles' buffer: number of tiles with holes, of those and their neighbours, and of those within two tiles of
// holes; pixels filled; sum and number of the shares of calibrate.wgsl; a bit for every tile with holes; the three lists.
const TILES_FILLED: u32 = 3u;
const TILES_SHARES: u32 = 4u;
const TILES_SAMPLES: u32 = 5u;
const TILES_HEADER: u32 = 6u;

// Of a share in the sum, which has room for a quarter of the pixels of the largest picture.
const TILES_SHARE_STEPS: f32 = 128.0;
// Samples that a share of one half counts for, so that a few hits do not decide.
const TILES_PRIOR_SAMPLES: f32 = 16.0;

// Share of the way from the lower to the upper end of a block's range at which the surface lies.
fn infill_share(sum: u32, samples: u32) -> f32 {
    return (f32(sum) / TILES_SHARE_STEPS + 0.5 * TILES_PRIOR_SAMPLES) / (f32(samples) + TILES_PRIOR_SAMPLES);
}

fn infill_flag_words(params: InfillParams) -> u32 {
    return (params.tiles.x * params.tiles.y + 31u) / 32u;
}

// The word of an entry of a list.
fn infill_list_word(params: InfillParams, list: u32, index: u32) -> u32 {
    return TILES_HEADER + infill_flag_words(params) + list * params.tiles.x * params.tiles.y + index;
}

// The first pixel of a tile.
fn infill_tile_corner(params: InfillParams, tile: u32) -> vec2<u32> {
    // Exact for the fewer than 2^20 tiles that there can be; an integer division is slow.
    let row = u32((f32(tile) + 0.5) / f32(params.tiles.x));
    return INFILL_TILE * vec2<u32>(tile - row * params.tiles.x, row);
}

fn infill_pixel_index(params: InfillParams, pixel: vec2<u32>) -> u32 {
    return pixel.x + params.size.x * pixel.y;
}
