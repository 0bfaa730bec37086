//! A scene's pipelines, and the memory that they work on.

use gpu_primitives::memory::Ledger;
use infill::{Guide, Weights};
use macrocell::{Activate, Masks, RangeBuffers};
use wavefront::{Draw, DrawBuffers, OutputTextures, Previews, Rays, Strategy};
use zfp_gpu::Payload;

use crate::casting::{Casting, Maker, Preview};
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
    pub(crate) previews: Option<Previews>,
}

/// Pipelines and weights of in-fill.
#[derive(Debug)]
pub(crate) struct InfillStage {
    pub(crate) stage: infill::Infill,
    pub(crate) weights: Option<&'static Weights>,
    pub(crate) guide: Option<Guide>,
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

/// What rendering needs, once the volume is loaded.
#[derive(Debug)]
pub(crate) struct Rendering {
    pub(crate) samples: SampleBuffers,
    full: Casting,
    previews: Vec<Preview>,
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
            previews: (!plan.previews.is_empty())
                .then(|| Previews::new(device, plan.wavefront.outputs(), layout)),
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
        let maker = Maker { device, ledger, stages, volume, samples: samples.samples() };
        let full = maker.casting(&plan.wavefront, plan.infill.as_ref(), textures)?;
        let mut previews: Vec<Preview> = Vec::new();
        for plan in &plan.previews {
            let Some(stage) = &stages.previews else { break };
            previews.push(maker.preview(stage, plan, (&full, textures), previews.last())?);
        }
        Ok(Self { samples, full, previews })
    }

    /// The rays of every `step`-th pixel in both directions: of the picture for 1, else of a preview.
    pub(crate) fn casting(&self, step: u32) -> &Casting {
        self.preview(step).map_or(&self.full, |preview| &preview.casting)
    }

    /// The preview of that many pixels.
    pub(crate) fn preview(&self, step: u32) -> Option<&Preview> {
        self.previews.iter().find(|preview| preview.step == step)
    }

    /// Records one round; `guided`: with requests up to where the coarse field is crossed.
    pub(crate) fn record_round(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        stages: &Stages,
        casting: &Casting,
        guided: bool,
    ) {
        casting.record_round(encoder, stages, guided, &mut |encoder| {
            self.samples.record_service(encoder, &stages.samples);
        });
    }

    /// What is read back after a pass: parts (buffer, byte offset, bytes).
    pub(crate) fn counters<'a>(
        &'a self,
        casting: &'a Casting,
    ) -> Vec<(&'a wgpu::Buffer, u64, u64)> {
        let (offset, bytes) = wavefront::Counters::BYTES;
        let mut parts = vec![(casting.rays().rays(), offset, bytes)];
        if let Some(counters) = self.samples.counters() {
            parts.extend(counters);
            parts.extend(casting.statistics());
        }
        parts
    }
}
