// Least and greatest samples of the blocks of a region, in eight classes, 32 blocks per workgroup. With
// KEEP_SAMPLES the samples are kept, too: block b in slot b.

#import indirect
#import zfp_group
#ifdef KEEP_SAMPLES
#import zfp_store
#endif

struct ExtremaParams {
    // First block of the region, in block coordinates; w: unused.
    origin: vec4<u32>,
    // Blocks of the region per axis; w: number of them.
    size: vec4<u32>,
    // Samples of the volume per axis; w: slots per page of slots.
    dims: vec4<u32>,
}

@group(0) @binding(0) var<uniform> page: ZfpPage;
@group(0) @binding(1) var<uniform> params: ExtremaParams;
@group(0) @binding(2) var<storage, read> payload: array<u32>;
// (min, max) of kind c of the region's block e at element e * 8 + c.
@group(0) @binding(3) var<storage, read_write> extrema: array<vec2<f32>>;
#ifdef KEEP_SAMPLES
@group(0) @binding(4) var<storage, read_write> zfp_slots_0: array<vec4<f32>>;
#ifdef ZFP_SLOT_PAGES_2
@group(0) @binding(5) var<storage, read_write> zfp_slots_1: array<vec4<f32>>;
#endif
#ifdef ZFP_SLOT_PAGES_3
@group(0) @binding(6) var<storage, read_write> zfp_slots_2: array<vec4<f32>>;
#endif
#ifdef ZFP_SLOT_PAGES_4
@group(0) @binding(7) var<storage, read_write> zfp_slots_3: array<vec4<f32>>;
#endif
// Block of each of the group's blocks that the region keeps, else NO_SLOT.
var<workgroup> kept_slots: array<u32, ZFP_GROUP_BLOCKS>;

const NO_SLOT: u32 = 0xffffffffu;
#endif

const EXTREMA_LARGEST: f32 = 3.40282346638528859812e38f;

fn zfp_word(index: u32) -> u32 {
    return payload[index];
}

// Of each of the group's blocks: samples inside the volume on each axis, four bits each; 0 for none.
var<workgroup> extents: array<u32, ZFP_GROUP_BLOCKS>;
// Of each row of the blocks that are transformed at a time: least, greatest and first sample.
var<workgroup> rows: array<vec3<f32>, 128>;

// First phase: one invocation reads the planes of the region's block number `element`.
fn read_element(element: u32, lane: u32) {
    extents[lane] = 0u;
#ifdef KEEP_SAMPLES
    kept_slots[lane] = NO_SLOT;
#endif
    zfp_group_leave_out(lane);
    if element >= min(params.size.w, arrayLength(&extrema) / 8u) {
        return;
    }
    let row = element / params.size.x;
    let local = vec3<u32>(element % params.size.x, row % params.size.y, row / params.size.y);
    let blocks = (params.dims.xyz - 1u) / 4u + 1u;
    // Written so that origins near the largest u32 do not wrap into the volume.
    if any(params.origin.xyz >= blocks) || any(local >= blocks - params.origin.xyz) {
        return;
    }
    let position = params.origin.xyz + local;
    let block = position.x + blocks.x * (position.y + blocks.y * position.z) - page.first_block;
    if block >= page.blocks {
        return;
    }
    let extent = min(params.dims.xyz - 4u * position, vec3<u32>(4u));
    extents[lane] = extent.x | (extent.y << 4u) | (extent.z << 8u);
#ifdef KEEP_SAMPLES
    // The last layers belong to the next regions, which decode them again.
    if all(local + vec3<u32>(1u) < params.size.xyz) {
        kept_slots[lane] = block + page.first_block;
    }
#endif
    zfp_group_read(lane, zfp_locate(page, block), page.bits_per_block);
}

// Range of the row's samples inside the volume, and its first sample; empty for a row outside.
fn row_extrema(block: u32, row: u32) -> vec3<f32> {
    let extent = extents[block];
    let samples = zfp_group_row(block, row);
#ifdef KEEP_SAMPLES
    if kept_slots[block] != NO_SLOT {
        zfp_store_row(kept_slots[block], params.dims.w, row, samples);
    }
#endif
    if (row & 3u) >= ((extent >> 4u) & 15u) || (row >> 2u) >= (extent >> 8u) {
        return vec3<f32>(EXTREMA_LARGEST, -EXTREMA_LARGEST, 0.0);
    }
    let present = vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(extent & 15u);
    let low = select(vec4<f32>(EXTREMA_LARGEST), samples, present);
    let high = select(vec4<f32>(-EXTREMA_LARGEST), samples, present);
    return vec3<f32>(
        min(min(low.x, low.y), min(low.z, low.w)), max(max(high.x, high.y), max(high.z, high.w)), samples.x);
}

// Range over a block's rows of one class, whose bits 1 and 2 keep only the rows with y = 0, z = 0 and
// whose bit 0 keeps only first samples.
fn class_extrema(first_row: u32, kind: u32) -> vec2<f32> {
    var range = vec2<f32>(EXTREMA_LARGEST, -EXTREMA_LARGEST);
    let step_y = select(1u, 4u, (kind & 2u) != 0u);
    let end = select(16u, 4u, (kind & 4u) != 0u);
    for (var row = 0u; row < end; row += step_y) {
        let found = rows[first_row + row];
        if found.x <= found.y {
            let values = select(found.xy, found.zz, (kind & 1u) != 0u);
            range = vec2<f32>(min(range.x, values.x), max(range.y, values.y));
        }
    }
    return range;
}

@compute @workgroup_size(ZFP_GROUP_LANES)
fn block_extrema(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let first = indirect_linear_group(group, groups) * ZFP_GROUP_BLOCKS;
    if lane < ZFP_GROUP_BLOCKS {
        read_element(first + lane, lane);
    }
    workgroupBarrier();
    zfp_group_invert(lane);
    let kind = lane & 7u;
    for (var turn = 0u; turn < 4u; turn++) {
        let block = turn * ZFP_GROUP_AT_ONCE + (lane >> 3u);
        let first_row = 16u * (lane >> 3u);
        rows[first_row + kind] = row_extrema(block, kind);
        rows[first_row + kind + 8u] = row_extrema(block, kind + 8u);
        workgroupBarrier();
        if extents[block] != 0u {
            extrema[(first + block) * 8u + kind] = class_extrema(first_row, kind);
        }
        workgroupBarrier();
    }
}
