// The trilinear field along a ray inside one dual cell: a cubic in Bernstein form, made from the
// corner values by convex combinations only. Corner values have the isovalue subtracted already, so
// "inside" is >= 0. On a face shared by two cells the value uses the face's four samples alone
// (weights of exactly 0 and 1 drop the others), hence both cells see the same sign.

struct CellCorners {
    low: vec4<f32>,  // x = 0: (y, z) = (0, 0), (1, 0), (0, 1), (1, 1)
    high: vec4<f32>, // x = 1
}

// A parameter interval in [0, 1] over which the field changes sides.
struct CellBracket {
    found: bool,
    low: f32,
    high: f32,
}

fn cell_mix4(a: vec4<f32>, b: vec4<f32>, w: f32) -> vec4<f32> {
    return a * (1.0 - w) + b * w;
}

fn cell_mix2(a: vec2<f32>, b: vec2<f32>, w: f32) -> vec2<f32> {
    return a * (1.0 - w) + b * w;
}

fn cell_mix(a: f32, b: f32, w: f32) -> f32 {
    return a * (1.0 - w) + b * w;
}

// Whether all corners are inside or all are outside.
fn cell_on_one_side(corners: CellCorners) -> bool {
    let low = corners.low >= vec4<f32>(0.0);
    let high = corners.high >= vec4<f32>(0.0);
    return (all(low) && all(high)) || !(any(low) || any(high));
}

// Coordinates in [0, 1]^3 of the ray at `event`, which leads into the cell or out of it through its
// sides `own`; exact on the event's own axis.
fn cell_local(ray: DdaRay, event: DdaEvent, cell: vec3<i32>, own: vec3<i32>) -> vec3<f32> {
    let position = (ray.origin - vec3<f32>(cell)) + event.t * ray.direction;
    let local = clamp(position, vec3<f32>(0.0), vec3<f32>(1.0));
    return select(local, vec3<f32>(own), dda_on_axis(event.axis));
}

fn cell_entry(ray: DdaRay, event: DdaEvent, cell: vec3<i32>) -> vec3<f32> {
    return cell_local(ray, event, cell, dda_behind(ray));
}

fn cell_exit(ray: DdaRay, event: DdaEvent, cell: vec3<i32>) -> vec3<f32> {
    return cell_local(ray, event, cell, ray.ahead);
}

// Bernstein coefficients along the segment from `a` to `b`: the field's polar form.
fn cell_bernstein(corners: CellCorners, a: vec3<f32>, b: vec3<f32>) -> vec4<f32> {
    let xa = cell_mix4(corners.low, corners.high, a.x);
    let xb = cell_mix4(corners.low, corners.high, b.x);
    let aa = cell_mix2(xa.xz, xa.yw, a.y);
    let ab = cell_mix2(xa.xz, xa.yw, b.y);
    let ba = cell_mix2(xb.xz, xb.yw, a.y);
    let bb = cell_mix2(xb.xz, xb.yw, b.y);
    let first = cell_mix(ba.x, ba.y, a.z) + cell_mix(ab.x, ab.y, a.z) + cell_mix(aa.x, aa.y, b.z);
    let second = cell_mix(ab.x, ab.y, b.z) + cell_mix(ba.x, ba.y, b.z) + cell_mix(bb.x, bb.y, a.z);
    return vec4<f32>(
        cell_mix(aa.x, aa.y, a.z),
        first * (1.0 / 3.0),
        second * (1.0 / 3.0),
        cell_mix(bb.x, bb.y, b.z),
    );
}

// De Casteljau: convex combinations keep the coefficients' common sign.
fn cell_at(b: vec4<f32>, s: f32) -> f32 {
    let first = b.xyz * (1.0 - s) + b.yzw * s;
    let second = first.xy * (1.0 - s) + first.yz * s;
    return cell_mix(second.x, second.y, s);
}

// Parameters in (0, 1), in order, where the derivative may vanish; 1 where there is none.
fn cell_turning_points(b: vec4<f32>) -> vec2<f32> {
    let steps = b.yzw - b.xyz;
    let size = max(abs(steps.x), max(abs(steps.y), abs(steps.z)));
    if (size < 1.0e-37) {
        return vec2<f32>(1.0);
    }
    // The derivative over 3 * size: d.x (1-s)^2 + 2 d.y s (1-s) + d.z s^2.
    let d = steps / size;
    let half_linear = d.y - d.x;
    let quadratic = d.x - 2.0 * d.y + d.z;
    let discriminant = d.y * d.y - d.x * d.z;
    if (discriminant < 0.0) {
        return vec2<f32>(1.0);
    }
    // Both roots without cancellation: q / quadratic and d.x / q.
    let q = -(half_linear + select(-1.0, 1.0, half_linear >= 0.0) * sqrt(discriminant));
    var roots = vec2<f32>(1.0);
    if (abs(quadratic) > abs(q)) {
        roots.x = q / quadratic;
    }
    if (abs(q) > abs(d.x)) {
        roots.y = d.x / q;
    }
    roots = select(vec2<f32>(1.0), roots, roots > vec2<f32>(0.0));
    return vec2<f32>(min(roots.x, roots.y), max(roots.x, roots.y));
}

// The first interval over which the field changes sides. The sides at both ends are given, so that
// changes along a ray add up exactly; inside the segment the field is split at its turning points.
fn cell_first_crossing(b: vec4<f32>, inside_low: bool, inside_high: bool) -> CellBracket {
    let inside_first = b.y >= 0.0;
    let inside_second = b.z >= 0.0;
    let changes = u32(inside_low != inside_first) + u32(inside_first != inside_second)
        + u32(inside_second != inside_high);
    if (changes < 2u) {
        return CellBracket(changes == 1u, 0.0, 1.0);
    }
    let turns = cell_turning_points(b);
    if (turns.x < 1.0 && (cell_at(b, turns.x) >= 0.0) != inside_low) {
        return CellBracket(true, 0.0, turns.x);
    }
    if (turns.y < 1.0 && (cell_at(b, turns.y) >= 0.0) != inside_low) {
        return CellBracket(true, min(turns.x, turns.y), turns.y);
    }
    if (inside_low == inside_high) {
        return CellBracket(false, 0.0, 1.0);
    }
    return CellBracket(true, select(0.0, select(turns.x, turns.y, turns.y < 1.0), turns.x < 1.0), 1.0);
}

// The crossing inside a bracket: false position with halved weights, every other step a bisection,
// until the bracket is 2^-22 of the segment or the field is exactly 0. Where it is 0 at an end of the
// bracket, false position would take that end for the crossing, which lies elsewhere: only bisection then.
fn cell_root(b: vec4<f32>, bracket: CellBracket, inside_low: bool) -> f32 {
    var low = bracket.low;
    var high = bracket.high;
    var value_low = cell_at(b, low);
    var value_high = cell_at(b, high);
    var root = low;
    for (var step = 0u; step < 48u; step++) {
        let width = high - low;
        var share = 0.5;
        let change = value_low - value_high;
        let ends_count = value_low != 0.0 && value_high != 0.0;
        if ((step & 1u) == 0u && ends_count && abs(change) > 1.0e-37) {
            share = clamp(value_low / change, 0.0, 1.0);
        }
        root = low + width * share;
        if (width <= 2.384186e-7) {
            break;
        }
        let value = cell_at(b, root);
        if (value == 0.0) {
            break;
        }
        if ((value >= 0.0) == inside_low) {
            low = root;
            value_low = value;
            value_high *= 0.5;
        } else {
            high = root;
            value_high = value;
            value_low *= 0.5;
        }
    }
    return root;
}

// The trilinear field at `p`.
fn cell_value(corners: CellCorners, p: vec3<f32>) -> f32 {
    let x = cell_mix4(corners.low, corners.high, p.x);
    let y = cell_mix2(x.xz, x.yw, p.y);
    return cell_mix(y.x, y.y, p.z);
}

// Gradient of the trilinear field at `p`, per voxel.
fn cell_gradient(corners: CellCorners, p: vec3<f32>) -> vec3<f32> {
    let dx = corners.high - corners.low;
    let x = cell_mix4(corners.low, corners.high, p.x);
    let along_x = cell_mix2(dx.xz, dx.yw, p.y);
    let along_y = x.yw - x.xz;
    let y = cell_mix2(x.xz, x.yw, p.y);
    return vec3<f32>(
        cell_mix(along_x.x, along_x.y, p.z),
        cell_mix(along_y.x, along_y.y, p.z),
        y.y - y.x,
    );
}
