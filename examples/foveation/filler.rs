//! Renderers that fill in different ways and do everything else alike.

use progressive_iso::{
    BlueNoise, Camera, Capture, Foveation, Frame, FrameOptions, Infill, InfillOptions,
    InfillSources, InfillWeights, Outputs, PassReport, ProgressiveIsoRenderer, RendererOptions,
};

use crate::support::shown::published_shading;
use crate::support::{Failure, Gpu};
use crate::view::Volume;

const BUDGET_BYTES: u64 = 1 << 30;

/// A way to fill.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    pub name: &'static str,
    pub infill: Infill,
    pub sources: InfillSources,
    pub weights: Option<fn() -> &'static InfillWeights>,
    /// At half the picture's resolution.
    pub half: bool,
}

const EVERYTHING: InfillSources =
    InfillSources { neighbours: true, coarse_field: true, history: true };
const NEIGHBOURS: InfillSources =
    InfillSources { neighbours: true, coarse_field: false, history: false };

/// Leaves what was not sampled.
pub const OFF: Way = Way {
    name: "unfinished",
    infill: Infill::Off,
    sources: NEIGHBOURS,
    weights: None,
    half: false,
};
/// The sampled pixels around.
pub const PUSH_PULL: Way = Way { name: "push-pull", infill: Infill::Classical, ..OFF };
/// Those and the hits of the frame before.
pub const CLASSICAL_NO_COARSE: Way = Way {
    name: "classical-no-coarse",
    infill: Infill::Classical,
    sources: InfillSources { history: true, ..NEIGHBOURS },
    ..OFF
};
/// The network for sparse masks.
pub const SPARSE: Way = Way {
    name: "network-sparse",
    infill: Infill::Network,
    sources: EVERYTHING,
    weights: Some(InfillWeights::trained_sparse),
    half: false,
};
/// Without rays through the coarse field, which every hole would have to walk from its start.
pub const SPARSE_NO_COARSE: Way = Way {
    name: "network-sparse-no-coarse",
    sources: InfillSources { coarse_field: false, ..EVERYTHING },
    ..SPARSE
};

/// Both at half the picture's resolution.
pub const SPARSE_HALF: Way = Way { name: "network-sparse-half", half: true, ..SPARSE };
pub const SPARSE_NO_COARSE_HALF: Way =
    Way { name: "network-sparse-no-coarse-half", half: true, ..SPARSE_NO_COARSE };

/// The first leaves what was not sampled.
pub const WAYS: [Way; 9] = [
    OFF,
    PUSH_PULL,
    CLASSICAL_NO_COARSE,
    Way { name: "classical", infill: Infill::Classical, weights: None, ..SPARSE },
    Way { name: "network", weights: Some(InfillWeights::trained), ..SPARSE },
    SPARSE,
    SPARSE_NO_COARSE,
    SPARSE_HALF,
    SPARSE_NO_COARSE_HALF,
];

impl Way {
    fn options(self) -> Option<InfillOptions> {
        let network = self.weights.map(|weights| weights());
        let options = InfillOptions {
            sources: self.sources,
            network,
            half_resolution: self.half,
            ..Default::default()
        };
        (self.infill != Infill::Off).then_some(options)
    }
}

/// Options of renderers that fill like this, foveated or not.
pub fn options(size: [u32; 2], way: Way, foveated: bool) -> RendererOptions {
    RendererOptions {
        size,
        budget_bytes: BUDGET_BYTES,
        outputs: Outputs { depth: true, normal: true, status: true },
        infill: way.options(),
        foveation: foveated.then(BlueNoise::tiles),
        capture: true,
        ..Default::default()
    }
}

/// A renderer with its way to fill.
pub struct Filler {
    pub way: Way,
    pub renderer: ProgressiveIsoRenderer,
    isovalue: f32,
}

impl Filler {
    pub fn new(
        gpu: &Gpu,
        volume: &Volume,
        way: Way,
        options: RendererOptions,
    ) -> Result<Self, Failure> {
        let compressed = volume.compressed.clone();
        let renderer = ProgressiveIsoRenderer::new(&gpu.device, &gpu.queue, compressed, options)?;
        Ok(Self { way, renderer, isovalue: volume.isovalue })
    }

    pub fn set_frame(
        &mut self,
        camera: Camera,
        foveation: Option<Foveation>,
    ) -> Result<(), Failure> {
        let options = FrameOptions {
            shading: published_shading(),
            infill: self.way.infill,
            foveation,
            ..Default::default()
        };
        let isovalues = vec![self.isovalue];
        Ok(self.renderer.set_frame(&Frame { camera, isovalues, options })?)
    }

    /// Goes on by one pass.
    pub fn pass(&mut self, gpu: &Gpu) -> Result<PassReport, Failure> {
        let first = |_: &ProgressiveIsoRenderer, report: &PassReport| report.pass == 0;
        Ok(self.renderer.render_to_completion(&gpu.device, &gpu.queue, first)?)
    }

    pub fn finish(&mut self, gpu: &Gpu) -> Result<PassReport, Failure> {
        Ok(self.renderer.render_to_completion(&gpu.device, &gpu.queue, |_, _| true)?)
    }

    pub fn capture(&self, gpu: &Gpu) -> Result<Capture, Failure> {
        Ok(self.renderer.capture_blocking(&gpu.device, &gpu.queue)?)
    }
}
