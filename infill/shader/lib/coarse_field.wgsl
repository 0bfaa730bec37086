// The volume at one pair of values per block: the ends of its value range, interpolated between the blocks' middles.
// The importing text declares `frame` and `params`; the ranges are bound from COARSE_BINDING on.
#import macrocell_quantise
#import cell

@group(0) @binding(COARSE_BINDING) var<storage, read> coarse_ranges: array<vec2<f32>>;
@group(0) @binding(COARSE_BINDING + 1u) var<storage, read> codes_0: array<u32>;
#ifdef CODE_PAGES_2
@group(0) @binding(COARSE_BINDING + 2u) var<storage, read> codes_1: array<u32>;
#endif
#ifdef CODE_PAGES_3
@group(0) @binding(COARSE_BINDING + 3u) var<storage, read> codes_2: array<u32>;
#endif

const COARSE_SPACING: f32 = 4.0; // voxels between the middles of blocks
const COARSE_MIDDLE: f32 = 2.0;  // from a block's first voxel to the middle of its dual cells

// The ends of the ranges of the eight blocks around a position, and its place between their middles, 0 to 1 on each axis.
struct CoarseSample {
    lower: CellCorners,
    upper: CellCorners,
    place: vec3<f32>,
}

fn coarse_code(cell: u32, lane: u32) -> u32 {
    // The words of 64 codes. No division, which is slow.
    let word = 32u * cell + (lane >> 1u);
    var codes = 0u;
#ifdef CODE_PAGES_2
    let page_words = 32u * params.coarse_per_page;
    if (word < page_words) {
        codes = codes_0[word];
    } else if (word < 2u * page_words) {
        codes = codes_1[word - page_words];
    }
#ifdef CODE_PAGES_3
    else {
        codes = codes_2[word - 2u * page_words];
    }
#endif
#else
    codes = codes_0[word];
#endif
    return (codes >> (16u * (lane & 1u))) & 0xffffu;
}

// A coarse cell and what turns its blocks' codes into values.
struct CoarseCell {
    index: u32,
    low: f32,
    step: f32,
}

fn coarse_cell(index: u32) -> CoarseCell {
    let range = coarse_ranges[index];
    return CoarseCell(index, range.x, 1.0 / macrocell_scale(range.x, range.y));
}

fn coarse_cell_of(block: vec3<u32>) -> u32 {
    return macrocell_linear(vec3<i32>(block >> vec3<u32>(2u)), frame.grid.coarse);
}

// The ends of a block's range, in a coarse cell.
fn coarse_block(block: vec3<u32>, cell: CoarseCell) -> vec2<f32> {
    let place = block & vec3<u32>(3u);
    let code = coarse_code(cell.index, place.x | (place.y << 2u) | (place.z << 4u));
    return cell.low + (vec2<f32>(vec2<u32>(code & 255u, code >> 8u)) + vec2<f32>(0.5)) * cell.step;
}

fn coarse_at(position: vec3<f32>) -> CoarseSample {
    let last = vec3<u32>(frame.grid.last_cell / 4);
    let q = clamp((position - COARSE_MIDDLE) / COARSE_SPACING, vec3<f32>(0.0), vec3<f32>(last));
    let a = vec3<u32>(q);
    let b = min(a + vec3<u32>(1u), last);
    let first = coarse_cell(coarse_cell_of(a));
    var cells = array<CoarseCell, 7>(first, first, first, first, first, first, first);
    let corners = array<vec3<u32>, 7>(
        vec3<u32>(b.x, a.yz), vec3<u32>(a.x, b.y, a.z), vec3<u32>(b.xy, a.z), vec3<u32>(a.xy, b.z),
        vec3<u32>(b.x, a.y, b.z), vec3<u32>(a.x, b.yz), b);
    // Most samples lie in one coarse cell.
    if (any((a >> vec3<u32>(2u)) != (b >> vec3<u32>(2u)))) {
        cells[0] = coarse_cell(coarse_cell_of(corners[0]));
        cells[1] = coarse_cell(coarse_cell_of(corners[1]));
        cells[2] = coarse_cell(coarse_cell_of(corners[2]));
        cells[3] = coarse_cell(coarse_cell_of(corners[3]));
        cells[4] = coarse_cell(coarse_cell_of(corners[4]));
        cells[5] = coarse_cell(coarse_cell_of(corners[5]));
        cells[6] = coarse_cell(coarse_cell_of(corners[6]));
    }
    let c000 = coarse_block(a, first);
    let c100 = coarse_block(corners[0], cells[0]);
    let c010 = coarse_block(corners[1], cells[1]);
    let c110 = coarse_block(corners[2], cells[2]);
    let c001 = coarse_block(corners[3], cells[3]);
    let c101 = coarse_block(corners[4], cells[4]);
    let c011 = coarse_block(corners[5], cells[5]);
    let c111 = coarse_block(b, cells[6]);
    return CoarseSample(
        CellCorners(vec4<f32>(c000.x, c010.x, c001.x, c011.x), vec4<f32>(c100.x, c110.x, c101.x, c111.x)),
        CellCorners(vec4<f32>(c000.y, c010.y, c001.y, c011.y), vec4<f32>(c100.y, c110.y, c101.y, c111.y)),
        q - vec3<f32>(a),
    );
}

// The interpolated ends.
fn coarse_ends(sample: CoarseSample) -> vec2<f32> {
    return vec2<f32>(cell_value(sample.lower, sample.place), cell_value(sample.upper, sample.place));
}

// The values at shares of the way from the lower to the upper end.
fn coarse_values(ends: vec2<f32>, shares: vec2<f32>) -> vec2<f32> {
    return ends.x + shares * (ends.y - ends.x);
}

// Of the values at a share, per voxel.
fn coarse_gradient(sample: CoarseSample, share: f32) -> vec3<f32> {
    let corners = CellCorners(
        sample.lower.low + share * (sample.upper.low - sample.lower.low),
        sample.lower.high + share * (sample.upper.high - sample.lower.high),
    );
    return cell_gradient(corners, sample.place) / COARSE_SPACING;
}
