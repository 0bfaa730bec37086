// The candidates of every hole but that of history, for the network. A workgroup for every tile with holes.
#import guesses
#import holes
#import indirect

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<uniform> params: InfillParams;
@group(0) @binding(3) var<storage, read> rays: array<u32>;
@group(0) @binding(4) var<storage, read> tiles: array<u32>;
@group(0) @binding(5) var<storage, read_write> candidates: array<u32>;
#ifdef NEIGHBOURS
@group(0) @binding(AVERAGES_BINDING) var<storage, read> averages: array<vec4<u32>>;
#endif

const LIST: u32 = 0u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    let listed = index < tiles[LIST];
    let corner = infill_tile_corner(params, tiles[infill_list_word(params, LIST, select(0u, index, listed))]);
    let count = holes_collect(corner, listed, lane);
#ifdef NEIGHBOURS
    pull_tile(corner, lane);
#endif
    let share = infill_share(tiles[TILES_SHARES], tiles[TILES_SAMPLES]);
    for (var i = lane; i < count; i += 64u) {
        let inside = holes_place(i, count);
        let pixel = corner + inside;
        let words = guesses(pixel, frame_number(frame, pixel), inside, share);
        let first = 3u * infill_pixel_index(params, pixel);
        candidates[first] = words.x;
        candidates[first + 1u] = words.y;
        candidates[first + 2u] = words.z;
    }
}
