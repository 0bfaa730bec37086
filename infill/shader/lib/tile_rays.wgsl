// A tile's rays in the order of their numbers: eight words of active bits, 8x4 pixels each. The importing text declares
// `frame`, `params` and `rays`.
#import infill_params
#import infill_rays

const INFILL_TILE_RAYS: u32 = INFILL_TILE * INFILL_TILE;
const INFILL_TILE_WORDS: u32 = INFILL_TILE_RAYS / 32u;

// The active bits of a word of the tile at `corner`; none outside the picture.
fn tile_word(corner: vec2<u32>, word: u32) -> u32 {
    // Squares of 8x8 pixels are two words whatever the picture's size.
    let square = corner + 8u * vec2<u32>((word >> 1u) & 1u, word >> 2u);
    if (any(square >= params.size)) {
        return 0u;
    }
    return rays[frame_active_word(frame, frame_number(frame, square)) + (word & 1u)];
}
