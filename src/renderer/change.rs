//! Other options for a volume that is on the GPU.

use super::{Phase, ProgressiveIsoRenderer};
use crate::faults::Task;
use crate::stages::Stages;
use crate::{Error, RendererOptions, Residency, ScenePlan, wgpu};

impl ProgressiveIsoRenderer {
    /// Changes the picture's size: [`Self::set_options`] with another size.
    ///
    /// # Errors
    /// As [`Self::set_options`].
    pub fn resize(&mut self, device: &wgpu::Device, size: [u32; 2]) -> Result<(), Error> {
        self.set_options(device, RendererOptions { size, ..self.options })
    }

    /// Changes what the renderer was made with, and keeps the volume on the GPU. The current frame starts
    /// again. Pictures stay as they are, unless their size or kinds change; decoded blocks stay where
    /// the budget still holds as many.
    ///
    /// Decoding every block belongs to loading. So a volume that is resident as a whole stays so or gets a
    /// cache, and one with a cache keeps to that whatever [`RendererOptions::residency`] says; while it is
    /// being loaded, neither changes.
    ///
    /// # Errors
    /// If the new options do not fit each other, the limits or the budget; nothing changes then. Or what
    /// went wrong with the device.
    pub fn set_options(
        &mut self,
        device: &wgpu::Device,
        options: RendererOptions,
    ) -> Result<(), Error> {
        let plan = self.replan(&options)?;
        if let Some(state) = &self.frame {
            options.check_frame(&state.frame.options)?;
        }
        let pictures = self.options.draw_target != options.draw_target
            || self.plan.wavefront.outputs() != plan.wavefront.outputs();
        let (layout, strategy) = (plan.samples.layout(), plan.strategy);
        if pictures
            || plan.infill_options != self.plan.infill_options
            || plan.infill_step() != self.plan.infill_step()
            || options.blue_noise() != self.options.blue_noise()
            || plan.previews.is_empty() != self.plan.previews.is_empty()
            || (layout, strategy) != (self.plan.samples.layout(), self.plan.strategy)
        {
            self.stages = self
                .faults
                .guard(device, Task::Pipelines, || Stages::new(device, &plan, &options))?;
        }
        // What goes does so before anything comes, or both together would exceed the budget.
        self.release_rays(plan.samples == self.plan.samples);
        if pictures || options.size != self.options.size {
            self.faults.guard(device, Task::Other, || {
                self.pictures.replace(device, &self.ledger, &self.stages, &plan);
                Ok(())
            })?;
        }
        self.records.set_infill(plan.infill.is_some());
        self.records.set_budget(options.budget, &self.ledger, &plan);
        self.options = options;
        self.plan = plan;
        if let Some(state) = self.frame.take() {
            self.set_frame(&state.frame)?;
        }
        Ok(())
    }

    /// A plan for other options with the same volume. What is resident stays so while options and budget
    /// allow it; what is cached stays cached, because loading is over. Until then, it goes on as it
    /// was planned.
    fn replan(&self, options: &RendererOptions) -> Result<ScenePlan, Error> {
        let load = matches!(self.phase, Phase::Loading(_)).then_some(self.plan.load);
        let plan = |residency| {
            let options = RendererOptions { residency, ..*options };
            ScenePlan::with_load(self.volume.layout(), &options, &self.limits, load)
        };
        match (self.plan.residency(), options.residency, load) {
            (Residency::Full, Residency::Auto, None) => {
                plan(Residency::Full).or_else(|_| plan(Residency::Cached))
            }
            (Residency::Full, Residency::Cached, None) => plan(Residency::Cached),
            (residency, ..) => plan(residency),
        }
    }

    /// Frees the memory of the rays and, unless they are kept, of the samples.
    fn release_rays(&mut self, keep_samples: bool) {
        self.shown.clear();
        let samples = match std::mem::replace(&mut self.phase, Phase::Loaded(None)) {
            Phase::Loading(loader) => {
                self.phase = Phase::Loading(loader);
                return;
            }
            Phase::Loaded(samples) => samples,
            Phase::Rendering(rendering) => Some(rendering.samples),
        };
        self.phase = Phase::Loaded(samples.filter(|_| keep_samples));
    }
}
