//! A scene's pipelines, and the memory that they work on.

use gpu_primitives::memory::Ledger;
use macrocell::{Activate, Masks};
use wavefront::{
    Draw, DrawBuffers, OutputTextures, RayBuffers, Rays, Rounds, RunAhead, Scene, Strategy,
};

use crate::plan::StrategyPlan;
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
}

/// Everything that depends on the picture's size.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) textures: OutputTextures,
    pub(crate) rays: RayBuffers,
    pub(crate) rounds: Box<dyn Rounds>,
    pub(crate) draw: Option<DrawBuffers>,
}

fn strategy(device: &wgpu::Device, plan: &ScenePlan) -> Box<dyn Strategy> {
    let samples = plan.samples.layout();
    match plan.strategy {
        StrategyPlan::RunAhead => Box::new(RunAhead::new(device, samples)),
        #[cfg(feature = "block-sorted")]
        StrategyPlan::BlockSorted(_, plan) => {
            Box::new(wavefront::BlockSorted::new(device, samples.pages, plan))
        }
    }
}

impl Stages {
    pub(crate) fn new(
        device: &wgpu::Device,
        plan: &ScenePlan,
        options: &RendererOptions,
    ) -> Result<Self, Error> {
        let _span = tracing::info_span!("progressive_iso.pipelines").entered();
        Ok(Self {
            activate: Activate::new(device, plan.macrocell.grid().has_third_level()),
            samples: SampleStages::new(device, &plan.samples)?,
            rays: Rays::new(device, plan.wavefront.outputs(), plan.samples.layout()),
            strategy: strategy(device, plan),
            draw: options.draw_target.map(|target| Draw::new(device, &target)),
        })
    }
}

impl Picture {
    pub(crate) fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stages: &Stages,
        plan: &ScenePlan,
        masks: &Masks,
        samples: &SampleBuffers,
    ) -> Result<Self, Error> {
        let wavefront = &plan.wavefront;
        let textures = OutputTextures::new(device, ledger, wavefront.outputs(), wavefront.size());
        let samples = samples.samples();
        let rays = RayBuffers::new(device, ledger, &stages.rays, wavefront, samples, &textures);
        let scene = Scene { rays: &rays, masks: masks.buffer(), samples };
        let rounds = stages.strategy.bind(device, ledger, scene)?;
        let draw =
            stages.draw.as_ref().and_then(|d| DrawBuffers::new(device, ledger, d, &textures));
        Ok(Self { textures, rays, rounds, draw })
    }
}
