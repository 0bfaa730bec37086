// The box of all active blocks, to the granularity of the coarsest level's children: rays that miss it
// are done, and the others end where they leave it. It follows the masks in their buffer. One workgroup.

struct ActiveBoxParams {
    cells: vec3<u32>,       // of the coarsest level
    first: u32,             // its first mask
    last_cell: vec3<i32>,   // dims - 2
    child_shift: u32,       // edge of a child, as a power of two of blocks
    active_box: u32,        // where the box goes
    has_third_level: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> params: ActiveBoxParams;
@group(0) @binding(1) var<storage, read_write> masks: array<vec2<u32>>;

const LANES: u32 = 256u;

// Behind the last child of any volume: the first child where nothing is active.
const NO_CHILD: i32 = 0x1000000;

// First child and the one after the last, on each axis.
var<workgroup> low: array<atomic<i32>, 3>;
var<workgroup> high: array<atomic<i32>, 3>;

// Which of four numbers are not 0, a bit for each.
fn not_zero(parts: vec4<u32>) -> u32 {
    return dot(select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), parts != vec4<u32>(0u)), vec4<u32>(1u));
}

// Which of 0 .. 3 the children of a mask take, a bit for each, on each axis.
fn taken(mask: vec2<u32>) -> vec3<u32> {
    let layers = vec4<u32>(mask.x & 0xffffu, mask.x >> 16u, mask.y & 0xffffu, mask.y >> 16u);
    let layer = layers.x | layers.y | layers.z | layers.w;
    let rows = vec4<u32>(layer & 15u, (layer >> 4u) & 15u, (layer >> 8u) & 15u, layer >> 12u);
    return vec3<u32>(rows.x | rows.y | rows.z | rows.w, not_zero(rows), not_zero(layers));
}

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_index) lane: u32) {
    if (lane < 3u) {
        atomicStore(&low[lane], NO_CHILD);
        atomicStore(&high[lane], 0);
    }
    workgroupBarrier();
    var mine_low = vec3<i32>(NO_CHILD);
    var mine_high = vec3<i32>(0);
    let size = params.cells;
    for (var index = lane; index < size.x * size.y * size.z; index += LANES) {
        let mask = masks[params.first + index];
        if ((mask.x | mask.y) != 0u) {
            let cell = vec3<u32>(index % size.x, (index / size.x) % size.y, index / (size.x * size.y));
            let children = taken(mask);
            mine_low = min(mine_low, vec3<i32>(4u * cell + firstTrailingBit(children)));
            mine_high = max(mine_high, vec3<i32>(4u * cell + firstLeadingBit(children) + vec3<u32>(1u)));
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        atomicMin(&low[axis], mine_low[axis]);
        atomicMax(&high[axis], mine_high[axis]);
    }
    workgroupBarrier();
    if (lane == 0u) {
        let shift = vec3<u32>(params.child_shift);
        let children = vec3<i32>(atomicLoad(&low[0]), atomicLoad(&low[1]), atomicLoad(&low[2]));
        let first = bitcast<vec3<u32>>(children << shift);
        let end = vec3<i32>(atomicLoad(&high[0]), atomicLoad(&high[1]), atomicLoad(&high[2])) << shift;
        let last = bitcast<vec3<u32>>(min(4 * end - vec3<i32>(1), params.last_cell));
        masks[params.active_box] = first.xy;
        masks[params.active_box + 1u] = vec2<u32>(first.z, params.has_third_level);
        masks[params.active_box + 2u] = last.xy;
        masks[params.active_box + 3u] = vec2<u32>(last.z, 0u);
    }
}
