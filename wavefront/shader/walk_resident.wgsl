// One round of the listed rays where all samples are resident: each walks to its hit or to the
// volume's end.
#import frame
#import indirect
#import macrocell_skip
#import first_block
#import block_samples
#import block_walk
#import work

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> lru_slots_0: array<f32>;
#ifdef LRU_PAGES_2
@group(0) @binding(4) var<storage, read> lru_slots_1: array<f32>;
#endif
#ifdef LRU_PAGES_3
@group(0) @binding(5) var<storage, read> lru_slots_2: array<f32>;
#endif
#ifdef LRU_PAGES_4
@group(0) @binding(6) var<storage, read> lru_slots_3: array<f32>;
#endif

fn lru_slots_per_page() -> u32 {
    return frame.lru.slots_per_page;
}

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// The ray's new state.
fn walk(grid: MacrocellGrid, ray: DdaRay, first_block: vec3<i32>) -> u32 {
    var place = macrocell_advance(
        grid, ray, macrocell_enter(grid, ray, first_block));
    while (macrocell_inside(grid, place.block)) {
        if (work_is_done()) {
            return RAY_ACTIVE | frame_pack(frame, place.block);
        }
        block_open(place.block);
        let box = macrocell_box(grid, place.block);
        let start = CellPlace(place.event, macrocell_first_cell(grid, ray, place));
        let result = block_walk(ray, start, box, frame.isovalue, 0u);
        work_cells += result.cells + u32(result.hit);
        if (result.hit) {
            return RAY_HIT | frame_pack_count(frame, result.cells) | frame_pack(frame, place.block);
        }
        place = macrocell_advance(
            grid, ray, macrocell_step(ray, place.block, result.place.event));
    }
    return RAY_DONE;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = indirect_linear_group(group, groups) * 64u + lane;
    let listed = atomicLoad(&rays[RAYS_LISTED]);
    if (index >= listed) {
        return;
    }
    let id = atomicLoad(&rays[frame_list_word(frame, index)]);
    let ray = frame_ray(frame, frame_pixel(frame, id)).ray;
    let grid = macrocell_active(frame.grid);
    let state = first_block_state(grid, ray, atomicLoad(&rays[RAYS_HEADER + id]));
    work_begin(listed);
    atomicStore(&rays[RAYS_HEADER + id], walk(grid, ray, frame_unpack(frame, state)));
    work_count();
}
