//! A scene's pipelines, and the memory that they work on.

use gpu_primitives::memory::Ledger;
use lru_cache_gpu::{CacheBuffers, Service};
use macrocell::{Activate, Masks};
use wavefront::{
    Draw, DrawBuffers, OutputTextures, RayBuffers, Rays, Rounds, RunAhead, Scene, Strategy,
};
use zfp_gpu::{Decode, DecodeBuffers, Payload};

use crate::plan::StrategyPlan;
use crate::{Error, RendererOptions, ScenePlan, wgpu};

/// Pipelines; nothing here depends on a picture's size.
#[derive(Debug)]
pub(crate) struct Stages {
    pub(crate) activate: Activate,
    pub(crate) service: Service,
    pub(crate) decode: Decode,
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

/// The block cache and what decodes into it.
pub(crate) fn cache(
    device: &wgpu::Device,
    ledger: &Ledger,
    stages: &Stages,
    plan: &ScenePlan,
    payload: &Payload,
) -> Result<(CacheBuffers, DecodeBuffers), Error> {
    let cache =
        CacheBuffers::new(device, ledger, &stages.service, &plan.cache, Decode::JOBS_PER_GROUP);
    let pages: Vec<&wgpu::Buffer> = cache.slots().iter().map(|page| &**page).collect();
    let decode = DecodeBuffers::new(
        device,
        ledger,
        &stages.decode,
        payload,
        cache.jobs(),
        cache.job_count(),
        &pages,
        plan.cache.params().slots_per_page,
    )?;
    Ok((cache, decode))
}

fn strategy(device: &wgpu::Device, plan: &ScenePlan) -> Box<dyn Strategy> {
    let pages = plan.cache.page_count();
    match plan.strategy {
        StrategyPlan::RunAhead => Box::new(RunAhead::new(device, pages)),
        #[cfg(feature = "block-sorted")]
        StrategyPlan::BlockSorted(_, plan) => {
            Box::new(wavefront::BlockSorted::new(device, pages, plan))
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
        let pages = plan.cache.page_count();
        Ok(Self {
            activate: Activate::new(device, plan.macrocell.grid().has_third_level()),
            service: Service::new(device),
            decode: Decode::new(device, pages)?,
            rays: Rays::new(device, plan.wavefront.outputs(), pages),
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
        cache: &CacheBuffers,
    ) -> Self {
        let wavefront = &plan.wavefront;
        let textures = OutputTextures::new(device, ledger, wavefront.outputs(), wavefront.size());
        let rays = RayBuffers::new(device, ledger, &stages.rays, wavefront, cache, &textures);
        let scene = Scene { rays: &rays, masks: masks.buffer(), cache };
        let rounds = stages.strategy.bind(device, ledger, scene);
        let draw =
            stages.draw.as_ref().and_then(|d| DrawBuffers::new(device, ledger, d, &textures));
        Self { textures, rays, rounds, draw }
    }
}
