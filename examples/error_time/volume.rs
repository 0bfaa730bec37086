//! A volume before and after compression.

use progressive_iso::{Camera, CompressedVolume, Frame, FrameOptions, FrameView};
use volume_io::ZfpVolume;

use crate::sets::{Setting, View};
use crate::support::Failure;
use crate::support::subject::{Subject, stream};

/// Vertical field of view.
const FIELD_OF_VIEW_DEGREES: f64 = 50.0;

/// Samples as they are before the compression that is measured.
pub struct Volume {
    pub name: String,
    pub dims: [u32; 3],
    /// x fastest.
    pub samples: Vec<f32>,
    pub isovalue: f32,
    /// The samples compressed at the subject's own rate: its place in space is the volume's.
    placed: CompressedVolume,
}

/// One view of a volume in one size.
pub struct Scene {
    pub position: [f64; 2],
    pub size: [u32; 2],
    pub settings: &'static [Setting],
    pub frame: Frame,
    pub view: FrameView,
}

impl Volume {
    /// The bundled scan has no samples but those of its own stream, at 4 bits per voxel.
    pub fn new(subject: &Subject) -> Result<Self, Failure> {
        let (zfp, isovalue) = stream(subject)?;
        let samples = match subject.volume {
            "brain" => zfp.decode(),
            name => volumes::samples(&*volumes::by_name(name, subject.dims)?, subject.dims),
        };
        let placed = CompressedVolume::try_from(&zfp)?;
        Ok(Self { name: subject.name(), dims: zfp.dims, samples, isovalue, placed })
    }

    /// The samples compressed at `rate` bits per voxel.
    pub fn compressed(&self, rate: f64) -> Result<ZfpVolume, Failure> {
        Ok(volume_io::encode(&self.samples, self.dims, rate)?)
    }

    /// A compressed volume in the place of this one.
    pub fn placed(&self, stream: &ZfpVolume) -> Result<CompressedVolume, Failure> {
        let mut volume = CompressedVolume::try_from(stream)?;
        volume.world_from_index = self.placed.world_from_index;
        Ok(volume)
    }

    pub fn world_from_index(&self) -> [[f64; 4]; 4] {
        self.placed.world_from_index
    }

    /// The volume fills the picture, its corners do not fit. A pass is one round, so that there are
    /// as many pictures as can be.
    pub fn scene(&self, view: &View) -> Result<Scene, Failure> {
        let View { position, size, settings } = *view;
        let (center, radius) = self.placed.bounding_ball();
        let [azimuth, elevation] = position;
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let camera =
            Camera::orbit(center, radius * 0.8, azimuth, elevation, FIELD_OF_VIEW_DEGREES, aspect);
        let view = FrameView::new(&camera, size, self.world_from_index(), self.dims)?;
        let options =
            FrameOptions { rounds_per_pass: 1, pass_ms: f32::INFINITY, ..Default::default() };
        let frame = Frame { camera, isovalues: vec![self.isovalue], options };
        Ok(Scene { position, size, settings, frame, view })
    }
}
