// Quads of 2x2 pixels. The importing text declares `frame`, `params` and `rays`.
#import infill_params
#import infill_rays

fn quad_columns() -> u32 {
    return (params.size.x + 1u) >> 1u;
}

// Of quads row by row.
fn quad_index(quad: vec2<u32>) -> u32 {
    return quad.x + quad_columns() * quad.y;
}

// A bit for every hole, row by row. Pixels outside the picture have none.
fn quad_holes(quad: vec2<u32>) -> u32 {
    let number = frame_number(frame, 2u * quad);
    return (rays[frame_active_word(frame, number)] >> (number & 31u)) & 15u;
}

// The quad's first hole, its first pixel without any: its place in the quad.
fn quad_first_hole(holes: u32) -> vec2<u32> {
    return frame_place(firstTrailingBit(holes | 16u) & 3u);
}
