//! Compute pipelines with explicit bind group layouts.

use std::cell::Cell;

use crate::indirect;
use crate::wgsl::Composed;

thread_local! {
    static DISPATCHES: Cell<u64> = const { Cell::new(0) };
}

/// Dispatches that this thread has recorded through [`Kernel`] so far: for reports and for tests
/// that something is left out.
#[must_use]
pub fn dispatches_recorded() -> u64 {
    DISPATCHES.get()
}

fn count_dispatch() {
    DISPATCHES.set(DISPATCHES.get().wrapping_add(1));
}

/// One binding of a compute kernel, in order of `@binding` index in group 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Binding {
    /// `var<uniform>` of this size.
    Uniform {
        /// Size of the WGSL type in bytes.
        bytes: u64,
    },
    /// `var<storage, read>`.
    StorageRead {
        /// Least size of a bound range in bytes; one element for a runtime-sized array.
        min_bytes: u64,
    },
    /// `var<storage, read_write>`.
    StorageReadWrite {
        /// Least size of a bound range in bytes; one element for a runtime-sized array.
        min_bytes: u64,
    },
    /// `texture_storage_2d<format, write>`.
    TextureWrite {
        /// Format of the texture.
        format: wgpu::TextureFormat,
    },
    /// `texture_2d`, read with `textureLoad`.
    TextureSample {
        /// What a load gives.
        sample: wgpu::TextureSampleType,
    },
}

impl Binding {
    /// The same as wgpu's binding type.
    #[must_use]
    pub fn binding_type(&self) -> wgpu::BindingType {
        match *self {
            Binding::Uniform { bytes } => buffer_type(wgpu::BufferBindingType::Uniform, bytes),
            Binding::StorageRead { min_bytes } => {
                buffer_type(wgpu::BufferBindingType::Storage { read_only: true }, min_bytes)
            }
            Binding::StorageReadWrite { min_bytes } => {
                buffer_type(wgpu::BufferBindingType::Storage { read_only: false }, min_bytes)
            }
            Binding::TextureWrite { format } => wgpu::BindingType::StorageTexture {
                access: wgpu::StorageTextureAccess::WriteOnly,
                format,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
            Binding::TextureSample { sample } => wgpu::BindingType::Texture {
                sample_type: sample,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
        }
    }
}

fn buffer_type(ty: wgpu::BufferBindingType, min_bytes: u64) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: wgpu::BufferSize::new(min_bytes),
    }
}

/// Everything that makes a kernel but the device: a stage lists its sources, so that tests can
/// check text and bindings without a GPU.
#[derive(Clone, Debug)]
pub struct KernelSource {
    /// `<crate>.<stage>.<what>`.
    pub label: &'static str,
    /// The composed text.
    pub wgsl: Composed,
    /// Name of the compute entry point.
    pub entry_point: &'static str,
    /// Bindings of group 0 in order.
    pub bindings: Vec<Binding>,
}

impl KernelSource {
    /// Makes the pipeline.
    #[must_use]
    pub fn kernel(&self, device: &wgpu::Device) -> Kernel {
        Kernel::new(device, self.label, &self.wgsl, self.entry_point, &self.bindings)
    }
}

/// A compute pipeline with its explicit bind group layout.
#[derive(Debug)]
pub struct Kernel {
    bindings: Vec<Binding>,
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

impl Kernel {
    /// Makes the pipeline; faults of the text or of the layout are reported through wgpu's error
    /// scopes.
    #[must_use]
    pub fn new(
        device: &wgpu::Device,
        label: &str,
        wgsl: &Composed,
        entry_point: &str,
        bindings: &[Binding],
    ) -> Kernel {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(wgsl.source.as_str().into()),
        });
        let entries: Vec<_> = (0u32..).zip(bindings).map(layout_entry).collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(label),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(entry_point),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Kernel { bindings: bindings.to_vec(), layout, pipeline }
    }

    /// Bindings of group 0 in order.
    #[must_use]
    pub fn bindings(&self) -> &[Binding] {
        &self.bindings
    }

    /// Layout of group 0.
    #[must_use]
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The pipeline itself.
    #[must_use]
    pub fn pipeline(&self) -> &wgpu::ComputePipeline {
        &self.pipeline
    }

    /// A bind group with `resources` in order of the bindings; wgpu reports what does not fit.
    #[must_use]
    pub fn bind(
        &self,
        device: &wgpu::Device,
        label: &str,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = (0u32..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(label),
            layout: &self.layout,
            entries: &entries,
        })
    }

    /// Dispatches `groups` workgroups, folded into two dimensions beyond 65535 by
    /// [`indirect::fold`]; nothing for 0.
    pub fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, bind: &wgpu::BindGroup, groups: u64) {
        let [x, y, z] = indirect::fold(groups);
        count_dispatch();
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bind, &[]);
        pass.dispatch_workgroups(x, y, z);
    }

    /// Dispatches what the three u32 at `offset_bytes` of `args` say.
    pub fn dispatch_indirect(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        bind: &wgpu::BindGroup,
        args: &wgpu::Buffer,
        offset_bytes: u64,
    ) {
        count_dispatch();
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bind, &[]);
        pass.dispatch_workgroups_indirect(args, offset_bytes);
    }
}

fn layout_entry((binding, kind): (u32, &Binding)) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: kind.binding_type(),
        count: None,
    }
}

/// Alignment of a bound offset that every WebGPU device accepts, in bytes.
pub const OFFSET_ALIGNMENT: u64 = 256;

/// A range of `buffer` that starts at a bindable offset and covers `bytes` bytes at
/// `offset_bytes` (a multiple of 4), with the index of the first covered u32 within the range.
///
/// Single numbers inside a larger buffer can thus be bound at any offset.
#[must_use]
pub fn window(
    buffer: &wgpu::Buffer,
    offset_bytes: u64,
    bytes: u64,
) -> (wgpu::BindingResource<'_>, u32) {
    let start = offset_bytes / OFFSET_ALIGNMENT * OFFSET_ALIGNMENT;
    let inside = offset_bytes - start;
    let range = wgpu::BufferBinding {
        buffer,
        offset: start,
        size: wgpu::BufferSize::new(inside.saturating_add(bytes)),
    };
    // Less than OFFSET_ALIGNMENT, so it fits.
    (wgpu::BindingResource::Buffer(range), (inside / 4) as u32)
}
