// What the kernels of the published network share. Feature maps hold four channels per element, one group of channels
// after the other. The importing text declares
//   var<uniform> layer: PublishedLayer;
//   var<storage, read> source: array<vec4<f32>>;   where it reads a map of another resolution
#import indirect

// As published::LayerParams.
struct PublishedLayer {
    size: vec2<u32>,       // of the map that is made
    picture: vec2<u32>,    // pixels; the maps of full resolution are padded to a multiple of 8
    tiles_x: u32,
    tiles: u32,
    inputs: u32,           // groups of four channels that are read
    outputs: u32,          // and made
    weights: u32,          // first weight of the layer
    rgb_weights: u32,      // first weight of the layer that makes colours
    skip_inputs: u32,      // of the inputs, those from this resolution
    low_inputs: u32,       // and those from half of it
}

// Texels that a workgroup makes, and what it reads for them.
const TILE: u32 = 8u;
const TILE_READ: u32 = TILE + 2u;
const TILE_TEXELS: u32 = TILE_READ * TILE_READ;
const LANES: u32 = TILE * TILE;

var<workgroup> tile: array<vec4<f32>, TILE_TEXELS>;

fn map_index(texel: vec2<u32>, group: u32, size: vec2<u32>) -> u32 {
    return (group * size.y + texel.y) * size.x + texel.x;
}

fn tile_origin(number: u32) -> vec2<u32> {
    return TILE * vec2<u32>(number % layer.tiles_x, number / layer.tiles_x);
}

fn tile_index(texel: vec2<u32>, tap: u32) -> u32 {
    return texel.x + tap % 3u + TILE_READ * (texel.y + tap / 3u);
}

// The texel that a lane reads for the tile; outside the map where the tile ends there.
fn tile_texel(origin: vec2<u32>, index: u32) -> vec2<u32> {
    return origin + vec2<u32>(index % TILE_READ, index / TILE_READ) - 1u;
}

#ifdef POOLED
// Mean of 2x2 texels of the map of twice the resolution.
fn source_pooled(texel: vec2<u32>, group: u32) -> vec4<f32> {
    let size = 2u * layer.size;
    let first = map_index(2u * texel, group, size);
    return 0.25 * (source[first] + source[first + 1u] + source[first + size.x] + source[first + size.x + 1u]);
}
#endif

#ifdef ENLARGED
// Bilinear interpolation of the map of half the resolution, clamped at the edges.
fn source_enlarged(texel: vec2<u32>, group: u32) -> vec4<f32> {
    let size = layer.size / 2u;
    let upper = (texel + 1u) / 2u;
    let low = max(upper, vec2<u32>(1u)) - 1u;
    let high = min(upper, size - 1u);
    let share = select(vec2<f32>(0.25), vec2<f32>(0.75), texel % 2u == vec2<u32>(0u));
    let above = mix(source[map_index(low, group, size)], source[map_index(vec2<u32>(high.x, low.y), group, size)], share.x);
    let below = mix(source[map_index(vec2<u32>(low.x, high.y), group, size)], source[map_index(high, group, size)], share.x);
    return mix(above, below, share.y);
}
#endif
