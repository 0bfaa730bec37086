//! Where rays find samples: in a cache that is filled as they ask, or all of them at hand.

use gpu_primitives::kernel::Binding;
use gpu_primitives::memory::Buffer;
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::Module;
use lru_cache_gpu::{CacheBuffers, ResidentBuffers};

use crate::rays::{READ, SLOTS};

const CACHED: Module =
    Module { name: "block_samples", source: include_str!("../shader/lib/block_slots.wgsl") };
const RESIDENT: Module =
    Module { name: "block_samples", source: include_str!("../shader/lib/block_resident.wgsl") };

/// What pipelines must know of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleLayout {
    /// Whether all samples are resident.
    pub resident: bool,
    /// Pages of slots, 1 to 4.
    pub pages: u32,
}

/// The memory that holds samples.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'a> {
    /// Decoded when asked for.
    Cached(&'a CacheBuffers),
    /// All of them.
    Resident(&'a ResidentBuffers),
}

impl SampleLayout {
    /// A cache of `pages` pages of slots.
    pub fn cached(pages: u32) -> Self {
        Self { resident: false, pages }
    }

    /// All samples in `pages` pages of slots.
    pub fn resident(pages: u32) -> Self {
        Self { resident: true, pages }
    }

    /// The WGSL that finds a block's samples.
    pub(crate) fn module(self) -> Module {
        if self.resident { RESIDENT } else { CACHED }
    }

    /// Bindings of a kernel that only reads samples: [`Samples::resources`].
    pub(crate) fn bindings(self) -> Vec<Binding> {
        let mut bindings = if self.resident { Vec::new() } else { vec![READ] };
        bindings.extend(vec![SLOTS; self.pages as usize]);
        bindings
    }
}

impl<'a> Samples<'a> {
    /// Pages of slots.
    pub(crate) fn slots(self) -> &'a [Buffer] {
        match self {
            Samples::Cached(cache) => cache.slots(),
            Samples::Resident(resident) => resident.slots(),
        }
    }

    /// The directory, if there is one, and the slots.
    pub(crate) fn resources(self) -> Vec<wgpu::BindingResource<'a>> {
        let directory = match self {
            Samples::Cached(cache) => Some(cache.directory().as_entire_binding()),
            Samples::Resident(_) => None,
        };
        let slots = self.slots().iter().map(|page| page.as_entire_binding());
        directory.into_iter().chain(slots).collect()
    }
}
