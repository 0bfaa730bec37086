// Starts a frame: a bit for every ray that may hit something. The pictures, unfinished everywhere, get their background where
// no ray has anything to hit.
#import frame
#import indirect
#import macrocell_skip
#import outputs
#import ray_quads

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

// Pixels on the edge of a workgroup's tile, unless the picture is tiny.
const TILE: u32 = 16u;

// Voxels inside a box: rays that are rounded differently from one another are not as far apart. A crossing's error is below
// 2^-4 voxels while rays that meet the volume start within 2^16 voxels of it: eight roundings of 2^-24.
const MARGIN: i32 = 1;

var<workgroup> entered: atomic<u32>;
var<workgroup> corners_inside: atomic<u32>;

fn macrocell_mask(index: u32) -> vec2<u32> {
    return masks[index];
}

// Whether the ray has a part inside the box, which may be empty.
fn meets(ray: DdaRay, box: DdaBox) -> bool {
    return all(box.low <= box.high) && dda_meets(ray, box);
}

// Whether the rays in all four corners of the workgroup's tile, one for each of the first lanes, meet what is inside the
// box: then all of its rays meet the box, since what a convex body covers of a picture is convex.
fn count_corner(corner: vec2<u32>, box: DdaBox, lane: u32) {
    let pixel = corner + (TILE - 1u) * vec2<u32>(lane & 1u, lane >> 1u);
    let is_tile = frame.ray_level > 0u && pixel.x < frame.width && pixel.y < frame.height;
    let inside = DdaBox(box.low + vec3<i32>(MARGIN), box.high - vec3<i32>(MARGIN));
    if (is_tile && meets(frame_ray(frame, pixel).ray, inside)) {
        atomicAdd(&corners_inside, 1u);
    }
}

// Starts a ray: (enters the volume, may hit something), 1 for yes.
fn start(pixel: vec2<u32>, volume: DdaBox, box: DdaBox) -> vec2<u32> {
    let ray = frame_ray(frame, pixel).ray;
    // Whatever meets a part of the volume meets all of it.
    if (meets(ray, box)) {
        return vec2<u32>(1u);
    }
    outputs_write_background(pixel);
    return vec2<u32>(u32(meets(ray, volume)), 0u);
}

fn write_header(box: DdaBox) {
    atomicStore(&rays[RAYS_ACTIVE], 1u);
    atomicStore(&rays[RAYS_LISTED], 1u); // the first list is to be made
    for (var axis = 0u; axis < 3u; axis++) {
        atomicStore(&rays[RAYS_BOX + axis], bitcast<u32>(box.low[axis]));
        atomicStore(&rays[RAYS_BOX + 3u + axis], bitcast<u32>(box.high[axis]));
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    quad_begin(lane);
    if (lane == 0u) {
        atomicStore(&entered, 0u);
        atomicStore(&corners_inside, 0u);
    }
    workgroupBarrier();
    let number = indirect_linear_group(group, groups) * 64u * QUAD_RAYS;
    let zero = frame_zero(atomicLoad(&rays[RAYS_HITS]));
    let grid = macrocell_active(frame.grid);
    let box = DdaBox(4 * grid.first_block, grid.last_cell);
    if (lane < 4u) {
        count_corner(frame_pixel(frame, number), box, lane);
    }
    workgroupBarrier();
    let first = number + lane * QUAD_RAYS;
    if (first < frame.ray_numbers) {
        // Entering the volume, and their bits.
        var counts = vec2<u32>(QUAD_RAYS, (1u << QUAD_RAYS) - 1u);
        if (atomicLoad(&corners_inside) < 4u) {
            let volume = DdaBox(vec3<i32>(0), frame.grid.last_cell + vec3<i32>(i32(zero)));
            let corner = frame_pixel(frame, first);
            counts = vec2<u32>(0u);
            for (var i = 0u; i < QUAD_RAYS + zero; i++) {
                let pixel = quad_pixel(corner, i);
                if (pixel.x < frame.width && pixel.y < frame.height) {
                    let started = start(pixel, volume, box);
                    counts += vec2<u32>(started.x, started.y << i);
                }
            }
        }
        quad_add(lane, counts.y);
        atomicAdd(&entered, counts.x);
    }
    workgroupBarrier();
    if (quad_leads(lane) && first < frame.ray_numbers) {
        atomicStore(&rays[frame_active_word(frame, first)], quad_word(lane));
    }
    if (lane == 0u) {
        atomicAdd(&rays[RAYS_ENTERED], atomicLoad(&entered));
        if (first == 0u) {
            write_header(box);
        }
    }
}
