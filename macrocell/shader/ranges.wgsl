// Value ranges of a region, built from the block extrema of the region and its plus-side neighbours.
// One workgroup per coarse cell, one invocation per block of it.

#import macrocell_quantise
#import indirect

struct RangesParams {
    blocks: vec3<u32>,        // blocks of the whole volume
    page_first: u32,          // first coarse cell of the bound code page
    coarse: vec3<u32>,        // coarse cells of the whole volume
    page_count: u32,          // coarse cells of the bound code page
    region_origin: vec3<u32>, // in blocks, a multiple of 4
    region_groups: u32,       // coarse cells to build
    region_blocks: vec3<u32>, // extent of the extrema, in blocks
    pad0: u32,
    region_coarse: vec3<u32>, // extent of the coarse cells to build
    pad1: u32,
    cells: vec3<u32>,         // dual cells of the whole volume: dims - 1
    pad2: u32,
}

@group(0) @binding(0) var<uniform> params: RangesParams;
@group(0) @binding(1) var<storage, read> extrema: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> coarse_ranges: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> codes: array<u32>;

const NO_VALUE: f32 = 3.0e38;

var<workgroup> lows: array<f32, 64>;
var<workgroup> highs: array<f32, 64>;
var<workgroup> packed: array<u32, 64>;

// Range over the samples of a block's own dual cells: its 4^3 samples and those of the plus-side
// neighbours' faces, edges and corner that its cells share. Empty (low > high) without dual cells.
fn block_range(block: vec3<u32>) -> vec2<f32> {
    var range = vec2<f32>(NO_VALUE, -NO_VALUE);
    if (any(block * 4u >= params.cells)) {
        return range;
    }
    for (var corner = 0u; corner < 8u; corner++) {
        let neighbour = block + vec3<u32>(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        if (all(neighbour < params.blocks)) {
            let local = neighbour - params.region_origin;
            let entry = local.x + params.region_blocks.x * (local.y + params.region_blocks.y * local.z);
            let extremes = extrema[entry * 8u + corner];
            range = vec2<f32>(min(range.x, extremes.x), max(range.y, extremes.y));
        }
    }
    return range;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    let in_region = index < params.region_groups;
    let size = params.region_coarse;
    let coarse = params.region_origin / 4u
        + vec3<u32>(index % size.x, (index / size.x) % size.y, index / (size.x * size.y));
    let block = coarse * 4u + vec3<u32>(lane & 3u, (lane >> 2u) & 3u, lane >> 4u);
    let present = in_region && all(block < params.blocks);
    var range = vec2<f32>(NO_VALUE, -NO_VALUE);
    if (present) {
        range = block_range(block);
    }
    lows[lane] = range.x;
    highs[lane] = range.y;
    workgroupBarrier();
    for (var half = 32u; half > 0u; half /= 2u) {
        if (lane < half) {
            lows[lane] = min(lows[lane], lows[lane + half]);
            highs[lane] = max(highs[lane], highs[lane + half]);
        }
        workgroupBarrier();
    }
    let low = lows[0];
    let high = highs[0];
    // An empty range is coded as (255, 0), which no code lies in.
    var code = 255u;
    if (range.x <= range.y) {
        let scale = macrocell_scale(low, high);
        code = macrocell_code(range.x, low, scale) | (macrocell_code(range.y, low, scale) << 8u);
    }
    packed[lane] = code;
    workgroupBarrier();
    let linear = coarse.x + params.coarse.x * (coarse.y + params.coarse.y * coarse.z);
    let in_page = in_region && linear >= params.page_first && linear - params.page_first < params.page_count;
    if (in_page && (lane & 1u) == 0u) {
        codes[(linear - params.page_first) * 32u + lane / 2u] = packed[lane] | (packed[lane + 1u] << 16u);
    }
    if (in_page && lane == 0u) {
        coarse_ranges[linear] = vec2<f32>(low, high);
    }
}
