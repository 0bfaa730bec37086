//! Texts and bindings of the kernels.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};
use wavefront::{FrameParams, ShadingParams};

use crate::options::PRIOR;
use crate::plan::InfillPlan;
use crate::weights::{LAYERS, Layer, PackedWeights};

macro_rules! modules {
    ($($name:ident = $text:literal),* $(,)?) => {
        [$(Module { name: stringify!($name), source: include_str!(concat!("../shader/lib/", $text)) }),*]
    };
}

/// What kernels of this crate import from it.
const LIBRARY: [Module; 11] = modules![
    infill_params = "infill_params.wgsl",
    infill_rays = "infill_rays.wgsl",
    candidate = "candidate.wgsl",
    average = "average.wgsl",
    pull = "pull.wgsl",
    coarse_field = "coarse_field.wgsl",
    march = "march.wgsl",
    history = "history.wgsl",
    features = "features.wgsl",
    conv = "conv.wgsl",
    mix = "mix.wgsl",
];

macro_rules! entry {
    ($name:literal) => {
        Module { name: $name, source: include_str!(concat!("../shader/", $name, ".wgsl")) }
    };
}

const SCATTER: Module = entry!("scatter");
const GATE: Module = entry!("gate");
const MARK: Module = entry!("mark");
const TILES: Module = entry!("tiles");
const TILE_ARGS: Module = entry!("tile_args");
const PUSH: Module = entry!("push");
const GUESS: Module = entry!("guess");
const ENCODE: Module = entry!("encode");
const LAYER: Module = entry!("layer");
const FILL: Module = entry!("fill");

/// Uniform struct `InfillParams` of `shader/lib/infill_params.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct InfillParams {
    pub(crate) size: [u32; 2],
    pub(crate) tiles: [u32; 2],
    pub(crate) levels: [u32; 4],
    pub(crate) padded: [u32; 2],
    pub(crate) coarse_per_page: u32,
    pub(crate) crisp: u32,
    pub(crate) diagonal: f32,
    pub(crate) none: f32,
    pub(crate) complete: f32,
    pub(crate) pad0: u32,
}

/// Uniform struct `ScatterParams` of `shader/scatter.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct ScatterParams {
    pub(crate) column: [f32; 4],
    pub(crate) row: [f32; 4],
    pub(crate) w: [f32; 4],
    pub(crate) depth: [f32; 4],
}

const FRAME: Binding = Binding::Uniform { bytes: FrameParams::BYTES };
const SHADING: Binding = Binding::Uniform { bytes: size_of::<ShadingParams>() as u64 };
const PARAMS: Binding = Binding::Uniform { bytes: size_of::<InfillParams>() as u64 };
const READ: Binding = Binding::StorageRead { min_bytes: 4 };
const READ_WRITE: Binding = Binding::StorageReadWrite { min_bytes: 4 };
const PAIRS: Binding = Binding::StorageRead { min_bytes: 8 };
const PAIRS_WRITE: Binding = Binding::StorageReadWrite { min_bytes: 8 };
const AVERAGES: Binding = Binding::StorageRead { min_bytes: 16 };
const TEXTURE: Binding =
    Binding::TextureSample { sample: wgpu::TextureSampleType::Float { filterable: false } };
const COLOR: Binding = Binding::TextureWrite { format: wgpu::TextureFormat::Rgba8Unorm };

/// One convolution of the coarser levels.
#[derive(Clone, Copy, Debug)]
struct Stage {
    /// Which of [`LAYERS`].
    layer: usize,
    label: &'static str,
    /// 1 for halves, 2 for quarters.
    level: u32,
    /// Whether it reads averages of the finer level.
    pooled: bool,
    /// Groups of channels that are its own level's, if the others are the coarser one's.
    own_groups: Option<u32>,
    /// List of tiles.
    list: u32,
}

const fn stage(
    layer: usize,
    label: &'static str,
    level: u32,
    pooled: bool,
    own_groups: Option<u32>,
    list: u32,
) -> Stage {
    Stage { layer, label, level, pooled, own_groups, list }
}

/// The convolutions between the first and the last one.
const STAGES: [Stage; 5] = [
    stage(1, "infill.e1a", 1, true, None, 2),
    stage(2, "infill.e1b", 1, false, None, 2),
    stage(3, "infill.e2a", 2, true, None, 2),
    stage(4, "infill.e2b", 2, false, None, 2),
    stage(5, "infill.d1", 1, false, Some(2), 1),
];

/// The list of tiles of every layer of [`layers`].
pub(crate) const LAYER_LISTS: [u32; 5] = [2, 2, 2, 2, 1];

fn source(
    label: &'static str,
    entry: Module,
    bindings: Vec<Binding>,
    constants: &[(&'static str, Constant)],
) -> KernelSource {
    let mut library = wavefront::wgsl::modules();
    library.extend(LIBRARY);
    library.push(indirect::MODULE);
    let wgsl = compose_fixed(entry, &library, constants);
    KernelSource { label, wgsl, entry_point: "main", bindings }
}

/// Binding number of the next binding.
fn next(bindings: &[Binding]) -> Constant {
    Constant::U32(bindings.len() as u32)
}

pub(crate) fn scatter() -> KernelSource {
    let scatter = Binding::Uniform { bytes: size_of::<ScatterParams>() as u64 };
    let bindings = vec![FRAME, FRAME, SHADING, PARAMS, scatter, READ, READ_WRITE, TEXTURE, TEXTURE];
    source("infill.scatter", SCATTER, bindings, &[])
}

pub(crate) fn gate() -> KernelSource {
    source("infill.gate", GATE, vec![PARAMS, READ, READ, READ_WRITE], &[])
}

pub(crate) fn mark() -> KernelSource {
    source("infill.mark", MARK, vec![FRAME, PARAMS, READ, READ_WRITE], &[])
}

pub(crate) fn tiles() -> KernelSource {
    source("infill.tiles", TILES, vec![PARAMS, READ_WRITE], &[])
}

pub(crate) fn tile_args() -> KernelSource {
    source("infill.tile_args", TILE_ARGS, vec![READ, READ_WRITE], &[])
}

pub(crate) fn push() -> KernelSource {
    let averages = Binding::StorageReadWrite { min_bytes: 16 };
    source("infill.push", PUSH, vec![FRAME, PARAMS, READ, READ, averages, TEXTURE, TEXTURE], &[])
}

pub(crate) fn guess(plan: &InfillPlan) -> KernelSource {
    let sources = plan.sources();
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ, READ_WRITE];
    let mut constants = Vec::new();
    if sources.neighbours {
        constants.push(("NEIGHBOURS", Constant::Bool(true)));
        constants.push(("AVERAGES_BINDING", next(&bindings)));
        bindings.push(AVERAGES);
    }
    if sources.coarse_field {
        constants.push(("COARSE_FIELD", Constant::Bool(true)));
        constants.push(("COARSE_BINDING", next(&bindings)));
        constants.push(("CODE_PAGES_2", Constant::Bool(plan.code_pages() >= 2)));
        constants.push(("CODE_PAGES_3", Constant::Bool(plan.code_pages() >= 3)));
        bindings.push(PAIRS);
        bindings.extend(vec![READ; plan.code_pages()]);
    }
    source("infill.guess", GUESS, bindings, &constants)
}

/// Constants of a convolution for `shader/lib/conv.wgsl`.
fn conv_constants(layer: usize, edge: u32) -> Vec<(&'static str, Constant)> {
    let Layer { inputs, outputs, .. } = LAYERS[layer];
    vec![
        ("CONV_EDGE", Constant::U32(edge)),
        ("CONV_IN", Constant::U32(inputs.div_ceil(4) as u32)),
        ("CONV_OUT", Constant::U32(outputs.div_ceil(4) as u32)),
        ("CONV_WEIGHTS", Constant::U32(PackedWeights::first()[layer])),
    ]
}

pub(crate) fn encode(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ, READ, PAIRS, PAIRS_WRITE, TEXTURE];
    let mut constants = conv_constants(0, 16);
    if plan.sources().history {
        constants.push(("HISTORY", Constant::Bool(true)));
        bindings.push(READ);
    }
    source("infill.e0", ENCODE, bindings, &constants)
}

/// The convolutions between the first and the last one.
pub(crate) fn layers() -> [KernelSource; 5] {
    STAGES.map(|stage| {
        let mut bindings = vec![PARAMS, READ, PAIRS, PAIRS, PAIRS_WRITE];
        let mut constants = conv_constants(stage.layer, 16 >> stage.level);
        constants.push(("LEVEL", Constant::U32(stage.level)));
        constants.push(("LIST", Constant::U32(stage.list)));
        constants.push(("POOLED", Constant::Bool(stage.pooled)));
        if let Some(groups) = stage.own_groups {
            constants.push(("JOINED", Constant::Bool(true)));
            constants.push(("OWN_GROUPS", Constant::U32(groups)));
            bindings.push(PAIRS);
        }
        source(stage.label, LAYER, bindings, &constants)
    })
}

pub(crate) fn fill(plan: &InfillPlan, network: bool) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ_WRITE, READ, TEXTURE, COLOR];
    let mut constants = vec![
        ("PRIOR_NEIGHBOURS", Constant::F32(PRIOR[0])),
        ("PRIOR_COARSE", Constant::F32(PRIOR[1])),
        ("PRIOR_COARSE_THIN", Constant::F32(PRIOR[2])),
        ("PRIOR_HISTORY", Constant::F32(PRIOR[3])),
    ];
    if plan.sources().history {
        constants.push(("HISTORY", Constant::Bool(true)));
        constants.push(("HISTORY_BINDING", next(&bindings)));
        bindings.push(READ);
    }
    if network {
        constants.extend(conv_constants(6, 16));
        constants.push(("HEAD_WEIGHTS", Constant::U32(PackedWeights::first()[7])));
        constants.push(("NETWORK", Constant::Bool(true)));
        constants.push(("NETWORK_BINDING", next(&bindings)));
        bindings.extend([PAIRS; 3]);
    }
    let label = if network { "infill.fill.network" } else { "infill.fill.classical" };
    source(label, FILL, bindings, &constants)
}
