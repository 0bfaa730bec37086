// Exact traversal of nested grids along a ray, driven by plane events.
//
// The ray crosses integer planes; the crossing of plane p of axis a has the parameter
// dda_plane_t(a, p), a pure function of the integer plane, non-decreasing along the ray for a fixed
// axis. Crossings are totally ordered by (t, axis, position along the axis). Planes at multiples of
// 4, 16, 64 are a subset of all planes, hence a coarser grid's crossings are a sub-sequence of the
// finer grid's: boxes can be skipped, entered and resumed at any level and the cells visited are
// those of one walk through all dual cells, in the same order.

struct DdaRay {
    origin: vec3<f32>,
    direction: vec3<f32>, // a component is exactly 0 or at least 2^-40 in size
    inverse: vec3<f32>,   // 1 / direction, 0 where the direction is 0
}

// The crossing of a plane, or the ray's start (axis = 3, t = 0), which follows all crossings at t <= 0.
struct DdaEvent {
    t: f32,
    axis: u32,
    plane: i32,
}

// Cells low ..= high on each axis.
struct DdaBox {
    low: vec3<i32>,
    high: vec3<i32>,
}

const DDA_START: u32 = 3u;
const DDA_FAR: f32 = 3.0e38;
const DDA_LEAST_DIRECTION: f32 = 9.094947e-13; // 2^-40: over 2^13 voxels it moves a ray by 2^-27

fn dda_ray(origin: vec3<f32>, direction: vec3<f32>) -> DdaRay {
    let moving = abs(direction) >= vec3<f32>(DDA_LEAST_DIRECTION);
    let kept = select(vec3<f32>(0.0), direction, moving);
    let inverse = select(vec3<f32>(0.0), vec3<f32>(1.0) / select(vec3<f32>(1.0), kept, moving), moving);
    return DdaRay(origin, kept, inverse);
}

fn dda_plane_t(ray: DdaRay, axis: u32, plane: i32) -> f32 {
    return (f32(plane) - ray.origin[axis]) * ray.inverse[axis];
}

fn dda_before(a: DdaEvent, b: DdaEvent) -> bool {
    return a.t < b.t || (a.t == b.t && a.axis < b.axis);
}

// Whether the ray has crossed `plane` of `axis` when `event` happens, for an event of another axis.
fn dda_crossed(ray: DdaRay, axis: u32, plane: i32, event: DdaEvent) -> bool {
    let t = dda_plane_t(ray, axis, plane);
    return t < event.t || (t == event.t && axis < event.axis);
}

// The cell on `axis`, among low ..= high, that the ray is in right after `event` of another axis.
fn dda_cell_on_axis(ray: DdaRay, event: DdaEvent, axis: u32, low: i32, high: i32) -> i32 {
    let direction = ray.direction[axis];
    let position = ray.origin[axis] + event.t * direction;
    var cell = i32(floor(clamp(position, f32(low), f32(high))));
    if (direction > 0.0) {
        while (cell < high && dda_crossed(ray, axis, cell + 1, event)) {
            cell++;
        }
        while (cell > low && !dda_crossed(ray, axis, cell, event)) {
            cell--;
        }
    } else if (direction < 0.0) {
        while (cell > low && dda_crossed(ray, axis, cell, event)) {
            cell--;
        }
        while (cell < high && !dda_crossed(ray, axis, cell + 1, event)) {
            cell++;
        }
    }
    return cell;
}

// The cell right after `event`, which lies in `box` on every axis but the event's own.
fn dda_cell_after(ray: DdaRay, event: DdaEvent, box: DdaBox) -> vec3<i32> {
    var cell: vec3<i32>;
    for (var axis = 0u; axis < 3u; axis++) {
        if (axis == event.axis) {
            cell[axis] = event.plane - select(0, 1, ray.direction[axis] < 0.0);
        } else {
            cell[axis] = dda_cell_on_axis(ray, event, axis, box.low[axis], box.high[axis]);
        }
    }
    return cell;
}

// The last of the crossings that lead into `box`, or the ray's start inside it.
fn dda_entry(ray: DdaRay, box: DdaBox) -> DdaEvent {
    var entry = DdaEvent(0.0, DDA_START, 0);
    for (var axis = 0u; axis < 3u; axis++) {
        let direction = ray.direction[axis];
        if (direction != 0.0) {
            let plane = select(box.low[axis], box.high[axis] + 1, direction < 0.0);
            let event = DdaEvent(dda_plane_t(ray, axis, plane), axis, plane);
            if (dda_before(entry, event)) {
                entry = event;
            }
        }
    }
    return entry;
}

// The first of the crossings that lead out of `box`.
fn dda_exit(ray: DdaRay, box: DdaBox) -> DdaEvent {
    var exit = DdaEvent(DDA_FAR, DDA_START, 0);
    for (var axis = 0u; axis < 3u; axis++) {
        let direction = ray.direction[axis];
        if (direction != 0.0) {
            let plane = select(box.high[axis] + 1, box.low[axis], direction < 0.0);
            let event = DdaEvent(dda_plane_t(ray, axis, plane), axis, plane);
            if (dda_before(event, exit)) {
                exit = event;
            }
        }
    }
    return exit;
}

// Whether the ray, from its start on, has a part inside `box`.
fn dda_meets(ray: DdaRay, box: DdaBox) -> bool {
    for (var axis = 0u; axis < 3u; axis++) {
        let origin = ray.origin[axis];
        let outside = origin < f32(box.low[axis]) || origin > f32(box.high[axis] + 1);
        if (ray.direction[axis] == 0.0 && outside) {
            return false;
        }
    }
    // Far from the origin both may be crossings of one axis with equal parameters.
    return !dda_before(dda_exit(ray, box), dda_entry(ray, box));
}

// The box of 2^level cells on each axis that holds `cell`, cut off at the volume's last cells.
fn dda_box(cell: vec3<i32>, level: u32, last: vec3<i32>) -> DdaBox {
    let shift = vec3<u32>(level);
    let low = (cell >> shift) << shift;
    return DdaBox(low, min(low + vec3<i32>((1 << level) - 1), last));
}
