// The tile of a workgroup of a dispatch over a list of tiles. The importing text declares `params` and
//   var<storage, read> tiles: array<u32>;
// and gives LIST.
#import infill_params
#import indirect

struct ListedTile {
    corner: vec2<u32>, // first pixel
    listed: bool,      // false for workgroups beyond the list's end, whose corner is some tile's
}

fn listed_tile(group: vec3<u32>, groups: vec3<u32>) -> ListedTile {
    let index = indirect_linear_group(group, groups);
    let listed = index < tiles[LIST];
    let tile = tiles[infill_list_word(params, LIST, select(0u, index, listed))];
    return ListedTile(infill_tile_corner(params, tile), listed);
}
