//! Sizes, before anything is allocated.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::wgpu;

use crate::Error;
use crate::layout::{ENTRY_WORDS, HEADER};

/// Bytes of a slot: 64 samples of 4 bytes.
pub const SLOT_BYTES: u64 = 256;

/// Most pages of slots: a walking kernel binds them all and has 8 storage buffers.
pub const MAX_PAGES: u64 = 4;

/// Blocks whose samples one dual cell can need, hence the fewest slots that guarantee progress.
const LEADER_BLOCKS: u64 = 8;

/// Most slots: indices of the directory's words, at most 4 for each slot, are 32 bits long.
const MAX_SLOTS: u64 = 1 << 28;

/// Requests served in one round at most.
const MAX_REQUESTS: u64 = 1 << 17;

/// Bytes of the indirect arguments of the service's own dispatches.
pub(crate) const CONTROL_BYTES: u64 = 48;

/// Bytes of the decode dispatch's arguments.
pub(crate) const ARGS_BYTES: u64 = 16;

/// Bytes of the two uniforms.
pub(crate) const PARAMS_BYTES: u64 = 16 + 32;

/// Uniform struct of `shader/lib/lru_params.wgsl`, for walking kernels to embed in theirs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct LruParams {
    /// Slots in all.
    pub slots: u32,
    /// Slots per page.
    pub slots_per_page: u32,
    /// Requests served in one round.
    pub request_capacity: u32,
    /// Chains of the directory, a power of two.
    pub heads: u32,
}

/// What a cache may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheRoom {
    /// Most bytes, what others allocate beside the cache included.
    pub bytes: u64,
    /// Most pages of slots, 1 to [`MAX_PAGES`].
    pub most_pages: u64,
    /// Most slots; there are never fewer than [`CachePlan::least_slots`].
    pub most_slots: u64,
}

impl CacheRoom {
    /// Room for as many slots as `bytes` hold.
    #[must_use]
    pub fn new(bytes: u64) -> Self {
        Self { bytes, most_pages: MAX_PAGES, most_slots: u64::MAX }
    }
}

/// Sizes of everything this crate allocates for one volume.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CachePlan {
    blocks: u64,
    slots: u64,
    slots_per_page: u64,
}

/// Slots of a full page: a power of two, so that kernels find a slot's page by a shift.
pub(crate) fn slots_of_a_page(binding: u64) -> u64 {
    1 << (binding / SLOT_BYTES).max(1).ilog2()
}

impl CachePlan {
    /// The largest cache for a volume of `blocks` blocks that takes at most `bytes`, and never
    /// more slots than there are blocks.
    ///
    /// # Errors
    /// If there are too many blocks, or `bytes` is less than [`CachePlan::minimum_bytes`].
    pub fn fit(blocks: u64, bytes: u64, limits: &wgpu::Limits) -> Result<Self, Error> {
        Self::fit_beside(blocks, CacheRoom::new(bytes), limits, |_| 0)
    }

    /// Like [`CachePlan::fit`] in a `room` where others allocate memory of their own,
    /// `beside(slots)` bytes, a function that does not decrease with the number of slots.
    ///
    /// # Errors
    /// As [`CachePlan::fit`]; the minimum includes what the others need.
    pub fn fit_beside(
        blocks: u64,
        room: CacheRoom,
        limits: &wgpu::Limits,
        beside: impl Fn(u64) -> u64,
    ) -> Result<Self, Error> {
        let CacheRoom { bytes, most_pages, most_slots } = room;
        let most_blocks = u64::from(u32::MAX);
        if blocks > most_blocks {
            return Err(Error::TooManyBlocks { blocks, most: most_blocks });
        }
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let slots_per_page = slots_of_a_page(binding);
        let most = [slots_per_page * most_pages.clamp(1, MAX_PAGES), most_slots, MAX_SLOTS]
            .into_iter()
            .fold(blocks, u64::min);
        let with = |slots| Self { blocks, slots, slots_per_page };
        let needed = |slots| with(slots).bytes() + beside(slots);
        let least = Self::least_slots(blocks);
        let minimum = needed(least);
        if minimum > bytes {
            return Err(Error::TooFewBytes { blocks, minimum, available: bytes });
        }
        let fit = |slots| needed(slots) <= bytes && with(slots).largest_table() <= binding;
        // No size decreases with the number of slots: the largest that fits, by bisection.
        let (mut fits, mut beyond) = (least, most.max(least) + 1);
        while beyond - fits > 1 {
            let middle = fits + (beyond - fits) / 2;
            if fit(middle) {
                fits = middle;
            } else {
                beyond = middle;
            }
        }
        Ok(with(fits))
    }

    /// Bytes of the largest buffer but the pages of slots.
    fn largest_table(&self) -> u64 {
        self.table_bytes().max(self.state_bytes()).max(self.job_bytes())
    }

    /// Slots of the smallest cache for a volume of `blocks` blocks.
    pub fn least_slots(blocks: u64) -> u64 {
        blocks.clamp(1, LEADER_BLOCKS)
    }

    /// Bytes of the smallest cache for a volume of `blocks` blocks.
    pub fn minimum_bytes(blocks: u64) -> u64 {
        Self { blocks, slots: Self::least_slots(blocks), slots_per_page: 1 << 19 }.bytes()
    }

    /// Slots in all.
    pub fn slots(&self) -> u64 {
        self.slots
    }

    /// Slots of every page.
    pub fn pages(&self) -> impl Iterator<Item = u64> + use<> {
        let (slots, step) = (self.slots, self.slots_per_page);
        (0..slots.div_ceil(step)).map(move |p| step.min(slots - p * step))
    }

    /// Pages of slots.
    pub fn page_count(&self) -> u32 {
        self.pages().count() as u32
    }

    /// Requests served in one round at most.
    pub fn request_capacity(&self) -> u64 {
        self.slots.min(MAX_REQUESTS)
    }

    /// Jobs of one round at most: every served request and the leader's blocks.
    pub fn job_capacity(&self) -> u64 {
        self.request_capacity() + LEADER_BLOCKS
    }

    /// Chains of the directory: the power of two next to the number of slots, at most 1.34 times
    /// as many.
    fn heads(&self) -> u64 {
        let above = self.slots.next_power_of_two();
        if 100 * above <= 134 * self.slots { above } else { above / 2 }
    }

    /// Places of the request table, and room of the request list.
    pub(crate) fn table_places(&self) -> u64 {
        (2 * self.request_capacity()).next_power_of_two()
    }

    /// Uniform for walking kernels.
    pub fn params(&self) -> LruParams {
        LruParams {
            slots: self.slots as u32,
            slots_per_page: self.slots_per_page.min(self.slots) as u32,
            request_capacity: self.request_capacity() as u32,
            heads: self.heads() as u32,
        }
    }

    /// Bytes of the samples.
    pub fn slot_bytes(&self) -> u64 {
        self.slots * SLOT_BYTES
    }

    /// Bytes of the directory, the slots' stamps, and the requests.
    pub fn directory_bytes(&self) -> u64 {
        self.table_bytes() + self.state_bytes()
    }

    /// Bytes of the hash table from block to slot.
    pub(crate) fn table_bytes(&self) -> u64 {
        4 * (self.heads() + ENTRY_WORDS as u64 * self.slots)
    }

    pub(crate) fn state_bytes(&self) -> u64 {
        4 * (HEADER as u64 + self.slots + 2 * self.table_places())
    }

    pub(crate) fn victim_bytes(&self) -> u64 {
        4 * self.request_capacity()
    }

    pub(crate) fn job_bytes(&self) -> u64 {
        8 * self.job_capacity()
    }

    /// Bytes of the victims, the job list, arguments and uniforms.
    pub fn scratch_bytes(&self) -> u64 {
        self.victim_bytes() + self.job_bytes() + CONTROL_BYTES + ARGS_BYTES + PARAMS_BYTES
    }

    /// Everything together.
    pub fn bytes(&self) -> u64 {
        self.slot_bytes() + self.directory_bytes() + self.scratch_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fits_the_bytes_and_not_less() {
        let limits = wgpu::Limits::default();
        for bytes in [1 << 20, 3_333_333, 100 << 20, 1 << 30] {
            let plan = CachePlan::fit(139_258, bytes, &limits).unwrap();
            assert!(plan.bytes() <= bytes);
            let one_more = CachePlan { slots: plan.slots + 1, ..plan.clone() };
            assert!(one_more.bytes() > bytes || plan.slots == 139_258);
        }
    }

    #[test]
    fn names_the_minimum() {
        let limits = wgpu::Limits::default();
        let minimum = CachePlan::minimum_bytes(1000);
        assert_eq!(CachePlan::fit(1000, minimum, &limits).unwrap().slots(), 8);
        assert_eq!(
            CachePlan::fit(1000, minimum - 1, &limits),
            Err(Error::TooFewBytes { blocks: 1000, minimum, available: minimum - 1 })
        );
        assert_eq!(CachePlan::fit(3, 1 << 20, &limits).unwrap().slots(), 3);
    }

    #[test]
    fn slots_can_be_capped() {
        let limits = wgpu::Limits::default();
        for (most_slots, slots) in [(0, 8), (9, 9), (131_072, 131_072), (u64::MAX, 1_000_000)] {
            let room = CacheRoom { most_slots, ..CacheRoom::new(1 << 30) };
            let plan = CachePlan::fit_beside(1_000_000, room, &limits, |_| 0).unwrap();
            assert_eq!(plan.slots(), slots);
        }
    }

    #[test]
    fn memory_follows_the_slots_and_not_the_blocks() {
        for slots in (1..=1000).chain((0..23).flat_map(|i| [(1 << i) - 1, 1 << i, (3 << i) / 4])) {
            let slots: u64 = slots.max(1);
            let of = |blocks| CachePlan { blocks, slots, slots_per_page: 1 << 19 };
            let plan = of(slots);
            assert!(plan.bytes() <= (256 + 18) * slots + 4_500_000, "{slots} slots");
            assert_eq!(plan.bytes(), of(u64::from(u32::MAX)).bytes());
            let heads = plan.params().heads;
            assert!(heads.is_power_of_two());
            assert!((0.66..=1.34).contains(&(f64::from(heads) / slots as f64)), "{slots} slots");
            let one_more = CachePlan { slots: slots + 1, ..plan.clone() };
            assert!(one_more.bytes() > plan.bytes() && one_more.heads() >= plan.heads());
        }
    }

    #[test]
    fn blocks_are_numbered_in_32_bits() {
        let (limits, most) = (wgpu::Limits::default(), u64::from(u32::MAX));
        assert_eq!(CachePlan::fit(most, 4 << 20, &limits).unwrap().blocks, most);
        assert_eq!(
            CachePlan::fit(most + 1, 4 << 20, &limits),
            Err(Error::TooManyBlocks { blocks: most + 1, most })
        );
    }

    #[test]
    fn pages_hold_all_slots() {
        let limits =
            wgpu::Limits { max_storage_buffer_binding_size: 1 << 24, ..Default::default() };
        let plan = CachePlan::fit(1 << 20, 40 << 20, &limits).unwrap();
        assert!(plan.page_count() > 1);
        assert_eq!(plan.pages().sum::<u64>(), plan.slots());
    }
}
