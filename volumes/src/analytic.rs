//! Fields with a closed formula, whose surfaces and normals are known.

use crate::field::{Field, Formula, centre, extent, longest, shortest};
use crate::math::Real;

/// Distance from a centre, in voxels: the surface of isovalue r is the sphere of radius r.
///
/// `f(p) = |p - c|`
///
/// The gradient is the unit vector away from the centre; there is none at the centre itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereDistance {
    /// The centre in index space.
    pub centre: [f64; 3],
    /// The radius that [`Field::suggested_isovalue`] gives, in voxels.
    pub radius: f64,
}

impl SphereDistance {
    /// Centred in the volume, with a radius of 0.4 times its smallest extent.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        SphereDistance { centre: centre(dims), radius: 0.4 * shortest(dims) }
    }
}

impl Formula for SphereDistance {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let [x, y, z] = [0, 1, 2].map(|axis| p[axis].plus(-self.centre[axis]));
        (x * x + y * y + z * z).sqrt()
    }
}

impl Field for SphereDistance {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        (p != self.centre).then(|| self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "sphere"
    }

    fn suggested_isovalue(&self) -> f64 {
        self.radius
    }
}

/// A plane's height: linear in the position, so that trilinear interpolation reproduces it and
/// every hit is known exactly.
///
/// `f(p) = n . p + d`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneRamp {
    /// The gradient n, per voxel.
    pub slope: [f64; 3],
    /// The value d at voxel (0, 0, 0).
    pub offset: f64,
    /// A position on the plane that [`Field::suggested_isovalue`] gives.
    pub through: [f64; 3],
}

impl PlaneRamp {
    /// Slope (1, 1/2, 1/4), whose values at voxels are exact in `f32`; the suggested plane passes
    /// through the middle.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        PlaneRamp { slope: [1.0, 0.5, 0.25], offset: 0.0, through: centre(dims) }
    }
}

impl Formula for PlaneRamp {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let [x, y, z] = [0, 1, 2].map(|axis| p[axis].scale(self.slope[axis]));
        (x + y + z).plus(self.offset)
    }
}

impl Field for PlaneRamp {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, _p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.slope)
    }

    fn name(&self) -> &'static str {
        "plane"
    }

    fn suggested_isovalue(&self) -> f64 {
        self.at(self.through)
    }
}

/// The test signal of S. R. Marschner and R. J. Lobb, "An evaluation of reconstruction filters for
/// volume rendering", IEEE Visualization 1994: rings close to the sampling limit at 41^3 voxels, a
/// hard case for reconstruction and normals.
///
/// With x, y, z in [-1, 1] from the first to the last voxel of each axis, r = sqrt(x^2 + y^2), a =
/// 0.25 and m = 6:
///
/// `f = ((1 - sin(pi z / 2)) + a (1 + cos(2 pi m cos(pi r / 2)))) / (2 (1 + a))`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarschnerLobb {
    /// Amplitude a of the rings.
    pub amplitude: f64,
    /// Frequency m of the rings.
    pub frequency: f64,
    centre: [f64; 3],
    per_voxel: [f64; 3],
}

impl MarschnerLobb {
    /// The published parameters, the cube [-1, 1]^3 stretched over the volume.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        MarschnerLobb {
            amplitude: 0.25,
            frequency: 6.0,
            centre: centre(dims),
            per_voxel: extent(dims).map(|e| 2.0 / e.max(1.0)),
        }
    }
}

impl Formula for MarschnerLobb {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let [x, y, z] =
            [0, 1, 2].map(|axis| p[axis].plus(-self.centre[axis]).scale(self.per_voxel[axis]));
        let r = (x * x + y * y).sqrt();
        let rings = r.scale(0.25).sin_cos_turns().1.scale(self.frequency).sin_cos_turns().1;
        let slope = z.scale(0.25).sin_cos_turns().0;
        (-slope + rings.scale(self.amplitude))
            .plus(1.0 + self.amplitude)
            .scale(0.5 / (1.0 + self.amplitude))
    }
}

impl Field for MarschnerLobb {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "marschner-lobb"
    }

    fn suggested_isovalue(&self) -> f64 {
        0.5
    }
}

/// The level-set approximation of A. H. Schoen's triply periodic minimal surface ("Infinite
/// periodic minimal surfaces without self-intersections", NASA TN D-5541, 1970): one connected
/// sheet through the whole volume.
///
/// With X, Y, Z = 2 pi (p - c) / period:
///
/// `f = sin X cos Y + sin Y cos Z + sin Z cos X`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gyroid {
    /// Length of a period in voxels.
    pub period: f64,
    /// The index-space position of the origin of X, Y, Z.
    pub centre: [f64; 3],
}

impl Gyroid {
    /// Four periods along the longest axis.
    #[must_use]
    pub fn new(dims: [u32; 3]) -> Self {
        Gyroid { period: longest(dims) / 4.0, centre: centre(dims) }
    }
}

impl Formula for Gyroid {
    fn at<T: Real>(&self, p: [T; 3]) -> T {
        let turns = [0, 1, 2].map(|axis| p[axis].plus(-self.centre[axis]).scale(1.0 / self.period));
        let [(sx, cx), (sy, cy), (sz, cz)] = turns.map(T::sin_cos_turns);
        sx * cy + sy * cz + sz * cx
    }
}

impl Field for Gyroid {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.at(p)
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        Some(self.gradient_at(p))
    }

    fn name(&self) -> &'static str {
        "gyroid"
    }

    fn suggested_isovalue(&self) -> f64 {
        0.0
    }
}
