// A bit for every tile with holes. One invocation per word of the rays' active bits, which are 8x4 pixels.
#import infill_params
#import frame
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> params: InfillParams;
@group(0) @binding(2) var<storage, read> rays: array<u32>;
@group(0) @binding(3) var<storage, read_write> tiles: array<atomic<u32>>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = 32u * (indirect_linear_group(group, groups) * 256u + lane);
    if (number >= frame.ray_numbers || rays[frame_active_word(frame, number)] == 0u) {
        return;
    }
    let place = frame_pixel(frame, number) / INFILL_TILE;
    let tile = place.x + params.tiles.x * place.y;
    atomicOr(&tiles[TILES_HEADER + (tile >> 5u)], 1u << (tile & 31u));
}
