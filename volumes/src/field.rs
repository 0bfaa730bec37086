//! What a generator is, and the list of them.

use crate::math::{Jet, Real};
use crate::{
    Blobs, Gyroid, Labels, MarschnerLobb, MixingLayer, Patch, PlaneRamp, RoughSolid, Sheets,
    Shells, SphereDistance, Tubes, Turbulence,
};

/// A scalar field over the index space of a volume: voxel (i, j, k) is the position `[i, j, k]`.
pub trait Field: Send + Sync {
    /// The field at an index-space position.
    fn value(&self, p: [f64; 3]) -> f64;

    /// The exact gradient of [`value`](Field::value) per voxel, or `None` where the field has none.
    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]>;

    /// The name under which [`by_name`] finds this generator.
    fn name(&self) -> &'static str;

    /// An isovalue whose surface shows what the field is made for.
    fn suggested_isovalue(&self) -> f64;

    /// The 64 samples of the block whose first voxel is `origin`, sample (x, y, z) at x + 4 y + 16 z:
    /// those of [`value`](Field::value), bit for bit. A field whose samples share work does it here.
    fn block(&self, origin: [u32; 3]) -> [f32; 64] {
        std::array::from_fn(|i| {
            let offset = [i % 4, i / 4 % 4, i / 16];
            let p = [0, 1, 2].map(|axis| f64::from(origin[axis] + offset[axis] as u32));
            self.value(p) as f32
        })
    }

    /// The value of all voxels from `low` to `high`, where the field knows without looking that they
    /// are equal.
    fn constant(&self, _low: [f64; 3], _high: [f64; 3]) -> Option<f64> {
        None
    }
}

/// A formula written once for values and for gradients.
pub(crate) trait Formula {
    fn at<T: Real>(&self, p: [T; 3]) -> T;

    fn gradient_at(&self, p: [f64; 3]) -> [f64; 3] {
        self.at(Jet::position(p)).gradient
    }
}

/// The names that [`by_name`] knows.
pub const NAMES: &[&str] = &[
    "sphere",
    "plane",
    "marschner-lobb",
    "gyroid",
    "shells",
    "turbulence",
    "rough-solid",
    "patch",
    "mixing-layer",
    "blobs",
    "sheets",
    "tubes",
    "labels",
];

/// No generator has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no generator is called \"{name}\"; there are {}", NAMES.join(", "))]
pub struct UnknownField {
    /// The name that was asked for.
    pub name: String,
}

/// The generator of this name with its default parameters, for a volume of `dims` voxels.
///
/// # Errors
/// [`UnknownField`] unless `name` is one of [`NAMES`].
pub fn by_name(name: &str, dims: [u32; 3]) -> Result<Box<dyn Field>, UnknownField> {
    by_name_with_seed(name, dims, 1)
}

/// As [`by_name`] with another seed of the noise, for fields that have noise.
///
/// # Errors
/// As [`by_name`].
pub fn by_name_with_seed(
    name: &str,
    dims: [u32; 3],
    seed: u32,
) -> Result<Box<dyn Field>, UnknownField> {
    Ok(match name {
        "sphere" => Box::new(SphereDistance::new(dims)),
        "plane" => Box::new(PlaneRamp::new(dims)),
        "marschner-lobb" => Box::new(MarschnerLobb::new(dims)),
        "gyroid" => Box::new(Gyroid::new(dims)),
        "shells" => Box::new(Shells::with_seed(dims, seed)),
        "turbulence" => Box::new(Turbulence::with_seed(dims, seed)),
        "rough-solid" => Box::new(RoughSolid::with_seed(dims, seed)),
        "patch" => Box::new(Patch::new(dims)),
        "mixing-layer" => Box::new(MixingLayer::with_seed(dims, seed)),
        "blobs" => Box::new(Blobs::with_seed(dims, seed)),
        "sheets" => Box::new(Sheets::with_seed(dims, seed)),
        "tubes" => Box::new(Tubes::with_seed(dims, seed)),
        "labels" => Box::new(Labels::with_seed(dims, seed)),
        _ => return Err(UnknownField { name: name.to_owned() }),
    })
}

/// The last index of each axis: the extent of the volume in voxel spacings.
pub(crate) fn extent(dims: [u32; 3]) -> [f64; 3] {
    dims.map(|n| f64::from(n.saturating_sub(1)))
}

/// The middle of the volume in index space.
pub(crate) fn centre(dims: [u32; 3]) -> [f64; 3] {
    extent(dims).map(|e| 0.5 * e)
}

/// The largest extent, at least one voxel spacing.
pub(crate) fn longest(dims: [u32; 3]) -> f64 {
    extent(dims).into_iter().fold(1.0, f64::max)
}

/// The smallest extent, at least one voxel spacing.
pub(crate) fn shortest(dims: [u32; 3]) -> f64 {
    extent(dims).into_iter().fold(f64::INFINITY, f64::min).max(1.0)
}
