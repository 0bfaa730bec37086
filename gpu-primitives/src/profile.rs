//! GPU times by stage: timestamps around the compute passes that this thread records through
//! [`begin_pass`].
//!
//! Without the feature `wgpu-profiler` only [`begin_pass`] exists, and it does nothing more than
//! its name says.

#[cfg(feature = "wgpu-profiler")]
pub use timed::{Profiler, StageTime, StageTimes};

/// Begins a compute pass, timed if a profiler is recording on this thread.
#[must_use]
pub fn begin_pass<'a>(encoder: &'a mut wgpu::CommandEncoder, label: &str) -> wgpu::ComputePass<'a> {
    #[cfg(feature = "wgpu-profiler")]
    if let Some((query_set, first)) = timed::next_queries(label) {
        return encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                query_set: &query_set,
                beginning_of_pass_write_index: Some(first),
                end_of_pass_write_index: Some(first + 1),
            }),
        });
    }
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: None,
    })
}

#[cfg(feature = "wgpu-profiler")]
mod timed {
    use std::cell::RefCell;

    use crate::memory::{Buffer, Category, Ledger};

    thread_local! {
        static RECORDING: RefCell<Option<Recording>> = const { RefCell::new(None) };
    }

    /// Compute passes timed between two calls of [`Profiler::begin`]; later ones are not.
    const MOST_PASSES: u32 = 2048;

    /// Bytes of one timestamp.
    const TICK_BYTES: u64 = 8;

    struct Recording {
        query_set: wgpu::QuerySet,
        labels: Vec<String>,
    }

    /// The query set and the first of the two queries of a pass, if this thread is recording.
    pub(super) fn next_queries(label: &str) -> Option<(wgpu::QuerySet, u32)> {
        RECORDING.with_borrow_mut(|recording| {
            let recording = recording.as_mut()?;
            let first = 2 * recording.labels.len() as u32;
            if first >= 2 * MOST_PASSES {
                return None;
            }
            recording.labels.push(label.to_owned());
            Some((recording.query_set.clone(), first))
        })
    }

    /// Time of all compute passes of one label.
    #[derive(Clone, Debug, PartialEq)]
    pub struct StageTime {
        /// The passes' label.
        pub label: String,
        /// Sum of their GPU times in milliseconds.
        pub ms: f64,
        /// How many there were.
        pub passes: u32,
    }

    /// Labels of the passes that were recorded, in order; makes times of their ticks.
    #[derive(Clone, Debug, Default)]
    pub struct StageTimes {
        labels: Vec<String>,
        nanoseconds_per_tick: f32,
    }

    /// Times compute passes, on devices with timestamp queries.
    #[derive(Debug)]
    pub struct Profiler {
        query_set: wgpu::QuerySet,
        resolved: Buffer,
        nanoseconds_per_tick: f32,
    }

    impl Profiler {
        /// Bytes that [`Profiler::new`] allocates, and most bytes of [`Profiler::part`].
        pub const BYTES: u64 = 2 * MOST_PASSES as u64 * TICK_BYTES;

        /// `None` where the device has no timestamp queries.
        #[must_use]
        pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, ledger: &Ledger) -> Option<Self> {
            if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
                return None;
            }
            let label = Some("gpu-primitives.profile");
            let query_set = device.create_query_set(&wgpu::QuerySetDescriptor {
                label,
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_PASSES,
            });
            let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
            let desc = wgpu::BufferDescriptor {
                label,
                size: Self::BYTES,
                usage,
                mapped_at_creation: false,
            };
            let resolved = ledger.buffer(device, Category::Readback, &desc);
            Some(Self { query_set, resolved, nanoseconds_per_tick: queue.get_timestamp_period() })
        }

        /// Times the passes that this thread begins from now on, up to [`Profiler::end`].
        pub fn begin(&self) {
            let query_set = self.query_set.clone();
            RECORDING.set(Some(Recording { query_set, labels: Vec::new() }));
        }

        /// Stops, and records resolving the timestamps.
        pub fn end(&self, encoder: &mut wgpu::CommandEncoder) -> StageTimes {
            let labels = RECORDING.take().map_or_else(Vec::new, |recording| recording.labels);
            let queries = 2 * labels.len() as u32;
            if queries > 0 {
                encoder.resolve_query_set(&self.query_set, 0..queries, &self.resolved, 0);
            }
            StageTimes { labels, nanoseconds_per_tick: self.nanoseconds_per_tick }
        }

        /// Where the ticks of `times` are: buffer, byte offset, bytes.
        #[must_use]
        pub fn part(&self, times: &StageTimes) -> (&wgpu::Buffer, u64, u64) {
            (&self.resolved, 0, 2 * TICK_BYTES * times.labels.len() as u64)
        }
    }

    impl StageTimes {
        /// Sums by label, in the order of first appearance. `ticks` are the bytes of
        /// [`Profiler::part`]; passes whose ticks are missing or run backwards count as 0.
        #[must_use]
        pub fn sums(&self, ticks: &[u8]) -> Vec<StageTime> {
            let tick = |at: usize| -> Option<u64> {
                let bytes = ticks.get(8 * at..8 * at + 8)?;
                Some(u64::from_le_bytes(bytes.try_into().ok()?))
            };
            let mut sums: Vec<StageTime> = Vec::new();
            for (index, label) in self.labels.iter().enumerate() {
                let elapsed = tick(2 * index + 1)
                    .zip(tick(2 * index))
                    .and_then(|(end, begin)| end.checked_sub(begin))
                    .unwrap_or(0);
                let ms = elapsed as f64 * f64::from(self.nanoseconds_per_tick) * 1e-6;
                match sums.iter_mut().find(|sum| sum.label == *label) {
                    Some(sum) => {
                        sum.ms += ms;
                        sum.passes += 1;
                    }
                    None => sums.push(StageTime { label: label.clone(), ms, passes: 1 }),
                }
            }
            sums
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn times_are_summed_by_label() {
            let labels = ["a", "b", "a", "c"].map(str::to_owned).to_vec();
            let times = StageTimes { labels, nanoseconds_per_tick: 1e6 };
            let ticks: Vec<u8> =
                [1u64, 2, 10, 5, 20, 23].iter().flat_map(|t| t.to_le_bytes()).collect();
            let sum = |label: &str, ms, passes| StageTime { label: label.into(), ms, passes };
            assert_eq!(times.sums(&ticks), [sum("a", 4.0, 2), sum("b", 0.0, 1), sum("c", 0.0, 1)]);
        }
    }
}
