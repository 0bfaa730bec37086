//! Twin of `shader/lib/dda.wgsl`: exact traversal of nested grids, driven by plane events.

/// Axis of the event "the ray starts".
pub const START: u32 = 3;
/// Parameter of an event that never happens.
pub const FAR: f32 = 3.0e38;
/// Direction components smaller than this are exactly 0 (2^-40).
pub const LEAST_DIRECTION: f32 = 9.094_947e-13;

/// A ray in index space; `t` is in voxels when the direction has unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Start, in voxels; `t = 0` here.
    pub origin: [f32; 3],
    /// Direction; a component is exactly 0 or at least 2^-40 in size.
    pub direction: [f32; 3],
    /// `1 / direction`, 0 where the direction is 0.
    pub inverse: [f32; 3],
}

impl Ray {
    /// A ray whose tiny direction components are set to 0.
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        let direction = direction.map(|d| if d.abs() >= LEAST_DIRECTION { d } else { 0.0 });
        let inverse = direction.map(|d| if d == 0.0 { 0.0 } else { 1.0 / d });
        Self { origin, direction, inverse }
    }

    /// Parameter at which the ray crosses the integer `plane` of `axis`.
    pub fn plane_t(&self, axis: usize, plane: i32) -> f32 {
        (plane as f32 - self.origin[axis]) * self.inverse[axis]
    }

    /// Whether the ray has crossed `plane` of `axis` when `event` of another axis happens.
    pub fn crossed(&self, axis: usize, plane: i32, event: Event) -> bool {
        let t = self.plane_t(axis, plane);
        t < event.t || (t == event.t && (axis as u32) < event.axis)
    }

    fn cell_on_axis(&self, event: Event, axis: usize, low: i32, high: i32) -> i32 {
        let direction = self.direction[axis];
        let position = self.origin[axis] + event.t * direction;
        let mut cell = position.clamp(low as f32, high as f32).floor() as i32;
        if direction > 0.0 {
            while cell < high && self.crossed(axis, cell + 1, event) {
                cell += 1;
            }
            while cell > low && !self.crossed(axis, cell, event) {
                cell -= 1;
            }
        } else if direction < 0.0 {
            while cell > low && self.crossed(axis, cell, event) {
                cell -= 1;
            }
            while cell < high && !self.crossed(axis, cell + 1, event) {
                cell += 1;
            }
        }
        cell
    }

    /// The cell right after `event`, which lies in `bounds` on every axis but the event's own.
    pub fn cell_after(&self, event: Event, bounds: CellBox) -> [i32; 3] {
        std::array::from_fn(|axis| {
            if axis as u32 == event.axis {
                event.plane - i32::from(self.direction[axis] < 0.0)
            } else {
                self.cell_on_axis(event, axis, bounds.low[axis], bounds.high[axis])
            }
        })
    }

    /// The last of the crossings that lead into `bounds`, or the ray's start inside it.
    pub fn entry(&self, bounds: CellBox) -> Event {
        let mut entry = Event { t: 0.0, axis: START, plane: 0 };
        for axis in 0..3 {
            let direction = self.direction[axis];
            if direction != 0.0 {
                let plane = if direction < 0.0 { bounds.high[axis] + 1 } else { bounds.low[axis] };
                let event = Event { t: self.plane_t(axis, plane), axis: axis as u32, plane };
                if entry.before(event) {
                    entry = event;
                }
            }
        }
        entry
    }

    /// The first of the crossings that lead out of `bounds`.
    pub fn exit(&self, bounds: CellBox) -> Event {
        let mut exit = Event { t: FAR, axis: START, plane: 0 };
        for axis in 0..3 {
            let direction = self.direction[axis];
            if direction != 0.0 {
                let plane = if direction < 0.0 { bounds.low[axis] } else { bounds.high[axis] + 1 };
                let event = Event { t: self.plane_t(axis, plane), axis: axis as u32, plane };
                if event.before(exit) {
                    exit = event;
                }
            }
        }
        exit
    }

    /// Whether the ray, from its start on, has a part inside `bounds`.
    pub fn meets(&self, bounds: CellBox) -> bool {
        let outside_slab = (0..3).any(|axis| {
            let origin = self.origin[axis];
            self.direction[axis] == 0.0
                && (origin < bounds.low[axis] as f32 || origin > (bounds.high[axis] + 1) as f32)
        });
        // Far from the origin both may be crossings of one axis with equal parameters.
        !outside_slab && !self.exit(bounds).before(self.entry(bounds))
    }
}

/// The crossing of a plane, or the ray's start ([`START`], `t = 0`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Parameter along the ray.
    pub t: f32,
    /// 0, 1, 2 or [`START`].
    pub axis: u32,
    /// Integer plane, in voxels.
    pub plane: i32,
}

impl Event {
    /// Order of crossings: by parameter, then by axis.
    pub fn before(self, other: Self) -> bool {
        self.t < other.t || (self.t == other.t && self.axis < other.axis)
    }
}

/// Cells `low ..= high` on each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellBox {
    /// First cell.
    pub low: [i32; 3],
    /// Last cell.
    pub high: [i32; 3],
}

impl CellBox {
    /// The box of `2^level` cells on each axis that holds `cell`, cut off at the `last` cells.
    pub fn around(cell: [i32; 3], level: u32, last: [i32; 3]) -> Self {
        let low = cell.map(|c| (c >> level) << level);
        let high = std::array::from_fn(|a| (low[a] + (1 << level) - 1).min(last[a]));
        Self { low, high }
    }

    /// Whether `cell` is one of the box's.
    pub fn contains(&self, cell: [i32; 3]) -> bool {
        (0..3).all(|a| self.low[a] <= cell[a] && cell[a] <= self.high[a])
    }
}
