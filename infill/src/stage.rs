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
use crate::reduced::{ReduceKernels, Reduced};
use crate::weights::{PackedWeights, Weights};

/// Rays of one workgroup of the scatter.
const RAYS_PER_GROUP: u64 = 256;

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
    scatter: Option<Kernel>,
    gate: Kernel,
    mark: Kernel,
    tiles: Kernel,
    tile_args: Kernel,
    push: Option<Kernel>,
    pull: Option<Kernel>,
    calibrate: Option<Kernel>,
    guess: Option<Kernel>,
    classical: Kernel,
    network: Option<NetworkKernels>,
    /// `None` unless it works at half the resolution.
    reduction: Option<ReduceKernels>,
}

#[derive(Debug)]
struct NetworkKernels {
    encode: Kernel,
    shrink: Kernel,
    quarters: Kernel,
    decode: Kernel,
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
    pull: Option<wgpu::BindGroup>,
    calibrate: Option<wgpu::BindGroup>,
    guess: Option<wgpu::BindGroup>,
    classical: wgpu::BindGroup,
    network: Option<NetworkBinds>,
    /// The reduced picture, and what shows it.
    reduced: Option<(Reduced, wgpu::BindGroup)>,
    _scratch: Vec<Buffer>,
}

/// The previous frame's hits in this frame's picture.
#[derive(Debug)]
struct History {
    keys: Buffer,
    frame: Buffer,
    scatter_params: Buffer,
    scatter: wgpu::BindGroup,
    /// Workgroups of the scatter.
    groups: u64,
}

#[derive(Debug)]
struct NetworkBinds {
    encode: wgpu::BindGroup,
    shrink: wgpu::BindGroup,
    quarters: wgpu::BindGroup,
    decode: wgpu::BindGroup,
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
    /// Makes the pipelines for scenes with such a plan, whatever the picture's size.
    pub fn new(device: &wgpu::Device, plan: &InfillPlan) -> Self {
        let sources = plan.sources();
        let make = |source: KernelSource| source.kernel(device);
        Self {
            scatter: sources.history.then(|| make(kernels::scatter(plan.step() > 1))),
            gate: make(kernels::gate()),
            mark: make(kernels::mark()),
            tiles: make(kernels::tiles()),
            tile_args: make(kernels::tile_args()),
            push: plan.averages().then(|| make(kernels::push(plan))),
            pull: sources.neighbours.then(|| make(kernels::pull(plan))),
            calibrate: sources.coarse_field.then(|| make(kernels::calibrate(plan))),
            guess: sources.coarse_field.then(|| make(kernels::guess(plan))),
            classical: make(kernels::fill(plan, false)),
            network: plan.network().then(|| NetworkKernels {
                encode: make(kernels::encode(plan)),
                shrink: make(kernels::shrink()),
                quarters: make(kernels::quarters()),
                decode: make(kernels::decode()),
                fill: make(kernels::fill(plan, true)),
            }),
            reduction: (plan.step() > 1).then(|| ReduceKernels::new(device)),
        }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(plan: &InfillPlan) -> Vec<KernelSource> {
        let sources = plan.sources();
        let mut all =
            vec![kernels::gate(), kernels::mark(), kernels::tiles(), kernels::tile_args()];
        all.extend(sources.history.then(|| kernels::scatter(plan.step() > 1)));
        all.extend(plan.averages().then(|| kernels::push(plan)));
        all.extend(sources.neighbours.then(|| kernels::pull(plan)));
        all.extend(sources.coarse_field.then(|| kernels::calibrate(plan)));
        all.extend(sources.coarse_field.then(|| kernels::guess(plan)));
        all.push(kernels::fill(plan, false));
        if plan.network() {
            all.extend([kernels::encode(plan), kernels::shrink()]);
            all.extend([kernels::quarters(), kernels::decode()]);
            all.push(kernels::fill(plan, true));
        }
        all.extend((plan.step() > 1).then(kernels::reduction).into_iter().flatten());
        all
    }

    /// Records the start of a frame, before its rays start: where the hits of the previous frame, whose rays and
    /// pictures are still there, fall in the picture of the next one. `follows`: there are such hits, of the same
    /// volume and isovalue. View and parameters are those of the rays that in-fill works on: if it is halved, of
    /// [`FrameView::reduced`].
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
        if let (Some(history), Some(kernel)) = (&buffers.history, &self.scatter) {
            encoder.clear_buffer(&history.keys, 0, None);
            if follows {
                Self::record_scatter(device, encoder, upload, (kernel, history), (view, params));
            }
        }
        if let Some((reduced, _)) = &buffers.reduced {
            upload.write(device, encoder, &reduced.frame, 0, bytemuck::bytes_of(params));
        }
    }

    fn record_scatter(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        (kernel, history): (&Kernel, &History),
        (view, params): (&FrameView, &FrameParams),
    ) {
        let [column, row, w, depth] = view.pixel_from_index();
        let scatter = ScatterParams { column, row, w, depth };
        upload.write(device, encoder, &history.frame, 0, bytemuck::bytes_of(params));
        upload.write(device, encoder, &history.scatter_params, 0, bytemuck::bytes_of(&scatter));
        let mut pass = begin_pass(encoder, "infill.scatter");
        kernel.dispatch(&mut pass, &history.scatter, history.groups);
    }

    /// Records filling the holes of the picture as it is, once it is complete enough. Until then and where no ray is
    /// active every dispatch but that of a single invocation is empty.
    pub fn record_fill(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &InfillBuffers,
        method: Method,
    ) {
        if let (Some(kernels), Some((reduced, _))) = (&self.reduction, &buffers.reduced) {
            kernels.record_reduce(encoder, reduced);
        }
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
        // The last: the list of tiles.
        let list = buffers.plan.averages_list();
        let push = ("infill.push", &self.push, &buffers.push, list);
        let pull = ("infill.pull", &self.pull, &buffers.pull, list);
        let calibrate = ("infill.calibrate", &self.calibrate, &buffers.calibrate, 1);
        let guess = ("infill.guess", &self.guess, &buffers.guess, 0);
        for (label, kernel, bind, list) in [push, pull, calibrate, guess] {
            if let (Some(kernel), Some(bind)) = (kernel, bind) {
                over(&mut begin_pass(encoder, label), kernel, bind, list);
            }
        }
        let (fill, bind) = match (method, &self.network, &buffers.network) {
            (Method::Network, Some(kernels), Some(binds)) => {
                let encode = ("infill.encode", &kernels.encode, &binds.encode, 2);
                let shrink = ("infill.shrink", &kernels.shrink, &binds.shrink, 2);
                let quarters = ("infill.quarters", &kernels.quarters, &binds.quarters, 1);
                let decode = ("infill.decode", &kernels.decode, &binds.decode, 1);
                for (label, kernel, bind, list) in [encode, shrink, quarters, decode] {
                    over(&mut begin_pass(encoder, label), kernel, bind, list);
                }
                (&kernels.fill, &binds.fill)
            }
            _ => (&self.classical, &buffers.classical),
        };
        over(&mut begin_pass(encoder, "infill.fill"), fill, bind, 0);
        if let (Some(kernels), Some((reduced, spread))) = (&self.reduction, &buffers.reduced) {
            kernels.record_spread(encoder, reduced, spread);
        }
    }
}

impl InfillBuffers {
    /// Allocates and binds what one picture needs. `plan` differs from the stage's in nothing but the picture's size.
    ///
    /// # Errors
    /// If the textures lack depth or normals, or the plan has a network and there are no weights.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Infill,
        plan: &InfillPlan,
        scene: Scene<'_>,
        weights: Option<&Weights>,
    ) -> Result<Self, Error> {
        let reduced = match &stage.reduction {
            Some(kernels) if plan.step() > 1 => {
                let Scene { rays, textures, .. } = scene;
                Some(Reduced::new(device, ledger, kernels, plan, rays, textures)?)
            }
            _ => None,
        };
        let Scene { rays, .. } = scene;
        let work = match &reduced {
            Some(Reduced { rays: own, frame, textures, .. }) => Work { frame, rays: own, textures },
            None => Work { frame: rays.frame(), rays: rays.rays(), textures: scene.textures },
        };
        let mut buffers = Maker { device, ledger, stage, plan, scene, work }.make(weights)?;
        buffers.reduced = match (reduced, &stage.reduction) {
            (Some(reduced), Some(kernels)) => {
                let own = [&*buffers.params, &*buffers.gate_args];
                let spread = kernels.bind_spread(device, &reduced, own, rays, scene.textures);
                Some((reduced, spread))
            }
            _ => None,
        };
        Ok(buffers)
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
    plan: &'a InfillPlan,
    scene: Scene<'a>,
    work: Work<'a>,
}

/// What in-fill works on: a picture's rays and textures, or those of the reduced one.
#[derive(Clone, Copy)]
struct Work<'a> {
    frame: &'a wgpu::Buffer,
    rays: &'a wgpu::Buffer,
    textures: &'a OutputTextures,
}

/// Memory of the network.
struct Maps {
    weights: Buffer,
    encoded: Buffer,
    shrunk: Buffer,
    quarters: Buffer,
    decoded: Buffer,
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

    fn views(textures: &OutputTextures) -> Result<[wgpu::BindingResource<'_>; 2], Error> {
        let (depth, normal) = (textures.depth_view(), textures.normal_view());
        let (Some(depth), Some(normal)) = (depth, normal) else {
            return Err(Error::MissingOutputs);
        };
        Ok([depth, normal].map(wgpu::BindingResource::TextureView))
    }

    fn make(&self, weights: Option<&Weights>) -> Result<InfillBuffers, Error> {
        let plan = self.plan;
        let (Work { frame, rays, textures }, ranges) = (self.work, self.scene.ranges);
        let (shading, active_args) = (self.scene.rays.shading(), self.scene.rays.active_args());
        let [depth, normals] = Self::views(self.work.textures)?;
        let tiles = self.storage("infill.tiles", plan.tile_bytes());
        let args_usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::INDIRECT
            | wgpu::BufferUsages::COPY_DST;
        let args = self.buffer(Category::Scratch, "infill.args", ARGS_BYTES, args_usage);
        let gate_args = self.buffer(Category::Scratch, "infill.gate", GATE_BYTES, args_usage);
        let params = self.uniform("infill.params", size_of::<InfillParams>() as u64);
        let averages = self.storage("infill.averages", plan.average_bytes());
        let pulled = self.storage("infill.pulled", plan.pulled_bytes());
        let guesses = self.storage("infill.guesses", plan.guess_bytes());
        let history = self.history(&params);
        let bind = |kernel: &Kernel, label: &str, resources: &[wgpu::BindingResource<'_>]| {
            kernel.bind(self.device, label, resources)
        };
        let own = || [frame.as_entire_binding(), params.as_entire_binding()];
        let mark = [&own()[..], &[rays.as_entire_binding(), tiles.as_entire_binding()]].concat();
        let push = [
            &own()[..],
            &[rays.as_entire_binding(), tiles.as_entire_binding(), averages.as_entire_binding()],
            &[depth.clone(), normals.clone()],
        ]
        .concat();
        let calibrate = [&mark[..], &[depth, normals], &coarse_field(ranges)].concat();
        let pixel = [
            frame.as_entire_binding(),
            shading.as_entire_binding(),
            params.as_entire_binding(),
            rays.as_entire_binding(),
            tiles.as_entire_binding(),
        ];
        let guess = [&pixel[..], &[guesses.as_entire_binding()], &coarse_field(ranges)].concat();
        let mut sources = Vec::new();
        sources.extend(plan.sources().coarse_field.then(|| guesses.as_entire_binding()));
        sources.extend(history.as_ref().map(|history| history.keys.as_entire_binding()));
        let color = wgpu::BindingResource::TextureView(textures.color_view());
        let mut fill = [&pixel[..], &[color], &sources[..]].concat();
        fill.extend(plan.sources().neighbours.then(|| pulled.as_entire_binding()));
        let known = if plan.sources().neighbours { &pulled } else { &averages };

        let mut scratch = Vec::new();
        let network = match &self.stage.network {
            None => None,
            Some(kernels) => {
                let maps = self.maps(weights.ok_or(Error::NoWeights)?);
                let network = self.network(kernels, &maps, (&pixel, &sources, &fill), known);
                scratch.extend([maps.weights, maps.encoded, maps.shrunk, maps.quarters]);
                scratch.push(maps.decoded);
                Some(network)
            }
        };
        let stage = self.stage;
        let pull = [
            params.as_entire_binding(),
            tiles.as_entire_binding(),
            averages.as_entire_binding(),
            pulled.as_entire_binding(),
        ];
        let lists = [params.as_entire_binding(), tiles.as_entire_binding()];
        let counts = [tiles.as_entire_binding(), args.as_entire_binding()];
        let gate = [
            params.as_entire_binding(),
            rays.as_entire_binding(),
            active_args.as_entire_binding(),
            gate_args.as_entire_binding(),
        ];
        let binds = InfillBuffers {
            plan: plan.clone(),
            gate: bind(&stage.gate, "infill.gate", &gate),
            mark: bind(&stage.mark, "infill.mark", &mark),
            tile_lists: bind(&stage.tiles, "infill.tiles", &lists),
            tile_args: bind(&stage.tile_args, "infill.tile_args", &counts),
            push: stage.push.as_ref().map(|kernel| bind(kernel, "infill.push", &push)),
            pull: stage.pull.as_ref().map(|kernel| bind(kernel, "infill.pull", &pull)),
            calibrate: (stage.calibrate.as_ref())
                .map(|kernel| bind(kernel, "infill.calibrate", &calibrate)),
            guess: stage.guess.as_ref().map(|kernel| bind(kernel, "infill.guess", &guess)),
            classical: bind(&stage.classical, "infill.fill.classical", &fill),
            network,
            tiles,
            args,
            gate_args,
            params,
            history,
            reduced: None,
            _scratch: Vec::new(),
        };
        scratch.extend([averages, pulled, guesses]);
        Ok(InfillBuffers { _scratch: scratch, ..binds })
    }

    fn history(&self, params: &Buffer) -> Option<History> {
        let kernel = self.stage.scatter.as_ref()?;
        // The picture's, which show one frame alone.
        let Scene { rays, textures, .. } = self.scene;
        let [depth, normals] = Self::views(textures).ok()?;
        let keys = self.storage("infill.history", self.plan.history_bytes());
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
        let groups = rays.plan().numbers().div_ceil(RAYS_PER_GROUP);
        Some(History { keys, frame, scatter_params, scatter, groups })
    }

    fn maps(&self, weights: &Weights) -> Maps {
        let plan = self.plan;
        let packed = PackedWeights::new(weights);
        let words: Vec<u16> = packed.vectors.iter().flatten().map(|w| w.to_bits()).collect();
        let (category, usage) = (Category::Params, wgpu::BufferUsages::STORAGE);
        let bytes = bytemuck::cast_slice(&words);
        let ledger = self.ledger;
        Maps {
            weights: ledger.buffer_with(self.device, category, "infill.weights", usage, bytes),
            encoded: self.storage("infill.encoded", plan.map_bytes()),
            shrunk: self.storage("infill.shrunk", plan.quarter_bytes()),
            quarters: self.storage("infill.quarters", plan.quarter_bytes()),
            decoded: self.storage("infill.decoded", plan.map_bytes()),
        }
    }

    /// `pixel`: what every kernel of pixels reads first. `sources`: what `lib/sources.wgsl` reads. `fill`: what the
    /// classical filler binds. `known`: averages of the quads' finished pixels, spread over the holes if neighbours are in.
    fn network(
        &self,
        kernels: &NetworkKernels,
        maps: &Maps,
        (pixel, sources, fill): (
            &[wgpu::BindingResource<'_>; 5],
            &[wgpu::BindingResource<'_>],
            &[wgpu::BindingResource<'_>],
        ),
        known: &Buffer,
    ) -> NetworkBinds {
        let [_, _, params, _, tiles] = pixel;
        let weights = maps.weights.as_entire_binding();
        let encode = [known, &maps.weights, &maps.encoded].map(|b| b.as_entire_binding());
        let encode = [&pixel[..], &encode, sources].concat();
        let convolution = |kernel: &Kernel, label: &str, maps: &[&Buffer]| {
            let mut resources = vec![params.clone(), tiles.clone(), weights.clone()];
            resources.extend(maps.iter().map(|map| map.as_entire_binding()));
            kernel.bind(self.device, label, &resources)
        };
        let Maps { encoded, shrunk, quarters, decoded, .. } = maps;
        let last = [fill, &[weights.clone(), decoded.as_entire_binding()]].concat();
        NetworkBinds {
            encode: kernels.encode.bind(self.device, "infill.encode", &encode),
            shrink: convolution(&kernels.shrink, "infill.shrink", &[encoded, shrunk]),
            quarters: convolution(&kernels.quarters, "infill.quarters", &[shrunk, quarters]),
            decode: convolution(&kernels.decode, "infill.decode", &[encoded, quarters, decoded]),
            fill: kernels.fill.bind(self.device, "infill.fill.network", &last),
        }
    }
}
