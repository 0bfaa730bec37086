//! A scene's pipelines, and the memory that they work on.

use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use infill::{Guide, GuideBinds, GuideScene, InfillBuffers, Method, Weights};
use macrocell::{Activate, Masks, RangeBuffers};
use wavefront::{
    Draw, DrawBuffers, FrameParams, FrameView, OutputTextures, RayBuffers, Rays, Rounds, Samples,
    SamplingParams, Scene, ShadingParams, Strategy,
};
use zfp_gpu::Payload;

use crate::samples::{SampleBuffers, SampleStages};
use crate::{Error, RendererOptions, ScenePlan, wgpu};

/// Pipelines; nothing here depends on a picture's size.
#[derive(Debug)]
pub(crate) struct Stages {
    pub(crate) activate: Activate,
    pub(crate) samples: SampleStages,
    pub(crate) rays: Rays,
    pub(crate) strategy: Box<dyn Strategy>,
    pub(crate) draw: Option<Draw>,
    pub(crate) infill: Option<InfillStage>,
}

/// Pipelines and weights of in-fill.
#[derive(Debug)]
pub(crate) struct InfillStage {
    pub(crate) stage: infill::Infill,
    weights: Option<&'static Weights>,
    guide: Option<Guide>,
}

/// The volume as it is needed all the time.
#[derive(Debug)]
pub(crate) struct VolumeBuffers {
    pub(crate) payload: Payload,
    pub(crate) ranges: RangeBuffers,
    pub(crate) masks: Masks,
}

/// The pictures, which callers may show from the start.
#[derive(Debug)]
pub(crate) struct Pictures {
    pub(crate) textures: OutputTextures,
    pub(crate) draw: Option<DrawBuffers>,
}

/// What rays need, once the volume is loaded.
#[derive(Debug)]
pub(crate) struct Rendering {
    pub(crate) samples: SampleBuffers,
    rays: RayBuffers,
    rounds: Box<dyn Rounds>,
    infill: Option<InfillBuffers>,
    guide: Option<GuideBinds>,
}

impl Stages {
    pub(crate) fn new(
        device: &wgpu::Device,
        plan: &ScenePlan,
        options: &RendererOptions,
    ) -> Result<Self, Error> {
        let _span = tracing::info_span!("progressive_iso.pipelines").entered();
        let (layout, asked) = (plan.samples.layout(), plan.infill_options);
        Ok(Self {
            activate: Activate::new(device, plan.macrocell.grid().has_third_level()),
            samples: SampleStages::new(device, &plan.samples)?,
            rays: match options.blue_noise() {
                Some(_) => Rays::with_foveation(device, plan.wavefront.outputs(), layout),
                None => Rays::new(device, plan.wavefront.outputs(), layout),
            },
            strategy: plan.strategy.pipelines(device, layout),
            draw: options.draw_target.map(|target| Draw::new(device, &target)),
            infill: plan.infill.as_ref().map(|plan| InfillStage {
                stage: infill::Infill::new(device, plan),
                weights: asked.and_then(|infill| infill.network),
                guide: (asked.is_some_and(|infill| infill.guided) && !layout.resident)
                    .then(|| Guide::new(device, plan))
                    .flatten(),
            }),
        })
    }
}

impl VolumeBuffers {
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &Stages,
        plan: &ScenePlan,
    ) -> Self {
        let payload = Payload::new(device, ledger, &plan.payload);
        let ranges = RangeBuffers::new(device, ledger, &plan.macrocell);
        let masks = Masks::new(device, ledger, &stages.activate, &ranges);
        Self { payload, ranges, masks }
    }
}

impl Pictures {
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &Stages,
        plan: &ScenePlan,
    ) -> Self {
        let wavefront = &plan.wavefront;
        let textures = OutputTextures::new(device, ledger, wavefront.outputs(), wavefront.size());
        let draw = Self::draw_buffers(device, ledger, stages, &textures);
        Self { textures, draw }
    }

    /// Replaces the pictures by those of another plan; the old memory goes first.
    pub(crate) fn replace(
        &mut self,
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &Stages,
        plan: &ScenePlan,
    ) {
        self.draw = None;
        let (outputs, size) = (plan.wavefront.outputs(), plan.wavefront.size());
        self.textures.replace(device, ledger, outputs, size);
        self.draw = Self::draw_buffers(device, ledger, stages, &self.textures);
    }

    fn draw_buffers(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &Stages,
        textures: &OutputTextures,
    ) -> Option<DrawBuffers> {
        stages.draw.as_ref().and_then(|draw| DrawBuffers::new(device, ledger, draw, textures))
    }
}

impl Rendering {
    /// Memory for rays, and for samples unless there are some already.
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &Stages,
        plan: &ScenePlan,
        volume: &VolumeBuffers,
        textures: &OutputTextures,
        samples: Option<SampleBuffers>,
    ) -> Result<Self, Error> {
        let samples = match samples {
            Some(samples) => samples,
            None => {
                let payload = &volume.payload;
                SampleBuffers::new(device, ledger, &stages.samples, &plan.samples, payload)?
            }
        };
        let read = samples.samples();
        let (wavefront, masks) = (&plan.wavefront, volume.masks.buffer());
        let rays = RayBuffers::new(device, ledger, &stages.rays, wavefront, masks, read, textures);
        let scene = Scene { rays: &rays, masks, samples: read };
        let rounds = stages.strategy.bind(device, ledger, scene)?;
        let scene = infill::Scene { rays: &rays, ranges: &volume.ranges, textures };
        let infill = stages.infill.as_ref().map(|InfillStage { stage, weights, .. }| {
            InfillBuffers::new(device, ledger, stage, scene, *weights)
        });
        let infill = infill.transpose()?;
        let guide = stages.infill.as_ref().and_then(|infill| infill.guide.as_ref());
        let guide = match (guide, &infill, read) {
            (Some(guide), Some(buffers), Samples::Cached(cache)) => {
                let cache = [cache.directory(), cache.state()];
                let scene = GuideScene { rays: &rays, masks, ranges: &volume.ranges, cache };
                Some(guide.bind(device, buffers, scene))
            }
            _ => None,
        };
        Ok(Self { samples, rays, rounds, infill, guide })
    }

    /// Records the first rays of a frame.
    pub(crate) fn record_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        stages: &Stages,
        textures: &OutputTextures,
        view: (&FrameParams, &ShadingParams),
        sampling: Option<&SamplingParams>,
    ) {
        let rays = &self.rays;
        stages.rays.record_start(device, encoder, upload, rays, textures, view, sampling);
        self.rounds.record_start(encoder, &stages.rays, &self.rays);
    }

    /// Records that another pass of a foveated frame casts more rays.
    pub(crate) fn record_mask(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        stages: &Stages,
        sampling: &SamplingParams,
    ) {
        stages.rays.record_mask(device, encoder, upload, &self.rays, sampling);
    }

    /// Records what in-fill keeps of the previous frame: before the new one starts.
    pub(crate) fn record_infill_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        stages: &Stages,
        next: (&FrameView, &FrameParams),
        follows: bool,
        look: infill::Look,
    ) {
        if let (Some(InfillStage { stage, .. }), Some(buffers)) = (&stages.infill, &self.infill) {
            stage.record_start(device, encoder, upload, buffers, next, follows, look);
        }
    }

    /// Records filling the unfinished pixels.
    pub(crate) fn record_fill(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stages: &Stages,
        method: Method,
    ) {
        if let (Some(InfillStage { stage, .. }), Some(buffers)) = (&stages.infill, &self.infill) {
            stage.record_fill(encoder, buffers, method);
        }
    }

    /// Where the number of filled pixels is after a fill.
    pub(crate) fn filled(&self) -> Option<(&wgpu::Buffer, u64, u64)> {
        self.infill.as_ref().map(InfillBuffers::filled)
    }

    /// Records one round; `guided`: with requests up to where the coarse field is crossed.
    pub(crate) fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stages: &Stages,
        guided: bool,
    ) {
        let guide = stages.infill.as_ref().and_then(|infill| infill.guide.as_ref());
        let guide = guide.zip(self.guide.as_ref()).filter(|_| guided);
        self.rounds.record_round(encoder, &stages.rays, &self.rays, &mut |encoder| {
            if let Some((guide, binds)) = guide {
                guide.record(encoder, binds, &self.rays);
            }
            self.samples.record_service(encoder, &stages.samples);
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

    /// What is read back after a pass: parts (buffer, byte offset, bytes).
    pub(crate) fn counters(&self) -> Vec<(&wgpu::Buffer, u64, u64)> {
        let (offset, bytes) = wavefront::Counters::BYTES;
        let mut parts = vec![(self.rays.rays(), offset, bytes)];
        if let Some(counters) = self.samples.counters() {
            parts.extend(counters);
            parts.extend(self.rounds.statistics());
        }
        parts
    }
}
