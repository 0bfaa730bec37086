//! The rays of one picture or preview, and what works on them.

use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use infill::{GuideBinds, GuideScene, InfillBuffers, InfillPlan, Method};
use wavefront::{
    FrameParams, FrameView, OutputTextures, PreviewBinds, Previews, RayBuffers, Rounds, Samples,
    SamplingParams, Scene, ShadingParams, WavefrontPlan,
};

use crate::plan::PreviewPlan;
use crate::stages::{InfillStage, Stages, VolumeBuffers};
use crate::{Error, wgpu};

/// Rays, their rounds and what fills their pixels.
#[derive(Debug)]
pub(crate) struct Casting {
    rays: RayBuffers,
    rounds: Box<dyn Rounds>,
    infill: Option<InfillBuffers>,
    guide: Option<GuideBinds>,
}

/// A preview, with textures of its own, and how other pictures come from it.
#[derive(Debug)]
pub(crate) struct Preview {
    /// Pixels of the picture from one of its rays to the next in both directions.
    pub(crate) step: u32,
    pub(crate) casting: Casting,
    pub(crate) textures: OutputTextures,
    /// The picture, and the next finer preview if there is one.
    to_picture: PreviewBinds,
    to_finer: Option<PreviewBinds>,
}

/// What making them needs all the time.
pub(crate) struct Maker<'a> {
    pub(crate) device: &'a wgpu::Device,
    pub(crate) ledger: &'a Ledger,
    pub(crate) stages: &'a Stages,
    pub(crate) volume: &'a VolumeBuffers,
    pub(crate) samples: Samples<'a>,
}

/// Where something is recorded, and the ring through which its parameters go.
pub(crate) struct Recorder<'a> {
    pub(crate) device: &'a wgpu::Device,
    pub(crate) encoder: &'a mut wgpu::CommandEncoder,
    pub(crate) upload: &'a mut UploadRing,
    pub(crate) stages: &'a Stages,
}

impl Maker<'_> {
    /// Rays for pictures in these textures.
    pub(crate) fn casting(
        &self,
        plan: &WavefrontPlan,
        infill: Option<&InfillPlan>,
        textures: &OutputTextures,
    ) -> Result<Casting, Error> {
        let Self { device, ledger, stages, volume, samples } = *self;
        let masks = volume.masks.buffer();
        let rays = RayBuffers::new(device, ledger, &stages.rays, plan, masks, samples, textures);
        let scene = Scene { rays: &rays, masks, samples };
        let rounds = stages.strategy.bind(device, ledger, scene)?;
        let scene = infill::Scene { rays: &rays, ranges: &volume.ranges, textures };
        let infill =
            stages.infill.as_ref().zip(infill).map(|(InfillStage { stage, weights, .. }, plan)| {
                InfillBuffers::new(device, ledger, stage, plan, scene, *weights)
            });
        let infill = infill.transpose()?;
        let guide = stages.infill.as_ref().and_then(|infill| infill.guide.as_ref());
        let guide = match (guide, &infill, samples) {
            (Some(guide), Some(buffers), Samples::Cached(cache)) => {
                let cache = [cache.directory(), cache.state()];
                let scene = GuideScene { rays: &rays, masks, ranges: &volume.ranges, cache };
                Some(guide.bind(device, buffers, scene))
            }
            _ => None,
        };
        Ok(Casting { rays, rounds, infill, guide })
    }

    /// A preview of the picture, and of the next `finer` preview.
    pub(crate) fn preview(
        &self,
        stage: &Previews,
        plan: &PreviewPlan,
        picture: (&Casting, &OutputTextures),
        finer: Option<&Preview>,
    ) -> Result<Preview, Error> {
        let PreviewPlan { step, wavefront, infill } = plan;
        let (outputs, size) = (wavefront.outputs(), wavefront.size());
        let textures = OutputTextures::new(self.device, self.ledger, outputs, size);
        let casting = self.casting(wavefront, Some(infill), &textures)?;
        let masks = self.volume.masks.buffer();
        let bind = |(to, pictures): (&Casting, _), step| {
            let (from, to) = ((&casting.rays, &textures), (&to.rays, pictures));
            stage.bind(self.device, self.ledger, from, to, masks, step)
        };
        let to_picture = bind(picture, *step);
        let to_finer = finer.map(|to| bind((&to.casting, &to.textures), step / to.step));
        Ok(Preview { step: *step, casting, textures, to_picture, to_finer })
    }
}

impl Preview {
    /// How the picture with every `step`-th pixel comes from it: 1, or the next finer preview.
    fn binds(&self, step: u32) -> &PreviewBinds {
        self.to_finer.as_ref().filter(|_| step > 1).unwrap_or(&self.to_picture)
    }

    /// Records making pictures with every `step`-th pixel from the preview; `crisp`: without mixtures of its colours.
    pub(crate) fn record_upscale(
        &self,
        to: &mut Recorder<'_>,
        (step, pictures): (u32, &OutputTextures),
        shading: &ShadingParams,
        crisp: bool,
    ) {
        let Recorder { device, encoder, upload, stages } = to;
        if let Some(stage) = &stages.previews {
            let (binds, to) = (self.binds(step), (&self.casting.rays, pictures));
            stage.record_upscale(device, encoder, upload, binds, to, shading, crisp);
        }
    }

    /// Records that the frame goes on in the pictures with every `step`-th pixel, whose rays these are.
    pub(crate) fn record_resume(
        &self,
        to: &mut Recorder<'_>,
        (step, casting): (u32, &Casting),
        view: (&FrameParams, &ShadingParams),
        sampling: Option<&SamplingParams>,
    ) {
        let Recorder { device, encoder, upload, stages } = to;
        if let Some(stage) = &stages.previews {
            let (rays, binds) = ((&self.casting.rays, &casting.rays), self.binds(step));
            let start = &stages.rays;
            stage.record_resume(device, encoder, upload, start, binds, rays, view, sampling);
            casting.rounds.record_start(encoder, start, &casting.rays);
        }
    }
}

impl Casting {
    /// Records the first rays of a frame of these textures.
    pub(crate) fn record_start(
        &self,
        to: &mut Recorder<'_>,
        textures: &OutputTextures,
        view: (&FrameParams, &ShadingParams),
        sampling: Option<&SamplingParams>,
    ) {
        let Recorder { device, encoder, upload, stages } = to;
        let rays = &self.rays;
        stages.rays.record_start(device, encoder, upload, rays, textures, view, sampling);
        self.rounds.record_start(encoder, &stages.rays, rays);
    }

    /// Records that another pass of a foveated frame casts more rays.
    pub(crate) fn record_mask(&self, to: &mut Recorder<'_>, sampling: &SamplingParams) {
        let Recorder { device, encoder, upload, stages } = to;
        stages.rays.record_mask(device, encoder, upload, &self.rays, sampling);
    }

    /// Records what in-fill keeps of the previous frame: before the new one starts.
    pub(crate) fn record_infill_start(
        &self,
        to: &mut Recorder<'_>,
        next: (&FrameView, &FrameParams),
        follows: bool,
        look: infill::Look,
    ) {
        let Recorder { device, encoder, upload, stages } = to;
        if let (Some(infill), Some(buffers)) = (&stages.infill, &self.infill) {
            infill.stage.record_start(device, encoder, upload, buffers, next, follows, look);
        }
    }

    /// Records filling the unfinished pixels.
    pub(crate) fn record_fill(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stages: &Stages,
        method: Method,
    ) {
        if let (Some(infill), Some(buffers)) = (&stages.infill, &self.infill) {
            infill.stage.record_fill(encoder, buffers, method);
        }
    }

    /// Where the number of filled pixels is after a fill.
    pub(crate) fn filled(&self) -> Option<(&wgpu::Buffer, u64, u64)> {
        self.infill.as_ref().map(InfillBuffers::filled)
    }

    /// Records one round; `guided`: with requests up to where the coarse field is crossed. `service` makes requested
    /// blocks resident.
    pub(crate) fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stages: &Stages,
        guided: bool,
        service: &mut dyn FnMut(&mut wgpu::CommandEncoder),
    ) {
        let guide = stages.infill.as_ref().and_then(|infill| infill.guide.as_ref());
        let guide = guide.zip(self.guide.as_ref()).filter(|_| guided);
        self.rounds.record_round(encoder, &stages.rays, &self.rays, &mut |encoder| {
            if let Some((guide, binds)) = guide {
                guide.record(encoder, binds, &self.rays);
            }
            service(encoder);
        });
    }

    /// The rays' states.
    pub(crate) fn rays(&self) -> &RayBuffers {
        &self.rays
    }

    /// Lists of active rays made before the first round.
    pub(crate) fn lists_at_start(&self) -> u32 {
        self.rounds.lists_at_start()
    }

    /// What the strategy tells: parts (buffer, byte offset, bytes).
    pub(crate) fn statistics(&self) -> Vec<(&wgpu::Buffer, u64, u64)> {
        self.rounds.statistics()
    }
}
