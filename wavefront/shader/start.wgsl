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

// Rays of one invocation, whose numbers follow each other: 2x2 pixels.
const RAYS_EACH: u32 = 4u;

var<workgroup> active_bits: array<atomic<u32>, 8>;
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

// Starts a ray: (enters the volume, may hit something), 1 for yes.
fn start(id: u32, pixel: vec2<u32>, volume: DdaBox, box: DdaBox) -> vec2<u32> {
    let ray = frame_ray(frame, pixel).ray;
    // Whatever meets a part of the volume meets all of it.
    if (meets(ray, box)) {
        atomicStore(&rays[RAYS_HEADER + id], waiting(ray, box));
        return vec2<u32>(1u);
    }
    atomicStore(&rays[RAYS_HEADER + id], RAY_DONE);
    outputs_write_background(pixel);
    return vec2<u32>(u32(meets(ray, volume)), 0u);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    if (lane < 8u) {
        atomicStore(&active_bits[lane], 0u);
    }
    if (lane == 0u) {
        atomicStore(&entered, 0u);
    }
    workgroupBarrier();
    let first = (indirect_linear_group(group, groups) * 64u + lane) * RAYS_EACH;
    if (first < frame.ray_numbers) {
        let zero = frame_zero(atomicLoad(&rays[RAYS_HITS]));
        let volume = DdaBox(vec3<i32>(0), frame.grid.last_cell + vec3<i32>(i32(zero)));
        let grid = macrocell_active(frame.grid);
        let box = DdaBox(4 * grid.first_block, grid.last_cell);
        let corner = frame_pixel(frame, first);
        var counts = vec2<u32>(0u);
        for (var i = 0u; i < RAYS_EACH + zero; i++) {
            let pixel = corner + vec2<u32>(i & 1u, i >> 1u);
            if (pixel.x < frame.width && pixel.y < frame.height) {
                let started = start(first + i, pixel, volume, box);
                counts += vec2<u32>(started.x, started.y << i);
            }
        }
        atomicOr(&active_bits[lane >> 3u], counts.y << (RAYS_EACH * (lane & 7u)));
        atomicAdd(&entered, counts.x);
    }
    workgroupBarrier();
    if ((lane & 7u) == 0u && first < frame.ray_numbers) {
        atomicStore(&rays[frame_active_word(frame, first)], atomicLoad(&active_bits[lane >> 3u]));
    }
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_ENTERED], atomicLoad(&entered));
        if (first == 0u) {
            atomicStore(&rays[RAYS_ACTIVE], 1u);
            atomicStore(&rays[RAYS_LISTED], 1u); // the first list is to be made
        }
    }
}
