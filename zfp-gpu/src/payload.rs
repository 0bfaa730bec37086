//! The compressed stream on the GPU.

use gpu_primitives::memory::{Buffer, Category, Ledger};
use gpu_primitives::upload::UploadRing;

use crate::plan::{PayloadPage, PayloadPlan};
use crate::{Error, StreamLayout};

/// The compressed stream on the GPU, in pages no larger than a binding.
///
/// Dropping it frees the pages; bind groups made from them must not be used afterwards.
#[derive(Debug)]
pub struct Payload {
    plan: PayloadPlan,
    pages: Vec<Page>,
    /// Stream bytes uploaded so far, also those that no page holds.
    next_byte: u64,
    /// Bytes of a word whose other bytes are in the next chunk.
    partial: [u8; 4],
}

/// Buffers of one page.
#[derive(Debug)]
pub(crate) struct Page {
    pub(crate) words: Buffer,
    pub(crate) params: Buffer,
}

impl Payload {
    /// Cuts a stream into pages; see [`PayloadPlan::new`].
    ///
    /// # Errors
    /// As [`PayloadPlan::new`].
    pub fn plan(layout: &StreamLayout, limits: &wgpu::Limits) -> Result<PayloadPlan, Error> {
        PayloadPlan::new(layout, limits)
    }

    /// Allocates the pages, filled with zeros: blocks that are not uploaded yet decode as zeros.
    #[must_use]
    pub fn new(device: &wgpu::Device, ledger: &Ledger, plan: &PayloadPlan) -> Self {
        let pages = plan.pages().iter().map(|page| Page::new(device, ledger, plan, page)).collect();
        Self { plan: plan.clone(), pages, next_byte: 0, partial: [0; 4] }
    }

    /// What was planned.
    pub fn payload_plan(&self) -> &PayloadPlan {
        &self.plan
    }

    /// Layout of the stream.
    pub fn layout(&self) -> &StreamLayout {
        self.plan.layout()
    }

    /// Number of pages.
    pub fn page_count(&self) -> usize {
        self.pages.len()
    }

    /// 32-bit words of page `page`, as WGSL `array<u32>`; `None` beyond the last page.
    pub fn page_words(&self, page: usize) -> Option<&wgpu::Buffer> {
        self.pages.get(page).map(|page| &*page.words)
    }

    /// Uniform buffer of page `page`, as WGSL `ZfpPage`; `None` beyond the last page.
    pub fn page_params(&self, page: usize) -> Option<&wgpu::Buffer> {
        self.pages.get(page).map(|page| &*page.params)
    }

    pub(crate) fn pages(&self) -> &[Page] {
        &self.pages
    }

    /// Stream bytes uploaded so far.
    pub fn uploaded_bytes(&self) -> u64 {
        self.next_byte
    }

    /// Whether every block is uploaded.
    pub fn is_complete(&self) -> bool {
        self.next_byte >= self.layout().stream_bytes()
    }

    /// Records the upload of a chunk of the stream, header included, that starts at `first_byte`.
    ///
    /// Chunks follow each other in stream order and have any size; a chunk that starts at byte 0
    /// starts over. Bytes behind the last block are ignored.
    ///
    /// # Errors
    /// [`Error::UploadOrder`] when the chunk does not continue the last one; nothing is recorded.
    pub fn record_upload(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        upload: &mut UploadRing,
        first_byte: u64,
        bytes: &[u8],
    ) -> Result<(), Error> {
        if first_byte != 0 && first_byte != self.next_byte {
            return Err(Error::UploadOrder { expected: self.next_byte, found: first_byte });
        }
        self.next_byte = first_byte.saturating_add(bytes.len() as u64);
        let end = self.layout().stream_bytes();
        let wanted = usize::try_from(end.saturating_sub(first_byte)).unwrap_or(usize::MAX);
        let mut rest = &bytes[..bytes.len().min(wanted)];
        let mut position = first_byte;
        let mut write = |first_word, words: &[u8]| {
            for (page, buffers) in self.plan.pages.iter().zip(&self.pages) {
                if let Some((offset, part)) = part_of_page(page, first_word, words) {
                    upload.write(device, encoder, &buffers.words, offset, part);
                }
            }
        };
        // A word that the last chunk began.
        while !position.is_multiple_of(4)
            && let Some((&byte, tail)) = rest.split_first()
        {
            self.partial[(position % 4) as usize] = byte;
            (position, rest) = (position + 1, tail);
            if position.is_multiple_of(4) {
                write(position / 4 - 1, &self.partial);
            }
        }
        let (words, tail) = rest.split_at(rest.len() / 4 * 4);
        write(position / 4, words);
        position += rest.len() as u64;
        if !tail.is_empty() {
            self.partial[..tail.len()].copy_from_slice(tail);
        }
        let filled = (position % 4) as usize;
        if position == end && filled != 0 {
            self.partial[filled..].fill(0);
            write(position / 4, &self.partial);
        }
        Ok(())
    }
}

impl Page {
    fn new(device: &wgpu::Device, ledger: &Ledger, plan: &PayloadPlan, page: &PayloadPage) -> Self {
        let words = ledger.buffer(
            device,
            Category::Payload,
            &wgpu::BufferDescriptor {
                label: Some("zfp-gpu.payload.page"),
                size: page.bytes(),
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_DST
                    | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            },
        );
        let layout = plan.layout();
        let first_bit = (layout.first_bit % 32) as u32;
        let params = [page.first_block, page.blocks, layout.bits_per_block, first_bit];
        let params = ledger.buffer_with(
            device,
            Category::Params,
            "zfp-gpu.payload.params",
            wgpu::BufferUsages::UNIFORM,
            bytemuck::bytes_of(&params),
        );
        Self { words, params }
    }
}

/// The bytes of `words` (whole words from stream word `first_word` on) that `page` holds, and
/// their byte offset in it.
fn part_of_page<'a>(
    page: &PayloadPage,
    first_word: u64,
    words: &'a [u8],
) -> Option<(u64, &'a [u8])> {
    let last_word = first_word + words.len() as u64 / 4;
    let from = first_word.max(page.first_word);
    let to = last_word.min(page.first_word + page.words);
    if from >= to {
        return None;
    }
    // Within `words`, so the offsets fit its length.
    let part = &words[((from - first_word) * 4) as usize..((to - first_word) * 4) as usize];
    Some(((from - page.first_word) * 4, part))
}
