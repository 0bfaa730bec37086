//! The network of the published renderer (Dyken, Usher, Kumar, TVCG 2024), for comparison: a recurrent U-Net predicts a
//! colour picture and the kernels that filter it. It sees colours only and makes the whole picture anew.

mod layers;
mod weights;

use bytemuck::{Pod, Zeroable};
use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, Kernel, KernelSource, OFFSET_ALIGNMENT};
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Constant, Module, compose_fixed};

use crate::Error;
use layers::{Filters, Kind, Map, Reads, Step, steps};
use weights::PackedWeights;

pub use layers::CHANNELS;
pub use weights::PublishedWeights;

const LAYER: Module =
    Module { name: "published_layer", source: include_str!("../shader/lib/published_layer.wgsl") };
const CONVOLUTION: Module = Module {
    name: "published_convolution",
    source: include_str!("../shader/published_convolution.wgsl"),
};
const FILTER: Module =
    Module { name: "published_filter", source: include_str!("../shader/published_filter.wgsl") };

/// Width and height of the maps of full resolution are multiples of this.
const ALIGNMENT: u32 = 8;
/// Width and height of what a workgroup makes.
const TILE: u32 = 8;
/// Channels of an element of a map, and its bytes.
const GROUP: usize = 4;
const GROUP_BYTES: u64 = 16;

/// How the network is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PublishedOptions {
    /// Finished pixels keep their colour. The published renderer replaces them by the network's.
    pub paste_finished: bool,
}

/// Uniform `PublishedLayer` of `shader/lib/published_layer.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct LayerParams {
    size: [u32; 2],
    picture: [u32; 2],
    tiles_x: u32,
    tiles: u32,
    inputs: u32,
    outputs: u32,
    weights: u32,
    rgb_weights: u32,
    skip_inputs: u32,
    low_inputs: u32,
}

const PARAMS_BYTES: u64 = size_of::<LayerParams>() as u64;

/// Sizes, before anything is allocated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PublishedPlan {
    size: [u32; 2],
}

impl PublishedPlan {
    /// Plans for pictures of `size` pixels.
    ///
    /// # Errors
    /// If a picture has no pixel, or a map of full resolution exceeds one binding.
    pub fn new(size: [u32; 2], limits: &wgpu::Limits) -> Result<Self, Error> {
        let available = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let plan = Self { size };
        let needed = plan.map_bytes(Map::Skip(0));
        if size.contains(&0) || needed > available {
            return Err(Error::PictureSize { width: size[0], height: size[1], needed, available });
        }
        Ok(plan)
    }

    /// Width and height of the maps of a level.
    fn level_size(&self, level: usize) -> [u32; 2] {
        self.size.map(|s| s.next_multiple_of(ALIGNMENT) >> level)
    }

    fn texels(&self, level: usize) -> u64 {
        self.level_size(level).iter().map(|&s| u64::from(s)).product()
    }

    fn map_bytes(&self, map: Map) -> u64 {
        let groups = |level: usize| (CHANNELS[level] / GROUP) as u64;
        match map {
            Map::Skip(level) | Map::Between(level) | Map::State(level) => {
                self.texels(level) * groups(level) * GROUP_BYTES
            }
            Map::Output => u64::from(self.size[0]) * u64::from(self.size[1]) * GROUP_BYTES,
        }
    }

    /// Bytes of everything that [`PublishedBuffers::new`] allocates.
    pub fn bytes(&self) -> u64 {
        let maps: u64 = maps().map(|map| self.map_bytes(map)).sum();
        let weights = PublishedWeights::from_fn(|_, _| 0.0).packed().values.len() as u64;
        maps + weights * GROUP_BYTES + steps().len() as u64 * OFFSET_ALIGNMENT
    }
}

/// Every map that is allocated.
fn maps() -> impl Iterator<Item = Map> {
    let of = |make: fn(usize) -> Map, levels: usize| (0..levels).map(make);
    of(Map::Skip, 4).chain(of(Map::Between, 4)).chain(of(Map::State, 3)).chain([Map::Output])
}

fn read() -> Binding {
    Binding::StorageRead { min_bytes: GROUP_BYTES }
}

/// Colour and status of the caller's picture.
fn picture_bindings() -> [Binding; 2] {
    [
        Binding::TextureSample { sample: wgpu::TextureSampleType::Float { filterable: false } },
        Binding::TextureSample { sample: wgpu::TextureSampleType::Uint },
    ]
}

/// The kernels; steps that differ in sizes only share one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Variant {
    FromPicture,
    FromSame,
    FromPooled,
    FromJoined,
    FilterColors,
    FilterPooled,
    FilterEnlarged,
    FilterOutput,
}

impl Variant {
    const ALL: [Self; 8] = [
        Self::FromPicture,
        Self::FromSame,
        Self::FromPooled,
        Self::FromJoined,
        Self::FilterColors,
        Self::FilterPooled,
        Self::FilterEnlarged,
        Self::FilterOutput,
    ];

    fn of(step: &Step) -> Self {
        match step.kind {
            Kind::Convolution(Reads::Picture) => Self::FromPicture,
            Kind::Convolution(Reads::Same(_)) => Self::FromSame,
            Kind::Convolution(Reads::Pooled(_)) => Self::FromPooled,
            Kind::Convolution(Reads::Joined { .. }) => Self::FromJoined,
            Kind::Filter(_, Filters::Colors) => Self::FilterColors,
            Kind::Filter(_, Filters::Pooled(_)) => Self::FilterPooled,
            Kind::Filter(..) if step.target == Map::Output => Self::FilterOutput,
            Kind::Filter(..) => Self::FilterEnlarged,
        }
    }

    fn source(self, options: PublishedOptions) -> KernelSource {
        let paste = self == Self::FilterOutput && options.paste_finished;
        let (module, label, flags, reads): (_, _, &[&str], _) = match self {
            Self::FromPicture => (CONVOLUTION, "infill.published.picture", &["PICTURE"], 0),
            Self::FromSame => (CONVOLUTION, "infill.published.same", &[], 1),
            Self::FromPooled => (CONVOLUTION, "infill.published.pooled", &["POOLED"], 1),
            Self::FromJoined => (CONVOLUTION, "infill.published.joined", &["ENLARGED"], 3),
            Self::FilterColors => (FILTER, "infill.published.colors", &["COLORS"], 1),
            Self::FilterPooled => (FILTER, "infill.published.down", &["POOLED"], 2),
            Self::FilterEnlarged => (FILTER, "infill.published.up", &["ENLARGED"], 3),
            Self::FilterOutput => {
                (FILTER, "infill.published.output", &["ENLARGED", "OUTPUT", "PASTE"], 3)
            }
        };
        let constants: Vec<_> =
            flags.iter().map(|&f| (f, Constant::Bool(f != "PASTE" || paste))).collect();
        let target = Binding::StorageReadWrite { min_bytes: GROUP_BYTES };
        let mut bindings = vec![Binding::Uniform { bytes: PARAMS_BYTES }, read(), target];
        bindings.extend((0..reads).map(|_| read()));
        if self == Self::FromPicture || paste {
            bindings.extend(picture_bindings());
        }
        KernelSource {
            label,
            wgsl: compose_fixed(module, &[LAYER, indirect::MODULE], &constants),
            entry_point: "main",
            bindings,
        }
    }
}

/// The stage. Immutable; used with any number of pictures.
#[derive(Debug)]
pub struct Published {
    options: PublishedOptions,
    /// In the order of [`Variant::ALL`].
    kernels: Vec<Kernel>,
}

/// Maps and weights for one picture.
#[derive(Debug)]
pub struct PublishedBuffers {
    plan: PublishedPlan,
    maps: Vec<(Map, Buffer)>,
    binds: Vec<(Variant, wgpu::BindGroup, u64)>,
    params: Buffer,
    weights: Buffer,
}

/// The picture to be filled.
#[derive(Clone, Copy, Debug)]
pub struct PublishedPicture<'a> {
    /// Display-referred colours in a float format; whatever at unfinished pixels.
    pub color: &'a wgpu::TextureView,
    /// `wavefront::PixelStatus` in `R32Uint`.
    pub status: &'a wgpu::TextureView,
}

impl Published {
    /// Makes the pipelines.
    pub fn new(device: &wgpu::Device, options: PublishedOptions) -> Self {
        let kernels = Self::sources(options).iter().map(|source| source.kernel(device)).collect();
        Self { options, kernels }
    }

    /// Texts and bindings of the kernels.
    pub fn sources(options: PublishedOptions) -> Vec<KernelSource> {
        Variant::ALL.iter().map(|variant| variant.source(options)).collect()
    }

    fn kernel(&self, variant: Variant) -> &Kernel {
        &self.kernels[variant as usize]
    }

    /// Records filling the picture; the state becomes that for the next frame.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, buffers: &PublishedBuffers) {
        let mut pass = gpu_primitives::profile::begin_pass(encoder, "infill.published");
        for (variant, bind, groups) in &buffers.binds {
            self.kernel(*variant).dispatch(&mut pass, bind, *groups);
        }
    }
}

impl PublishedBuffers {
    /// Allocates the maps and binds them to a picture of the planned size.
    pub fn new(
        device: &wgpu::Device,
        ledger: &Ledger,
        stage: &Published,
        plan: &PublishedPlan,
        weights: &PublishedWeights,
        picture: PublishedPicture<'_>,
    ) -> Self {
        let packed = weights.packed();
        let weights = ledger.buffer_with(
            device,
            Category::Params,
            "infill.published.weights",
            wgpu::BufferUsages::STORAGE,
            bytemuck::cast_slice(&packed.values),
        );
        let params = ledger.buffer_with(
            device,
            Category::Params,
            "infill.published.params",
            wgpu::BufferUsages::UNIFORM,
            &plan.params(&packed),
        );
        let mut buffers = Self {
            plan: *plan,
            maps: maps().map(|map| (map, plan.buffer(device, ledger, map))).collect(),
            binds: Vec::new(),
            params,
            weights,
        };
        let bind = |(number, step)| buffers.bind(device, stage, picture, number, step);
        buffers.binds = steps().iter().enumerate().map(bind).collect();
        buffers
    }

    fn map(&self, map: Map) -> wgpu::BindingResource<'_> {
        // Every map of a step is in the list, which the tests of `layers` and of the sizes walk through.
        let found = self.maps.iter().find(|(known, _)| *known == map).unwrap_or(&self.maps[0]);
        found.1.as_entire_binding()
    }

    fn bind(
        &self,
        device: &wgpu::Device,
        stage: &Published,
        picture: PublishedPicture<'_>,
        number: usize,
        step: &Step,
    ) -> (Variant, wgpu::BindGroup, u64) {
        let params = wgpu::BufferBinding {
            buffer: &self.params,
            offset: number as u64 * OFFSET_ALIGNMENT,
            size: wgpu::BufferSize::new(PARAMS_BYTES),
        };
        let mut resources = vec![
            wgpu::BindingResource::Buffer(params),
            self.weights.as_entire_binding(),
            self.map(step.target),
        ];
        resources.extend(step.reads().into_iter().map(|map| self.map(map)));
        let variant = Variant::of(step);
        let paste = variant == Variant::FilterOutput && stage.options.paste_finished;
        if variant == Variant::FromPicture || paste {
            resources
                .extend([picture.color, picture.status].map(wgpu::BindingResource::TextureView));
        }
        let groups = u64::from(self.plan.tiles(step.level).1)
            * match step.kind {
                Kind::Convolution(_) => step.outputs.div_ceil(GROUP) as u64,
                Kind::Filter(..) => 1,
            };
        (variant, stage.kernel(variant).bind(device, "infill.published", &resources), groups)
    }

    /// Records forgetting the previous frame. The published renderer does so when the isovalue changes.
    pub fn record_clear_state(&self, encoder: &mut wgpu::CommandEncoder) {
        for (_, buffer) in self.maps.iter().filter(|(map, _)| matches!(map, Map::State(_))) {
            encoder.clear_buffer(buffer, 0, None);
        }
    }

    /// The filled picture: red, green, blue and 1 as four f32 per pixel, row by row.
    pub fn output(&self) -> &wgpu::Buffer {
        // The last of all maps.
        &self.maps[self.maps.len() - 1].1
    }
}

impl PublishedPlan {
    fn buffer(&self, device: &wgpu::Device, ledger: &Ledger, map: Map) -> Buffer {
        let category = if map == Map::Output { Category::Outputs } else { Category::Scratch };
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let desc = wgpu::BufferDescriptor {
            label: Some("infill.published.map"),
            size: self.map_bytes(map),
            usage,
            mapped_at_creation: false,
        };
        ledger.buffer(device, category, &desc)
    }

    /// Tiles in a row, and in all.
    fn tiles(&self, level: usize) -> (u32, u32) {
        let [x, y] = self.level_size(level).map(|s| s.div_ceil(TILE));
        (x, x * y)
    }

    /// The uniforms of all steps.
    fn params(&self, packed: &PackedWeights) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (step, &weights) in steps().iter().zip(&packed.first) {
            let groups = |channels: usize| channels.div_ceil(GROUP) as u32;
            let (tiles_x, tiles) = self.tiles(step.level);
            let skip_inputs = groups(CHANNELS[step.level]);
            let joined = matches!(step.kind, Kind::Convolution(Reads::Joined { .. }));
            let params = LayerParams {
                size: self.level_size(step.level),
                picture: self.size,
                tiles_x,
                tiles,
                inputs: groups(step.inputs),
                outputs: groups(step.outputs),
                weights,
                rgb_weights: packed.rgb,
                skip_inputs,
                low_inputs: if joined { groups(CHANNELS[step.level + 1]) } else { 0 },
            };
            bytes.extend_from_slice(bytemuck::bytes_of(&params));
            bytes.resize(bytes.len().next_multiple_of(OFFSET_ALIGNMENT as usize), 0);
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;
    use gpu_testkit::layout::{check_struct, struct_size};

    #[test]
    fn uniforms_lie_where_the_host_writes_them() {
        let members = members!(LayerParams {
            size,
            picture,
            tiles_x,
            tiles,
            inputs,
            outputs,
            weights,
            rgb_weights,
            skip_inputs,
            low_inputs
        });
        for source in Published::sources(PublishedOptions::default()) {
            let text = source.wgsl.source;
            check_struct(&text, "PublishedLayer", &members).unwrap();
            assert_eq!(u64::from(struct_size(&text, "PublishedLayer").unwrap()), PARAMS_BYTES);
        }
    }

    #[test]
    fn every_step_finds_its_maps() {
        let known: Vec<Map> = maps().collect();
        for step in steps() {
            assert!(step.reads().iter().chain([&step.target]).all(|map| known.contains(map)));
        }
        assert_eq!(known.last(), Some(&Map::Output));
    }

    #[test]
    fn pictures_that_do_not_fit_are_refused() {
        let limits = wgpu::Limits::default();
        assert!(PublishedPlan::new([1920, 1080], &limits).is_ok());
        for size in [[0, 5], [5, 0], [4096, 4096]] {
            assert!(matches!(PublishedPlan::new(size, &limits), Err(Error::PictureSize { .. })));
        }
    }
}
