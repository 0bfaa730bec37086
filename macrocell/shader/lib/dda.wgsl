// Exact traversal of nested grids along a ray, driven by plane events.
//
// The ray crosses integer planes; the crossing of plane p of axis a has the parameter
// (p - origin[a]) * inverse[a], a pure function of the integer plane, non-decreasing along the ray for a fixed
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

// Parameters at which the ray crosses one integer plane of each axis.
fn dda_planes_t(ray: DdaRay, planes: vec3<i32>) -> vec3<f32> {
    return (vec3<f32>(planes) - ray.origin) * ray.inverse;
}

fn dda_on_axis(axis: u32) -> vec3<bool> {
    return vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis);
}

fn dda_before(a: DdaEvent, b: DdaEvent) -> bool {
    return a.t < b.t || (a.t == b.t && a.axis < b.axis);
}

// One axis of a ray, so that no vector is indexed by a variable.
struct DdaAxis {
    axis: u32,
    origin: f32,
    direction: f32,
    inverse: f32,
}

// Whether the ray has crossed `plane` of the axis when `event` happens, for an event of another axis.
fn dda_crossed(on: DdaAxis, plane: i32, event: DdaEvent) -> bool {
    let t = (f32(plane) - on.origin) * on.inverse;
    return t < event.t || (t == event.t && on.axis < event.axis);
}

// The cell on the axis, among low ..= high, that the ray is in right after `event` of another axis.
fn dda_cell_on_axis(on: DdaAxis, event: DdaEvent, low: i32, high: i32) -> i32 {
    let position = on.origin + event.t * on.direction;
    var cell = i32(floor(clamp(position, f32(low), f32(high))));
    if (on.direction > 0.0) {
        while (cell < high && dda_crossed(on, cell + 1, event)) {
            cell++;
        }
        while (cell > low && !dda_crossed(on, cell, event)) {
            cell--;
        }
    } else if (on.direction < 0.0) {
        while (cell > low && dda_crossed(on, cell, event)) {
            cell--;
        }
        while (cell < high && !dda_crossed(on, cell + 1, event)) {
            cell++;
        }
    }
    return cell;
}

// The cell right after `event`, which lies in `box` on every axis but the event's own.
fn dda_cell_after(ray: DdaRay, event: DdaEvent, box: DdaBox) -> vec3<i32> {
    let o = ray.origin;
    let d = ray.direction;
    let i = ray.inverse;
    var cell = vec3<i32>(event.plane) - select(vec3<i32>(0), vec3<i32>(1), d < vec3<f32>(0.0));
    if (event.axis != 0u) {
        cell.x = dda_cell_on_axis(DdaAxis(0u, o.x, d.x, i.x), event, box.low.x, box.high.x);
    }
    if (event.axis != 1u) {
        cell.y = dda_cell_on_axis(DdaAxis(1u, o.y, d.y, i.y), event, box.low.y, box.high.y);
    }
    if (event.axis != 2u) {
        cell.z = dda_cell_on_axis(DdaAxis(2u, o.z, d.z, i.z), event, box.low.z, box.high.z);
    }
    return cell;
}

// The last of the crossings that lead into `box`, or the ray's start inside it.
fn dda_entry(ray: DdaRay, box: DdaBox) -> DdaEvent {
    let planes = select(box.low, box.high + vec3<i32>(1), ray.direction < vec3<f32>(0.0));
    let still = ray.direction == vec3<f32>(0.0);
    let t = select(dda_planes_t(ray, planes), vec3<f32>(-DDA_FAR), still);
    var entry = DdaEvent(0.0, DDA_START, 0);
    if (t.x > 0.0) {
        entry = DdaEvent(t.x, 0u, planes.x);
    }
    if (t.y > entry.t || (t.y == entry.t && entry.axis < 1u)) {
        entry = DdaEvent(t.y, 1u, planes.y);
    }
    if (t.z > entry.t || (t.z == entry.t && entry.axis < 2u)) {
        entry = DdaEvent(t.z, 2u, planes.z);
    }
    return entry;
}

// The first of the crossings that lead out of `box`; the start's axis when the ray does not move.
fn dda_exit(ray: DdaRay, box: DdaBox) -> DdaEvent {
    let planes = select(box.high + vec3<i32>(1), box.low, ray.direction < vec3<f32>(0.0));
    let still = ray.direction == vec3<f32>(0.0);
    let t = select(dda_planes_t(ray, planes), vec3<f32>(DDA_FAR), still);
    var exit = DdaEvent(DDA_FAR, DDA_START, 0);
    if (t.x < exit.t) {
        exit = DdaEvent(t.x, 0u, planes.x);
    }
    if (t.y < exit.t) {
        exit = DdaEvent(t.y, 1u, planes.y);
    }
    if (t.z < exit.t) {
        exit = DdaEvent(t.z, 2u, planes.z);
    }
    return exit;
}

// Whether the ray, from its start on, has a part inside `box`.
fn dda_meets(ray: DdaRay, box: DdaBox) -> bool {
    let below = ray.origin < vec3<f32>(box.low);
    let above = ray.origin > vec3<f32>(box.high + vec3<i32>(1));
    if (any((ray.direction == vec3<f32>(0.0)) & (below | above))) {
        return false;
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
