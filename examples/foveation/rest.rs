//! Camera and gaze at rest: passes add rays until the picture is the exact one.

use gpu_testkit::image::psnr;
use serde::{Deserialize, Serialize};

use crate::filler::{Filler, OFF, SPARSE, options};
use crate::sets::Plan;
use crate::support::shown::Shown;
use crate::support::{Failure, Gpu};
use crate::view::{Place, Volume, foveation};

/// The picture after some passes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Rest {
    pub volume: String,
    pub base_density: f32,
    pub pass: u32,
    /// Share of the pixels that are finished.
    pub finished: f64,
    /// Filled by the network for sparse masks, in dB; null for the exact picture.
    pub psnr: Option<f64>,
}

/// Adds a row for the passes 1, 2, 4, .. and the last.
pub fn measure(
    gpu: &Gpu,
    volume: &Volume,
    plan: &Plan,
    rows: &mut Vec<Rest>,
) -> Result<(), Failure> {
    let size = plan.quality_size;
    let camera = volume.camera(Place::Near, 0, size);
    let mut exact = Filler::new(gpu, volume, OFF, options(size, OFF, false))?;
    exact.set_frame(camera, None)?;
    exact.finish(gpu)?;
    let exact = Shown::from(&exact.capture(gpu)?);
    let mut filler = Filler::new(gpu, volume, SPARSE, options(size, SPARSE, true))?;
    for base_density in [plan.middle_density] {
        filler.set_frame(camera, Some(foveation(0, base_density)))?;
        loop {
            let report = filler.pass(gpu)?;
            if report.pass.is_power_of_two() || report.complete() {
                let shown = Shown::from(&filler.capture(gpu)?);
                let psnr = psnr(shown.colors.as_flattened(), exact.colors.as_flattened(), 1.0);
                rows.push(Rest {
                    volume: volume.name.clone(),
                    base_density,
                    pass: report.pass,
                    finished: report.completeness_pixels(),
                    psnr: psnr.is_finite().then_some(psnr),
                });
            }
            if report.complete() {
                break;
            }
        }
        if rows.last().is_some_and(|row| row.psnr.is_some()) {
            return Err(format!("{}: the last picture is not the exact one", volume.name).into());
        }
    }
    Ok(())
}
