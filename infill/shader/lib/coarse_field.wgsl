// The volume at one pair of values per block: the ends of its value range, interpolated between the blocks' middles.
// The importing text declares `frame` and `params`; the ranges are bound from COARSE_BINDING on.
#import macrocell_quantise

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

struct CoarseSample {
    ends: vec2<f32>,
    // Gradients per voxel of the lower and the upper end.
    low: vec3<f32>,
    high: vec3<f32>,
}

fn coarse_code(cell: u32, lane: u32) -> u32 {
    let page = cell / params.coarse_per_page;
    let word = 32u * (cell - page * params.coarse_per_page) + (lane >> 1u);
    var codes = 0u;
    if (page == 0u) {
        codes = codes_0[word];
    }
#ifdef CODE_PAGES_2
    if (page == 1u) {
        codes = codes_1[word];
    }
#endif
#ifdef CODE_PAGES_3
    if (page == 2u) {
        codes = codes_2[word];
    }
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

fn coarse_block(block: vec3<u32>, cell: CoarseCell) -> vec2<f32> {
    let place = block & vec3<u32>(3u);
    let code = coarse_code(cell.index, place.x | (place.y << 2u) | (place.z << 4u));
    return cell.low + (vec2<f32>(vec2<u32>(code & 255u, code >> 8u)) + vec2<f32>(0.5)) * cell.step;
}

fn coarse_at(position: vec3<f32>) -> CoarseSample {
    let last = vec3<u32>(frame.grid.last_cell / 4);
    let q = clamp((position - COARSE_MIDDLE) / COARSE_SPACING, vec3<f32>(0.0), vec3<f32>(last));
    let first = vec3<u32>(q);
    let share = q - vec3<f32>(first);
    var sample = CoarseSample(vec2<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0));
    var cell = coarse_cell(coarse_cell_of(first));
    for (var corner = 0u; corner < 8u; corner++) {
        let upper = vec3<u32>(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let block = min(first + upper, last);
        // Most corners lie in one coarse cell.
        let index = coarse_cell_of(block);
        if (index != cell.index) {
            cell = coarse_cell(index);
        }
        let ends = coarse_block(block, cell);
        let w = select(vec3<f32>(1.0) - share, share, upper == vec3<u32>(1u));
        let s = select(vec3<f32>(-1.0), vec3<f32>(1.0), upper == vec3<u32>(1u)) / COARSE_SPACING;
        let slopes = vec3<f32>(s.x * w.y * w.z, w.x * s.y * w.z, w.x * w.y * s.z);
        sample.ends += (w.x * w.y * w.z) * ends;
        sample.low += slopes * ends.x;
        sample.high += slopes * ends.y;
    }
    return sample;
}

// The values at shares of the way from the lower to the upper end.
fn coarse_values(sample: CoarseSample, shares: vec2<f32>) -> vec2<f32> {
    return sample.ends.x + shares * (sample.ends.y - sample.ends.x);
}

fn coarse_gradient(sample: CoarseSample, share: f32) -> vec3<f32> {
    return sample.low + share * (sample.high - sample.low);
}
