//! What a caller chooses.

use infill::{Sources, Weights};
use wavefront::{BlueNoise, Camera, DrawTarget, Foveation, Outputs, Shading};

use crate::{BudgetMode, Error};

/// How rays find the surface. All strategies make the same picture, bit for bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum TraversalStrategy {
    /// Every ray walks on through everything that is resident and stops only at missing samples.
    #[default]
    RunAhead,
    /// The published algorithm: every round takes each ray to its next n active blocks and
    /// intersects block by block.
    #[cfg(feature = "block-sorted")]
    BlockSorted(wavefront::BlockSortedOptions),
}

/// Whether decoded samples are kept for the whole volume or for what rays see.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Residency {
    /// [`Residency::Full`] where the strategy, the budget and the device's limits allow it, because
    /// it is faster from the first picture on; else [`Residency::Cached`].
    #[default]
    Auto,
    /// Blocks are decoded into a cache when rays need them.
    Cached,
    /// Every block is decoded once, at load. `RunAhead` only.
    Full,
}

/// When filling unfinished pixels is part of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum InfillWhen {
    /// Not where the whole volume is resident and frames are neither foveated nor held to a time: every ray
    /// ends in a frame's first pass there, unless a dispatch would take long, so there is nothing to fill.
    /// [`crate::ScenePlan`] leaves it out, frames may ask for it all the same, and unfinished pixels show
    /// [`Shading::unfinished`].
    #[default]
    WhereItPays,
    /// Always.
    Always,
}

/// What filling unfinished pixels may use, for the life of a renderer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InfillOptions {
    /// Where guesses come from.
    pub sources: Sources,
    /// Weights of the network, for [`Infill::Network`]; [`Weights::trained`] are those that come with the crate.
    pub network: Option<&'static Weights>,
    /// What [`FrameOptions::guided`] needs; nothing where the whole volume is resident.
    pub guided: bool,
    /// Whether a scene that has next to nothing to fill has it, too.
    pub when: InfillWhen,
    /// Whether it works at half the picture's resolution, with about half of the memory and in a fraction of the time where most
    /// pixels are to be filled: of 2x2 pixels one that is finished counts for all, and unfinished ones show colours between
    /// those of such pixels. For large pictures, and where few rays are cast at first. Tiny pictures are filled at theirs.
    pub half_resolution: bool,
}

/// What shows where a pixel is unfinished.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Infill {
    /// [`Shading::unfinished`].
    #[default]
    Off,
    /// A guess: the sources' average.
    Classical,
    /// A guess: the sources in shares that the network gives them.
    Network,
}

/// Finished share of the rays that enter the volume, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Completeness(pub f32);

/// Choices that hold for the life of a renderer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererOptions {
    /// Width and height of the picture in pixels; see [`crate::ProgressiveIsoRenderer::resize`].
    pub size: [u32; 2],
    /// Most bytes of GPU memory: every buffer and texture that the library makes.
    pub budget_bytes: u64,
    /// Pictures beside the colour.
    pub outputs: Outputs,
    /// The caller's targets for [`crate::ProgressiveIsoRenderer::draw`]; adds the depth output.
    pub draw_target: Option<DrawTarget>,
    /// What filling unfinished pixels needs, and adds the outputs depth and normal; `None`: they are never filled.
    pub infill: Option<InfillOptions>,
    /// What [`FrameOptions::foveation`] needs: [`BlueNoise::tiles`]. `None`: every pass works on all rays.
    pub foveation: Option<&'static BlueNoise>,
    /// What [`FrameOptions::target_ms`] needs: how settings follow from it. `None`: frames take as long as they do.
    pub budget: Option<BudgetMode>,
    /// Whether pictures will be read back with [`crate::ProgressiveIsoRenderer::capture`].
    pub capture: bool,
    /// How rays find the surface.
    pub strategy: TraversalStrategy,
    /// What is kept of the decoded volume.
    pub residency: Residency,
    /// Most blocks that are decoded at a time, if the budget holds more; at least 8 where the volume
    /// has as many. [`Residency::Auto`] caches volumes of more blocks, [`Residency::Full`] ignores it.
    pub most_slots: Option<u64>,
}

impl Default for RendererOptions {
    /// 1280x720 pixels in 256 MiB, colour only.
    fn default() -> Self {
        Self {
            size: [1280, 720],
            budget_bytes: 256 << 20,
            outputs: Outputs::default(),
            draw_target: None,
            infill: None,
            foveation: None,
            budget: None,
            capture: false,
            strategy: TraversalStrategy::RunAhead,
            residency: Residency::Auto,
            most_slots: None,
        }
    }
}

impl RendererOptions {
    /// The outputs, with those that other choices need; `infill`: whether pixels are filled.
    pub(crate) fn all_outputs(&self, infill: bool) -> Outputs {
        let depth = self.outputs.depth || self.draw_target.is_some() || infill;
        Outputs { depth, normal: self.outputs.normal || infill, ..self.outputs }
    }

    /// What fills unfinished pixels where the whole volume is resident, or where it is not.
    pub(crate) fn infill_in(&self, resident: bool) -> Option<InfillOptions> {
        self.infill.filter(|infill| {
            infill.when == InfillWhen::Always || !resident || self.blue_noise().is_some()
        })
    }

    /// What sampling masks are made from, if any are.
    pub(crate) fn blue_noise(&self) -> Option<&'static BlueNoise> {
        self.foveation.or_else(|| self.budget.map(|_| BlueNoise::tiles()))
    }

    /// Whether a frame may be filled, guided and foveated as it asks.
    pub(crate) fn check_frame(&self, frame: &FrameOptions) -> Result<(), Error> {
        let infill = self.infill;
        let filled = match frame.infill {
            Infill::Off => true,
            Infill::Classical => infill.is_some(),
            Infill::Network => infill.is_some_and(|infill| infill.network.is_some()),
        };
        let guided = !frame.guided || infill.is_some_and(|infill| infill.guided);
        if !(filled && guided) {
            return Err(Error::InfillNotPlanned);
        }
        match frame.target_ms {
            Some(_) if self.budget.is_none() => return Err(Error::BudgetNotPlanned),
            Some(found) if !(found.is_finite() && found > 0.0) => {
                return Err(Error::Target { found });
            }
            _ => {}
        }
        match frame.foveation {
            Some(_) if self.foveation.is_none() => Err(Error::FoveationNotPlanned),
            Some(foveation) => Ok(foveation.check()?),
            None => Ok(()),
        }
    }
}

/// What one picture shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The camera.
    pub camera: Camera,
    /// Values of the surfaces; exactly one for now.
    pub isovalues: Vec<f32>,
    /// Choices for this frame.
    pub options: FrameOptions,
}

/// Choices that may change with every frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameOptions {
    /// Colours and light.
    pub shading: Shading,
    /// Most rounds of walk, request and decode in a pass, at least 1. Those that come after the frame is
    /// complete cost next to nothing.
    pub rounds_per_pass: u32,
    /// GPU time in milliseconds that a pass should not exceed, so that no driver's watchdog fires and the
    /// caller's own work gets its turn: by what rounds took so far, a pass has as many as fit, but never less
    /// than one. Infinity: always `rounds_per_pass`.
    pub pass_ms: f32,
    /// `RunAhead`: active blocks that a stopped ray requests, the missing one included. It doubles with every
    /// round in which the ray stops again, up to 64, and is larger from the start where the cache holds the last
    /// frame's blocks. 1 means no look-ahead at all. More need fewer passes and decode more.
    pub look_ahead: u32,
    /// What unfinished pixels show after every pass, or, where one was a preview ([`crate::PassReport::step`]), those of that, between
    /// which others are shown; needs [`RendererOptions::infill`]. They stay unfinished in
    /// status, depth and normals, and passes go on replacing them by exact ones.
    pub infill: Infill,
    /// Whether filled pixels show either surface or background; else their colour is a mixture of both. Pixels between those of a
    /// preview then show one of these, not a mixture.
    pub crisp_infill: bool,
    /// Whether rays also request everything on their way to where the coarse field is crossed, beside what they need
    /// and look ahead to: fewer rounds for more decoded blocks. The finished picture is the same. Needs
    /// [`InfillOptions::guided`], and does nothing where the volume is resident.
    pub guided: bool,
    /// Where the eye looks: the first pass casts the rays of a sampling mask alone, which is dense there, and every
    /// pass adds some, until the frame is as finished as any other. Rays that were not cast are unfinished, so
    /// they show and are filled as those are, and count in [`crate::PassReport::active_rays`];
    /// [`crate::PassReport::sampled_rays`] counts the mask's. Needs [`RendererOptions::foveation`].
    ///
    /// ```no_run
    /// use progressive_iso::{
    ///     BlueNoise, Camera, CompressedVolume, Error, Foveation, Frame, FrameOptions, Infill, InfillOptions,
    ///     InfillWeights, ProgressiveIsoRenderer, RendererOptions, wgpu,
    /// };
    ///
    /// fn renderer(
    ///     device: &wgpu::Device,
    ///     queue: &wgpu::Queue,
    ///     volume: CompressedVolume,
    /// ) -> Result<ProgressiveIsoRenderer, Error> {
    ///     let infill =
    ///         InfillOptions { network: Some(InfillWeights::trained_sparse()), ..Default::default() };
    ///     let options = RendererOptions {
    ///         foveation: Some(BlueNoise::tiles()),
    ///         infill: Some(infill),
    ///         ..Default::default()
    ///     };
    ///     ProgressiveIsoRenderer::new(device, queue, volume, options)
    /// }
    ///
    /// /// Whenever camera or gaze move; between, passes go on from what there is.
    /// fn look(renderer: &mut ProgressiveIsoRenderer, camera: Camera, gaze: [f32; 2]) -> Result<(), Error> {
    ///     let options = FrameOptions {
    ///         foveation: Some(Foveation { gaze, ..Default::default() }),
    ///         infill: Infill::Network,
    ///         ..Default::default()
    ///     };
    ///     renderer.set_frame(&Frame { camera, isovalues: vec![0.5], options })
    /// }
    /// ```
    pub foveation: Option<Foveation>,
    /// Milliseconds that the frame's first pass should take. Its time is predicted, and it casts as large a share of the
    /// rays, spread evenly over the picture, as fits; the passes after it cast the others. Where that are few and pixels
    /// are filled after every pass, it is a preview, see [`crate::PassReport::step`]: in-fill works at that resolution, and
    /// pixels between the preview's show colours between its until they are finished. Rays that were not
    /// cast are unfinished, as with `foveation`, so else they are filled as `infill` says. A caller's own `foveation` is left
    /// alone: such frames are not adapted. Needs [`RendererOptions::budget`]; there are no previews with
    /// [`RendererOptions::draw_target`], since `draw` leaves pixels without a depth out.
    pub target_ms: Option<f32>,
    /// Completeness that is enough: from then on reports are [`crate::PassReport::stopped`] and pixels are filled,
    /// not before. Passes that are called for all the same go on. `None`: pixels are filled after every pass.
    pub stop_at: Option<Completeness>,
}

impl Default for FrameOptions {
    fn default() -> Self {
        Self {
            shading: Shading::default(),
            rounds_per_pass: 8,
            pass_ms: 30.0,
            look_ahead: 2,
            infill: Infill::Off,
            crisp_infill: false,
            guided: false,
            foveation: None,
            target_ms: None,
            stop_at: None,
        }
    }
}
