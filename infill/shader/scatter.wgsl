// The previous frame's hits into the next picture. One invocation for 2x2 pixels of the previous frame, whose pictures are
// still there.
#import infill_params
#import history
#import shading
#import indirect

struct ScatterParams {
    // Rows that take an index-space position to (column * w, row * w, w, view depth) of the next frame.
    column: vec4<f32>,
    row: vec4<f32>,
    w: vec4<f32>,
    depth: vec4<f32>,
}

@group(0) @binding(0) var<uniform> old_frame: FrameParams;
@group(0) @binding(1) var<uniform> frame: FrameParams; // the next one
@group(0) @binding(2) var<uniform> shading: ShadingParams;
@group(0) @binding(3) var<uniform> params: InfillParams;
@group(0) @binding(4) var<uniform> scatter: ScatterParams;
@group(0) @binding(5) var<storage, read> rays: array<u32>; // of the previous frame
@group(0) @binding(6) var<storage, read_write> keys: array<atomic<u32>>;
@group(0) @binding(7) var depth: texture_2d<f32>;
@group(0) @binding(8) var normals: texture_2d<f32>;

const FARTHEST: f32 = 3.0e38;

// What a loop over pixels reads of the next frame, loaded once.
struct NextFrame {
    scatter: ScatterParams,
    lines: FrameRays,
    size: vec2<u32>,
    volume: DdaBox,
}

fn place_hit(next: NextFrame, position: vec4<f32>, normal: vec3<f32>) {
    let w = dot(next.scatter.w, position);
    let place = vec2<f32>(dot(next.scatter.column, position), dot(next.scatter.row, position)) / w;
    let inside = all(place >= vec2<f32>(0.0)) && all(place < vec2<f32>(next.size));
    if (!(w > 0.0 && inside)) {
        return;
    }
    let pixel = vec2<u32>(place);
    let frame_ray = frame_ray_of(next.lines, pixel);
    let ray = frame_ray.ray;
    if (!dda_meets(ray, next.volume) || dot(normal, shading_to_viewer(ray.direction)) <= 0.0) {
        return;
    }
    let t = frame_t(frame, frame_ray, dot(next.scatter.depth, position));
    let key = history_key(t - dda_entry(ray, next.volume).t, normal);
    atomicMax(&keys[pixel.x + next.size.x * pixel.y], key);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = 4u * (indirect_linear_group(group, groups) * 64u + lane);
    if (number >= old_frame.ray_numbers) {
        return;
    }
    let corner = frame_pixel(old_frame, number);
    let old_lines = frame_rays(old_frame);
    let next = NextFrame(scatter, frame_rays(frame), params.size, infill_volume());
    for (var child = 0u; child < 4u; child++) {
        let pixel = corner + frame_place(child);
        if (all(pixel < vec2<u32>(old_frame.width, old_frame.height))) {
            let view_depth = textureLoad(depth, pixel, 0).x;
            if (view_depth < FARTHEST) {
                let frame_ray = frame_ray_of(old_lines, pixel);
                let t = frame_t(old_frame, frame_ray, view_depth);
                let position = frame_ray.ray.origin + t * frame_ray.ray.direction;
                place_hit(next, vec4<f32>(position, 1.0), textureLoad(normals, pixel, 0).xyz);
#ifdef HALVED
                // The next picture has one pixel for these.
                break;
#endif
            }
        }
    }
}
