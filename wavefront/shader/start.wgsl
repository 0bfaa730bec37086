// Starts a frame: every ray's first block, a bit for those that enter the volume, cleared outputs.
#import frame
#import indirect
#import outputs

@group(0) @binding(0) var<uniform> frame: FrameParams;
@group(0) @binding(1) var<uniform> shading: ShadingParams;
@group(0) @binding(2) var<storage, read_write> rays: array<atomic<u32>>;
@group(0) @binding(3) var color_out: texture_storage_2d<rgba8unorm, write>;
#ifdef OUTPUT_DEPTH
@group(0) @binding(DEPTH_BINDING) var depth_out: texture_storage_2d<r32float, write>;
#endif
#ifdef OUTPUT_NORMAL
@group(0) @binding(NORMAL_BINDING) var normal_out: texture_storage_2d<rgba16float, write>;
#endif
#ifdef OUTPUT_STATUS
@group(0) @binding(STATUS_BINDING) var status_out: texture_storage_2d<r32uint, write>;
#endif

var<workgroup> entered_bits: array<atomic<u32>, 2>;

// The ray's first state: waiting in the block where it enters the volume, or done.
fn first_state(grid: MacrocellGrid, ray: DdaRay) -> u32 {
    let volume = DdaBox(vec3<i32>(0), grid.last_cell);
    if (any(grid.last_cell < vec3<i32>(0)) || !dda_meets(ray, volume)) {
        return RAY_DONE;
    }
    let cell = dda_cell_after(ray, dda_entry(ray, volume), volume, dda_first_cells(ray, volume));
    return RAY_ACTIVE | frame_pack_count(frame, frame.first_misses) | frame_pack(frame, cell >> vec3<u32>(2u));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane < 2u) {
        atomicStore(&entered_bits[lane], 0u);
    }
    workgroupBarrier();
    let id = indirect_linear_group(group, groups) * 64u + lane;
    let pixel = frame_pixel(frame, id);
    if (id < frame.ray_numbers && pixel.x < frame.width && pixel.y < frame.height) {
        let grid = frame_grid(frame, atomicLoad(&rays[RAYS_HITS]));
        let state = first_state(grid, frame_ray(frame, pixel).ray);
        let entered = state != RAY_DONE;
        atomicStore(&rays[RAYS_HEADER + id], state);
        outputs_write_empty(pixel, entered);
        if (entered) {
            atomicOr(&entered_bits[lane >> 5u], 1u << (lane & 31u));
        }
    }
    workgroupBarrier();
    if ((lane & 31u) == 0u && id < frame.ray_numbers) {
        let bits = atomicLoad(&entered_bits[lane >> 5u]);
        atomicStore(&rays[frame_active_word(frame, id)], bits);
        atomicAdd(&rays[RAYS_ENTERED], countOneBits(bits));
    }
    if (id == 0u) {
        atomicStore(&rays[RAYS_ACTIVE], 1u); // the first list is to be made
    }
}
