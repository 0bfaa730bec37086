// Which pixels are holes, and where their rays wait. The importing text declares `frame` and
//   var<storage, read> rays: array<u32>;
#import frame

fn infill_is_hole(number: u32) -> bool {
    return ((rays[frame_active_word(frame, number)] >> (number & 31u)) & 1u) != 0u;
}

fn infill_cell(word: u32) -> vec3<i32> {
    return bitcast<vec3<i32>>(vec3<u32>(rays[word], rays[word + 1u], rays[word + 2u]));
}

// Where an active ray enters the block in which it waits, or the box of the active ones if it has not started: no hit is
// nearer.
fn infill_t_low(ray: DdaRay, number: u32) -> f32 {
    let state = rays[RAYS_HEADER + number];
    var box = macrocell_box(frame.grid, frame_unpack(frame, state));
    if (state == RAY_DONE) {
        box = DdaBox(infill_cell(RAYS_BOX), infill_cell(RAYS_BOX + 3u));
    }
    return dda_entry(ray, box).t;
}

fn infill_volume() -> DdaBox {
    return DdaBox(vec3<i32>(0), frame.grid.last_cell);
}
