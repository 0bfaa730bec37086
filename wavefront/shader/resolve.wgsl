// Turns every new hit into parameter, normal and colour, and takes finished rays off the active ones. All
// strategies share this kernel, so that their pictures are equal bit for bit.
#import frame
#import indirect
#ifdef RESIDENT
#else
#import lru_lookup
#endif
#import block_samples
#import block_walk
#import outputs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<storage, read_write> rays: array<atomic<u32>>;
#ifdef RESIDENT
const FIRST_PAGE: u32 = 3u;
#else
@group(0) @binding(3) var<storage, read> lru_directory: array<u32>;
const FIRST_PAGE: u32 = 4u;
#endif
@group(0) @binding(FIRST_PAGE) var<storage, read> lru_slots_0: array<f32>;
#ifdef LRU_PAGES_2
@group(0) @binding(FIRST_PAGE + 1u) var<storage, read> lru_slots_1: array<f32>;
#endif
#ifdef LRU_PAGES_3
@group(0) @binding(FIRST_PAGE + 2u) var<storage, read> lru_slots_2: array<f32>;
#endif
#ifdef LRU_PAGES_4
@group(0) @binding(FIRST_PAGE + 3u) var<storage, read> lru_slots_3: array<f32>;
#endif

var<workgroup> hit_count: atomic<u32>;
// Bits of a float that is not negative: they are ordered as the floats are.
var<workgroup> open_depth: atomic<u32>;

fn lru_params() -> LruParams {
    return frame.lru;
}

fn lru_slots_per_page() -> u32 {
    return frame.lru.slots_per_page;
}

#ifdef RESIDENT
#else
fn block_use(slot: u32) {}
#endif

// Finds the hit again: the first crossing in the block, whose samples are still resident.
fn hit_in_block(ray: DdaRay, block: vec3<i32>, known: u32) -> BlockWalk {
    block_open(block);
    let place = macrocell_enter(frame.grid, ray, block);
    let start = CellPlace(place.event, macrocell_first_cell(frame.grid, ray, place));
    return block_walk(ray, start, macrocell_box(frame.grid, block), frame.isovalue, known);
}

fn resolve(id: u32, state: u32) {
    let pixel = frame_pixel(frame, id);
    let frame_ray = frame_ray(frame, pixel);
    let ray = frame_ray.ray;
    let walk = hit_in_block(ray, frame_unpack(frame, state), frame_count(frame, state));
    let s = cell_root(walk.bernstein, walk.bracket, walk.inside_low);
    let t = cell_mix(walk.place.event.t, walk.exit.t, s);
    let low = cell_entry(ray, walk.place.event, walk.place.cell);
    let high = cell_exit(ray, walk.exit, walk.place.cell);
    let gradient = cell_gradient(walk.corners, low * (1.0 - s) + high * s);
    let to_viewer = shading_to_viewer(ray.direction);
    let normal = shading_normal(gradient, to_viewer);
    let depth = frame.start_depth + t * frame_ray.depth_per_voxel;
    outputs_write_hit(pixel, shading_color(normal, to_viewer), depth, normal);
}

// Length of the ray's part in which its first hit may still lie, in voxels: from where it enters the block that it
// waits for to where it leaves the volume.
fn open_voxels(id: u32, state: u32) -> f32 {
    let ray = frame_ray(frame, frame_pixel(frame, id)).ray;
    let waits = dda_entry(ray, macrocell_box(frame.grid, frame_unpack(frame, state)));
    let leaves = dda_exit(ray, DdaBox(vec3<i32>(0), frame.grid.last_cell));
    return max(leaves.t - waits.t, 0.0);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane == 0u) {
        atomicStore(&hit_count, 0u);
        atomicStore(&open_depth, 0u);
    }
    workgroupBarrier();
    let index = indirect_linear_group(group, groups) * 64u + lane;
    if (index < atomicLoad(&rays[RAYS_LISTED])) {
        let id = atomicLoad(&rays[frame_list_word(frame, index)]);
        let state = atomicLoad(&rays[RAYS_HEADER + id]);
        let status = state & RAY_STATUS;
        if (status == RAY_ACTIVE) {
            atomicMax(&open_depth, bitcast<u32>(open_voxels(id, state)));
        } else {
            atomicAnd(&rays[frame_active_word(frame, id)], ~(1u << (id & 31u)));
        }
        if (status == RAY_HIT) {
            resolve(id, state);
            atomicStore(&rays[RAYS_HEADER + id], RAY_SHADED);
            atomicAdd(&hit_count, 1u);
        } else if (status == RAY_DONE) {
            outputs_write_background(frame_pixel(frame, id));
        }
    }
    workgroupBarrier();
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_HITS], atomicLoad(&hit_count));
        atomicMax(&rays[RAYS_OPEN_NOW], atomicLoad(&open_depth));
    }
}
