//! What a pass records of the current frame.

use infill::Method;
use wavefront::{OutputTextures, ShadingParams};

use super::frame_state::{FrameState, ShownHits};
use super::{Phase, ProgressiveIsoRenderer, WARM_MISSES};
use crate::budget::{Request, Sampling, Setting};
use crate::casting::Recorder;
use crate::records::PassRecords;
use crate::schedule::Schedule;
use crate::stages::{Rendering, VolumeBuffers};
use crate::{Infill, RendererOptions, ScenePlan, wgpu};

impl ProgressiveIsoRenderer {
    /// Records one pass of the current frame, once the volume is loaded.
    pub(super) fn record_frame(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
    ) {
        self.record_start(device, encoder);
        let (Phase::Rendering(rendering), Some(state)) = (&self.phase, &mut self.frame) else {
            return;
        };
        if let (Some(budget), Some(choice), 1) = (&self.records.budget, &state.choice, state.passes)
        {
            state.sampling = budget.second(choice);
        }
        let mut pass = Pass {
            to: Recorder { device, encoder, upload: &mut self.upload, stages: &self.stages },
            rendering,
            textures: &self.pictures.textures,
            plan: &self.plan,
            schedule: &self.records.schedule,
            world_from_index: self.volume.world_from_index,
            shown: &mut self.shown,
            state,
        };
        if pass.state.passes == 0 {
            pass.record_first();
        } else {
            pass.record_further();
        }
    }

    /// Records the start of the current frame unless it has started.
    fn record_start(&mut self, device: &wgpu::Device, encoder: &mut wgpu::CommandEncoder) {
        let (Phase::Rendering(rendering), Some(state)) = (&self.phase, &mut self.frame) else {
            return;
        };
        if std::mem::replace(&mut state.started, true) {
            return;
        }
        let _span = tracing::debug_span!("progressive_iso.start").entered();
        let (stages, upload) = (&self.stages, &mut self.upload);
        let isovalue = state.frame.isovalues[0];
        let clear = std::mem::take(&mut self.clear_cache);
        state.clears_cache = clear;
        let warm = !clear && self.active_isovalue == Some(isovalue);
        rendering.samples.record_begin_frame(encoder, &stages.samples, clear);
        if self.active_isovalue != Some(isovalue) {
            let VolumeBuffers { ranges, masks, .. } = &self.buffers;
            stages.activate.record(device, encoder, upload, ranges, masks, isovalue);
            self.active_isovalue = Some(isovalue);
        }
        state.most_cells = self.records.schedule.most_cells();
        state.first_misses = if warm { WARM_MISSES } else { 0 };
        choose_setting(&mut self.records, &self.options, &self.plan, state, clear);
        if let (Some(draw), Some(buffers)) = (&stages.draw, &self.pictures.draw) {
            draw.record_params(device, encoder, upload, buffers, &state.view);
        }
    }
}

/// Chooses which of a frame's rays its first pass casts, if the frame is held to a time.
fn choose_setting(
    records: &mut PassRecords,
    options: &RendererOptions,
    plan: &ScenePlan,
    state: &mut FrameState,
    clear: bool,
) {
    let frame = &state.frame;
    let foveated = |foveation| Sampling { foveation, lattice: 1 };
    (state.sampling, state.choice) = (frame.options.foveation.map(foveated), None);
    let Some(budget) = &mut records.budget else { return };
    if clear {
        budget.forget_cache();
    }
    if let (Some(target_ms), None) = (frame.options.target_ms, frame.options.foveation) {
        let fills = frame.options.infill != Infill::Off;
        // All of a preview's pixels are shown filled, whatever is finished.
        let has_previews = fills && frame.options.stop_at.is_none();
        let steps = plan.previews.iter().filter(|_| has_previews).map(|preview| preview.step);
        let choice = budget.choose(&Request {
            view: &state.view,
            size: options.size,
            steps: &std::iter::once(1).chain(steps).collect::<Vec<_>>(),
            isovalue: frame.isovalues[0],
            look_ahead: frame.options.look_ahead,
            fills,
            target_ms: target_ms.into(),
        });
        state.step = choice.setting.first;
        (state.sampling, state.choice) = (choice.setting.first_sampling(), Some(choice));
    }
}

/// One pass of a frame that is being recorded.
struct Pass<'a> {
    to: Recorder<'a>,
    rendering: &'a Rendering,
    /// Those of the picture.
    textures: &'a OutputTextures,
    plan: &'a ScenePlan,
    schedule: &'a Schedule,
    world_from_index: [[f64; 4]; 4],
    shown: &'a mut ShownHits,
    state: &'a mut FrameState,
}

impl Pass<'_> {
    /// Records the frame's first rays, and those with which it goes on from a preview at once.
    fn record_first(&mut self) {
        self.record_rays();
        let setting = self.state.choice.map_or(Setting::ALL, |choice| choice.setting);
        let rounds = self.rounds(setting);
        let goes_on = setting.last < setting.first;
        // The rest is for what it goes on with, one at least.
        let first = if goes_on { rounds.saturating_sub(1).max(1) } else { rounds };
        self.record_rounds(first);
        self.record_fill();
        if goes_on {
            self.record_upscale(setting.last);
            self.state.sampling = setting.last_sampling();
            self.record_resume(setting.last, 0);
            self.record_rounds(rounds.saturating_sub(first).max(1));
        }
        self.state.passes = 1;
        if self.state.step > 1 {
            self.record_upscale(1);
        }
    }

    /// Records what a pass after the first one casts beside what there is.
    fn record_further(&mut self) {
        let pass = self.state.passes;
        self.state.passes += 1;
        if self.state.step > 1 {
            self.record_resume(1, pass);
        } else {
            if pass == 1 && self.state.choice.is_some() {
                // From now on the frame looks as far ahead as it is asked to.
                let Recorder { device, encoder, upload, .. } = &mut self.to;
                let params = self.state.params(self.plan);
                self.rendering.casting(1).rays().record_params(device, encoder, upload, &params);
            }
            if let Some(sampling) = self.state.sampling(pass) {
                self.state.lists += 1;
                self.rendering.casting(1).record_mask(&mut self.to, &sampling);
            }
        }
        self.record_rounds(self.rounds(Setting::ALL));
        self.record_fill();
    }

    /// How hits look; what is filled before it is shown starts as background.
    fn shading(&self) -> ShadingParams {
        let options = &self.state.frame.options;
        let shading = ShadingParams::new(&options.shading, self.world_from_index);
        let fills = self.to.stages.infill.is_some() && options.infill != Infill::Off;
        if fills && options.stop_at.is_none() { shading.filled() } else { shading }
    }

    /// Records the start of the frame's first rays.
    fn record_rays(&mut self) {
        let isovalue = self.state.frame.isovalues[0];
        let follows = self.shown.replace(self.state.step, isovalue) == Some(isovalue);
        self.record_infill_start(follows);
        let (rendering, params, shading) =
            (self.rendering, self.state.params(self.plan), self.shading());
        let sampling = self.state.sampling(0);
        let preview = rendering.preview(self.state.step);
        let textures = preview.map_or(self.textures, |preview| &preview.textures);
        let casting = rendering.casting(self.state.step);
        casting.record_start(&mut self.to, textures, (&params, &shading), sampling.as_ref());
        self.state.lists += 1;
    }

    /// Records what in-fill needs of the rays that are about to start; `follows`: their pictures show hits of the isovalue.
    fn record_infill_start(&mut self, follows: bool) {
        let state = &self.state;
        let options = &state.frame.options;
        if options.infill == Infill::Off && !options.guided {
            return;
        }
        let look = infill::Look {
            from_completeness: options.stop_at.map_or(0.0, |stop| stop.0),
            crisp: options.crisp_infill,
        };
        let view = match state.step {
            1 => state.view.reduced(self.plan.infill_step()),
            _ => state.ray_view(),
        };
        let next = (&view, &state.params_of(&view, self.plan));
        let casting = self.rendering.casting(state.step);
        casting.record_infill_start(&mut self.to, next, follows, look);
    }

    /// As many rounds as fit into a pass of a setting.
    fn rounds(&self, setting: Setting) -> u32 {
        let options = &self.state.frame.options;
        let pass_ms = options.pass_ms.min(options.target_ms.unwrap_or(f32::INFINITY));
        let is_first = self.state.passes == 0;
        self.schedule.rounds(setting, is_first, options.rounds_per_pass, pass_ms)
    }

    fn record_rounds(&mut self, rounds: u32) {
        let guided = self.state.frame.options.guided;
        for _ in 0..rounds {
            self.state.rounds += 1;
            let _span =
                tracing::debug_span!("progressive_iso.round", round = self.state.rounds).entered();
            let casting = self.rendering.casting(self.state.step);
            let Recorder { encoder, stages, .. } = &mut self.to;
            self.rendering.record_round(encoder, stages, casting, guided);
        }
    }

    /// Records filling the unfinished pixels, unless they have a preview's colours.
    fn record_fill(&mut self) {
        let method = match self.state.frame.options.infill {
            _ if self.state.is_resumed() => return,
            Infill::Off => return,
            Infill::Classical => Method::Classical,
            Infill::Network => Method::Network,
        };
        let casting = self.rendering.casting(self.state.step);
        casting.record_fill(self.to.encoder, self.to.stages, method);
    }

    /// Records making the pictures with every `step`-th pixel from the preview.
    fn record_upscale(&mut self, step: u32) {
        // They show no hits that history could follow from.
        self.shown.forget(step);
        let finer = self.rendering.preview(step);
        let textures = finer.map_or(self.textures, |preview| &preview.textures);
        let (shading, crisp) = (self.shading(), self.state.frame.options.crisp_infill);
        if let Some(preview) = self.rendering.preview(self.state.step) {
            preview.record_upscale(&mut self.to, (step, textures), &shading, crisp);
        }
    }

    /// Records that the frame goes on with the rays of every `step`-th pixel, in pass `pass`, counted from 0.
    fn record_resume(&mut self, step: u32, pass: u32) {
        let Some(preview) = self.rendering.preview(self.state.step) else { return };
        self.state.resumed_step = self.state.step / step;
        self.state.step = step;
        self.state.lists += 1;
        if self.state.frame.options.guided {
            self.record_infill_start(false);
        }
        let sampling = self.state.sampling(pass);
        let view = (&self.state.params(self.plan), &self.shading());
        let next = (step, self.rendering.casting(step));
        preview.record_resume(&mut self.to, next, view, sampling.as_ref());
    }
}
