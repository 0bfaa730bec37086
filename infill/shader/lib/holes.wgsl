// A tile's holes, one after the other, so that no lane is without one while others work. The importing text declares
// `frame`, `params` and `rays`.
#import infill_params
#import tile_rays

var<workgroup> holes_inside: array<u32, INFILL_TILE_RAYS>;
var<workgroup> holes_words: array<u32, INFILL_TILE_WORDS>;

// Collects them, none unless the tile is `listed`; their number. All 64 invocations call it together.
fn holes_collect(corner: vec2<u32>, listed: bool, lane: u32) -> u32 {
    if (lane < INFILL_TILE_WORDS) {
        holes_words[lane] = select(0u, tile_word(corner, lane), listed);
    }
    workgroupBarrier();
    // An invocation looks at four of the rays.
    let shift = 4u * (lane & 7u);
    let word = holes_words[lane >> 3u];
    var count = 0u;
    var before = countOneBits(word & ((1u << shift) - 1u));
    for (var i = 0u; i < INFILL_TILE_WORDS; i++) {
        before += select(0u, countOneBits(holes_words[i]), i < (lane >> 3u));
        count += countOneBits(holes_words[i]);
    }
    if (count < INFILL_TILE_RAYS) {
        for (var i = 0u; i < 4u; i++) {
            if (((word >> (shift + i)) & 1u) != 0u) {
                holes_inside[before] = 4u * lane + i;
                before++;
            }
        }
    }
    workgroupBarrier();
    return count;
}

// The place in its tile of one of `count` holes.
fn holes_place(index: u32, count: u32) -> vec2<u32> {
    if (count == INFILL_TILE_RAYS) {
        return frame_place(index);
    }
    return frame_place(holes_inside[index]);
}
