// A tile's holes, one after the other, so that no lane is without one while others work. The importing text declares
// `frame`, `params` and `rays`.
#import infill_params
#import infill_rays

var<workgroup> holes_inside: array<u32, INFILL_TILE * INFILL_TILE>;
var<workgroup> holes_count: atomic<u32>;

// Collects them, none unless the tile is `listed`. All 64 invocations call it together.
fn holes_collect(corner: vec2<u32>, listed: bool, lane: u32) {
    if (lane == 0u) {
        atomicStore(&holes_count, 0u);
    }
    workgroupBarrier();
    for (var i = lane; i < INFILL_TILE * INFILL_TILE; i += 64u) {
        let pixel = corner + vec2<u32>(i % INFILL_TILE, i / INFILL_TILE);
        if (listed && all(pixel < params.size) && infill_is_hole(frame_number(frame, pixel))) {
            holes_inside[atomicAdd(&holes_count, 1u)] = i;
        }
    }
    workgroupBarrier();
}

// The place of a hole in its tile.
fn holes_place(index: u32) -> vec2<u32> {
    let i = holes_inside[index];
    return vec2<u32>(i % INFILL_TILE, i / INFILL_TILE);
}
