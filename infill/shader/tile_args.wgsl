// Arguments of dispatches over the three lists of tiles. Where this is not dispatched they stay 0.
#import indirect

@group(0) @binding(0) var<storage, read> tiles: array<u32>;
@group(0) @binding(1) var<storage, read_write> args: array<u32>;

@compute @workgroup_size(4)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) list: u32) {
    if (any(group != vec3<u32>(0u)) || list >= 3u) {
        return;
    }
    let folded = indirect_fold(tiles[list]);
    args[4u * list] = folded.x;
    args[4u * list + 1u] = folded.y;
    args[4u * list + 2u] = folded.z;
}
