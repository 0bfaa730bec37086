//! A volume as the measurements need it: compressed, and decoded for what the CPU computes.

use std::collections::HashMap;

use progressive_iso::{Camera, CompressedVolume, Frame, FrameView};
use volume_io::ZfpVolume;

use crate::cpu_renderer::PictureRays;
use crate::cpu_volume::{CpuVolume, Masks};
use crate::cpu_walk::Surface;
use crate::library::frame_options;
use crate::needed::{Needed, needed};
use crate::support::Failure;
use crate::support::subject::{Subject, stream};

/// Volumes with more voxels are not decoded on the CPU: 4 bytes each.
const MOST_DECODED_VOXELS: u64 = 1 << 27;

/// Vertical field of view.
pub const FIELD_OF_VIEW_DEGREES: f64 = 50.0;

pub struct Scene {
    pub subject: Subject,
    pub volume: CompressedVolume,
    /// The isovalue suggested for the volume.
    pub isovalue: f32,
    /// `None` for a large volume.
    pub decoded: Option<CpuVolume>,
    /// What the camera looks at: a middle and the radius of a ball around it.
    ball: ([f64; 3], f64),
    needed: HashMap<String, Needed>,
}

/// One camera position and one isovalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    pub isovalue: f32,
    /// Azimuth and elevation in degrees.
    pub position: [f64; 2],
    pub size: [u32; 2],
}

impl Scene {
    /// Makes the volume; `decode`: for the CPU too, unless it is large.
    pub fn new(subject: Subject, decode: bool) -> Result<Self, Failure> {
        let (zfp, isovalue) = stream(&subject)?;
        let decoded = (decode && zfp.voxel_count() <= MOST_DECODED_VOXELS)
            .then(|| CpuVolume::decode(&zfp))
            .transpose()?;
        Ok(Self { decoded, ..Self::of_stream(subject, &zfp, isovalue)? })
    }

    /// A volume whose stream there is already.
    pub fn of_stream(subject: Subject, zfp: &ZfpVolume, isovalue: f32) -> Result<Self, Failure> {
        let volume = CompressedVolume::try_from(zfp)?;
        let ball = match subject.volume {
            "patch" => volumes::Patch::new(subject.dims).ball(),
            _ => volume.bounding_ball(),
        };
        Ok(Self { subject, volume, isovalue, decoded: None, ball, needed: HashMap::new() })
    }

    /// The camera of a view. The volume fills the picture, its corners do not fit.
    pub fn camera(&self, view: &View) -> Camera {
        let (center, radius) = self.ball;
        let [azimuth, elevation] = view.position;
        let aspect = f64::from(view.size[0]) / f64::from(view.size[1]);
        Camera::orbit(center, radius * 0.8, azimuth, elevation, FIELD_OF_VIEW_DEGREES, aspect)
    }

    /// The frame of a view.
    pub fn frame(&self, view: &View, look_ahead: u32, rounds: u32) -> Frame {
        Frame {
            camera: self.camera(view),
            isovalues: vec![view.isovalue],
            options: frame_options(look_ahead, rounds),
        }
    }

    /// The rays of a frame's picture.
    pub fn rays(&self, frame: &Frame, size: [u32; 2]) -> Result<PictureRays, Failure> {
        let world = self.volume.world_from_index;
        Ok(PictureRays::new(&FrameView::new(&frame.camera, size, world, self.volume.dims())?, size))
    }

    /// What a view needs; computed once. `None` where the volume is not decoded.
    pub fn needed(&mut self, view: &View, masks: &Masks) -> Result<Option<Needed>, Failure> {
        let key = format!("{view:?}");
        if let Some(known) = self.needed.get(&key) {
            return Ok(Some(*known));
        }
        let rays = self.rays(&self.frame(view, 1, 1), view.size)?;
        let Some(volume) = &self.decoded else {
            return Ok(None);
        };
        let result = needed(&Surface { volume, masks, isovalue: view.isovalue }, &rays);
        self.needed.insert(key, result);
        Ok(Some(result))
    }
}
