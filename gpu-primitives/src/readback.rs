//! A few numbers from the GPU, some frames late, in order, without blocking.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

use crate::memory::{Buffer, Category, Ledger};

/// Buffers are mapped and copied in multiples of this.
const WORD_BYTES: u64 = 4;

/// What a record ends with says that its submission ran: one of these in turn, so that what the record
/// before left in the buffer is not taken for it, nor the zeros of a new buffer.
const STAMPS: [u32; 2] = [1, 2];

/// Why a record has no bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Lost {
    /// Its encoder was dropped.
    #[error("the encoder of a record was dropped")]
    Dropped,
    /// Its staging buffer could not be made or mapped, or the device is lost.
    #[error("a staging buffer could not be mapped")]
    NotMapped,
    /// Its commands were submitted, or meant to be, and did not run: the device refused them.
    #[error("a submission did not run")]
    NotRun,
}

/// Copies parts of buffers into staging memory at a point of an encoder, and hands the bytes out
/// once the submission is done and the caller has polled the device.
///
/// Staging buffers are made when first needed, one per record in flight. The bytes are those that the
/// GPU copied in this very submission, or the record is [`Lost`]: a submission that is refused can leave
/// its staging buffer as it was and still have it mapped.
#[derive(Debug)]
pub struct ReadbackRing {
    ledger: Ledger,
    label: String,
    bytes: u64,
    limit: usize,
    in_flight: VecDeque<Record>,
    idle: Vec<Staging>,
    stamps: Option<Arc<Buffer>>,
}

#[derive(Debug)]
struct Record {
    tag: u64,
    bytes: u64,
    /// Bytes before the stamp.
    room: u64,
    /// Which of the [`STAMPS`] the record ends with once it has run.
    stamp: usize,
    slot: Arc<Slot>,
}

/// A buffer that no record uses.
#[derive(Debug)]
struct Staging {
    buffer: Arc<Buffer>,
    /// Bytes before the stamp.
    room: u64,
    next_stamp: usize,
}

/// A staging buffer and what became of one mapping, shared with the callback that reports it: the
/// buffers have to outlive the ring when an encoder still uses them, and a late callback must not touch
/// the state of the buffer's next record.
#[derive(Debug)]
struct Slot {
    buffer: Arc<Buffer>,
    _stamps: Arc<Buffer>,
    state: AtomicU8,
}

/// States of a slot.
mod state {
    pub(super) const RECORDED: u8 = 0;
    pub(super) const MAPPED: u8 = 1;
    pub(super) const DROPPED: u8 = 2;
    pub(super) const NOT_MAPPED: u8 = 3;
}

impl ReadbackRing {
    /// A ring for at most `in_flight` records of at most `bytes` bytes each.
    #[must_use]
    pub fn new(ledger: &Ledger, label: &str, bytes: u64, in_flight: usize) -> Self {
        Self {
            ledger: ledger.clone(),
            label: label.to_owned(),
            bytes: bytes.next_multiple_of(WORD_BYTES),
            limit: in_flight,
            in_flight: VecDeque::new(),
            idle: Vec::new(),
            stamps: None,
        }
    }

    /// Changes how many bytes a record has at most. Those in flight stay as they are; their buffers go with them.
    pub fn set_bytes(&mut self, bytes: u64) {
        self.bytes = bytes.next_multiple_of(WORD_BYTES);
        self.idle.retain(|staging| staging.room == self.bytes);
    }

    /// Bytes of a staging buffer: a record and its stamp.
    fn staging_bytes(&self) -> u64 {
        self.bytes.saturating_add(WORD_BYTES)
    }

    /// Most bytes that the ring allocates.
    #[must_use]
    pub fn bytes_limit(&self) -> u64 {
        let stamps = size_of_val(&STAMPS) as u64;
        self.staging_bytes().saturating_mul(self.limit as u64).saturating_add(stamps)
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
        let Staging { buffer, room, next_stamp: stamp } = match self.idle.pop() {
            Some(staging) => staging,
            None => {
                let buffer = Arc::new(self.staging(device));
                Staging { buffer, room: self.bytes, next_stamp: 0 }
            }
        };
        let mut at = 0;
        for &(source, offset, size) in parts.iter().filter(|part| part.2 > 0) {
            encoder.copy_buffer_to_buffer(source, offset, &buffer, at, size);
            at += size;
        }
        let stamps = || Arc::new(stamps(&self.ledger, device));
        let stamps = Arc::clone(self.stamps.get_or_insert_with(stamps));
        let from = stamp as u64 * WORD_BYTES;
        encoder.copy_buffer_to_buffer(&stamps, from, &buffer, room, WORD_BYTES);
        let state = AtomicU8::new(state::RECORDED);
        let slot = Arc::new(Slot { buffer, _stamps: stamps, state });
        let handle = wgpu::Buffer::clone(&slot.buffer);
        let report = Report(Arc::clone(&slot));
        encoder.map_buffer_on_submit(&handle, wgpu::MapMode::Read, .., move |mapped| {
            let outcome = if mapped.is_ok() { state::MAPPED } else { state::NOT_MAPPED };
            report.0.state.store(outcome, Ordering::Release);
        });
        self.in_flight.push_back(Record { tag, bytes, room, stamp, slot });
        true
    }

    /// The tag and the bytes of the oldest record, if it is finished, or why there are none. Callers poll
    /// the device.
    ///
    /// The buffer of a lost record goes with it.
    pub fn take(&mut self) -> Option<(u64, Result<Vec<u8>, Lost>)> {
        let state = self.in_flight.front()?.slot.state.load(Ordering::Acquire);
        if state == state::RECORDED {
            return None;
        }
        let record = self.in_flight.pop_front()?;
        let bytes = match state {
            state::MAPPED => self.read(&record),
            state::DROPPED => Err(Lost::Dropped),
            _ => Err(Lost::NotMapped),
        };
        if let Err(lost) = bytes {
            tracing::warn!(%lost, label = self.label, tag = record.tag);
        }
        Some((record.tag, bytes))
    }

    fn read(&mut self, record: &Record) -> Result<Vec<u8>, Lost> {
        let buffer = &record.slot.buffer;
        let mapped = match buffer.get_mapped_range(..) {
            Ok(view) => view.to_vec(),
            Err(error) => {
                tracing::warn!(%error, label = self.label, "no mapped range");
                return Err(Lost::NotMapped);
            }
        };
        buffer.unmap();
        let (bytes, stamp) = mapped.split_at(record.room.min(mapped.len() as u64) as usize);
        if stamp != STAMPS[record.stamp].to_le_bytes() {
            return Err(Lost::NotRun);
        }
        if record.room == self.bytes {
            let (buffer, room) = (Arc::clone(buffer), record.room);
            let next_stamp = (record.stamp + 1) % STAMPS.len();
            self.idle.push(Staging { buffer, room, next_stamp });
        }
        Ok(bytes[..bytes.len().min(record.bytes as usize)].to_vec())
    }

    fn staging(&self, device: &wgpu::Device) -> Buffer {
        let desc = wgpu::BufferDescriptor {
            label: Some(&self.label),
            size: self.staging_bytes(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        };
        self.ledger.buffer(device, Category::Readback, &desc)
    }
}

/// The [`STAMPS`] to copy from.
fn stamps(ledger: &Ledger, device: &wgpu::Device) -> Buffer {
    let (label, usage) = ("gpu-primitives.readback.stamps", wgpu::BufferUsages::COPY_SRC);
    ledger.buffer_with(device, Category::Readback, label, usage, bytemuck::bytes_of(&STAMPS))
}

/// Held by the callback; dropped uncalled, it marks the record as dropped.
struct Report(Arc<Slot>);

impl Drop for Report {
    fn drop(&mut self) {
        let dropped = |state| (state == state::RECORDED).then_some(state::DROPPED);
        // An error only says that the callback has been called.
        self.0.state.fetch_update(Ordering::AcqRel, Ordering::Acquire, dropped).ok();
    }
}
