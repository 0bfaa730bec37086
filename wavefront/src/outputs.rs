//! The pictures: textures, shading parameters.

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DMat4, DVec3};
use gpu_primitives::kernel::Binding;
use gpu_primitives::memory::{Category, Ledger, Texture};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{Constant, Module};

pub(crate) const OUTPUT_TEXTURES: Module =
    Module { name: "output_textures", source: include_str!("../shader/lib/output_textures.wgsl") };
pub(crate) const OUTPUTS: Module =
    Module { name: "outputs", source: include_str!("../shader/lib/outputs.wgsl") };
pub(crate) const SHADING: Module =
    Module { name: "shading", source: include_str!("../shader/lib/shading.wgsl") };

/// Depth of pixels without a hit in the depth texture: the largest f32, since shaders have no
/// infinity.
pub const DEPTH_NONE: f32 = f32::MAX;

/// Which pictures are made beside the colour. What is not asked for costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// `R32Float`: distance along the view axis in world units, [`DEPTH_NONE`] without a hit.
    pub depth: bool,
    /// `Rgba16Float`: unit world-space normal towards the viewer, 0 without a hit.
    pub normal: bool,
    /// `R32Uint`: [`PixelStatus`].
    pub status: bool,
}

/// What a pixel of the status texture shows.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelStatus {
    /// No surface along the ray: final.
    Background = 0,
    /// The surface: final.
    Hit = 1,
    /// Not known yet.
    Unfinished = 2,
}

/// One kind of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PictureFormat {
    label: &'static str,
    /// Constant in the shaders that holds its binding number.
    binding: &'static str,
    /// That of a preview's picture that is read.
    read_binding: &'static str,
    format: wgpu::TextureFormat,
}

const COLOR: PictureFormat = PictureFormat {
    label: "wavefront.output.color",
    binding: "COLOR_BINDING",
    read_binding: "PREVIEW_COLOR_BINDING",
    format: wgpu::TextureFormat::Rgba8Unorm,
};
const DEPTH: PictureFormat = PictureFormat {
    label: "wavefront.output.depth",
    binding: "DEPTH_BINDING",
    read_binding: "PREVIEW_DEPTH_BINDING",
    format: wgpu::TextureFormat::R32Float,
};
const NORMAL: PictureFormat = PictureFormat {
    label: "wavefront.output.normal",
    binding: "NORMAL_BINDING",
    read_binding: "PREVIEW_NORMAL_BINDING",
    format: wgpu::TextureFormat::Rgba16Float,
};
const STATUS: PictureFormat = PictureFormat {
    label: "wavefront.output.status",
    binding: "STATUS_BINDING",
    read_binding: "PREVIEW_STATUS_BINDING",
    format: wgpu::TextureFormat::R32Uint,
};

impl PictureFormat {
    fn texture(self, device: &wgpu::Device, ledger: &Ledger, size: [u32; 2]) -> Texture {
        let desc = wgpu::TextureDescriptor {
            label: Some(self.label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        };
        ledger.texture(device, Category::Outputs, &desc)
    }

    /// An unfinished pixel, whose colour is `unfinished`.
    fn unfinished(self, unfinished: [f32; 4]) -> wgpu::Color {
        let [r, g, b, a] = unfinished.map(f64::from);
        let first = |r: f64| wgpu::Color { r, ..wgpu::Color::TRANSPARENT };
        match self {
            COLOR => wgpu::Color { r, g, b, a },
            DEPTH => first(DEPTH_NONE.into()),
            STATUS => first(f64::from(PixelStatus::Unfinished as u32)),
            _ => wgpu::Color::TRANSPARENT,
        }
    }
}

impl Outputs {
    /// The textures, in the order in which kernels bind them.
    fn formats(self) -> impl Iterator<Item = PictureFormat> {
        let all =
            [(true, COLOR), (self.depth, DEPTH), (self.normal, NORMAL), (self.status, STATUS)];
        all.into_iter().filter_map(|(wanted, picture)| wanted.then_some(picture))
    }

    /// Bytes per pixel of all pictures.
    #[must_use]
    pub fn bytes_per_pixel(self) -> u64 {
        self.formats().map(|p| u64::from(p.format.block_copy_size(None).unwrap_or(0))).sum()
    }

    /// Bindings of the textures where they are read, to follow a kernel's buffers.
    pub(crate) fn read_bindings(self) -> Vec<Binding> {
        let sample = |picture| match picture {
            STATUS => wgpu::TextureSampleType::Uint,
            _ => wgpu::TextureSampleType::Float { filterable: false },
        };
        self.formats().map(|p| Binding::TextureSample { sample: sample(p) }).collect()
    }

    /// Their binding numbers from `first` on, under names for `shader/upscale.wgsl`.
    pub(crate) fn read_constants(self, first: u32) -> Vec<(&'static str, Constant)> {
        let names = self.formats().map(|picture| picture.read_binding);
        names.zip(first..).map(|(name, number)| (name, Constant::U32(number))).collect()
    }

    /// Bindings of the textures, to follow a kernel's buffers.
    pub(crate) fn bindings(self) -> Vec<Binding> {
        self.formats().map(|p| Binding::TextureWrite { format: p.format }).collect()
    }

    /// Constants for `shader/lib/outputs.wgsl` and the importing texts, whose first texture has
    /// the binding number `first`.
    pub(crate) fn constants(self, first: u32) -> Vec<(&'static str, Constant)> {
        let mut constants = vec![
            ("OUTPUT_DEPTH", Constant::Bool(self.depth)),
            ("OUTPUT_NORMAL", Constant::Bool(self.normal)),
            ("OUTPUT_STATUS", Constant::Bool(self.status)),
        ];
        for (number, picture) in (first..).zip(self.formats()) {
            constants.push((picture.binding, Constant::U32(number)));
        }
        constants
    }
}

/// The textures of one picture.
#[derive(Debug)]
pub struct OutputTextures {
    outputs: Outputs,
    textures: Vec<Texture>,
    views: Vec<wgpu::TextureView>,
}

impl OutputTextures {
    /// Allocates the textures asked for.
    pub fn new(device: &wgpu::Device, ledger: &Ledger, outputs: Outputs, size: [u32; 2]) -> Self {
        let mut pictures = Self { outputs, textures: Vec::new(), views: Vec::new() };
        pictures.replace(device, ledger, outputs, size);
        pictures
    }

    /// Replaces the textures by others, without contents; the old ones go first.
    pub fn replace(
        &mut self,
        device: &wgpu::Device,
        ledger: &Ledger,
        outputs: Outputs,
        size: [u32; 2],
    ) {
        self.views.clear();
        self.textures.clear();
        self.outputs = outputs;
        let textures = self.outputs.formats().map(|picture| picture.texture(device, ledger, size));
        self.textures.extend(textures);
        let view = |t: &Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
        self.views.extend(self.textures.iter().map(view));
    }

    /// Records making every pixel an unfinished one of the colour `unfinished`.
    pub fn record_unfinished(&self, encoder: &mut wgpu::CommandEncoder, unfinished: [f32; 4]) {
        let attachments: Vec<_> = self
            .outputs
            .formats()
            .zip(&self.views)
            .map(|(picture, view)| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(picture.unfinished(unfinished)),
                        store: wgpu::StoreOp::Store,
                    },
                })
            })
            .collect();
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("wavefront.unfinished"),
            color_attachments: &attachments,
            ..wgpu::RenderPassDescriptor::default()
        });
    }

    /// Which pictures there are.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// All views in binding order.
    pub(crate) fn views(&self) -> &[wgpu::TextureView] {
        &self.views
    }

    fn position(&self, wanted: PictureFormat) -> Option<usize> {
        self.outputs.formats().position(|picture| picture == wanted)
    }

    /// Colour: `Rgba8Unorm`, display-referred (sRGB-encoded) values, alpha 1 on the surface.
    pub fn color(&self) -> &wgpu::Texture {
        &self.textures[0]
    }

    /// View of [`OutputTextures::color`].
    pub fn color_view(&self) -> &wgpu::TextureView {
        &self.views[0]
    }

    /// Depth, if asked for.
    pub fn depth(&self) -> Option<&wgpu::Texture> {
        self.position(DEPTH).map(|i| &*self.textures[i])
    }

    /// View of [`OutputTextures::normal`].
    pub fn normal_view(&self) -> Option<&wgpu::TextureView> {
        self.position(NORMAL).map(|i| &self.views[i])
    }

    /// View of [`OutputTextures::depth`].
    pub fn depth_view(&self) -> Option<&wgpu::TextureView> {
        self.position(DEPTH).map(|i| &self.views[i])
    }

    /// Normals, if asked for.
    pub fn normal(&self) -> Option<&wgpu::Texture> {
        self.position(NORMAL).map(|i| &*self.textures[i])
    }

    /// Pixel status, if asked for.
    pub fn status(&self) -> Option<&wgpu::Texture> {
        self.position(STATUS).map(|i| &*self.textures[i])
    }
}

/// Where the light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// From the viewer.
    Headlight,
    /// From infinitely far along this world-space direction (towards the light; any length but 0).
    Directional([f32; 3]),
}

/// Blinn-Phong shading. Colours are display-referred, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// Colour of the surface.
    pub base_color: [f32; 3],
    /// Share of the base colour that is always there.
    pub ambient: f32,
    /// Share of the base colour in full light.
    pub diffuse: f32,
    /// Strength of the white highlight.
    pub specular: f32,
    /// Exponent of the highlight.
    pub shininess: f32,
    /// The light.
    pub light: Light,
    /// Pixels without a surface; rounded to 8 bits, as the picture holds it, before the surface is blended with it.
    pub background: [f32; 4],
    /// Pixels that are not known yet.
    pub unfinished: [f32; 4],
}

impl Default for Shading {
    fn default() -> Self {
        Self {
            base_color: [0.85, 0.76, 0.68],
            ambient: 0.15,
            diffuse: 0.75,
            specular: 0.2,
            shininess: 30.0,
            light: Light::Headlight,
            background: [1.0; 4],
            unfinished: [1.0; 4],
        }
    }
}

/// Uniform struct `ShadingParams` of `shader/lib/shading.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ShadingParams {
    pub(crate) background: [f32; 4],
    pub(crate) unfinished: [f32; 4],
    pub(crate) base_color: [f32; 3],
    pub(crate) ambient: f32,
    pub(crate) light: [f32; 3],
    pub(crate) headlight: u32,
    pub(crate) diffuse: f32,
    pub(crate) specular: f32,
    pub(crate) shininess: f32,
    pub(crate) start_columns: u32,
    pub(crate) normal_x: [f32; 3],
    pub(crate) pad1: u32,
    pub(crate) normal_y: [f32; 3],
    pub(crate) pad2: u32,
    pub(crate) normal_z: [f32; 3],
    pub(crate) pad3: u32,
    pub(crate) world_x: [f32; 3],
    pub(crate) pad4: u32,
    pub(crate) world_y: [f32; 3],
    pub(crate) pad5: u32,
    pub(crate) world_z: [f32; 3],
    pub(crate) pad6: u32,
}

/// Columns scaled so that the largest entry is 1: shaders normalise, extreme spacings do not overflow.
fn columns(m: DMat3) -> [[f32; 3]; 3] {
    let largest = m.to_cols_array().iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    (m / largest).to_cols_array_2d().map(|c| c.map(|v| v as f32))
}

impl ShadingParams {
    /// `world_from_index` as for [`crate::FrameView`], which has checked it.
    pub fn new(shading: &Shading, world_from_index: [[f64; 4]; 4]) -> Self {
        let world = DMat3::from_mat4(DMat4::from_cols_array_2d(&world_from_index));
        let [world_x, world_y, world_z] = columns(world);
        let [normal_x, normal_y, normal_z] = columns(world.inverse().transpose());
        let (light, headlight) = match shading.light {
            Light::Headlight => ([0.0, 0.0, 1.0], 1),
            Light::Directional(d) => {
                let unit = DVec3::from(d.map(f64::from)).try_normalize().unwrap_or(DVec3::Z);
                (unit.as_vec3().to_array(), 0)
            }
        };
        // As the picture holds them, so that it does not matter who writes them.
        let [background, unfinished] = [shading.background, shading.unfinished]
            .map(|color| color.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() / 255.0));
        Self {
            background,
            unfinished,
            // Nothing is to be written over a colour that is right already.
            start_columns: if background == unfinished { 0 } else { u32::MAX },
            base_color: shading.base_color,
            ambient: shading.ambient,
            light,
            headlight,
            diffuse: shading.diffuse,
            specular: shading.specular,
            shininess: shading.shininess,
            normal_x,
            pad1: 0,
            normal_y,
            pad2: 0,
            normal_z,
            pad3: 0,
            world_x,
            pad4: 0,
            world_y,
            pad5: 0,
            world_z,
            pad6: 0,
        }
    }

    /// For frames whose unfinished pixels are all filled before they are shown: until then they look like the background,
    /// which is not to be written then.
    #[must_use]
    pub fn filled(self) -> Self {
        Self { start_columns: 0, ..self }
    }

    /// For frames that start in pictures of any colour.
    pub(crate) fn drawn_over(self) -> Self {
        Self { start_columns: u32::MAX, ..self }
    }

    /// The colour of the picture when a frame starts.
    pub(crate) fn start_color(&self) -> [f32; 4] {
        if self.start_columns == 0 { self.background } else { self.unfinished }
    }
}
