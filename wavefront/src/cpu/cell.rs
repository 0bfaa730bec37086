//! Twin of `shader/lib/cell.wgsl`: the trilinear field along a ray inside one dual cell.

use macrocell::cpu::dda::{Event, Ray, START};

/// Corner values with the isovalue subtracted: "inside" is >= 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corners {
    /// x = 0: (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
    pub low: [f32; 4],
    /// x = 1.
    pub high: [f32; 4],
}

/// A parameter interval in [0, 1] over which the field changes sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bracket {
    /// Lower end.
    pub low: f32,
    /// Upper end.
    pub high: f32,
}

/// Most evaluations in the search for a root.
pub const MOST_STEPS: u32 = 48;

fn mix(a: f32, b: f32, w: f32) -> f32 {
    a * (1.0 - w) + b * w
}

fn mix_all<const N: usize>(a: [f32; N], b: [f32; N], w: f32) -> [f32; N] {
    std::array::from_fn(|i| mix(a[i], b[i], w))
}

/// Between the values at (0, 0), (1, 0), (0, 1), (1, 1): along the first axis.
fn mix_first(v: [f32; 4], w: f32) -> [f32; 2] {
    mix_all([v[0], v[2]], [v[1], v[3]], w)
}

impl Corners {
    /// Whether no point of the cell is outside.
    pub fn all_inside(&self) -> bool {
        self.low.iter().chain(&self.high).all(|&v| v >= 0.0)
    }

    /// Whether no point of the cell is inside.
    pub fn all_outside(&self) -> bool {
        self.low.iter().chain(&self.high).all(|&v| v < 0.0)
    }

    /// Bernstein coefficients along the segment from `a` to `b`, both in [0, 1]^3.
    pub fn bernstein(&self, a: [f32; 3], b: [f32; 3]) -> [f32; 4] {
        let xa = mix_all(self.low, self.high, a[0]);
        let xb = mix_all(self.low, self.high, b[0]);
        let [aa, ab] = [a[1], b[1]].map(|w| mix_first(xa, w));
        let [ba, bb] = [a[1], b[1]].map(|w| mix_first(xb, w));
        let z = |v: [f32; 2], w| mix(v[0], v[1], w);
        let first = z(ba, a[2]) + z(ab, a[2]) + z(aa, b[2]);
        let second = z(ab, b[2]) + z(ba, b[2]) + z(bb, a[2]);
        let third = 1.0 / 3.0;
        [z(aa, a[2]), first * third, second * third, z(bb, b[2])]
    }

    /// The trilinear field at `p`, in [0, 1]^3.
    pub fn value(&self, p: [f32; 3]) -> f32 {
        let y = mix_first(mix_all(self.low, self.high, p[0]), p[1]);
        mix(y[0], y[1], p[2])
    }

    /// Gradient of the trilinear field at `p`, per voxel.
    pub fn gradient(&self, p: [f32; 3]) -> [f32; 3] {
        let dx: [f32; 4] = std::array::from_fn(|i| self.high[i] - self.low[i]);
        let x = mix_all(self.low, self.high, p[0]);
        let along_x = mix_first(dx, p[1]);
        let along_y = [x[1] - x[0], x[3] - x[2]];
        let y = mix_first(x, p[1]);
        [mix(along_x[0], along_x[1], p[2]), mix(along_y[0], along_y[1], p[2]), y[1] - y[0]]
    }
}

/// Coordinates in [0, 1]^3 of the ray at `event`; exact on the event's own axis.
pub fn local(ray: &Ray, event: Event, cell: [i32; 3]) -> [f32; 3] {
    std::array::from_fn(|a| {
        if event.axis != START && a as u32 == event.axis {
            (event.plane - cell[a]) as f32
        } else {
            let position = (ray.origin[a] - cell[a] as f32) + event.t * ray.direction[a];
            position.clamp(0.0, 1.0)
        }
    })
}

/// Parameter between those of two events.
pub fn parameter(entry: Event, exit: Event, s: f32) -> f32 {
    mix(entry.t, exit.t, s)
}

/// The polynomial at `s`, by de Casteljau.
pub fn at(b: [f32; 4], s: f32) -> f32 {
    let first = mix_all([b[0], b[1], b[2]], [b[1], b[2], b[3]], s);
    let second = mix_all([first[0], first[1]], [first[1], first[2]], s);
    mix(second[0], second[1], s)
}

/// Parameters in (0, 1), in order, where the derivative may vanish; 1 where there is none.
pub fn turning_points(b: [f32; 4]) -> [f32; 2] {
    let steps: [f32; 3] = std::array::from_fn(|i| b[i + 1] - b[i]);
    let size = steps.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    if size < 1.0e-37 {
        return [1.0; 2];
    }
    let d = steps.map(|v| v / size);
    let half_linear = d[1] - d[0];
    let quadratic = d[0] - 2.0 * d[1] + d[2];
    let discriminant = d[1] * d[1] - d[0] * d[2];
    if discriminant < 0.0 {
        return [1.0; 2];
    }
    let sign = if half_linear >= 0.0 { 1.0 } else { -1.0 };
    let q = -(half_linear + sign * discriminant.sqrt());
    let mut roots = [1.0_f32; 2];
    if quadratic.abs() > q.abs() {
        roots[0] = q / quadratic;
    }
    if q.abs() > d[0].abs() {
        roots[1] = d[0] / q;
    }
    let roots = roots.map(|r| if r > 0.0 { r } else { 1.0 });
    [roots[0].min(roots[1]), roots[0].max(roots[1])]
}

/// How often the sides change along the four coefficients, those at the ends given.
fn sign_changes(b: [f32; 4], inside_low: bool, inside_high: bool) -> usize {
    let sides = [inside_low, b[1] >= 0.0, b[2] >= 0.0, inside_high];
    sides.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// The first interval over which the field changes sides; the sides at both ends are given.
pub fn first_crossing(b: [f32; 4], inside_low: bool, inside_high: bool) -> Option<Bracket> {
    let changes = sign_changes(b, inside_low, inside_high);
    if changes < 2 {
        return (changes == 1).then_some(Bracket { low: 0.0, high: 1.0 });
    }
    let turns = turning_points(b);
    if turns[0] < 1.0 && (at(b, turns[0]) >= 0.0) != inside_low {
        return Some(Bracket { low: 0.0, high: turns[0] });
    }
    if turns[1] < 1.0 && (at(b, turns[1]) >= 0.0) != inside_low {
        return Some(Bracket { low: turns[0].min(turns[1]), high: turns[1] });
    }
    if inside_low == inside_high {
        return None;
    }
    let low = match turns {
        [_, second] if second < 1.0 => second,
        [first, _] if first < 1.0 => first,
        _ => 0.0,
    };
    Some(Bracket { low, high: 1.0 })
}

/// Every interval over which the field changes sides, in order: [`first_crossing`] and what follows it.
pub fn crossings(b: [f32; 4], inside_low: bool, inside_high: bool) -> Vec<Bracket> {
    if sign_changes(b, inside_low, inside_high) < 2 {
        return first_crossing(b, inside_low, inside_high).into_iter().collect();
    }
    let mut nodes = vec![(0.0, inside_low)];
    let turns = turning_points(b).into_iter().filter(|&s| s < 1.0);
    nodes.extend(turns.map(|s| (s, at(b, s) >= 0.0)));
    nodes.push((1.0, inside_high));
    nodes
        .windows(2)
        .filter(|pair| pair[0].1 != pair[1].1)
        .map(|pair| Bracket { low: pair[0].0, high: pair[1].0 })
        .collect()
}

/// The crossing inside a bracket.
pub fn root(b: [f32; 4], bracket: Bracket, inside_low: bool) -> f32 {
    root_and_steps(b, bracket, inside_low).0
}

/// The crossing inside a bracket, and the number of evaluations of the field that it took beside those at
/// the bracket's ends.
pub fn root_and_steps(b: [f32; 4], bracket: Bracket, inside_low: bool) -> (f32, u32) {
    let Bracket { mut low, mut high } = bracket;
    let (mut value_low, mut value_high) = (at(b, low), at(b, high));
    let mut root = low;
    for step in 0..MOST_STEPS {
        let width = high - low;
        let change = value_low - value_high;
        let mut share = 0.5_f32;
        // At an end where the field is 0 there need be no crossing.
        let ends_count = value_low != 0.0 && value_high != 0.0;
        if step % 2 == 0 && ends_count && change.abs() > 1.0e-37 {
            share = (value_low / change).clamp(0.0, 1.0);
        }
        root = low + width * share;
        if width <= 2.384_186e-7 {
            return (root, step);
        }
        let value = at(b, root);
        if value == 0.0 {
            return (root, step + 1);
        }
        if (value >= 0.0) == inside_low {
            low = root;
            value_low = value;
            value_high *= 0.5;
        } else {
            high = root;
            value_high = value;
            value_low *= 0.5;
        }
    }
    (root, MOST_STEPS)
}
