//! Full residency: a slot for every block, filled at load. No directory, no requests.

use bytemuck::Zeroable;
use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::wgpu;

use crate::Error;
use crate::plan::{LruParams, SLOT_BYTES, slots_of_a_page};

/// Sizes of a volume that is resident as a whole: block b in slot b.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResidentPlan {
    blocks: u64,
    slots_per_page: u64,
}

impl ResidentPlan {
    /// Plans `blocks` blocks in at most `most_pages` pages.
    ///
    /// # Errors
    /// [`Error::TooManyBlocks`] if the pages do not hold them.
    pub fn new(blocks: u64, limits: &wgpu::Limits, most_pages: u64) -> Result<Self, Error> {
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let slots_per_page = slots_of_a_page(binding);
        let most = slots_per_page * most_pages;
        if blocks > most {
            return Err(Error::TooManyBlocks { blocks, most });
        }
        Ok(Self { blocks, slots_per_page: slots_per_page.min(blocks.max(1)) })
    }

    /// Blocks, hence slots.
    pub fn blocks(&self) -> u64 {
        self.blocks
    }

    /// Slots of every page.
    pub fn pages(&self) -> impl Iterator<Item = u64> + use<> {
        let (slots, step) = (self.blocks, self.slots_per_page);
        (0..slots.div_ceil(step)).map(move |p| step.min(slots - p * step))
    }

    /// Pages of slots.
    pub fn page_count(&self) -> u32 {
        self.pages().count() as u32
    }

    /// Slots of every page but the last.
    pub fn slots_per_page(&self) -> u32 {
        self.slots_per_page as u32
    }

    /// Bytes of all slots.
    pub fn bytes(&self) -> u64 {
        self.blocks * SLOT_BYTES
    }

    /// Uniform for walking kernels.
    pub fn params(&self) -> LruParams {
        LruParams {
            slots: self.blocks as u32,
            slots_per_page: self.slots_per_page(),
            ..LruParams::zeroed()
        }
    }
}

/// The memory of a volume that is resident as a whole.
#[derive(Debug)]
pub struct ResidentBuffers {
    plan: ResidentPlan,
    slots: Vec<Buffer>,
}

impl ResidentBuffers {
    /// Allocates the slots, which the caller fills.
    pub fn new(device: &wgpu::Device, ledger: &Ledger, plan: &ResidentPlan) -> Self {
        use wgpu::BufferUsages as Usage;
        let page = |count: u64| {
            let desc = wgpu::BufferDescriptor {
                label: Some("lru.resident.slots"),
                size: count * SLOT_BYTES,
                usage: Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST,
                mapped_at_creation: false,
            };
            ledger.buffer(device, Category::Slots, &desc)
        };
        let slots = plan.pages().map(page).collect();
        Self { plan: plan.clone(), slots }
    }

    /// The plan these buffers were made from.
    pub fn plan(&self) -> &ResidentPlan {
        &self.plan
    }

    /// Pages of slots: sample `x + 4y + 16z` of slot `s` of a page at `64 s + ..`.
    pub fn slots(&self) -> &[Buffer] {
        &self.slots
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_default_pages_hold_512_cubed() {
        let limits = wgpu::Limits::default();
        let plan = ResidentPlan::new(128 * 128 * 128, &limits, 4).unwrap();
        assert_eq!(plan.page_count(), 4);
        assert_eq!(plan.pages().sum::<u64>(), 1 << 21);
        let blocks = (1 << 21) + 1;
        let refused = ResidentPlan::new(blocks, &limits, 4);
        assert_eq!(refused, Err(Error::TooManyBlocks { blocks, most: 1 << 21 }));
    }

    #[test]
    fn small_volumes_have_one_page_of_their_own_size() {
        let plan = ResidentPlan::new(7, &wgpu::Limits::default(), 4).unwrap();
        assert_eq!(plan.pages().collect::<Vec<_>>(), [7]);
        assert_eq!(plan.bytes(), 7 * 256);
    }
}
