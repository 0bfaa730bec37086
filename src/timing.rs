//! GPU time of a pass, where the device has timestamp queries.

use gpu_primitives::memory::{Buffer, Category, Ledger};

use crate::wgpu;

/// Two timestamps around a pass.
#[derive(Debug)]
pub(crate) struct Timer {
    queries: Option<Queries>,
    /// Two 64-bit ticks; zeros without timestamps.
    resolved: Buffer,
}

#[derive(Debug)]
struct Queries {
    set: wgpu::QuerySet,
    nanoseconds_per_tick: f32,
}

impl Timer {
    /// Bytes of the resolved timestamps.
    pub(crate) const BYTES: u64 = 16;

    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, ledger: &Ledger) -> Self {
        let timed = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let resolve =
            if timed { wgpu::BufferUsages::QUERY_RESOLVE } else { wgpu::BufferUsages::empty() };
        let resolved = ledger.buffer(
            device,
            Category::Readback,
            &wgpu::BufferDescriptor {
                label: Some("progressive-iso.timestamps"),
                size: Self::BYTES,
                usage: resolve | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            },
        );
        let queries = timed.then(|| Queries {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("progressive-iso.timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            nanoseconds_per_tick: queue.get_timestamp_period(),
        });
        Self { queries, resolved }
    }

    pub(crate) fn record_begin(&self, encoder: &mut wgpu::CommandEncoder) {
        self.record(encoder, Some(0), None);
    }

    pub(crate) fn record_end(&self, encoder: &mut wgpu::CommandEncoder) {
        self.record(encoder, None, Some(1));
        if let Some(queries) = &self.queries {
            encoder.resolve_query_set(&queries.set, 0..2, &self.resolved, 0);
        }
    }

    /// An empty compute pass: timestamps are written at the borders of passes.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, begin: Option<u32>, end: Option<u32>) {
        if let Some(queries) = &self.queries {
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("progressive-iso.timestamp"),
                timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                    query_set: &queries.set,
                    beginning_of_pass_write_index: begin,
                    end_of_pass_write_index: end,
                }),
            });
        }
    }

    /// What to read back: two 64-bit ticks.
    pub(crate) fn part(&self) -> (&wgpu::Buffer, u64, u64) {
        (&self.resolved, 0, Self::BYTES)
    }

    pub(crate) fn milliseconds(&self, ticks: [u32; 4]) -> Option<f64> {
        let queries = self.queries.as_ref()?;
        let tick = |low: u32, high: u32| u64::from(low) | (u64::from(high) << 32);
        let elapsed = tick(ticks[2], ticks[3]).checked_sub(tick(ticks[0], ticks[1]))?;
        Some(elapsed as f64 * f64::from(queries.nanoseconds_per_tick) * 1e-6)
    }
}

/// GPU times of the stages of passes in flight.
#[cfg(feature = "wgpu-profiler")]
#[derive(Debug)]
pub(crate) struct Profile {
    profiler: Option<gpu_primitives::profile::Profiler>,
    /// Of the passes in flight, oldest first.
    recorded: std::collections::VecDeque<gpu_primitives::profile::StageTimes>,
    newest: Vec<gpu_primitives::profile::StageTime>,
}

#[cfg(feature = "wgpu-profiler")]
impl Profile {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, ledger: &Ledger) -> Self {
        let profiler = gpu_primitives::profile::Profiler::new(device, queue, ledger);
        Self { profiler, recorded: [].into(), newest: Vec::new() }
    }

    pub(crate) fn begin(&self) {
        if let Some(profiler) = &self.profiler {
            profiler.begin();
        }
    }

    pub(crate) fn end(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(profiler) = &self.profiler {
            self.recorded.push_back(profiler.end(encoder));
        }
    }

    /// What to read back of the pass that ended last.
    pub(crate) fn part(&self) -> Option<(&wgpu::Buffer, u64, u64)> {
        Some(self.profiler.as_ref()?.part(self.recorded.back()?))
    }

    /// Takes in the ticks of the oldest pass in flight.
    pub(crate) fn take(&mut self, ticks: &[u8]) {
        if let Some(times) = self.recorded.pop_front() {
            self.newest = times.sums(ticks);
        }
    }

    /// Forgets the oldest pass in flight: its ticks do not come.
    pub(crate) fn drop_oldest(&mut self) {
        self.recorded.pop_front();
    }

    pub(crate) fn newest(&self) -> &[gpu_primitives::profile::StageTime] {
        &self.newest
    }
}
