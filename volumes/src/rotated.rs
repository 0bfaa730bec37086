//! Any field in another orientation to the grid of voxels.

use crate::field::{Field, centre};

/// A field turned about the middle of its volume.
pub struct Rotated {
    field: Box<dyn Field>,
    centre: [f64; 3],
    /// Rows of the rotation from the volume's axes to the field's.
    rows: [[f64; 3]; 3],
}

impl Rotated {
    /// `field`, made for a volume of `dims` voxels, with orthonormal `rows` as its axes.
    #[must_use]
    pub fn new(field: Box<dyn Field>, dims: [u32; 3], rows: [[f64; 3]; 3]) -> Self {
        Self { field, centre: centre(dims), rows }
    }

    fn turned(&self, p: [f64; 3]) -> [f64; 3] {
        let offset = [0, 1, 2].map(|a| p[a] - self.centre[a]);
        let along = |row: [f64; 3]| row[0] * offset[0] + row[1] * offset[1] + row[2] * offset[2];
        [0, 1, 2].map(|a| self.centre[a] + along(self.rows[a]))
    }
}

impl Field for Rotated {
    fn value(&self, p: [f64; 3]) -> f64 {
        self.field.value(self.turned(p))
    }

    fn gradient(&self, p: [f64; 3]) -> Option<[f64; 3]> {
        let g = self.field.gradient(self.turned(p))?;
        Some([0, 1, 2].map(|a| (0..3).map(|row| self.rows[row][a] * g[row]).sum()))
    }

    fn name(&self) -> &'static str {
        self.field.name()
    }

    fn suggested_isovalue(&self) -> f64 {
        self.field.suggested_isovalue()
    }
}

impl std::fmt::Debug for Rotated {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rotated").field("field", &self.name()).field("rows", &self.rows).finish()
    }
}
