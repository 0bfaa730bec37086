// Asking for what a ray needs. The importing text declares
//   var<uniform> frame: FrameParams;
// and what lru_request asks for.
#import frame
#import lru_request

// Keeps or requests the needed ones of a block and its plus-side neighbours.
fn block_request(block: vec3<i32>, need: u32, leads: bool) {
    var led = 0u;
    for (var rest = need; rest != 0u; rest &= rest - 1u) {
        let i = countTrailingZeros(rest);
        let offset = vec3<i32>(vec3<u32>(i & 1u, (i >> 1u) & 1u, i >> 2u));
        let number = macrocell_linear(block + offset, frame.grid.blocks);
        let slot = lru_lookup(number);
        if (slot != LRU_MISSING) {
            lru_keep(slot);
        } else if (!leads) {
            lru_request(number);
        }
        if (leads) {
            lru_lead(led, number);
            led++;
        }
    }
}
