//! Texts and bindings of the kernels.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, KernelSource};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};
use wavefront::{FrameParams, ShadingParams};

use crate::options::{DOUBT, PRIOR};
use crate::plan::InfillPlan;
use crate::weights::PackedWeights;

macro_rules! modules {
    ($($name:ident = $text:literal),* $(,)?) => {
        [$(Module { name: stringify!($name), source: include_str!(concat!("../shader/lib/", $text)) }),*]
    };
}

/// What kernels of this crate import from it.
const LIBRARY: [Module; 17] = modules![
    infill_params = "infill_params.wgsl",
    infill_rays = "infill_rays.wgsl",
    candidate = "candidate.wgsl",
    average = "average.wgsl",
    pulled = "pulled.wgsl",
    coarse_field = "coarse_field.wgsl",
    march = "march.wgsl",
    quads = "quads.wgsl",
    listed_tile = "listed_tile.wgsl",
    tile_rays = "tile_rays.wgsl",
    holes = "holes.wgsl",
    history = "history.wgsl",
    sources = "sources.wgsl",
    conv_texel = "conv_texel.wgsl",
    conv = "conv.wgsl",
    head = "head.wgsl",
    mix = "mix.wgsl",
];

macro_rules! entry {
    ($name:literal) => {
        Module { name: $name, source: include_str!(concat!("../shader/", $name, ".wgsl")) }
    };
}

const SCATTER: Module = entry!("scatter");
const REDUCE: Module = entry!("reduce");
const SPREAD: Module = entry!("spread");
const GATE: Module = entry!("gate");
const GUIDE: Module = entry!("guide");
const MARK: Module = entry!("mark");
const TILES: Module = entry!("tiles");
const TILE_ARGS: Module = entry!("tile_args");
const PUSH: Module = entry!("push");
const PULL: Module = entry!("pull");
const CALIBRATE: Module = entry!("calibrate");
const GUESS: Module = entry!("guess");
const ENCODE: Module = entry!("encode");
const SHRINK: Module = entry!("shrink");
const QUARTERS: Module = entry!("quarters");
const DECODE: Module = entry!("decode");
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
const VECTORS: Binding = Binding::StorageRead { min_bytes: 16 };
const VECTORS_WRITE: Binding = Binding::StorageReadWrite { min_bytes: 16 };
const TEXTURE: Binding =
    Binding::TextureSample { sample: wgpu::TextureSampleType::Float { filterable: false } };
const COLOR: Binding = Binding::TextureWrite { format: wgpu::TextureFormat::Rgba8Unorm };

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

pub(crate) fn scatter(halved: bool) -> KernelSource {
    let scatter = Binding::Uniform { bytes: size_of::<ScatterParams>() as u64 };
    let bindings = vec![FRAME, FRAME, SHADING, PARAMS, scatter, READ, READ_WRITE, TEXTURE, TEXTURE];
    let halved = ("HALVED", Constant::Bool(halved));
    source("infill.scatter", SCATTER, bindings, &[halved])
}

/// What makes the reduced picture, and what shows it.
pub(crate) fn reduction() -> [KernelSource; 2] {
    let picture = |format| Binding::TextureWrite { format };
    let mut reduce = vec![FRAME, READ, READ, READ_WRITE, TEXTURE, TEXTURE, TEXTURE];
    reduce.push(COLOR);
    reduce.push(picture(wgpu::TextureFormat::R32Float));
    reduce.push(picture(wgpu::TextureFormat::Rgba16Float));
    [
        source("infill.reduce", REDUCE, reduce, &[]),
        source("infill.spread", SPREAD, vec![FRAME, PARAMS, READ, READ, TEXTURE, COLOR], &[]),
    ]
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

pub(crate) fn push(plan: &InfillPlan) -> KernelSource {
    let bindings = vec![FRAME, PARAMS, READ, READ, VECTORS_WRITE, TEXTURE, TEXTURE];
    source("infill.push", PUSH, bindings, &[("LIST", Constant::U32(plan.averages_list()))])
}

pub(crate) fn pull(plan: &InfillPlan) -> KernelSource {
    let bindings = vec![PARAMS, READ, VECTORS, VECTORS_WRITE];
    source("infill.pull", PULL, bindings, &[("LIST", Constant::U32(plan.averages_list()))])
}

pub(crate) fn calibrate(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, PARAMS, READ, READ_WRITE, TEXTURE, TEXTURE];
    let constants = coarse_field(&mut bindings, plan);
    source("infill.calibrate", CALIBRATE, bindings, &constants)
}

pub(crate) fn guess(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ, PAIRS_WRITE];
    let constants = coarse_field(&mut bindings, plan);
    source("infill.guess", GUESS, bindings, &constants)
}

/// Adds the bindings of what `shader/lib/sources.wgsl` reads; constants for it.
fn sources(bindings: &mut Vec<Binding>, plan: &InfillPlan) -> Vec<(&'static str, Constant)> {
    let sources = plan.sources();
    let mut constants = Vec::new();
    if sources.coarse_field {
        constants.push(("COARSE_FIELD", Constant::Bool(true)));
        constants.push(("GUESSES_BINDING", next(bindings)));
        bindings.push(PAIRS);
    }
    if sources.history {
        constants.push(("HISTORY", Constant::Bool(true)));
        constants.push(("HISTORY_BINDING", next(bindings)));
        bindings.push(READ);
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

/// First pair of a layer's weights.
fn weights(layer: usize) -> Constant {
    Constant::U32(PackedWeights::first()[layer])
}

pub(crate) fn encode(plan: &InfillPlan) -> KernelSource {
    let mut bindings = vec![FRAME, SHADING, PARAMS, READ, READ, VECTORS, VECTORS, PAIRS_WRITE];
    let mut constants = sources(&mut bindings, plan);
    constants.push(("WEIGHTS", weights(0)));
    constants.push(("NEIGHBOURS", Constant::Bool(plan.sources().neighbours)));
    source("infill.encode", ENCODE, bindings, &constants)
}

pub(crate) fn shrink() -> KernelSource {
    let bindings = vec![PARAMS, READ, VECTORS, VECTORS, PAIRS_WRITE];
    source("infill.shrink", SHRINK, bindings, &[("WEIGHTS", weights(1))])
}

pub(crate) fn quarters() -> KernelSource {
    let bindings = vec![PARAMS, READ, VECTORS, VECTORS, PAIRS_WRITE];
    source("infill.quarters", QUARTERS, bindings, &[("WEIGHTS", weights(2))])
}

pub(crate) fn decode() -> KernelSource {
    let bindings = vec![PARAMS, READ, VECTORS, VECTORS, VECTORS, PAIRS_WRITE];
    source("infill.decode", DECODE, bindings, &[("WEIGHTS", weights(3))])
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
    constants.extend(sources(&mut bindings, plan));
    if plan.sources().neighbours {
        constants.push(("NEIGHBOURS", Constant::Bool(true)));
        constants.push(("PULLED_BINDING", next(&bindings)));
        bindings.push(VECTORS);
    }
    if network {
        constants.push(("HEAD_WEIGHTS", weights(4)));
        constants.push(("NETWORK", Constant::Bool(true)));
        constants.push(("NETWORK_BINDING", next(&bindings)));
        bindings.extend([VECTORS; 2]);
    }
    let label = if network { "infill.fill.network" } else { "infill.fill.classical" };
    source(label, FILL, bindings, &constants)
}
