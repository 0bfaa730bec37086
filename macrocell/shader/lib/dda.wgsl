// Exact traversal of nested grids along a ray, driven by plane events.
//
// The ray crosses integer planes; the crossing of plane p of axis a has the parameter
// (p - origin[a]) * inverse[a], a pure function of the integer plane, non-decreasing along the ray for a fixed
// axis. Crossings are totally ordered by (t, axis, position along the axis). Planes at multiples of
// 4, 16, 64 are a subset of all planes, hence a coarser grid's crossings are a sub-sequence of the
// finer grid's: boxes can be skipped, entered and resumed at any level and the cells visited are
// those of one walk through all dual cells, in the same order.
//
// Everything is done on three axes at once: no branches, no vector indexed by a variable.

struct DdaRay {
    origin: vec3<f32>,
    direction: vec3<f32>, // a component is exactly 0 or at least 2^-40 in size
    inverse: vec3<f32>,   // 1 / direction, 0 where the direction is 0
    far: vec3<f32>,       // 0, DDA_FAR where the direction is 0: planes of that axis are never crossed
    step: vec3<i32>,      // sign of the direction
    ahead: vec3<i32>,     // 1 where the direction is positive: the ray leaves cell c at plane c + ahead
}

// The crossing of a plane of an axis, or the ray's start (axis = 3, t = 0), which follows all crossings
// at t <= 0. Where the plane is, those who need it know.
struct DdaEvent {
    t: f32,
    axis: u32,
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
    let ahead = select(vec3<i32>(0), vec3<i32>(1), kept > vec3<f32>(0.0));
    let step = ahead - select(vec3<i32>(0), vec3<i32>(1), kept < vec3<f32>(0.0));
    return DdaRay(origin, kept, inverse, select(vec3<f32>(DDA_FAR), vec3<f32>(0.0), moving), step, ahead);
}

// 1 where the ray enters cell c at plane c + 1, 0 where at plane c.
fn dda_behind(ray: DdaRay) -> vec3<i32> {
    return ray.ahead - ray.step;
}

// Parameters at which the ray crosses one integer plane of each axis.
fn dda_planes_t(ray: DdaRay, planes: vec3<i32>) -> vec3<f32> {
    return (vec3<f32>(planes) - ray.origin) * ray.inverse + ray.far;
}

fn dda_on_axis(axis: u32) -> vec3<bool> {
    return vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis);
}

// `step` on the event's axis, 0 on the others.
fn dda_step_on(axis: u32, step: vec3<i32>) -> vec3<i32> {
    return select(vec3<i32>(0), step, dda_on_axis(axis));
}

fn dda_before(a: DdaEvent, b: DdaEvent) -> bool {
    return a.t < b.t || (a.t == b.t && a.axis < b.axis);
}

// On which axes the crossings at t come before `event`.
fn dda_crossed(t: vec3<f32>, event: DdaEvent) -> vec3<bool> {
    let tie = (t == vec3<f32>(event.t)) & (vec3<u32>(0u, 1u, 2u) < vec3<u32>(event.axis));
    return (t < vec3<f32>(event.t)) | tie;
}

// The first of the crossings at t, one of each axis; the start's axis when the ray does not move.
fn dda_first(t: vec3<f32>) -> DdaEvent {
    let least = min(t.x, min(t.y, t.z));
    let axis = select(select(2u, 1u, t.y == least), 0u, t.x == least);
    return DdaEvent(least, select(axis, DDA_START, least >= DDA_FAR));
}

// The cell right after `event`, which lies in `box` on every axis but the event's own, where it is `own`.
fn dda_cell_after(ray: DdaRay, event: DdaEvent, box: DdaBox, own: vec3<i32>) -> vec3<i32> {
    let position = ray.origin + event.t * ray.direction;
    var cell = vec3<i32>(floor(clamp(position, vec3<f32>(box.low), vec3<f32>(box.high))));
    let fixed = dda_on_axis(event.axis);
    cell = select(cell, own, fixed);
    // The guess may be a cell off: on until the ray has not left the cell, back until it has entered it.
    let free = !fixed & (ray.step != vec3<i32>(0));
    let last = select(box.low, box.high, ray.step > vec3<i32>(0));
    loop {
        let left = dda_crossed(dda_planes_t(ray, cell + ray.ahead), event) & free & (cell != last);
        if (!any(left)) {
            break;
        }
        cell += select(vec3<i32>(0), ray.step, left);
    }
    let behind = dda_behind(ray);
    let first = select(box.high, box.low, ray.step > vec3<i32>(0));
    loop {
        let entered = dda_crossed(dda_planes_t(ray, cell + behind), event) | !free | (cell == first);
        if (all(entered)) {
            break;
        }
        cell -= select(ray.step, vec3<i32>(0), entered);
    }
    return cell;
}

// The last of the crossings that lead into `box`, or the ray's start inside it.
fn dda_entry(ray: DdaRay, box: DdaBox) -> DdaEvent {
    let planes = select(box.low, box.high + vec3<i32>(1), ray.step < vec3<i32>(0));
    let t = select(dda_planes_t(ray, planes), vec3<f32>(-DDA_FAR), ray.step == vec3<i32>(0));
    let most = max(t.x, max(t.y, t.z));
    let axis = select(select(0u, 1u, t.y == most), 2u, t.z == most);
    if (most <= 0.0) {
        return DdaEvent(0.0, DDA_START);
    }
    return DdaEvent(most, axis);
}

// The first of the crossings that lead out of `box`.
fn dda_exit(ray: DdaRay, box: DdaBox) -> DdaEvent {
    return dda_first(dda_planes_t(ray, select(box.low, box.high + vec3<i32>(1), ray.step > vec3<i32>(0))));
}

// The first of the crossings that lead out of a cell.
fn dda_cell_exit(ray: DdaRay, cell: vec3<i32>) -> DdaEvent {
    return dda_first(dda_planes_t(ray, cell + ray.ahead));
}

// Cells of the box next to its sides: where the ray comes in, on each axis.
fn dda_first_cells(ray: DdaRay, box: DdaBox) -> vec3<i32> {
    return select(box.low, box.high, ray.step < vec3<i32>(0));
}

// Whether the ray, from its start on, has a part inside `box`.
fn dda_meets(ray: DdaRay, box: DdaBox) -> bool {
    let below = ray.origin < vec3<f32>(box.low);
    let above = ray.origin > vec3<f32>(box.high + vec3<i32>(1));
    if (any((ray.step == vec3<i32>(0)) & (below | above))) {
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
