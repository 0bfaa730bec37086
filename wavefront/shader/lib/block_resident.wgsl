// Samples of a volume that is resident as a whole: block b in slot b. Needs lru_sample; the importing
// text declares
//   var<uniform> frame: FrameParams;
#import frame
#import lru_slots

var<private> block_index: u32;

fn block_open(position: vec3<i32>) {
    block_index = macrocell_linear(position, frame.grid.blocks);
}

fn block_take(need: u32) -> bool {
    return true;
}

fn block_sample(x: i32, y: i32, z: i32) -> f32 {
    let size = frame.grid.blocks;
    let slot = block_index + u32(x >> 2u) + size.x * (u32(y >> 2u) + size.y * u32(z >> 2u));
    return lru_sample(slot, u32((x & 3) | ((y & 3) << 2u) | ((z & 3) << 4u)));
}
