//! Volumes by name.

use volume_io::ZfpVolume;

use super::Failure;

/// A volume, named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subject {
    /// "brain", or the name of a generator.
    pub volume: &'static str,
    /// Voxels per axis of a generated volume.
    pub dims: [u32; 3],
    /// Bits per voxel of a generated volume.
    pub rate: f64,
}

impl Subject {
    /// Name with the volume's size, as in the reports.
    pub fn name(&self) -> String {
        let [x, y, z] = self.dims;
        match self.volume {
            "brain" => "brain".into(),
            name if x == y && y == z => format!("{name}-{x}"),
            name => format!("{name}-{x}x{y}x{z}"),
        }
    }
}

pub fn cube(volume: &'static str, edge: u32, rate: f64) -> Subject {
    Subject { volume, dims: [edge; 3], rate }
}

/// The bundled scan.
pub const BRAIN: Subject = Subject { volume: "brain", dims: [193, 229, 193], rate: 4.0 };

pub fn turbulence(edge: u32) -> Subject {
    cube("turbulence", edge, 4.0)
}

/// A volume's stream and its suggested isovalue.
pub fn stream(subject: &Subject) -> Result<(ZfpVolume, f32), Failure> {
    if subject.volume == "brain" {
        return Ok((volumes::brain(), volumes::BRAIN_ISOVALUE));
    }
    let field = volumes::by_name(subject.volume, subject.dims)?;
    let volume = volumes::generate(&*field, subject.dims, subject.rate)?;
    Ok((volume, field.suggested_isovalue() as f32))
}
