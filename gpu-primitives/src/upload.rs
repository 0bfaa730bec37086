//! Host data into GPU buffers as copies inside the encoder, through reusable mapped staging
//! chunks.

use std::sync::{Arc, Mutex, PoisonError};

use crate::memory::{Buffer, Category, Ledger};

/// Size of the smallest chunk in bytes: most writes are a few parameters.
const LEAST_CHUNK: u64 = 256;

/// Smallest chunks that may wait besides the two large ones.
const SMALL_CHUNKS: u64 = 64;

/// Staging memory that goes through the encoder, unlike `Queue::write_buffer`, whose data lands
/// before the whole submission.
///
/// A write takes chunks of its own, in powers of two from 256 bytes up to the size given here;
/// they come back when the submission is done, through `map_buffer_on_submit`, so that whoever
/// holds the encoder may submit it. At most [`UploadRing::waiting_bytes_limit`] bytes wait for
/// reuse; what comes back beyond that is freed. An encoder that is dropped frees its chunks.
#[derive(Debug)]
pub struct UploadRing {
    ledger: Ledger,
    label: String,
    chunk_bytes: u64,
    waiting: Arc<Waiting>,
}

/// Mapped chunks that no encoder uses.
#[derive(Debug)]
struct Waiting {
    chunks: Mutex<Vec<Buffer>>,
    limit: u64,
}

impl UploadRing {
    /// A ring without chunks; `chunk_bytes` is the size of the largest one, rounded up to a power
    /// of two.
    #[must_use]
    pub fn new(ledger: &Ledger, label: &str, chunk_bytes: u64) -> Self {
        let chunk_bytes =
            chunk_bytes.max(LEAST_CHUNK).checked_next_power_of_two().unwrap_or(1 << 63);
        let limit = Self::limit(chunk_bytes);
        let waiting = Arc::new(Waiting { chunks: Mutex::new(Vec::new()), limit });
        Self { ledger: ledger.clone(), label: label.to_owned(), chunk_bytes, waiting }
    }

    fn limit(chunk_bytes: u64) -> u64 {
        chunk_bytes.saturating_mul(2).saturating_add(SMALL_CHUNKS * LEAST_CHUNK)
    }

    /// Most bytes that wait for reuse. Beyond them, memory is only what unfinished submissions
    /// hold: each write rounded up to a power of two.
    #[must_use]
    pub fn waiting_bytes_limit(&self) -> u64 {
        self.waiting.limit
    }

    /// Bytes that wait for reuse now.
    #[must_use]
    pub fn waiting_bytes(&self) -> u64 {
        self.waiting.lock().iter().map(|chunk| chunk.size()).sum()
    }

    /// Whether no encoder or submission uses a chunk: dropping the ring then frees all its memory.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        // Every chunk in use has a share in the list that its callback brings it back to.
        Arc::strong_count(&self.waiting) == 1
    }

    /// Writes `data` at byte `offset` of `target` at this point of the encoder.
    ///
    /// Data larger than a chunk is split over several. `offset` and the length are multiples of 4
    /// and `target` has the usage `COPY_DST`; otherwise wgpu reports the copy. Empty data records
    /// nothing.
    pub fn write(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::Buffer,
        offset: u64,
        data: &[u8],
    ) {
        let step = usize::try_from(self.chunk_bytes).unwrap_or(usize::MAX);
        let mut offset = offset;
        for part in data.chunks(step) {
            self.write_part(device, encoder, target, offset, part);
            offset += part.len() as u64;
        }
    }

    fn write_part(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::Buffer,
        offset: u64,
        part: &[u8],
    ) {
        let bytes = part.len() as u64;
        let chunk = self.chunk(device, bytes.next_power_of_two().max(LEAST_CHUNK));
        match chunk.get_mapped_range_mut(..) {
            Ok(mut view) => view.slice(..part.len()).copy_from_slice(part),
            Err(error) => {
                tracing::error!(%error, label = self.label, "a staging chunk is not mapped");
                return;
            }
        }
        chunk.unmap();
        encoder.copy_buffer_to_buffer(&chunk, 0, target, offset, bytes);
        let waiting = Arc::clone(&self.waiting);
        let buffer = wgpu::Buffer::clone(&chunk);
        encoder.map_buffer_on_submit(&buffer, wgpu::MapMode::Write, .., move |mapped| {
            if mapped.is_ok() {
                waiting.put(chunk);
            }
        });
    }

    fn chunk(&self, device: &wgpu::Device, bytes: u64) -> Buffer {
        if let Some(chunk) = self.waiting.take(bytes) {
            return chunk;
        }
        let desc = wgpu::BufferDescriptor {
            label: Some(&self.label),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: true,
        };
        self.ledger.buffer(device, Category::Upload, &desc)
    }
}

impl Waiting {
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Buffer>> {
        // The list is whole between any two statements, so a poisoned lock does no harm.
        self.chunks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn take(&self, bytes: u64) -> Option<Buffer> {
        let mut chunks = self.lock();
        let index = chunks.iter().position(|chunk| chunk.size() == bytes)?;
        Some(chunks.remove(index))
    }

    /// Keeps the chunk and frees the longest unused ones beyond the limit.
    fn put(&self, chunk: Buffer) {
        let mut freed = Vec::new();
        let mut chunks = self.lock();
        chunks.push(chunk);
        let mut bytes: u64 = chunks.iter().map(|chunk| chunk.size()).sum();
        while bytes > self.limit && !chunks.is_empty() {
            let oldest = chunks.remove(0);
            bytes -= oldest.size();
            freed.push(oldest);
        }
        drop(chunks);
        drop(freed);
    }
}
