// Intersects every visible block with its rays: one workgroup per block holds the block's 5^3
// vertices in workgroup memory and takes its rays 64 at a time.
#import frame
#import indirect
#import lru_lookup
#import lru_slots
#import pairs
#import block_walk

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read> rays: array<u32>;
@group(0) @binding(2) var<storage, read_write> pairs: array<u32>;
@group(0) @binding(3) var<storage, read> visible: array<u32>;  // slots, and at the end their number
@group(0) @binding(4) var<storage, read> slot_ends: array<u32>;
@group(0) @binding(5) var<storage, read> lru_directory: array<u32>;
@group(0) @binding(6) var<storage, read> lru_slots_0: array<f32>;
#ifdef LRU_PAGES_2
@group(0) @binding(7) var<storage, read> lru_slots_1: array<f32>;
#endif
#ifdef LRU_PAGES_3
@group(0) @binding(8) var<storage, read> lru_slots_2: array<f32>;
#endif

var<workgroup> vertices: array<f32, 125>;

fn lru_params() -> LruParams {
    return frame.lru;
}

fn lru_slots_per_page() -> u32 {
    return frame.lru.slots_per_page;
}

fn block_take(need: u32) -> bool {
    return true; // pairs come here when all samples are resident
}

fn block_sample(x: i32, y: i32, z: i32) -> f32 {
    return vertices[x + 5 * y + 25 * z];
}

// Vertex i of the block at `position`; 0 outside the volume, where no dual cell reaches.
fn load_vertex(position: vec3<i32>, i: u32) -> f32 {
    let vertex = vec3<i32>(vec3<u32>(i % 5u, (i / 5u) % 5u, i / 25u));
    let neighbour = position + (vertex >> vec3<u32>(2u));
    if (any(vec3<u32>(neighbour) >= frame.grid.blocks)) {
        return 0.0;
    }
    let slot = lru_lookup(macrocell_linear(neighbour, frame.grid.blocks));
    let local = vertex & vec3<i32>(3);
    return lru_sample(slot, u32(local.x | (local.y << 2u) | (local.z << 4u)));
}

fn intersect(pair: u32, position: vec3<i32>) {
    let id = rays[frame_list_word(frame, pair / pairs[PAIRS_SPECULATION])];
    let ray = frame_ray(frame, frame_pixel(frame, id)).ray;
    let box = macrocell_box(frame.grid, position);
    let entry = dda_entry(ray, box);
    let start = CellPlace(entry, dda_cell_after(ray, entry, box, dda_first_cells(ray, box)));
    if (block_walk(ray, start, box, frame.isovalue, 0u).hit) {
        let block = pairs[PAIRS_HEADER + pair] & PAIR_BLOCK;
        pairs[PAIRS_HEADER + pair] = PAIR_HIT | block;
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups);
    var first = 0u;
    var end = 0u;
    var position = vec3<i32>(0);
    if (index < visible[frame.lru.slots]) {
        let slot = visible[index];
        end = slot_ends[slot];
        if (slot > 0u) {
            first = slot_ends[slot - 1u];
        }
        let some_pair = pairs[PAIRS_HEADER + pairs[PAIRS_CAPACITY] + first];
        position = frame_block_position(frame, pairs[PAIRS_HEADER + some_pair] & PAIR_BLOCK);
    }
    for (var i = lane; i < 125u; i += 64u) {
        if (first < end) {
            vertices[i] = load_vertex(position, i);
        }
    }
    workgroupBarrier();
    for (var i = first + lane; i < end; i += 64u) {
        intersect(pairs[PAIRS_HEADER + pairs[PAIRS_CAPACITY] + i], position);
    }
}
