// Starts a frame: every ray's first block, a bit for those that may hit something. The pictures, unfinished everywhere,
// get their background where no ray has anything to hit.
#import frame
#import indirect
#import macrocell_skip
#import outputs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> masks: array<vec2<u32>>;
@group(0) @binding(4) var color_out: texture_storage_2d<rgba8unorm, write>;
#ifdef OUTPUT_DEPTH
@group(0) @binding(DEPTH_BINDING) var depth_out: texture_storage_2d<r32float, write>;
#endif
#ifdef OUTPUT_NORMAL
@group(0) @binding(NORMAL_BINDING) var normal_out: texture_storage_2d<rgba16float, write>;
#endif
#ifdef OUTPUT_STATUS
@group(0) @binding(STATUS_BINDING) var status_out: texture_storage_2d<r32uint, write>;
#endif

var<workgroup> active_bits: array<atomic<u32>, 2>;
var<workgroup> entered: atomic<u32>;

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// Whether the ray has a part inside the box, which may be empty.
fn meets(ray: DdaRay, box: DdaBox) -> bool {
    return all(box.low <= box.high) && dda_meets(ray, box);
}

// The state of a ray that waits in the block where it enters `box`.
fn waiting(ray: DdaRay, box: DdaBox) -> u32 {
    let cell = dda_cell_after(ray, dda_entry(ray, box), box, dda_first_cells(ray, box));
    return RAY_ACTIVE | frame_pack_count(frame, frame.first_misses) | frame_pack(frame, cell >> vec3<u32>(2u));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane < 2u) {
        atomicStore(&active_bits[lane], 0u);
    }
    if (lane == 0u) {
        atomicStore(&entered, 0u);
    }
    workgroupBarrier();
    let id = indirect_linear_group(group, groups) * 64u + lane;
    let pixel = frame_pixel(frame, id);
    if (id < frame.ray_numbers && pixel.x < frame.width && pixel.y < frame.height) {
        let ray = frame_ray(frame, pixel).ray;
        let zero = i32(frame_zero(atomicLoad(&rays[RAYS_HITS])));
        let volume = DdaBox(vec3<i32>(0), frame.grid.last_cell + vec3<i32>(zero));
        let grid = macrocell_active(frame.grid);
        let box = DdaBox(4 * grid.first_block, grid.last_cell);
        if (meets(ray, volume)) {
            atomicAdd(&entered, 1u);
        }
        var state = RAY_DONE;
        if (meets(ray, box)) {
            state = waiting(ray, box);
            atomicOr(&active_bits[lane >> 5u], 1u << (lane & 31u));
        }
        atomicStore(&rays[RAYS_HEADER + id], state);
        if (state == RAY_DONE) {
            outputs_write_background(pixel);
        }
    }
    workgroupBarrier();
    if ((lane & 31u) == 0u && id < frame.ray_numbers) {
        atomicStore(&rays[frame_active_word(frame, id)], atomicLoad(&active_bits[lane >> 5u]));
    }
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_ENTERED], atomicLoad(&entered));
    }
    if (id == 0u) {
        atomicStore(&rays[RAYS_ACTIVE], 1u);
        atomicStore(&rays[RAYS_LISTED], 1u); // the first list is to be made
    }
}
