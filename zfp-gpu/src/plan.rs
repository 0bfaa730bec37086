//! How a stream is cut into payload pages: pure arithmetic, before anything is allocated.

use crate::{Error, StreamLayout};

/// Most blocks of a volume on the GPU: block indices are `u32`, the last two values are reserved
/// for "none" and "pending" marks of caches.
pub const MAX_BLOCKS: u64 = u32::MAX as u64 - 1;

/// Blocks per page are a multiple of this, so that pages start at whole words of the stream's grid:
/// this many blocks take exactly `bits_per_block` 32-bit words.
const PAGE_GRANULE: u64 = 32;

/// Words behind a page's last block that decoders may read and ignore.
const SLACK_WORDS: u64 = 2;

/// Bytes of the uniform buffer that belongs to every page.
pub(crate) const PAGE_PARAM_BYTES: u64 = 16;

/// A contiguous run of blocks in one buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PayloadPage {
    /// First block of the page, a multiple of 32.
    pub first_block: u32,
    /// Blocks of the page.
    pub blocks: u32,
    /// Index of the page's first 32-bit word in the stream.
    pub first_word: u64,
    /// 32-bit words of the stream that the page holds. A word that two pages' blocks share is in
    /// both pages.
    pub words: u64,
}

impl PayloadPage {
    /// Bytes of the page's buffer, two zeroed words of slack included.
    pub fn bytes(&self) -> u64 {
        (self.words + SLACK_WORDS) * 4
    }
}

/// The pages of a stream and the bytes that they take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PayloadPlan {
    pub(crate) layout: StreamLayout,
    pub(crate) pages: Vec<PayloadPage>,
}

impl PayloadPlan {
    /// Cuts `layout` into pages no larger than one storage binding of one buffer.
    ///
    /// # Errors
    /// [`Error::TooManyBlocks`] beyond [`MAX_BLOCKS`], [`Error::PageTooSmall`] when not even 32
    /// blocks fit into a binding.
    pub fn new(layout: &StreamLayout, limits: &wgpu::Limits) -> Result<Self, Error> {
        let count = layout.block_count();
        if count > MAX_BLOCKS {
            return Err(Error::TooManyBlocks { found: count, most: MAX_BLOCKS });
        }
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let granule_words = u64::from(layout.bits_per_block);
        // One more word where the pages start inside a word.
        let fixed_words = SLACK_WORDS + 1;
        let granules = (limit / 4).saturating_sub(fixed_words) / granule_words;
        if granules == 0 {
            let needed = (granule_words + fixed_words) * 4;
            return Err(Error::PageTooSmall { needed, limit });
        }
        let per_page = (granules * PAGE_GRANULE).min(u64::from(u32::MAX) + 1 - PAGE_GRANULE);
        let starts = (0..count.div_ceil(per_page)).map(|page| page * per_page);
        let pages = starts.map(|first| page(layout, first, per_page.min(count - first))).collect();
        Ok(Self { layout: *layout, pages })
    }

    /// The stream's layout.
    pub fn layout(&self) -> &StreamLayout {
        &self.layout
    }

    /// The pages in stream order; at least one.
    pub fn pages(&self) -> &[PayloadPage] {
        &self.pages
    }

    /// Number of pages, which is the number of dispatches that decode jobs of any block.
    pub fn page_count(&self) -> usize {
        self.pages.len()
    }

    /// Bytes that [`Payload::new`](crate::Payload::new) allocates: the pages and 16 bytes of
    /// parameters for each.
    pub fn bytes(&self) -> u64 {
        self.pages.iter().map(|page| page.bytes() + PAGE_PARAM_BYTES).sum()
    }

    /// Page that holds block `block`, if the volume has it.
    pub fn page_of(&self, block: u32) -> Option<usize> {
        let after = self.pages.partition_point(|page| page.first_block <= block);
        let index = after.checked_sub(1)?;
        let page = self.pages.get(index)?;
        (block - page.first_block < page.blocks).then_some(index)
    }
}

fn page(layout: &StreamLayout, first: u64, blocks: u64) -> PayloadPage {
    let first_word = layout.block_bit(first) / 32;
    let words = layout.block_bit(first + blocks).div_ceil(32) - first_word;
    // Both fit: there are at most MAX_BLOCKS blocks.
    PayloadPage { first_block: first as u32, blocks: blocks as u32, first_word, words }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits(bytes: u64) -> wgpu::Limits {
        wgpu::Limits { max_storage_buffer_binding_size: bytes, ..wgpu::Limits::default() }
    }

    #[test]
    fn a_small_stream_is_one_page_of_its_own_size() {
        let layout = StreamLayout::new([8, 8, 4], 100, 96).unwrap();
        let plan = PayloadPlan::new(&layout, &wgpu::Limits::default()).unwrap();
        let page = PayloadPage { first_block: 0, blocks: 4, first_word: 3, words: 13 };
        assert_eq!(plan.pages(), [page]);
        assert_eq!(plan.bytes(), (13 + 2) * 4 + 16);
    }

    #[test]
    fn a_gibibyte_takes_nine_default_pages() {
        let layout = StreamLayout::new([2048, 2048, 1920], 64, 0).unwrap();
        let plan = PayloadPlan::new(&layout, &wgpu::Limits::default()).unwrap();
        assert_eq!(plan.page_count(), 8);
        assert!(plan.pages().iter().all(|p| p.bytes() <= 128 << 20));
        let layout = StreamLayout::new([2048, 2048, 2048], 64, 0).unwrap();
        let plan = PayloadPlan::new(&layout, &wgpu::Limits::default()).unwrap();
        assert_eq!(plan.page_count(), 9, "the slack leaves no room for exactly 128 MiB of blocks");
    }

    #[test]
    fn the_smaller_of_binding_and_buffer_limits_counts() {
        let layout = StreamLayout::new([256; 3], 128, 0).unwrap();
        let small_buffers = wgpu::Limits { max_buffer_size: 1 << 20, ..wgpu::Limits::default() };
        let plan = PayloadPlan::new(&layout, &small_buffers).unwrap();
        assert_eq!(plan, PayloadPlan::new(&layout, &limits(1 << 20)).unwrap());
        assert_eq!(plan.page_count(), 5);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let layout = StreamLayout::new([4; 3], 2120, 0).unwrap();
        let result = PayloadPlan::new(&layout, &limits(2123 * 4 - 1));
        assert!(matches!(result, Err(Error::PageTooSmall { needed: 8492, limit: 8491 })));
        assert!(PayloadPlan::new(&layout, &limits(2123 * 4)).is_ok());

        let most = StreamLayout::new([1 << 18, 1 << 18, 4], 9, 0).unwrap();
        assert_eq!(most.block_count(), 1 << 32);
        let result = PayloadPlan::new(&most, &wgpu::Limits::default());
        assert!(matches!(result, Err(Error::TooManyBlocks { found, .. }) if found == 1 << 32));
        let fits = StreamLayout::new([4 * 65535, 4 * 65536, 4], 9, 0).unwrap();
        assert!(PayloadPlan::new(&fits, &wgpu::Limits::default()).is_ok());
    }

    #[test]
    fn addresses_beyond_32_bits_are_exact() {
        let layout = StreamLayout::new([4096, 4096, 2048], 1000, 148).unwrap();
        let plan = PayloadPlan::new(&layout, &wgpu::Limits::default()).unwrap();
        let last = plan.pages().last().unwrap();
        assert_eq!(u64::from(last.first_block + last.blocks), layout.block_count());
        let bit = u64::from(last.first_block) * 1000 + 148;
        assert!(bit > 1 << 36);
        assert_eq!((last.first_word, bit % 32), (bit / 32, 148 % 32));
    }

    proptest! {
        #[test]
        fn pages_cover_every_block_once(
            dims in [1_u32..600, 1_u32..600, 1_u32..600], bits in 9_u32..=2120,
            first_bit in 0_u64..300, limit in (2123_u64 * 4)..(1 << 28),
        ) {
            let layout = StreamLayout::new(dims, bits, first_bit).unwrap();
            let limits = wgpu::Limits { max_buffer_size: u64::MAX, ..limits(limit) };
            let plan = PayloadPlan::new(&layout, &limits).unwrap();
            let mut next = 0;
            for (index, page) in plan.pages().iter().enumerate() {
                prop_assert_eq!(page.first_block, next);
                prop_assert!(page.blocks > 0 && page.first_block % 32 == 0);
                prop_assert!(page.bytes() <= limit);
                let start = layout.block_bit(u64::from(page.first_block));
                prop_assert_eq!(start - page.first_word * 32, first_bit % 32);
                let end = layout.block_bit(u64::from(page.first_block + page.blocks));
                prop_assert!(end <= (page.first_word + page.words) * 32);
                next = page.first_block + page.blocks;
                prop_assert_eq!(plan.page_of(page.first_block), Some(index));
                prop_assert_eq!(plan.page_of(next - 1), Some(index));
            }
            prop_assert_eq!(u64::from(next), layout.block_count());
            prop_assert_eq!(plan.page_of(next), None);
        }
    }
}
