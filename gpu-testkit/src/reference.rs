//! A reference isosurface ray caster in f64, kept apart from every shader and CPU twin.
//!
//! The field is the trilinear interpolant of the samples: sample `(i, j, k)` lies at index-space
//! position `(i, j, k)`, so the field fills the box from 0 to `dims - 1`. A position is inside
//! when its value is at least the isovalue. A hit is where the inside flag changes along a ray.
//!
//! Instead of stepping from cell to cell, the caster lists every parameter at which the ray
//! crosses a plane between cells and sorts them; within one interval of that list the field is
//! one cubic, and between its extrema that cubic is monotone, so the flags at the resulting
//! *nodes* tell exactly how often the ray crosses the surface.

mod cubic;

#[cfg(test)]
mod tests;

use cubic::Cubic;

/// Bisection steps: enough to exhaust the 53 bits of a parameter in `[0, 1]`.
const BISECTIONS: u32 = 64;
/// Threads that share the rays of [`Scene::trace_rays`].
const THREADS: usize = 2;

/// A ray in index space. `t` counts in lengths of `direction`, which the caller normalises.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Position at `t = 0`, voxels.
    pub origin: [f64; 3],
    /// Direction, not zero.
    pub direction: [f64; 3],
    /// Nothing before this parameter counts.
    pub t_min: f64,
}

impl Ray {
    /// Position at parameter `t`, voxels.
    #[must_use]
    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + self.direction[axis] * t)
    }
}

/// A crossing of the isosurface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter along the ray.
    pub t: f64,
    /// Least corner of the dual cell whose cubic has the root.
    pub cell: [u32; 3],
    /// Index-space position.
    pub position: [f64; 3],
    /// Gradient of the field there, in index space (per voxel, not normalised).
    pub gradient: [f64; 3],
    /// df/dt there: positive when the ray enters the inside.
    pub slope: f64,
    /// True when the ray goes from outside to inside here.
    pub enters: bool,
    /// Largest magnitude among the cell's eight samples and the isovalue.
    pub cell_max_abs: f64,
    /// Distance from the hit to the nearest face of its cell, voxels: where it is tiny, f32 may
    /// rightly name the neighbouring cell.
    pub face_distance: f64,
}

/// The first crossing along a ray, and how near the ray came to another answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// The first crossing at or after `t_min`.
    pub hit: Option<Hit>,
    /// Smallest |value - isovalue| over cell faces, local extrema and the ends of the path, up to
    /// the first such point after the hit (over the whole path when there is none).
    pub margin: f64,
    /// The same over local extrema and ends alone, including the first extremum after the hit:
    /// this is what decides whether the hit exists, however near a cell face it lies.
    pub turning_margin: f64,
    /// Largest |value| among the samples of all visited cells and the isovalue: the scale of
    /// rounding errors in both margins.
    pub max_abs: f64,
    /// Smallest distance (maximum norm, voxels) from the ray to a cell edge, taken where the path
    /// crosses a plane between cells, up to the hit.
    pub edge_distance: f64,
    /// How deep the ray dips below the surface of the box (maximum norm, voxels); negative is the
    /// distance by which it passes the box. Near zero the ray follows the silhouette.
    pub silhouette_distance: f64,
}

impl Trace {
    /// Whether arithmetic of lower precision may rightly find another hit, or none: an extremum
    /// comes within `relative` times [`Trace::max_abs`] of the isovalue, or the ray within
    /// `distance` voxels of the box's silhouette. Tests that compare cells look at
    /// [`Trace::edge_distance`] and [`Hit::face_distance`] too.
    #[must_use]
    pub fn is_ambiguous(&self, relative: f64, distance: f64) -> bool {
        self.turning_margin <= relative * self.max_abs || self.silhouette_distance.abs() <= distance
    }
}

/// A volume and an isovalue to trace.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    dims: [u32; 3],
    samples: &'a [f32],
    isovalue: f64,
}

/// One interval of the path inside one dual cell.
struct Segment {
    cell: [u32; 3],
    t: [f64; 2],
    cubic: Cubic,
}

/// A point between which and the next the field is monotone along the ray.
#[derive(Clone, Copy)]
struct Node {
    t: f64,
    /// Value minus isovalue.
    value: f64,
}

impl Node {
    fn inside(self) -> bool {
        self.value >= 0.0
    }
}

/// What a walk along a ray leaves behind.
#[derive(Default)]
struct Path {
    nodes: Vec<Node>,
    hits: Vec<Hit>,
    /// Index of the first node after the first hit.
    after_first_hit: Option<usize>,
    max_abs: f64,
}

impl<'a> Scene<'a> {
    /// `samples` holds `dims` values, x fastest.
    ///
    /// # Panics
    /// When the number of samples is not the product of `dims`.
    #[must_use]
    pub fn new(dims: [u32; 3], samples: &'a [f32], isovalue: f64) -> Self {
        let expected: u64 = dims.iter().map(|&n| u64::from(n)).product();
        assert_eq!(samples.len() as u64, expected, "samples for a volume of {dims:?}");
        Self { dims, samples, isovalue }
    }

    /// Value minus isovalue at an index-space position, which is clamped to the box.
    ///
    /// # Panics
    /// When the volume has no dual cell: every one of `dims` must be at least 2.
    #[must_use]
    pub fn value(&self, position: [f64; 3]) -> f64 {
        let position = self.clamped(position);
        let cell = self.cell_of(position);
        let corners = self.corners(cell);
        let weights = local(cell, position).map(|x| [1.0 - x, x]);
        corner_sum(&corners, |i, j, k| weights[0][i] * weights[1][j] * weights[2][k])
    }

    /// Gradient of the field (per voxel) at a position within the given dual cell.
    #[must_use]
    pub fn gradient(&self, cell: [u32; 3], position: [f64; 3]) -> [f64; 3] {
        let corners = self.corners(cell);
        let weights = local(cell, position).map(|x| [1.0 - x, x]);
        std::array::from_fn(|axis| {
            let mut weights = weights;
            weights[axis] = [-1.0, 1.0];
            corner_sum(&corners, |i, j, k| weights[0][i] * weights[1][j] * weights[2][k])
        })
    }

    /// The parameters at which the ray enters and leaves the box, the first not before `t_min`;
    /// `None` when it misses the box or when the volume has no dual cell.
    #[must_use]
    pub fn interval(&self, ray: &Ray) -> Option<[f64; 2]> {
        let mut interval = [ray.t_min, f64::INFINITY];
        for axis in 0..3 {
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            let end = f64::from(self.dims[axis].checked_sub(2)? + 1);
            if direction == 0.0 {
                if origin < 0.0 || origin > end {
                    return None;
                }
                continue;
            }
            let (a, b) = ((0.0 - origin) / direction, (end - origin) / direction);
            interval = [interval[0].max(a.min(b)), interval[1].min(a.max(b))];
        }
        (interval[0] <= interval[1]).then_some(interval)
    }

    /// The first crossing at or after `t_min`, with the distances to ambiguity.
    #[must_use]
    pub fn trace(&self, ray: &Ray) -> Trace {
        let path = self.walk(ray, true);
        let nodes_before = path.after_first_hit.map_or(path.nodes.len(), |after| after + 1);
        let turning = |&i: &usize| turns(&path.nodes, i);
        let until_turn = match path.after_first_hit {
            Some(after) => (after..path.nodes.len()).find(turning).map_or(0, |i| i + 1),
            None => path.nodes.len(),
        };
        let hit = path.hits.first().copied();
        Trace {
            hit,
            margin: least_abs(path.nodes[..nodes_before].iter()),
            turning_margin: least_abs((0..until_turn).filter(turning).map(|i| &path.nodes[i])),
            max_abs: path.max_abs.max(self.isovalue.abs()),
            edge_distance: self.edge_distance(ray, hit.map_or(f64::INFINITY, |hit| hit.t)),
            silhouette_distance: self.silhouette_distance(ray),
        }
    }

    /// Every crossing at or after `t_min`, in order. Their number is odd exactly when the flags
    /// at both ends of the path differ.
    #[must_use]
    pub fn trace_all(&self, ray: &Ray) -> Vec<Hit> {
        self.walk(ray, false).hits
    }

    /// [`Scene::trace`] for every ray, on two threads.
    #[must_use]
    pub fn trace_rays(&self, rays: &[Ray]) -> Vec<Trace> {
        let share = rays.len().div_ceil(THREADS).max(1);
        std::thread::scope(|scope| {
            let workers: Vec<_> = rays
                .chunks(share)
                .map(|rays| scope.spawn(move || rays.iter().map(|ray| self.trace(ray)).collect()))
                .collect();
            let join = |worker: std::thread::ScopedJoinHandle<'_, Vec<Trace>>| match worker.join() {
                Ok(traces) => traces,
                Err(panic) => std::panic::resume_unwind(panic),
            };
            workers.into_iter().flat_map(join).collect()
        })
    }

    /// Visits the path's segments in order. With `first_only`, stops at the first extremum (or the
    /// path's end) after the first hit.
    fn walk(&self, ray: &Ray, first_only: bool) -> Path {
        let mut path = Path::default();
        let Some(interval) = self.interval(ray) else { return path };
        let stops = self.stops(ray, interval);
        path.nodes.push(Node { t: stops[0], value: self.value(ray.at(stops[0])) });
        for pair in stops.windows(2) {
            let segment = self.segment(ray, [pair[0], pair[1]]);
            path.max_abs = path.max_abs.max(self.cell_max_abs(segment.cell));
            // The value at a stop is computed once and serves the cells on both sides of it.
            let end = Node { t: pair[1], value: self.value(ray.at(pair[1])) };
            for node in segment.extrema().into_iter().chain([end]) {
                self.step(ray, &segment, node, &mut path);
            }
            let turned = |after| (after..path.nodes.len() - 1).any(|i| turns(&path.nodes, i));
            if first_only && path.after_first_hit.is_some_and(turned) {
                break;
            }
        }
        path
    }

    /// Appends a node, and the hit between it and the one before when the flags differ.
    fn step(&self, ray: &Ray, segment: &Segment, node: Node, path: &mut Path) {
        let previous = path.nodes[path.nodes.len() - 1];
        path.nodes.push(node);
        if previous.inside() != node.inside() {
            let t = segment.bisect(previous, node);
            path.hits.push(self.hit(ray, segment.cell, t, node.inside()));
            path.after_first_hit.get_or_insert(path.nodes.len() - 1);
        }
    }

    /// The sorted parameters at which the path starts, crosses planes between cells, and ends.
    fn stops(&self, ray: &Ray, interval: [f64; 2]) -> Vec<f64> {
        let mut stops = interval.to_vec();
        for axis in (0..3).filter(|&axis| ray.direction[axis] != 0.0) {
            let planes = (1..self.dims[axis].saturating_sub(1)).map(f64::from);
            let parameters = planes.map(|plane| (plane - ray.origin[axis]) / ray.direction[axis]);
            stops.extend(parameters.filter(|t| (interval[0]..=interval[1]).contains(t)));
        }
        stops.sort_by(f64::total_cmp);
        stops.dedup();
        stops
    }

    fn segment(&self, ray: &Ray, t: [f64; 2]) -> Segment {
        let cell = self.cell_of(self.clamped(ray.at(0.5 * (t[0] + t[1]))));
        let ends = t.map(|t| local(cell, self.clamped(ray.at(t))));
        let cubic = Cubic::along(&self.corners(cell), ends[0], ends[1]);
        Segment { cell, t, cubic }
    }

    fn hit(&self, ray: &Ray, cell: [u32; 3], t: f64, enters: bool) -> Hit {
        let position = self.clamped(ray.at(t));
        let gradient = self.gradient(cell, position);
        let slope = (0..3).map(|axis| gradient[axis] * ray.direction[axis]).sum();
        let face_distance =
            local(cell, position).iter().map(|x| x.abs().min((1.0 - x).abs())).fold(1.0, f64::min);
        let cell_max_abs = self.cell_max_abs(cell).max(self.isovalue.abs());
        Hit { t, cell, position, gradient, slope, enters, cell_max_abs, face_distance }
    }

    fn edge_distance(&self, ray: &Ray, until: f64) -> f64 {
        let Some(interval) = self.interval(ray) else { return f64::INFINITY };
        let crossings = self.stops(ray, interval).into_iter().filter(|&t| t <= until);
        let distance = |t| {
            let mut to_plane = ray.at(t).map(|x| (x - x.round()).abs());
            to_plane.sort_by(f64::total_cmp);
            to_plane[1]
        };
        crossings.map(distance).fold(f64::INFINITY, f64::min)
    }

    /// The depth below the box's surface is the least of six linear functions of `t`; it is
    /// greatest where two of them meet, or at `t_min`.
    fn silhouette_distance(&self, ray: &Ray) -> f64 {
        let mut lines = Vec::with_capacity(6);
        for axis in 0..3 {
            let end = f64::from(self.dims[axis]) - 1.0;
            lines.push((ray.origin[axis], ray.direction[axis]));
            lines.push((end - ray.origin[axis], -ray.direction[axis]));
        }
        let depth = |t: f64| lines.iter().map(|(a, b)| a + b * t).fold(f64::INFINITY, f64::min);
        let mut deepest = f64::NEG_INFINITY;
        for (i, (a, b)) in lines.iter().enumerate() {
            let meets = lines[..i].iter().map(|(c, d)| (c - a) / (b - d));
            for t in meets.filter(|t| t.is_finite()) {
                deepest = deepest.max(depth(t.max(ray.t_min)));
            }
        }
        deepest
    }

    fn clamped(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| position[axis].clamp(0.0, f64::from(self.dims[axis]) - 1.0))
    }

    /// The dual cell that holds a position of the box; positions on a face belong to the cell of
    /// larger index where there is one.
    fn cell_of(&self, position: [f64; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| (position[axis].floor() as u32).min(self.dims[axis] - 2))
    }

    /// The cell's samples minus the isovalue, indexed by `x + 2y + 4z`.
    fn corners(&self, cell: [u32; 3]) -> [f64; 8] {
        self.cell_samples(cell).map(|sample| f64::from(sample) - self.isovalue)
    }

    fn cell_max_abs(&self, cell: [u32; 3]) -> f64 {
        self.cell_samples(cell).iter().map(|&sample| f64::from(sample).abs()).fold(0.0, f64::max)
    }

    fn cell_samples(&self, cell: [u32; 3]) -> [f32; 8] {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let [x, y, z] = cell.map(|i| i as usize);
        std::array::from_fn(|corner| {
            let (x, y, z) = (x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
            self.samples[x + nx * (y + ny * z)]
        })
    }
}

impl Segment {
    /// The local extrema strictly inside the segment, in order.
    fn extrema(&self) -> Vec<Node> {
        let node = |s| Node { t: self.t_at(s), value: self.cubic.value(s) };
        self.cubic.extrema().into_iter().map(node).collect()
    }

    /// The parameter between two nodes of this segment at which the flag changes.
    fn bisect(&self, from: Node, to: Node) -> f64 {
        let (mut low, mut high) = (self.s_at(from.t), self.s_at(to.t));
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if (self.cubic.value(middle) >= 0.0) == from.inside() {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.t_at(high).clamp(from.t, to.t)
    }

    fn t_at(&self, s: f64) -> f64 {
        self.t[0] + (self.t[1] - self.t[0]) * s
    }

    fn s_at(&self, t: f64) -> f64 {
        (t - self.t[0]) / (self.t[1] - self.t[0])
    }
}

/// Position within a cell, each coordinate in `[0, 1]` up to rounding.
fn local(cell: [u32; 3], position: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| position[axis] - f64::from(cell[axis]))
}

/// Sum of the corners weighted by a function of their position `(i, j, k)` in the cell.
fn corner_sum(corners: &[f64; 8], weight: impl Fn(usize, usize, usize) -> f64) -> f64 {
    let term = |(n, corner): (usize, &f64)| corner * weight(n & 1, n >> 1 & 1, n >> 2);
    corners.iter().enumerate().map(term).sum()
}

/// Whether the values turn at node `i`: the ends of the path do, and plateaus do.
fn turns(nodes: &[Node], i: usize) -> bool {
    if i == 0 || i + 1 >= nodes.len() {
        return true;
    }
    let (before, after) =
        (nodes[i].value - nodes[i - 1].value, nodes[i + 1].value - nodes[i].value);
    before * after <= 0.0
}

fn least_abs<'n>(nodes: impl Iterator<Item = &'n Node>) -> f64 {
    nodes.map(|node| node.value.abs()).fold(f64::INFINITY, f64::min)
}
