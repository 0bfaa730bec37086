//! Texts and bindings of the kernels.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};
use wavefront::{FrameParams, ShadingParams};

use crate::options::{DOUBT, PRIOR};
use crate::plan::InfillPlan;
use crate::weights::{LAYERS, Layer, PackedWeights};

macro_rules! modules {
    ($($name:ident = $text:literal),* $(,)?) => {
        [$(Module { name: stringify!($name), source: include_str!(concat!("../shader/lib/", $text)) }),*]
    };
}

/// What kernels of this crate import from it.
const LIBRARY: [Module; 15] = modules![
    infill_params = "infill_params.wgsl",
    infill_rays = "infill_rays.wgsl",
    candidate = "candidate.wgsl",
    average = "average.wgsl",
    pull = "pull.wgsl",
    coarse_field = "coarse_field.wgsl",
    march = "march.wgsl",
    guesses = "guesses.wgsl",
    tile_rays = "tile_rays.wgsl",
    holes = "holes.wgsl",
    history = "history.wgsl",
    sources = "sources.wgsl",
    conv = "conv.wgsl",
    decode = "decode.wgsl",
    mix = "mix.wgsl",
];

macro_rules! entry {
    ($name:literal) => {
        Module { name: $name, source: include_str!(concat!("../shader/", $name, ".wgsl")) }
    };
}

const SCATTER: Module = entry!("scatter");
const GATE: Module = entry!("gate");
const GUIDE: Module = entry!("guide");
const MARK: Module = entry!("mark");
const TILES: Module = entry!("tiles");
const TILE_ARGS: Module = entry!("tile_args");
const PUSH: Module = entry!("push");
const CALIBRATE: Module = entry!("calibrate");
const GUESS: Module = entry!("guess");
const ENCODE: Module = entry!("encode");
const PAIR: Module = entry!("pair");
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

/// Two convolutions of a coarser level.
#[derive(Clone, Copy, Debug)]
struct Pair {
    label: &'static str,
    /// The first of the two among [`LAYERS`].
    layer: usize,
    /// 1 for halves, 2 for quarters.
    level: u32,
}

/// The convolutions of the coarser levels on the way down.
const PAIRS_OF_LAYERS: [Pair; 2] = [
    Pair { label: "infill.halves", layer: 1, level: 1 },
    Pair { label: "infill.quarters", layer: 3, level: 2 },
];

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

pub(crate) fn calibrate(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, PARAMS, READ, READ_WRITE, TEXTURE, TEXTURE];
    let constants = coarse_field(&mut bindings, plan);
    source("infill.calibrate", CALIBRATE, bindings, &constants)
}

pub(crate) fn guess(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ, READ_WRITE];
    let mut constants = guesses(&mut bindings, plan);
    constants.push(("NETWORK", Constant::Bool(true)));
    source("infill.guess", GUESS, bindings, &constants)
}

/// Adds the bindings of what `shader/lib/guesses.wgsl` reads; constants for it.
fn guesses(bindings: &mut Vec<Binding>, plan: &InfillPlan) -> Vec<(&'static str, Constant)> {
    let sources = plan.sources();
    let mut constants = Vec::new();
    if sources.neighbours {
        constants.push(("NEIGHBOURS", Constant::Bool(true)));
        constants.push(("AVERAGES_BINDING", next(bindings)));
        bindings.push(AVERAGES);
    }
    if sources.coarse_field {
        constants.push(("COARSE_FIELD", Constant::Bool(true)));
        constants.extend(coarse_field(bindings, plan));
    }
    constants
}

pub(crate) fn guide(plan: &InfillPlan) -> KernelSource {
    let masks = PAIRS;
    let mut bindings = vec![FRAME, PARAMS, READ, masks, READ_WRITE, READ_WRITE];
    let constants = coarse_field(&mut bindings, plan);
    source("infill.guide", GUIDE, bindings, &constants)
}

/// Adds the bindings of the coarse field, as `shader/lib/coarse_field.wgsl` declares them; constants for it.
fn coarse_field(bindings: &mut Vec<Binding>, plan: &InfillPlan) -> [(&'static str, Constant); 3] {
    let first = next(bindings);
    bindings.push(PAIRS);
    bindings.extend(vec![READ; plan.code_pages()]);
    [
        ("COARSE_BINDING", first),
        ("CODE_PAGES_2", Constant::Bool(plan.code_pages() >= 2)),
        ("CODE_PAGES_3", Constant::Bool(plan.code_pages() >= 3)),
    ]
}

/// First vector of a layer's weights.
fn weights(layer: usize) -> Constant {
    Constant::U32(PackedWeights::first()[layer])
}

pub(crate) fn encode(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ, READ, PAIRS, PAIRS_WRITE, TEXTURE];
    let mut constants = vec![("NETWORK", Constant::Bool(true)), ("FIRST_WEIGHTS", weights(0))];
    if plan.sources().history {
        constants.push(("HISTORY", Constant::Bool(true)));
        bindings.push(READ);
    }
    source("infill.encode", ENCODE, bindings, &constants)
}

/// Halves, then quarters.
pub(crate) fn pairs() -> [KernelSource; 2] {
    PAIRS_OF_LAYERS.map(|Pair { label, layer, level }| {
        let groups = |channels: usize| Constant::U32(channels.div_ceil(4) as u32);
        let Layer { inputs, outputs, .. } = LAYERS[layer];
        let constants = [
            ("LEVEL", Constant::U32(level)),
            ("GROUPS_IN", groups(inputs)),
            ("GROUPS_OUT", groups(outputs)),
            ("FIRST_WEIGHTS", weights(layer)),
            ("SECOND_WEIGHTS", weights(layer + 1)),
        ];
        source(label, PAIR, vec![PARAMS, READ, PAIRS, PAIRS, PAIRS_WRITE], &constants)
    })
}

pub(crate) fn fill(plan: &InfillPlan, network: bool) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ_WRITE, COLOR];
    let mut constants = vec![
        ("PRIOR_NEIGHBOURS", Constant::F32(PRIOR[0])),
        ("PRIOR_COARSE", Constant::F32(PRIOR[1])),
        ("PRIOR_COARSE_THIN", Constant::F32(PRIOR[2])),
        ("PRIOR_HISTORY", Constant::F32(PRIOR[3])),
        ("DOUBT", Constant::F32(DOUBT)),
    ];
    if plan.sources().history {
        constants.push(("HISTORY", Constant::Bool(true)));
        constants.push(("HISTORY_BINDING", next(&bindings)));
        bindings.push(READ);
    }
    if network {
        constants.push(("HALF_WEIGHTS", weights(5)));
        constants.push(("LAST_WEIGHTS", weights(6)));
        constants.push(("HEAD_WEIGHTS", weights(7)));
        constants.push(("NETWORK", Constant::Bool(true)));
        constants.push(("NETWORK_BINDING", next(&bindings)));
        bindings.push(READ);
        bindings.extend([PAIRS; 4]);
    } else {
        constants.extend(guesses(&mut bindings, plan));
    }
    let label = if network { "infill.fill.network" } else { "infill.fill.classical" };
    source(label, FILL, bindings, &constants)
}
