//! The stage: pipelines, memory, recordings.

use gpu_primitives::kernel::{Kernel, KernelSource};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::profile::begin_pass;
use gpu_primitives::upload::UploadRing;
use gpu_primitives::wgpu;
use macrocell::RangeBuffers;
use wavefront::{FrameParams, FrameView, OutputTextures, RayBuffers};

use crate::Error;
use crate::kernels::{self, InfillParams, ScatterParams};
use crate::options::Look;
use crate::plan::{ARGS_BYTES, GATE_BYTES, InfillPlan};
use crate::weights::{PackedWeights, Weights};

/// Rays of one workgroup of the scatter.
const RAYS_PER_GROUP: u64 = 64;

/// Which filler makes the colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The candidates in fixed shares.
    Classical,
    /// In the shares that the network gives them.
    Network,
}

/// The kernels. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct Infill {
    plan: InfillPlan,
    scatter: Option<Kernel>,
    gate: Kernel,
    mark: Kernel,
    tiles: Kernel,
    tile_args: Kernel,
    push: Option<Kernel>,
    calibrate: Option<Kernel>,
    classical: Kernel,
    network: Option<NetworkKernels>,
}

#[derive(Debug)]
struct NetworkKernels {
    guess: Kernel,
    encode: Kernel,
    pairs: [Kernel; 2],
    fill: Kernel,
}

/// A picture's scratch memory with everything bound.
#[derive(Debug)]
pub struct InfillBuffers {
    plan: InfillPlan,
    tiles: Buffer,
    args: Buffer,
    gate_args: Buffer,
    params: Buffer,
    history: Option<History>,
    gate: wgpu::BindGroup,
    mark: wgpu::BindGroup,
    tile_lists: wgpu::BindGroup,
    tile_args: wgpu::BindGroup,
    push: Option<wgpu::BindGroup>,
    calibrate: Option<wgpu::BindGroup>,
    classical: wgpu::BindGroup,
    network: Option<NetworkBinds>,
    _scratch: Vec<Buffer>,
}

/// The previous frame's hits in this frame's picture.
#[derive(Debug)]
struct History {
    keys: Buffer,
    frame: Buffer,
    scatter_params: Buffer,
    scatter: wgpu::BindGroup,
}

#[derive(Debug)]
struct NetworkBinds {
    guess: wgpu::BindGroup,
    encode: wgpu::BindGroup,
    pairs: [wgpu::BindGroup; 2],
    fill: wgpu::BindGroup,
}

/// What a picture's in-fill reads and writes.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The picture's rays.
    pub rays: &'a RayBuffers,
    /// The volume's value ranges.
    pub ranges: &'a RangeBuffers,
    /// The pictures, with depth and normals.
    pub textures: &'a OutputTextures,
}

impl Infill {
    /// Makes the pipelines for scenes with such a plan.
    pub fn new(device: &wgpu::Device, plan: &InfillPlan) -> Self {
        let sources = plan.sources();
        let make = |source: KernelSource| source.kernel(device);
        Self {
            plan: plan.clone(),
            scatter: sources.history.then(|| make(kernels::scatter())),
            gate: make(kernels::gate()),
            mark: make(kernels::mark()),
            tiles: make(kernels::tiles()),
            tile_args: make(kernels::tile_args()),
            push: sources.neighbours.then(|| make(kernels::push())),
            calibrate: sources.coarse_field.then(|| make(kernels::calibrate(plan))),
            classical: make(kernels::fill(plan, false)),
            network: plan.network().then(|| NetworkKernels {
                guess: make(kernels::guess(plan)),
                encode: make(kernels::encode(plan)),
                pairs: kernels::pairs().map(make),
                fill: make(kernels::fill(plan, true)),
            }),
        }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(plan: &InfillPlan) -> Vec<KernelSource> {
        let sources = plan.sources();
        let mut all =
            vec![kernels::gate(), kernels::mark(), kernels::tiles(), kernels::tile_args()];
        all.extend(sources.history.then(kernels::scatter));
        all.extend(sources.neighbours.then(kernels::push));
        all.extend(sources.coarse_field.then(|| kernels::calibrate(plan)));
        all.push(kernels::fill(plan, false));
        if plan.network() {
            all.extend([kernels::guess(plan), kernels::encode(plan)]);
            all.extend(kernels::pairs());
            all.push(kernels::fill(plan, true));
        }
        all
    }

    /// Records the start of a frame, before its rays start: where the hits of the previous frame, whose rays and
    /// pictures are still there, fall in the picture of the next one. `follows`: there are such hits, of the same
    /// volume and isovalue.
    pub fn record_start(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        buffers: &InfillBuffers,
        (view, params): (&FrameView, &FrameParams),
        follows: bool,
        look: Look,
    ) {
        let own = buffers.plan.params(look);
        upload.write(device, encoder, &buffers.params, 0, bytemuck::bytes_of(&own));
        let (Some(history), Some(kernel)) = (&buffers.history, &self.scatter) else {
            return;
        };
        encoder.clear_buffer(&history.keys, 0, None);
        if !follows {
            return;
        }
        let [column, row, w, depth] = view.pixel_from_index();
        let scatter = ScatterParams { column, row, w, depth };
        upload.write(device, encoder, &history.frame, 0, bytemuck::bytes_of(params));
        upload.write(device, encoder, &history.scatter_params, 0, bytemuck::bytes_of(&scatter));
        let numbers = wavefront::RayOrder::new(buffers.plan.size()).numbers();
        let mut pass = begin_pass(encoder, "infill.scatter");
        kernel.dispatch(&mut pass, &history.scatter, numbers.div_ceil(RAYS_PER_GROUP));
    }

    /// Records filling the holes of the picture as it is, once it is complete enough. Until then and where no ray is
    /// active every dispatch but that of a single invocation is empty.
    pub fn record_fill(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &InfillBuffers,
        method: Method,
    ) {
        encoder.clear_buffer(&buffers.tiles, 0, Some(4 * buffers.plan.tile_header_words()));
        encoder.clear_buffer(&buffers.args, 0, None);
        {
            let mut pass = begin_pass(encoder, "infill.tiles");
            self.gate.dispatch(&mut pass, &buffers.gate, 1);
            let args = &buffers.gate_args;
            self.mark.dispatch_indirect(&mut pass, &buffers.mark, args, 0);
            self.tiles.dispatch_indirect(&mut pass, &buffers.tile_lists, args, 0);
            self.tile_args.dispatch_indirect(&mut pass, &buffers.tile_args, args, 0);
        }
        let over = |pass: &mut wgpu::ComputePass<'_>, kernel: &Kernel, bind, list: u32| {
            kernel.dispatch_indirect(pass, bind, &buffers.args, 16 * u64::from(list));
        };
        if let (Some(kernel), Some(bind)) = (&self.push, &buffers.push) {
            over(&mut begin_pass(encoder, "infill.push"), kernel, bind, 1);
        }
        if let (Some(kernel), Some(bind)) = (&self.calibrate, &buffers.calibrate) {
            over(&mut begin_pass(encoder, "infill.calibrate"), kernel, bind, 1);
        }
        match (method, &self.network, &buffers.network) {
            (Method::Network, Some(kernels), Some(binds)) => {
                over(&mut begin_pass(encoder, "infill.guess"), &kernels.guess, &binds.guess, 0);
                over(&mut begin_pass(encoder, "infill.encode"), &kernels.encode, &binds.encode, 2);
                let labels = ["infill.halves", "infill.quarters"];
                for ((label, kernel), bind) in labels.iter().zip(&kernels.pairs).zip(&binds.pairs) {
                    over(&mut begin_pass(encoder, label), kernel, bind, 2);
                }
                let mut pass = begin_pass(encoder, "infill.fill");
                over(&mut pass, &kernels.fill, &binds.fill, 0);
            }
            _ => {
                let mut pass = begin_pass(encoder, "infill.fill");
                over(&mut pass, &self.classical, &buffers.classical, 0);
            }
        }
    }
}

impl InfillBuffers {
    /// Allocates and binds what one picture needs.
    ///
    /// # Errors
    /// If the textures lack depth or normals, or the plan has a network and there are no weights.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Infill,
        scene: Scene<'_>,
        weights: Option<&Weights>,
    ) -> Result<Self, Error> {
        Maker { device, ledger, stage, scene }.make(weights)
    }

    /// Where the number of filled pixels is after a fill: buffer, byte offset, bytes.
    pub fn filled(&self) -> (&wgpu::Buffer, u64, u64) {
        (&self.tiles, 12, 4)
    }

    /// The picture's parameters.
    pub(crate) fn params(&self) -> wgpu::BindingResource<'_> {
        self.params.as_entire_binding()
    }

    /// Inverted keys of the previous frame's hits: for tests.
    pub fn history_keys(&self) -> Option<&wgpu::Buffer> {
        self.history.as_ref().map(|history| &*history.keys)
    }
}

/// What is bound of the coarse field, in the order of `shader/lib/coarse_field.wgsl`.
pub(crate) fn coarse_field(ranges: &RangeBuffers) -> Vec<wgpu::BindingResource<'_>> {
    let pages = ranges.code_pages().iter().map(|page| page.as_entire_binding());
    std::iter::once(ranges.coarse_ranges().as_entire_binding()).chain(pages).collect()
}

/// What making the buffers needs all the time.
struct Maker<'a> {
    device: &'a wgpu::Device,
    ledger: &'a Ledger,
    stage: &'a Infill,
    scene: Scene<'a>,
}

/// Memory of the network.
struct Maps {
    candidates: Buffer,
    weights: Buffer,
    halves: Buffer,
    quarters: Buffer,
}

impl Maker<'_> {
    fn buffer(
        &self,
        category: Category,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Buffer {
        let desc =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        self.ledger.buffer(self.device, category, &desc)
    }

    fn storage(&self, label: &str, size: u64) -> Buffer {
        use wgpu::BufferUsages as Usage;
        let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
        self.buffer(Category::Scratch, label, size.max(16), usage)
    }

    fn uniform(&self, label: &str, size: u64) -> Buffer {
        use wgpu::BufferUsages as Usage;
        self.buffer(Category::Params, label, size, Usage::UNIFORM | Usage::COPY_DST)
    }

    fn views(&self) -> Result<[wgpu::BindingResource<'_>; 2], Error> {
        let textures = self.scene.textures;
        let (depth, normal) = (textures.depth_view(), textures.normal_view());
        let (Some(depth), Some(normal)) = (depth, normal) else {
            return Err(Error::MissingOutputs);
        };
        Ok([depth, normal].map(wgpu::BindingResource::TextureView))
    }

    fn make(&self, weights: Option<&Weights>) -> Result<InfillBuffers, Error> {
        let plan = &self.stage.plan;
        let Scene { rays, ranges, textures } = self.scene;
        let [depth, normals] = self.views()?;
        let tiles = self.storage("infill.tiles", plan.tile_bytes());
        let args_usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::INDIRECT
            | wgpu::BufferUsages::COPY_DST;
        let args = self.buffer(Category::Scratch, "infill.args", ARGS_BYTES, args_usage);
        let gate_args = self.buffer(Category::Scratch, "infill.gate", GATE_BYTES, args_usage);
        let params = self.uniform("infill.params", size_of::<InfillParams>() as u64);
        let shared = self.storage("infill.averages", plan.shared_bytes());
        let history = self.history(&params, [depth.clone(), normals.clone()]);
        let keys = history.as_ref().map(|h| h.keys.as_entire_binding());

        let bind = |kernel: &Kernel, label: &str, resources: &[wgpu::BindingResource<'_>]| {
            kernel.bind(self.device, label, resources)
        };
        let own = || [rays.frame().as_entire_binding(), params.as_entire_binding()];
        let mark =
            [&own()[..], &[rays.rays().as_entire_binding(), tiles.as_entire_binding()]].concat();
        let push = [
            &own()[..],
            &[
                rays.rays().as_entire_binding(),
                tiles.as_entire_binding(),
                shared.as_entire_binding(),
            ],
            &[depth.clone(), normals.clone()],
        ]
        .concat();
        let calibrate = [&mark[..], &[depth, normals.clone()], &coarse_field(ranges)].concat();
        let pixel = vec![
            rays.frame().as_entire_binding(),
            rays.shading().as_entire_binding(),
            params.as_entire_binding(),
            rays.rays().as_entire_binding(),
            tiles.as_entire_binding(),
        ];
        let mut guesses = Vec::new();
        guesses.extend(plan.sources().neighbours.then(|| shared.as_entire_binding()));
        if plan.sources().coarse_field {
            guesses.extend(coarse_field(ranges));
        }
        let mut fill = pixel.clone();
        fill.push(wgpu::BindingResource::TextureView(textures.color_view()));
        fill.extend(keys.clone());
        let classical = [&fill[..], &guesses[..]].concat();

        let mut scratch = Vec::new();
        let network = match &self.stage.network {
            None => None,
            Some(kernels) => {
                let maps = self.maps(weights.ok_or(Error::NoWeights)?);
                let candidates = maps.candidates.as_entire_binding();
                let guess = [&pixel[..], std::slice::from_ref(&candidates), &guesses[..]].concat();
                let mut encode = pixel.clone();
                encode.extend([
                    candidates.clone(),
                    maps.weights.as_entire_binding(),
                    shared.as_entire_binding(),
                    normals,
                ]);
                encode.extend(keys);
                let mut last = fill;
                last.push(candidates);
                let inputs = [&maps.weights, &shared, &maps.halves, &maps.quarters];
                last.extend(inputs.map(|buffer| buffer.as_entire_binding()));
                let binds = NetworkBinds {
                    guess: bind(&kernels.guess, "infill.guess", &guess),
                    encode: bind(&kernels.encode, "infill.encode", &encode),
                    pairs: self.pairs(kernels, &maps, [&params, &tiles, &shared]),
                    fill: bind(&kernels.fill, "infill.fill.network", &last),
                };
                scratch.extend([maps.candidates, maps.weights, maps.halves, maps.quarters]);
                Some(binds)
            }
        };
        let stage = self.stage;
        let lists = [params.as_entire_binding(), tiles.as_entire_binding()];
        let counts = [tiles.as_entire_binding(), args.as_entire_binding()];
        let gate = [
            params.as_entire_binding(),
            rays.rays().as_entire_binding(),
            rays.active_args().as_entire_binding(),
            gate_args.as_entire_binding(),
        ];
        let binds = InfillBuffers {
            plan: plan.clone(),
            gate: bind(&stage.gate, "infill.gate", &gate),
            mark: bind(&stage.mark, "infill.mark", &mark),
            tile_lists: bind(&stage.tiles, "infill.tiles", &lists),
            tile_args: bind(&stage.tile_args, "infill.tile_args", &counts),
            push: stage.push.as_ref().map(|kernel| bind(kernel, "infill.push", &push)),
            calibrate: (stage.calibrate.as_ref())
                .map(|kernel| bind(kernel, "infill.calibrate", &calibrate)),
            classical: bind(&stage.classical, "infill.fill.classical", &classical),
            network,
            tiles,
            args,
            gate_args,
            params,
            history,
            _scratch: Vec::new(),
        };
        scratch.push(shared);
        Ok(InfillBuffers { _scratch: scratch, ..binds })
    }

    fn history(
        &self,
        params: &Buffer,
        [depth, normals]: [wgpu::BindingResource<'_>; 2],
    ) -> Option<History> {
        let kernel = self.stage.scatter.as_ref()?;
        let rays = self.scene.rays;
        let keys = self.storage("infill.history", self.stage.plan.history_bytes());
        let frame = self.uniform("infill.history.frame", FrameParams::BYTES);
        let bytes = size_of::<ScatterParams>() as u64;
        let scatter_params = self.uniform("infill.history.scatter", bytes);
        let resources = [
            rays.frame().as_entire_binding(),
            frame.as_entire_binding(),
            rays.shading().as_entire_binding(),
            params.as_entire_binding(),
            scatter_params.as_entire_binding(),
            rays.rays().as_entire_binding(),
            keys.as_entire_binding(),
            depth,
            normals,
        ];
        let scatter = kernel.bind(self.device, "infill.scatter", &resources);
        Some(History { keys, frame, scatter_params, scatter })
    }

    fn maps(&self, weights: &Weights) -> Maps {
        let plan = &self.stage.plan;
        let packed = PackedWeights::new(weights);
        let words: Vec<u16> = packed.vectors.iter().flatten().map(|w| w.to_bits()).collect();
        let (category, usage) = (Category::Params, wgpu::BufferUsages::STORAGE);
        let bytes = bytemuck::cast_slice(&words);
        let ledger = self.ledger;
        Maps {
            candidates: self.storage("infill.candidates", plan.candidate_bytes()),
            weights: ledger.buffer_with(self.device, category, "infill.weights", usage, bytes),
            halves: self.storage("infill.halves", plan.map_bytes(1, 2)),
            quarters: self.storage("infill.quarters", plan.map_bytes(2, 3)),
        }
    }

    fn pairs(
        &self,
        kernels: &NetworkKernels,
        maps: &Maps,
        [params, tiles, encoded]: [&Buffer; 3],
    ) -> [wgpu::BindGroup; 2] {
        let Maps { weights, halves, quarters, .. } = maps;
        let ways = [(encoded, halves), (halves, quarters)];
        std::array::from_fn(|i| {
            let (finer, outputs) = ways[i];
            let buffers = [params, tiles, weights, finer, outputs];
            let resources = buffers.map(|b| b.as_entire_binding());
            kernels.pairs[i].bind(self.device, "infill.pair", &resources)
        })
    }
}
