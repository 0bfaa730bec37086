//! Buffers and textures whose bytes are counted where they are allocated.

use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What an allocation is for; shown in reports.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
#[non_exhaustive]
pub enum Category {
    /// The compressed volume.
    Payload,
    /// Value ranges of cells.
    Ranges,
    /// Active masks of the current isovalue.
    Masks,
    /// Tables from block to slot.
    Directory,
    /// Decoded blocks.
    Slots,
    /// State of rays.
    Rays,
    /// Pictures and other results.
    Outputs,
    /// Intermediate results of a stage.
    Scratch,
    /// Uniform parameters.
    Params,
    /// Staging memory from host to device.
    Upload,
    /// Staging memory from device to host.
    Readback,
}

impl Category {
    /// Every category, in order.
    pub const ALL: [Category; 11] = [
        Category::Payload,
        Category::Ranges,
        Category::Masks,
        Category::Directory,
        Category::Slots,
        Category::Rays,
        Category::Outputs,
        Category::Scratch,
        Category::Params,
        Category::Upload,
        Category::Readback,
    ];
}

/// Counts the bytes of every GPU buffer and texture where they are allocated (a clone shares the
/// counts).
///
/// Counted is what the descriptors ask for; drivers add alignment of their own.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    counts: Arc<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    categories: [AtomicU64; Category::ALL.len()],
    total: AtomicU64,
    peak: AtomicU64,
}

impl Ledger {
    /// A ledger with nothing in it.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Creates a buffer and counts its bytes until it is dropped.
    #[must_use]
    pub fn buffer(
        &self,
        device: &wgpu::Device,
        category: Category,
        desc: &wgpu::BufferDescriptor<'_>,
    ) -> Buffer {
        let entry = self.enter(category, desc.size);
        Buffer { inner: device.create_buffer(desc), entry }
    }

    /// Creates a buffer that starts with `contents`, whose length is a multiple of 4.
    ///
    /// Meant for small values that never change, such as a stage's constants.
    #[must_use]
    pub fn buffer_with(
        &self,
        device: &wgpu::Device,
        category: Category,
        label: &str,
        usage: wgpu::BufferUsages,
        contents: &[u8],
    ) -> Buffer {
        let buffer = self.buffer(
            device,
            category,
            &wgpu::BufferDescriptor {
                label: Some(label),
                size: contents.len() as u64,
                usage,
                mapped_at_creation: true,
            },
        );
        if !contents.is_empty() {
            match buffer.get_mapped_range_mut(..) {
                Ok(mut view) => view.copy_from_slice(contents),
                Err(error) => tracing::error!(%error, label, "a new buffer is not mapped"),
            }
        }
        buffer.unmap();
        buffer
    }

    /// Creates a texture and counts its bytes ([`texture_bytes`]) until it is dropped.
    #[must_use]
    pub fn texture(
        &self,
        device: &wgpu::Device,
        category: Category,
        desc: &wgpu::TextureDescriptor<'_>,
    ) -> Texture {
        let entry = self.enter(category, texture_bytes(desc));
        Texture { inner: device.create_texture(desc), entry }
    }

    /// Bytes of one category that live now.
    #[must_use]
    pub fn bytes(&self, category: Category) -> u64 {
        self.counts.category(category).load(Ordering::Relaxed)
    }

    /// Bytes that live now.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.total.load(Ordering::Relaxed)
    }

    /// Most bytes that ever lived at one time.
    #[must_use]
    pub fn peak(&self) -> u64 {
        self.counts.peak.load(Ordering::Relaxed)
    }

    /// Bytes that live now by category, in the order of [`Category`], zero entries left out.
    #[must_use]
    pub fn by_category(&self) -> Vec<(Category, u64)> {
        Category::ALL
            .into_iter()
            .map(|category| (category, self.bytes(category)))
            .filter(|&(_, bytes)| bytes > 0)
            .collect()
    }

    fn enter(&self, category: Category, bytes: u64) -> Entry {
        self.counts.category(category).fetch_add(bytes, Ordering::Relaxed);
        let total = self.counts.total.fetch_add(bytes, Ordering::Relaxed).saturating_add(bytes);
        self.counts.peak.fetch_max(total, Ordering::Relaxed);
        Entry { counts: Arc::clone(&self.counts), category, bytes }
    }
}

impl Counts {
    fn category(&self, category: Category) -> &AtomicU64 {
        &self.categories[category as usize]
    }
}

/// One line of the ledger; leaves it when dropped.
#[derive(Debug)]
struct Entry {
    counts: Arc<Counts>,
    category: Category,
    bytes: u64,
}

impl Drop for Entry {
    fn drop(&mut self) {
        self.counts.category(self.category).fetch_sub(self.bytes, Ordering::Relaxed);
        self.counts.total.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

/// A counted GPU buffer. Dropping it destroys the wgpu buffer, even where bind groups still name it.
#[derive(Debug)]
pub struct Buffer {
    inner: wgpu::Buffer,
    entry: Entry,
}

impl Buffer {
    /// What the buffer is for.
    #[must_use]
    pub fn category(&self) -> Category {
        self.entry.category
    }
}

impl Deref for Buffer {
    type Target = wgpu::Buffer;

    fn deref(&self) -> &wgpu::Buffer {
        &self.inner
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.inner.destroy();
    }
}

/// A counted GPU texture. Dropping it destroys the wgpu texture, even where bind groups still name
/// it.
#[derive(Debug)]
pub struct Texture {
    inner: wgpu::Texture,
    entry: Entry,
}

impl Texture {
    /// What the texture is for.
    #[must_use]
    pub fn category(&self) -> Category {
        self.entry.category
    }

    /// Bytes that the ledger counts for it.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.entry.bytes
    }
}

impl Deref for Texture {
    type Target = wgpu::Texture;

    fn deref(&self) -> &wgpu::Texture {
        &self.inner
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        self.inner.destroy();
    }
}

/// Bytes of a texture with all its mip levels, layers and samples, without a driver's padding.
#[must_use]
pub fn texture_bytes(desc: &wgpu::TextureDescriptor<'_>) -> u64 {
    let level = |level| {
        let size = desc.size.mip_level_size(level, desc.dimension);
        desc.format.theoretical_memory_footprint(size)
    };
    let one_sample: u64 = (0..desc.mip_level_count).map(level).sum();
    one_sample * u64::from(desc.sample_count)
}
