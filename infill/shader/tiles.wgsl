// Lists of the tiles with holes and of those near them. One invocation per tile.
#import infill_params
#import indirect

@group(0) @binding(0) var<uniform> params: InfillParams;
@group(0) @binding(1) var<storage, read_write> tiles: array<atomic<u32>>;

const LISTS: u32 = 3u;

fn has_holes(place: vec2<i32>) -> bool {
    if (any(place < vec2<i32>(0)) || any(place >= vec2<i32>(params.tiles))) {
        return false;
    }
    let tile = u32(place.x) + params.tiles.x * u32(place.y);
    return ((atomicLoad(&tiles[TILES_HEADER + (tile >> 5u)]) >> (tile & 31u)) & 1u) != 0u;
}

// Tiles to the nearest one with holes, LISTS for more.
fn distance_to_holes(place: vec2<i32>) -> u32 {
    var least = LISTS;
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            if (has_holes(place + vec2<i32>(x, y))) {
                least = min(least, u32(max(abs(x), abs(y))));
            }
        }
    }
    return least;
}

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let tile = indirect_linear_group(group, groups) * 256u + lane;
    if (tile >= params.tiles.x * params.tiles.y) {
        return;
    }
    let nearest = distance_to_holes(vec2<i32>(vec2<u32>(tile % params.tiles.x, tile / params.tiles.x)));
    for (var list = nearest; list < LISTS; list++) {
        let index = atomicAdd(&tiles[list], 1u);
        atomicStore(&tiles[infill_list_word(params, list, index)], tile);
    }
}
