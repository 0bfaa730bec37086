//! Volumes that only training needs: parts of the bundled scan, and thin rods.

use glam::DVec3;
use volumes::Field;

use crate::random::Random;

/// A part of the bundled scan, mirrored and with its axes exchanged at random: a scan's noise and furrows,
/// but not the views of the whole on which in-fill is tested.
pub struct BrainPart {
    /// Of the whole scan.
    samples: Vec<f32>,
    dims: [u32; 3],
    origin: [u32; 3],
    edge: u32,
    /// Axis of the scan for each of the part's, and whether it runs backwards.
    axes: [(usize, bool); 3],
    isovalue: f64,
}

impl BrainPart {
    /// `edge` voxels on each axis with a voxel inside the surface in its middle; isovalues between fluid and
    /// white matter.
    pub fn random(edge: u32, random: &mut Random) -> Self {
        let scan = volumes::brain();
        let (samples, dims) = (scan.decode(), scan.dims);
        let edge = dims.into_iter().fold(edge, u32::min);
        let isovalue = f64::from(volumes::BRAIN_ISOVALUE) * random.between(0.7, 1.1);
        let mut axes = [0, 1, 2].map(|axis| (axis, random.below(2) == 1));
        for last in [2, 1] {
            axes.swap(last as usize, random.below(last + 1) as usize);
        }
        let origin = loop {
            let origin = dims.map(|n| random.below(n - edge + 1));
            if f64::from(samples[index(dims, origin.map(|o| o + edge / 2))]) > isovalue {
                break origin;
            }
        };
        Self { samples, dims, origin, edge, axes, isovalue }
    }
}

fn index(dims: [u32; 3], [x, y, z]: [u32; 3]) -> usize {
    (x + dims[0] * (y + dims[1] * z)) as usize
}

impl Field for BrainPart {
    /// The nearest voxel's.
    fn value(&self, p: [f64; 3]) -> f64 {
        let mut voxel = self.origin;
        for (place, (axis, backwards)) in p.into_iter().zip(self.axes) {
            let place = (place.round().max(0.0) as u32).min(self.edge - 1);
            voxel[axis] += if backwards { self.edge - 1 - place } else { place };
        }
        self.samples[index(self.dims, voxel)].into()
    }

    fn gradient(&self, _p: [f64; 3]) -> Option<[f64; 3]> {
        None
    }

    fn name(&self) -> &'static str {
        "brain-part"
    }

    fn suggested_isovalue(&self) -> f64 {
        self.isovalue
    }
}

/// Straight rods of several thicknesses through the volume: thin features other than the tubes of the held-out set,
/// which bend, are all of one thickness and nowhere straight.
pub struct Rods {
    rods: Vec<Rod>,
}

struct Rod {
    through: DVec3,
    along: DVec3,
    radius: f64,
}

/// Number of rods, and their radii in voxels.
const RODS: u32 = 24;
const RADII: [f64; 2] = [1.0, 4.0];

impl Rods {
    /// In a volume of `edge` voxels on each axis.
    pub fn random(edge: u32, random: &mut Random) -> Self {
        let extent = f64::from(edge - 1);
        let rod = |_| Rod {
            through: DVec3::from(random.vector(0.0, extent)),
            along: DVec3::from(random.direction()),
            radius: random.between(RADII[0], RADII[1]),
        };
        Self { rods: (0..RODS).map(rod).collect() }
    }
}

impl Field for Rods {
    /// 1 on a rod's axis, 0.5 on its surface, down to 0 at twice its radius.
    fn value(&self, p: [f64; 3]) -> f64 {
        let height = |rod: &Rod| {
            let offset = DVec3::from(p) - rod.through;
            1.0 - 0.5 * offset.reject_from_normalized(rod.along).length() / rod.radius
        };
        self.rods.iter().map(height).fold(0.0, f64::max)
    }

    fn gradient(&self, _p: [f64; 3]) -> Option<[f64; 3]> {
        None
    }

    fn name(&self) -> &'static str {
        "rods"
    }

    fn suggested_isovalue(&self) -> f64 {
        0.5
    }
}
