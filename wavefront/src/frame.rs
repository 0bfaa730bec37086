//! One frame: from camera and volume to the rays' parameters, in f64.

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3, DVec4};
use lru_cache_gpu::LruParams;
use macrocell::Grid;

use crate::order::RayOrder;
use crate::plan::list_capacity;
use crate::{Camera, Error};

/// Uniform struct `MacrocellGrid` of `macrocell/shader/lib/macrocell_grid.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct GridParams {
    pub(crate) blocks: [u32; 3],
    pub(crate) coarse_count: u32,
    pub(crate) coarse: [u32; 3],
    pub(crate) has_third_level: u32,
    pub(crate) third: [u32; 3],
    pub(crate) active_box: u32,
    pub(crate) last_cell: [i32; 3],
    pub(crate) pad0: u32,
    pub(crate) first_block: [i32; 3],
    pub(crate) pad1: u32,
}

impl GridParams {
    /// The grids of a volume.
    pub fn new(grid: Grid) -> Self {
        Self {
            blocks: grid.blocks(),
            coarse_count: grid.coarse_count() as u32,
            coarse: grid.coarse(),
            has_third_level: grid.has_third_level().into(),
            third: grid.third(),
            active_box: grid.mask_count() as u32,
            last_cell: grid.last_cell(),
            pad0: 0,
            first_block: [0; 3],
            pad1: 0,
        }
    }
}

/// Uniform struct `FrameParams` of `shader/lib/frame.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct FrameParams {
    pub(crate) origin: [f32; 3],
    pub(crate) isovalue: f32,
    pub(crate) origin_dx: [f32; 3],
    pub(crate) width: u32,
    pub(crate) origin_dy: [f32; 3],
    pub(crate) height: u32,
    pub(crate) direction: [f32; 3],
    pub(crate) start_depth: f32,
    pub(crate) direction_dx: [f32; 3],
    pub(crate) look_ahead: u32,
    pub(crate) direction_dy: [f32; 3],
    pub(crate) ray_numbers: u32,
    pub(crate) ray_level: u32,
    pub(crate) ray_columns: u32,
    pub(crate) list_capacity: u32,
    pub(crate) first_misses: u32,
    pub(crate) shift_y: u32,
    pub(crate) shift_z: u32,
    pub(crate) shift_misses: u32,
    pub(crate) most_cells: u32,
    pub(crate) middle: [f32; 2],
    pub(crate) step: f32,
    pub(crate) preview_level: u32,
    pub(crate) volume_low: [u32; 2],
    pub(crate) volume_end: [u32; 2],
    pub(crate) grid: GridParams,
    pub(crate) lru: LruParams,
}

impl FrameParams {
    /// Most that a bound on the cells of a walk may be: so a count of cells stays far below 2^32.
    pub const MOST_CELLS: u32 = 1 << 31;

    /// Bytes of the uniform.
    pub const BYTES: u64 = PARAMS_BYTES;

    /// Width and height of the picture in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// The frame's isovalue.
    #[must_use]
    pub fn isovalue(&self) -> f32 {
        self.isovalue
    }

    /// Cells that one walk of all listed rays visits at most, [`Self::MOST_CELLS`] if nothing else is said. A
    /// ray visits one block at least in a round, so less than 10 per listed ray count as 10.
    #[must_use]
    pub fn with_most_cells(self, most_cells: u32) -> Self {
        Self { most_cells: most_cells.min(Self::MOST_CELLS), ..self }
    }

    /// The frame goes on from a preview of every `step`-th pixel, see [`crate::Previews::record_resume`]; 1 for none.
    #[must_use]
    pub fn after_preview(self, step: u32) -> Self {
        Self { preview_level: step.max(1).ilog2(), ..self }
    }
}

/// How many blocks stopped rays of `RunAhead` request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LookAhead {
    /// Active blocks on a ray's way, the missing one included; at least 1, which means none ahead, ever.
    pub blocks: u32,
    /// Rounds that count as missed before the first one; each doubles the blocks.
    pub first_misses: u32,
}

impl LookAhead {
    /// Nothing but what a ray needs.
    pub const NONE: Self = Self { blocks: 1, first_misses: 0 };
}

pub(crate) const PARAMS_BYTES: u64 = size_of::<FrameParams>() as u64;

/// The geometry of one frame in f64; rays are affine in the pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameView {
    /// Size of the picture, and pixels of it from one ray to the next.
    size: [u32; 2],
    step: u32,
    /// Pixels from the centre of the first pixel to the first ray.
    shift: f64,
    /// Index-space start of the central ray and its change per pixel.
    origin: [DVec3; 3],
    /// Index-space direction per unit of view depth of the central ray and its change per pixel.
    direction: [DVec3; 3],
    /// View depth at which the rays start, in world units.
    start_depth: f64,
    view_from_index: DMat4,
    clip_from_view: DMat4,
    /// View-space x and y at view depth d: base + d * slope, each affine in clip-space x and y.
    base: [DVec3; 3],
    slope: [DVec3; 3],
}

impl FrameView {
    /// A camera's rays through a volume of `dims` voxels in a picture of `size` pixels.
    ///
    /// `world_from_index` (column-major) takes the index-space position (i, j, k) of a voxel to
    /// world space.
    ///
    /// # Errors
    /// If a matrix is not finite or cannot be inverted, the projection's w depends on x or y, or it changes sign
    /// where the volume is: rays would run through one point inside of it.
    pub fn new(
        camera: &Camera,
        size: [u32; 2],
        world_from_index: [[f64; 4]; 4],
        dims: [u32; 3],
    ) -> Result<Self, Error> {
        let view_from_world = matrix("view_from_world", camera.view_from_world)?;
        let clip_from_view = matrix("clip_from_view", camera.clip_from_view)?;
        let world_from_index = matrix("world_from_index", world_from_index)?;
        let view_from_index = view_from_world * world_from_index;
        let index_from_view = inverse("view_from_index", view_from_index)?;
        let [base, slope] = unproject(clip_from_view)?;
        let [nearest, farthest] = depths(view_from_index, dims);
        let start_depth = start_depth([nearest, farthest], clip_from_view);
        let row = clip_from_view.row(3);
        let w = |depth: f64| row.w - row.z * depth;
        if w(start_depth) * w(farthest.max(start_depth)) < 0.0 {
            return Err(Error::UnsupportedProjection { row: row.to_array() });
        }
        // Per pixel: clip x grows by 2 / width to the right, clip y falls by 2 / height downwards.
        let steps = [2.0 / f64::from(size[0]), -2.0 / f64::from(size[1])];
        let per_pixel = |v: [DVec3; 3]| [v[0], v[1] * steps[0], v[2] * steps[1]];
        let start = |i: usize| {
            let z = if i == 0 { DVec3::new(0.0, 0.0, -start_depth) } else { DVec3::ZERO };
            let view = base[i] + slope[i] * start_depth + z;
            if i == 0 {
                index_from_view.transform_point3(view)
            } else {
                index_from_view.transform_vector3(view)
            }
        };
        let along = |i: usize| {
            let z = if i == 0 { DVec3::NEG_Z } else { DVec3::ZERO };
            index_from_view.transform_vector3(slope[i] + z)
        };
        Ok(Self {
            size,
            step: 1,
            shift: 0.0,
            origin: per_pixel([start(0), start(1), start(2)]),
            direction: per_pixel([along(0), along(1), along(2)]),
            start_depth,
            view_from_index,
            clip_from_view,
            base,
            slope,
        })
    }

    /// The view of a preview: its ray (x, y) is that of the picture's pixel (step x, step y), bit for bit. `step` is a
    /// power of two.
    #[must_use]
    pub fn preview(&self, step: u32) -> Self {
        Self { step: step.max(1), shift: 0.0, ..*self }
    }

    /// The view of a picture with a pixel for `step` x `step` of these, a power of two: its rays go through their middles.
    #[must_use]
    pub fn reduced(&self, step: u32) -> Self {
        let own = f64::from(self.step) * 0.5 * (f64::from(step.max(1)) - 1.0);
        Self { step: self.step * step.max(1), shift: self.shift + own, ..*self }
    }

    /// Rays in a row and in a column.
    pub fn ray_size(&self) -> [u32; 2] {
        preview_size(self.size, self.step)
    }

    /// The uniform for the kernels.
    pub fn params(
        &self,
        grid: Grid,
        lru: LruParams,
        isovalue: f32,
        look_ahead: LookAhead,
    ) -> FrameParams {
        let [shift_y, shift_z, shift_misses] = grid.packing();
        let LookAhead { blocks: look_ahead, first_misses } = look_ahead;
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let order = RayOrder::new(self.size);
        let preview = order.preview(self.step);
        debug_assert!(preview.is_some(), "a step that `WavefrontPlan::preview` refuses");
        let order = preview.unwrap_or(order);
        let [width, height] = self.ray_size();
        let [volume_low, volume_end] = self.volume_pixels(grid.last_cell());
        FrameParams {
            origin: narrow(self.origin[0]),
            isovalue,
            origin_dx: narrow(self.origin[1]),
            width,
            origin_dy: narrow(self.origin[2]),
            height,
            direction: narrow(self.direction[0]),
            start_depth: self.start_depth as f32,
            direction_dx: narrow(self.direction[1]),
            look_ahead: look_ahead.max(1),
            direction_dy: narrow(self.direction[2]),
            ray_numbers: order.numbers() as u32,
            ray_level: order.level(),
            ray_columns: order.columns(),
            list_capacity: list_capacity([width, height]) as u32,
            first_misses,
            shift_y,
            shift_z,
            shift_misses,
            most_cells: FrameParams::MOST_CELLS,
            middle: self.size.map(|s| (0.5 * f64::from(s) - self.shift) as f32),
            step: self.step as f32,
            preview_level: 0,
            volume_low,
            volume_end,
            grid: GridParams::new(grid),
            lru,
        }
    }

    /// The ray through the centre of pixel (x, y), row 0 on top: start in index space and unit
    /// direction, in f64, and the view depth gained per voxel.
    pub fn ray(&self, pixel: [u32; 2]) -> ([f64; 3], [f64; 3], f64) {
        let place = pixel.map(|p| f64::from(p) * f64::from(self.step) + 0.5 + self.shift);
        let [x, y] = [0, 1].map(|a| place[a] - f64::from(self.size[a]) / 2.0);
        let at = |v: &[DVec3; 3]| v[0] + v[1] * x + v[2] * y;
        let direction = at(&self.direction);
        let voxels_per_depth = direction.length();
        let unit = direction / voxels_per_depth;
        (at(&self.origin).to_array(), unit.to_array(), 1.0 / voxels_per_depth)
    }

    /// View depth at which the rays start, in world units.
    pub fn start_depth(&self) -> f64 {
        self.start_depth
    }

    /// Pixels that may have a ray that meets the volume, whose cells end at `last_cell`: the first ones in a row and in a
    /// column, and those after the last ones.
    fn volume_pixels(&self, last_cell: [i32; 3]) -> [[u32; 2]; 2] {
        let size = self.ray_size();
        let rows = self.pixel_rows();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut signs = [false; 2];
        for corner in 0..8 {
            // A voxel more on every side: rounding moves a ray's crossing by less.
            let at = |axis: usize| {
                if corner >> axis & 1 == 0 { -1.0 } else { f64::from(last_cell[axis]) + 2.0 }
            };
            let p = DVec4::new(at(0), at(1), at(2), 1.0);
            let w = rows[2].dot(p);
            signs[usize::from(w > 0.0)] = true;
            for axis in 0..2 {
                let place = rows[axis].dot(p) / w;
                // Behind the eye's plane, or in it.
                let is_usable = place.is_finite() && w != 0.0;
                low[axis] = low[axis].min(if is_usable { place } else { f64::NEG_INFINITY });
                high[axis] = high[axis].max(if is_usable { place } else { f64::INFINITY });
            }
        }
        if signs[0] && signs[1] {
            // The eye's plane cuts the volume, so it may be anywhere.
            return [[0; 2], size];
        }
        // A pixel more on every side, since w is next to nothing where the volume comes near the eye's plane.
        let first = |axis: usize| (low[axis] - 2.0).clamp(0.0, f64::from(size[axis])) as u32;
        let end = |axis: usize| (high[axis] + 2.0).clamp(0.0, f64::from(size[axis])).ceil() as u32;
        [[first(0), first(1)], [end(0), end(1)]]
    }

    /// Rows that take an index-space position (x, y, z, 1) to (column * w, row * w, w, view depth): its place in
    /// the picture, or the preview, in pixels, whose centres lie at halves.
    pub fn pixel_from_index(&self) -> [[f32; 4]; 4] {
        self.pixel_rows().map(|v| v.as_vec4().to_array())
    }

    fn pixel_rows(&self) -> [DVec4; 4] {
        let clip = (self.clip_from_view * self.view_from_index).transpose();
        let step = f64::from(self.step);
        let [width, height] = self.size.map(|s| f64::from(s) / step);
        // The first ray's place is a half of its own pixels, and a half and the shift of the picture's.
        let first = clip.w_axis * (0.5 - (0.5 + self.shift) / step);
        let column = (clip.x_axis + clip.w_axis) * (0.5 * width) + first;
        let row = (clip.w_axis - clip.y_axis) * (0.5 * height) + first;
        let depth = -self.view_from_index.row(2);
        [column, row, clip.w_axis, depth]
    }

    /// Clip-space z and w for a pixel at view depth d: (z0 + d z1, w0 + d w1), each row affine in
    /// (1, x, y) of clip space.
    pub(crate) fn clip_rows(&self) -> [[f32; 4]; 4] {
        let row = |r: usize| {
            let coefficients = self.clip_from_view.row(r);
            let constant = |i: usize, v: &[DVec3; 3]| coefficients.truncate().dot(v[i]);
            let base = [
                constant(0, &self.base) + coefficients.w,
                constant(1, &self.base),
                constant(2, &self.base),
            ];
            let slope = [
                constant(0, &self.slope) - coefficients.z,
                constant(1, &self.slope),
                constant(2, &self.slope),
            ];
            [base, slope].map(|v| [v[0] as f32, v[1] as f32, v[2] as f32, 0.0])
        };
        let [z0, z1] = row(2);
        let [w0, w1] = row(3);
        [z0, z1, w0, w1]
    }
}

/// Rays in a row and in a column of a preview.
pub(crate) fn preview_size(size: [u32; 2], step: u32) -> [u32; 2] {
    size.map(|s| s.div_ceil(step.max(1)))
}

fn matrix(what: &'static str, columns: [[f64; 4]; 4]) -> Result<DMat4, Error> {
    let m = DMat4::from_cols_array_2d(&columns);
    if m.is_finite() { Ok(m) } else { Err(Error::NotFinite { what }) }
}

fn inverse(what: &'static str, m: DMat4) -> Result<DMat4, Error> {
    let inverse = m.inverse();
    if m.determinant() != 0.0 && inverse.is_finite() {
        Ok(inverse)
    } else {
        Err(Error::Singular { what })
    }
}

/// View-space (x, y) of the points that project to clip-space (X, Y) at view depth d are
/// base + d * slope; both are returned as coefficients of (1, X, Y).
fn unproject(clip_from_view: DMat4) -> Result<[[DVec3; 3]; 2], Error> {
    let [r0, r1, r3] = [0, 1, 3].map(|r| clip_from_view.row(r));
    if r3.x != 0.0 || r3.y != 0.0 {
        return Err(Error::UnsupportedProjection { row: r3.to_array() });
    }
    let determinant = r0.x * r1.y - r0.y * r1.x;
    let solve =
        |a: f64, b: f64| DVec3::new(a * r1.y - b * r0.y, b * r0.x - a * r1.x, 0.0) / determinant;
    // r0 . p = X w and r1 . p = Y w with p = (x, y, -d, 1) and w = r3.w - r3.z d.
    let base = [solve(-r0.w, -r1.w), solve(r3.w, 0.0), solve(0.0, r3.w)];
    let slope = [solve(r0.z, r1.z), solve(-r3.z, 0.0), solve(0.0, -r3.z)];
    let finite = base.iter().chain(&slope).all(|v| v.is_finite());
    if finite { Ok([base, slope]) } else { Err(Error::Singular { what: "clip_from_view" }) }
}

/// Least and greatest view depth of the volume's corners.
fn depths(view_from_index: DMat4, dims: [u32; 3]) -> [f64; 2] {
    let last = DVec3::from(dims.map(|d| f64::from(d) - 1.0));
    let depths = (0..8u32).map(|corner| {
        let pick = |axis: u32| f64::from((corner >> axis) & 1);
        let index = DVec3::new(pick(0), pick(1), pick(2)) * last;
        -view_from_index.transform_point3(index).z
    });
    let (mut nearest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
    for depth in depths {
        nearest = nearest.min(depth);
        farthest = farthest.max(depth);
    }
    [nearest, farthest]
}

/// The near plane's view depth, or a plane just before the volume where that is farther.
fn start_depth([nearest, farthest]: [f64; 2], clip_from_view: DMat4) -> f64 {
    // A hundredth of the extent, so that rounding to f32 cannot put a start inside the volume.
    let before = nearest - 0.01 * (farthest - nearest);
    before.max(near_depth(clip_from_view))
}

/// View depth of the nearer of the planes z = 0 and z = w on the view axis; the eye's where a
/// perspective projection has neither in front.
fn near_depth(clip_from_view: DMat4) -> f64 {
    let (z, w): (DVec4, DVec4) = (clip_from_view.row(2), clip_from_view.row(3));
    // z(d) = z.w - z.z d and w(d) = w.w - w.z d.
    let zero = z.w / z.z;
    let full = (z.w - w.w) / (z.z - w.z);
    let perspective = w.z != 0.0;
    [zero, full]
        .into_iter()
        .filter(|d| d.is_finite() && (!perspective || *d > 0.0))
        .reduce(f64::min)
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projection_whose_rays_meet_in_the_volume_is_refused() {
        let (size, dims) = ([64, 64], [40, 40, 40]);
        let world = DMat4::IDENTITY.to_cols_array_2d();
        let camera = Camera::orbit([20.0; 3], 100.0, 25.0, 40.0, 50.0, 1.0);
        FrameView::new(&camera, size, world, dims).unwrap();
        // w = 240 - depth, where the volume reaches from about 205 on.
        let mut clip = camera.clip_from_view;
        (clip[2][3], clip[3][3]) = (1.0, 240.0);
        let found = FrameView::new(&Camera { clip_from_view: clip, ..camera }, size, world, dims);
        assert!(matches!(found, Err(Error::UnsupportedProjection { .. })), "{found:?}");
    }

    #[test]
    fn rays_that_meet_the_volume_are_of_the_pixels_named() {
        use macrocell::cpu::dda::CellBox;
        let (size, dims) = ([61, 44], [40, 60, 50]);
        let world = DMat4::from_scale(DVec3::new(1.0, 0.5, 2.0)).to_cols_array_2d();
        let grid = Grid::new(dims);
        let volume = CellBox { low: [0; 3], high: grid.last_cell() };
        let lru = LruParams { slots: 1, slots_per_page: 1, request_capacity: 1, heads: 1 };
        let (mut outside, mut whole) = (0, 0);
        for i in 0..300 {
            // From inside to far away, looking past the volume at times.
            let t = f64::from(i);
            let center = [20.0 + 30.0 * (0.7 * t).sin(), 15.0, 50.0 + 60.0 * (1.3 * t).sin()];
            let distance = 1.03_f64.powf(t) - 0.9;
            let camera =
                Camera::orbit(center, distance, 37.0 * t, 23.0 * (0.3 * t).sin(), 60.0, 1.4);
            let view = FrameView::new(&camera, size, world, dims).unwrap();
            for step in [1, 2] {
                let params = view.preview(step).params(grid, lru, 0.5, LookAhead::NONE);
                let [low, end] = [params.volume_low, params.volume_end];
                whole += u32::from([low, end] == [[0; 2], params.size()]);
                for y in 0..params.size()[1] {
                    for x in 0..params.size()[0] {
                        let is_named = x >= low[0] && y >= low[1] && x < end[0] && y < end[1];
                        let ray = crate::cpu::frame::FrameRay::new(&params, [x, y]).ray;
                        assert!(is_named || !ray.meets(volume), "camera {i}, ({x}, {y})");
                        outside += u32::from(!is_named);
                    }
                }
            }
        }
        assert!(
            outside > 100_000 && whole > 50,
            "{outside} pixels outside, {whole} whole pictures"
        );
    }

    #[test]
    fn a_preview_has_the_same_rays() {
        let (size, dims) = ([101, 66], [40, 60, 50]);
        let camera = Camera::orbit([20.0, 30.0, 25.0], 90.0, 25.0, 40.0, 50.0, 1.5);
        let view = FrameView::new(&camera, size, DMat4::IDENTITY.to_cols_array_2d(), dims).unwrap();
        let params = |view: &FrameView| {
            let lru = LruParams { slots: 1, slots_per_page: 1, request_capacity: 1, heads: 1 };
            view.params(Grid::new(dims), lru, 0.5, LookAhead::NONE)
        };
        let full = params(&view);
        for step in [2, 4] {
            let preview = view.preview(step);
            let own = params(&preview);
            assert_eq!(own.size(), size.map(|s| s.div_ceil(step)));
            let last = own.size().map(|s| s - 1);
            for pixel in [[0, 0], [3, 7], last] {
                let at = pixel.map(|p| p * step);
                assert_eq!(preview.ray(pixel), view.ray(at));
                let rays = [(&own, pixel), (&full, at)]
                    .map(|(f, p)| crate::cpu::frame::FrameRay::new(f, p));
                assert_eq!(rays[0], rays[1], "{pixel:?}, every {step}th");
                let (origin, direction, _) = preview.ray(pixel);
                let p = (DVec3::from(origin) + 40.0 * DVec3::from(direction)).extend(1.0);
                let rows = preview.pixel_from_index().map(|r| DVec4::from(r.map(f64::from)).dot(p));
                assert!((rows[0] / rows[2] - f64::from(pixel[0]) - 0.5).abs() < 1e-4, "{pixel:?}");
                assert!((rows[1] / rows[2] - f64::from(pixel[1]) - 0.5).abs() < 1e-4, "{pixel:?}");
            }
        }
    }

    #[test]
    fn a_point_on_a_ray_comes_back_to_its_pixel() {
        let (size, dims) = ([37, 22], [40, 60, 50]);
        let camera = Camera::orbit([20.0, 30.0, 25.0], 30.0, 25.0, 40.0, 50.0, 37.0 / 22.0);
        let world = DMat4::from_translation(DVec3::new(3.0, -2.0, 1.0))
            * DMat4::from_scale(DVec3::new(1.0, 0.5, 2.0));
        let view = FrameView::new(&camera, size, world.to_cols_array_2d(), dims).unwrap();
        let rows = view.pixel_from_index().map(|r| DVec4::from(r.map(f64::from)));
        for pixel in [[0, 0], [36, 21], [5, 17]] {
            let (origin, direction, depth_per_voxel) = view.ray(pixel);
            for t in [1.0, 30.0] {
                let p = (DVec3::from(origin) + t * DVec3::from(direction)).extend(1.0);
                let [x, y, w, depth] = rows.map(|row| row.dot(p));
                assert!((x / w - f64::from(pixel[0]) - 0.5).abs() < 1e-4, "{pixel:?}");
                assert!((y / w - f64::from(pixel[1]) - 0.5).abs() < 1e-4, "{pixel:?}");
                assert!((depth - view.start_depth() - t * depth_per_voxel).abs() < 1e-4);
            }
        }
    }
}
