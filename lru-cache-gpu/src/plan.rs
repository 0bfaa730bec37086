//! Sizes, before anything is allocated.

use bytemuck::{Pod, Zeroable};
use gpu_primitives::compact::Compact;
use gpu_primitives::wgpu;

use crate::Error;

/// Bytes of a slot: 64 samples of 4 bytes.
pub const SLOT_BYTES: u64 = 256;

/// Most pages of slots: a walking kernel binds them all and has 8 storage buffers.
pub const MAX_PAGES: u64 = 3;

/// Blocks whose samples one dual cell can need, hence the fewest slots that guarantee progress.
const LEADER_BLOCKS: u64 = 8;

/// Words of the header of the state, as in `shader/lib/lru_state.wgsl`.
pub(crate) const HEADER_WORDS: u64 = 24;

/// Requests served in one round at most.
const MAX_REQUESTS: u64 = 1 << 17;

/// Slots searched for victims in one round at most.
const MAX_WINDOW: u64 = 2 * MAX_REQUESTS;

/// Bytes of the buffer of indirect arguments and the search window.
pub(crate) const CONTROL_BYTES: u64 = 32;

/// Bytes of the decode dispatch's arguments.
pub(crate) const ARGS_BYTES: u64 = 16;

/// Bytes of the two uniforms.
pub(crate) const PARAMS_BYTES: u64 = 16 + 32;

/// Uniform struct of `shader/lib/lru_state.wgsl`, for walking kernels to embed in theirs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct LruParams {
    /// Slots in all.
    pub slots: u32,
    /// Slots per page.
    pub slots_per_page: u32,
    /// Requests that the list holds.
    pub request_capacity: u32,
    /// Slots that one search for victims looks at, at most.
    pub window_capacity: u32,
}

/// Sizes of everything this crate allocates for one volume.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CachePlan {
    blocks: u64,
    slots: u64,
    slots_per_page: u64,
}

impl CachePlan {
    /// The largest cache for a volume of `blocks` blocks that takes at most `bytes`, and never
    /// more slots than there are blocks.
    ///
    /// # Errors
    /// If the directory exceeds a binding, or `bytes` is less than [`CachePlan::minimum_bytes`].
    pub fn fit(blocks: u64, bytes: u64, limits: &wgpu::Limits) -> Result<Self, Error> {
        Self::fit_beside(blocks, bytes, limits, |_| 0)
    }

    /// Like [`CachePlan::fit`] where others allocate memory of their own, `beside(slots)` bytes, a
    /// function that does not decrease with the number of slots.
    ///
    /// # Errors
    /// As [`CachePlan::fit`]; the minimum includes what the others need.
    pub fn fit_beside(
        blocks: u64,
        bytes: u64,
        limits: &wgpu::Limits,
        beside: impl Fn(u64) -> u64,
    ) -> Result<Self, Error> {
        let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let directory = blocks * 4;
        if directory > binding {
            return Err(Error::DirectoryTooLarge { blocks, needed: directory, available: binding });
        }
        let state_slots = Self::slots_of_a_state(binding);
        let slots_per_page = (binding / SLOT_BYTES).max(1);
        let most = blocks.min(slots_per_page * MAX_PAGES).min(state_slots);
        let with = |slots| Self { blocks, slots, slots_per_page };
        let needed = |slots| with(slots).bytes() + beside(slots);
        let least = Self::least_slots(blocks);
        let minimum = needed(least);
        if minimum > bytes {
            return Err(Error::TooFewBytes { blocks, minimum, available: bytes });
        }
        // needed() does not decrease with slots: the largest fitting count, by bisection.
        let (mut fits, mut beyond) = (least, most.max(least) + 1);
        while beyond - fits > 1 {
            let middle = fits + (beyond - fits) / 2;
            if needed(middle) <= bytes {
                fits = middle;
            } else {
                beyond = middle;
            }
        }
        Ok(with(fits))
    }

    /// Most slots whose state (two words each, and the requests) fits one binding.
    fn slots_of_a_state(binding: u64) -> u64 {
        let words = (binding / 4).saturating_sub(HEADER_WORDS);
        // Each slot adds a request, too, until the list is as long as it gets.
        if words <= 3 * MAX_REQUESTS { words / 3 } else { (words - MAX_REQUESTS) / 2 }
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

    /// Requests that the list holds.
    pub fn request_capacity(&self) -> u64 {
        self.slots.min(MAX_REQUESTS)
    }

    /// Jobs of one round at most: every served request and the leader's blocks.
    pub fn job_capacity(&self) -> u64 {
        self.request_capacity() + LEADER_BLOCKS
    }

    pub(crate) fn window_capacity(&self) -> u64 {
        self.slots.min(MAX_WINDOW)
    }

    /// Uniform for walking kernels.
    pub fn params(&self) -> LruParams {
        LruParams {
            slots: self.slots as u32,
            slots_per_page: self.slots_per_page.min(self.slots) as u32,
            request_capacity: self.request_capacity() as u32,
            window_capacity: self.window_capacity() as u32,
        }
    }

    /// Bytes of the samples.
    pub fn slot_bytes(&self) -> u64 {
        self.slots * SLOT_BYTES
    }

    /// Bytes of the directory and of the slots' owners, stamps and the request list.
    pub fn directory_bytes(&self) -> u64 {
        self.blocks * 4 + self.state_bytes()
    }

    pub(crate) fn block_directory_bytes(&self) -> u64 {
        self.blocks * 4
    }

    pub(crate) fn state_bytes(&self) -> u64 {
        4 * (HEADER_WORDS + 2 * self.slots + self.request_capacity())
    }

    /// Bytes of the search for victims, the job list, arguments and uniforms.
    pub fn scratch_bytes(&self) -> u64 {
        let window = self.window_capacity();
        let compact = Compact::plan(window).bytes();
        3 * 4 * window
            + compact
            + 8 * self.job_capacity()
            + CONTROL_BYTES
            + 2 * ARGS_BYTES
            + PARAMS_BYTES
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
    fn refuses_a_directory_beyond_a_binding() {
        assert!(matches!(
            CachePlan::fit(125_829_120, 1 << 40, &wgpu::Limits::default()),
            Err(Error::DirectoryTooLarge { .. })
        ));
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
