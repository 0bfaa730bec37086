//! What waits for the device, for offline use.

use crate::faults::{Faults, Task, is_lost};
use crate::{Capture, Error, PassReport, ProgressiveIsoRenderer, wgpu};

impl ProgressiveIsoRenderer {
    /// Renders passes until the frame is complete, blocking on the device: for offline use.
    /// `each` sees every report; returning false stops early. A stream that arrives in pieces must be there
    /// or come from another thread.
    ///
    /// # Errors
    /// If no frame is set, the device fails, or passes stop making progress.
    pub fn render_to_completion(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        mut each: impl FnMut(&Self, &PassReport) -> bool,
    ) -> Result<PassReport, Error> {
        const PATIENCE: u32 = 256;
        let mut idle_passes = 0;
        let mut last = self.report(false);
        loop {
            self.render_pass(device, queue)?;
            wait(device)?;
            self.check(device)?;
            let report = self.report(false);
            let progressed = report.frame != last.frame
                || report.active_rays != last.active_rays
                || report.blocks_decoded != last.blocks_decoded
                || report.cut_walks != last.cut_walks
                || report.pass == 0;
            idle_passes = if progressed { 0 } else { idle_passes + 1 };
            if !each(self, &report) || report.complete() {
                return Ok(report);
            }
            if idle_passes >= PATIENCE {
                let active_rays = report.active_rays;
                return Err(Error::Stalled { passes: idle_passes, active_rays });
            }
            last = report;
        }
    }

    /// Reads the pictures back, blocking on the device: for offline use.
    ///
    /// # Errors
    /// Without [`RendererOptions::capture`](crate::RendererOptions::capture), or if the device fails.
    pub fn capture_blocking(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Capture, Error> {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("progressive-iso.capture"),
        });
        let mut pending = self.capture(device, &mut encoder)?;
        Faults::default().guard(device, Task::Other, || {
            #[expect(
                clippy::disallowed_methods,
                reason = "the facade submits on behalf of the caller"
            )]
            queue.submit([encoder.finish()]);
            Ok(())
        })?;
        wait(device)?;
        let lost = || if is_lost(device) { Error::DeviceLost } else { Error::MapFailed };
        pending.try_take().ok_or_else(lost)
    }
}

fn wait(device: &wgpu::Device) -> Result<(), Error> {
    #[expect(clippy::disallowed_methods, reason = "offline use blocks by request")]
    let result = device.poll(wgpu::PollType::wait_indefinitely());
    result.map(|_| ()).map_err(|error| Error::Device(error.to_string()))
}
