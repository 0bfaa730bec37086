//! A case: a volume from a formula, isovalues, and views of it.

use progressive_iso::{Camera, CompressedVolume};
use volume_io::ZfpVolume;

use super::views::{self, Effort};

/// Bits per voxel at which a block keeps all of its planes: 2,120 bits.
const EVERYTHING: f64 = 33.125;

/// From an index-space position to the world, column-major.
pub type Matrix = [[f64; 4]; 4];

/// A volume with its samples as the GPU decodes them.
#[derive(Clone, Debug)]
pub struct Volume {
    pub dims: [u32; 3],
    pub samples: Vec<f32>,
    pub compressed: CompressedVolume,
}

/// A camera and a picture.
#[derive(Clone, Debug)]
pub struct View {
    pub camera: Camera,
    pub size: [u32; 2],
    /// Every how many pixels are compared with the reference, counted along the rows.
    pub stride: usize,
}

/// Which rays the reference follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rays {
    /// Those of the camera, in f64.
    Camera,
    /// Those that the GPU makes of them in f32.
    Own,
}

type Isovalues = Box<dyn Fn(&Volume) -> Vec<f32>>;
type Views = Box<dyn Fn(&Volume, f32, Effort) -> Vec<View>>;

/// What is drawn and compared.
pub struct Case {
    pub group: &'static str,
    pub name: String,
    pub dims: [u32; 3],
    pub samples: Vec<f32>,
    /// Whether the codec must give the samples back exactly.
    pub exact: bool,
    pub world_from_index: Matrix,
    pub isovalues: Isovalues,
    pub views: Views,
    /// Whether the surfaces are closed and smooth enough that no true miss is surrounded by hits.
    pub closed: bool,
    /// Whether every ray has to hit.
    pub all_hit: bool,
    /// Whether no ray may hit.
    pub none_hit: bool,
    pub rays: Rays,
}

impl Case {
    /// A volume from a formula, seen from all sides.
    pub fn new(
        group: &'static str,
        name: impl Into<String>,
        dims: [u32; 3],
        value: impl Fn([f64; 3]) -> f64,
    ) -> Self {
        let mut samples = Vec::new();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    samples.push(value([x, y, z].map(f64::from)) as f32);
                }
            }
        }
        Self {
            group,
            name: name.into(),
            dims,
            samples,
            exact: false,
            world_from_index: CompressedVolume::placed([1.0; 3], [0.0; 3]),
            isovalues: Box::new(|_| vec![0.0]),
            views: Box::new(|volume, _, effort| views::all_around(volume, effort)),
            closed: false,
            all_hit: false,
            none_hit: false,
            rays: Rays::Camera,
        }
    }

    pub fn at(self, isovalues: &[f32]) -> Self {
        let isovalues = isovalues.to_vec();
        self.at_decoded(move |_| isovalues.clone())
    }

    /// Isovalues that depend on the decoded samples.
    pub fn at_decoded(self, isovalues: impl Fn(&Volume) -> Vec<f32> + 'static) -> Self {
        Self { isovalues: Box::new(isovalues), ..self }
    }

    pub fn seen(self, views: impl Fn(&Volume, f32, Effort) -> Vec<View> + 'static) -> Self {
        Self { views: Box::new(views), ..self }
    }

    pub fn placed(self, world_from_index: Matrix) -> Self {
        Self { world_from_index, ..self }
    }

    pub fn exact(self) -> Self {
        Self { exact: true, ..self }
    }

    pub fn closed(self) -> Self {
        Self { closed: true, ..self }
    }

    pub fn all_hit(self) -> Self {
        Self { all_hit: true, ..self }
    }

    pub fn none_hit(self) -> Self {
        Self { none_hit: true, ..self }
    }

    pub fn own_rays(self) -> Self {
        let name = format!("{}, the GPU's own rays", self.name);
        Self { rays: Rays::Own, name, ..self }
    }

    /// Encodes the volume and decodes it as the GPU does.
    pub fn volume(&self) -> Result<Volume, super::row::Failure> {
        let encoded = volume_io::encode(&self.samples, self.dims, EVERYTHING)?;
        let volume = Volume::new(&encoded, self.world_from_index)?;
        if self.exact && volume.samples != self.samples {
            return Err(format!("{}: the codec changed samples", self.name).into());
        }
        Ok(volume)
    }
}

impl Volume {
    pub fn new(encoded: &ZfpVolume, world_from_index: Matrix) -> Result<Self, super::row::Failure> {
        let mut compressed = CompressedVolume::try_from(encoded)?;
        compressed.world_from_index = world_from_index;
        let samples = zfp_gpu::cpu::decode::decode_volume(&encoded.bytes, compressed.layout());
        Ok(Self { dims: encoded.dims, samples, compressed })
    }

    /// World position of an index-space position.
    pub fn world(&self, p: [f64; 3]) -> [f64; 3] {
        let m = &self.compressed.world_from_index;
        [0, 1, 2].map(|r| m[0][r] * p[0] + m[1][r] * p[1] + m[2][r] * p[2] + m[3][r])
    }

    pub fn middle(&self) -> [f64; 3] {
        self.dims.map(|n| 0.5 * (f64::from(n) - 1.0))
    }

    pub fn sample(&self, [x, y, z]: [u32; 3]) -> f32 {
        let [nx, ny, _] = self.dims;
        self.samples[(x + nx * (y + ny * z)) as usize]
    }
}
