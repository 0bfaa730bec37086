//! A few numbers from the GPU, some frames late, in order, without blocking.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::memory::{Buffer, Category, Ledger};

/// Smallest size of a record: a mapping is never empty.
const LEAST_BYTES: u64 = 4;

/// Copies parts of buffers into staging memory at a point of an encoder, and hands the bytes out
/// once the submission is done and the caller has polled the device.
///
/// Staging buffers are made when first needed, one per record in flight. A record whose encoder is
/// dropped, or whose buffer cannot be mapped, is left out.
#[derive(Debug)]
pub struct ReadbackRing {
    ledger: Ledger,
    label: String,
    bytes: u64,
    limit: usize,
    in_flight: VecDeque<Record>,
    idle: Vec<Arc<Buffer>>,
}

#[derive(Debug)]
struct Record {
    tag: u64,
    bytes: u64,
    slot: Arc<Slot>,
}

/// A staging buffer and what became of one mapping, shared with the callback that reports it: the
/// buffer has to outlive the ring when an encoder still uses it, and a late callback must not touch
/// the state of the buffer's next record.
#[derive(Debug)]
struct Slot {
    buffer: Arc<Buffer>,
    state: AtomicU8,
}

/// States of a slot.
mod state {
    pub(super) const RECORDED: u8 = 0;
    pub(super) const MAPPED: u8 = 1;
    pub(super) const LOST: u8 = 2;
}

impl ReadbackRing {
    /// A ring for at most `in_flight` records of at most `bytes` bytes each.
    #[must_use]
    pub fn new(ledger: &Ledger, label: &str, bytes: u64, in_flight: usize) -> Self {
        Self {
            ledger: ledger.clone(),
            label: label.to_owned(),
            bytes: bytes.next_multiple_of(LEAST_BYTES).max(LEAST_BYTES),
            limit: in_flight,
            in_flight: VecDeque::new(),
            idle: Vec::new(),
        }
    }

    /// Most bytes that the ring allocates.
    #[must_use]
    pub fn bytes_limit(&self) -> u64 {
        self.bytes.saturating_mul(self.limit as u64)
    }

    /// Records that were not taken yet.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.in_flight.len()
    }

    /// Whether another record fits; [`ReadbackRing::take`] makes room.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.in_flight.len() < self.limit
    }

    /// Records copies of `parts` (buffer, byte offset, bytes), which follow each other in the
    /// record. Offsets and sizes are multiples of 4 and the buffers have the usage `COPY_SRC`;
    /// otherwise wgpu reports the copy.
    ///
    /// `false`: nothing was recorded, because there is no room or because the parts are larger than
    /// a record (which is also logged).
    pub fn record(
        &mut self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        parts: &[(&wgpu::Buffer, u64, u64)],
        tag: u64,
    ) -> bool {
        let bytes = parts.iter().fold(0u64, |sum, part| sum.saturating_add(part.2));
        if bytes > self.bytes {
            tracing::error!(label = self.label, bytes, limit = self.bytes, "record too large");
            return false;
        }
        if !self.has_room() {
            return false;
        }
        let buffer = self.idle.pop().unwrap_or_else(|| Arc::new(self.staging(device)));
        let mut at = 0;
        for &(source, offset, size) in parts.iter().filter(|part| part.2 > 0) {
            encoder.copy_buffer_to_buffer(source, offset, &buffer, at, size);
            at += size;
        }
        let slot = Arc::new(Slot { buffer, state: AtomicU8::new(state::RECORDED) });
        let handle = wgpu::Buffer::clone(&slot.buffer);
        let report = Report(Arc::clone(&slot));
        encoder.map_buffer_on_submit(&handle, wgpu::MapMode::Read, .., move |mapped| {
            if mapped.is_ok() {
                report.0.state.store(state::MAPPED, Ordering::Release);
            }
        });
        self.in_flight.push_back(Record { tag, bytes, slot });
        true
    }

    /// The tag and the bytes of the oldest record, if it is finished. Callers poll the device.
    pub fn take(&mut self) -> Option<(u64, Vec<u8>)> {
        loop {
            match self.in_flight.front()?.slot.state.load(Ordering::Acquire) {
                state::RECORDED => return None,
                state::MAPPED => {
                    let record = self.in_flight.pop_front()?;
                    if let Some(bytes) = self.read(&record) {
                        return Some((record.tag, bytes));
                    }
                }
                _ => {
                    // Its buffer goes with it: what became of the mapping is not known.
                    let record = self.in_flight.pop_front()?;
                    tracing::warn!(label = self.label, tag = record.tag, "record lost");
                }
            }
        }
    }

    fn read(&mut self, record: &Record) -> Option<Vec<u8>> {
        let buffer = &record.slot.buffer;
        let bytes = match buffer.get_mapped_range(..) {
            Ok(view) => view.iter().take(record.bytes as usize).copied().collect(),
            Err(error) => {
                tracing::warn!(%error, label = self.label, tag = record.tag, "record lost");
                return None;
            }
        };
        buffer.unmap();
        self.idle.push(Arc::clone(buffer));
        Some(bytes)
    }

    fn staging(&self, device: &wgpu::Device) -> Buffer {
        let desc = wgpu::BufferDescriptor {
            label: Some(&self.label),
            size: self.bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        };
        self.ledger.buffer(device, Category::Readback, &desc)
    }
}

/// Held by the callback; dropped uncalled or after a failure, it marks the record as lost.
struct Report(Arc<Slot>);

impl Drop for Report {
    fn drop(&mut self) {
        let lost = |state| (state == state::RECORDED).then_some(state::LOST);
        // An error only says that the record is mapped.
        self.0.state.fetch_update(Ordering::AcqRel, Ordering::Acquire, lost).ok();
    }
}
