// Which pixels are holes, and where their rays wait. The importing text declares `frame` and
//   var<storage, read> rays: array<u32>;
#import frame

fn infill_is_hole(number: u32) -> bool {
    return ((rays[frame_active_word(frame, number)] >> (number & 31u)) & 1u) != 0u;
}

// Where an active ray enters the block in which it waits: no hit is nearer.
fn infill_t_low(ray: DdaRay, number: u32) -> f32 {
    let block = frame_unpack(frame, rays[RAYS_HEADER + number]);
    return macrocell_enter(frame.grid, ray, block).event.t;
}

fn infill_volume() -> DdaBox {
    return DdaBox(vec3<i32>(0), frame.grid.last_cell);
}
