//! The ways of grouping and their time.

use std::time::Instant;

use crate::Failure;
use crate::data::Pairs;
use gpu_primitives::cpu;
use gpu_primitives::indirect;
use gpu_primitives::kernel::{Binding, Kernel};
use gpu_primitives::memory::Ledger;
use gpu_primitives::scan::{Scan, ScanBuffers};
use gpu_primitives::sort::{Sort, SortBuffers};
use gpu_primitives::wgpu;
use gpu_primitives::wgsl::{self, Constant, Module};
use gpu_testkit::gpu;

const LANES: u64 = 64;
const KERNELS: Module = Module { name: "grouping", source: include_str!("kernels.wgsl") };

#[derive(Clone, Copy, PartialEq)]
pub enum Way {
    /// The sort alone.
    Sort,
    /// The sort, and where the group of each slot ends.
    SortAndEnds,
    /// Counting scatter, which knows the ends anyway.
    CountingScatter,
}

impl Way {
    pub const ALL: [Way; 3] = [Way::Sort, Way::SortAndEnds, Way::CountingScatter];

    pub fn name(self) -> &'static str {
        match self {
            Way::Sort => "sort",
            Way::SortAndEnds => "sort and ends",
            Way::CountingScatter => "counting scatter",
        }
    }
}

pub struct Stages {
    sort: Sort,
    scan: Scan,
    bounds: Kernel,
    count: Kernel,
    scatter: Kernel,
}

impl Stages {
    pub fn new(device: &wgpu::Device) -> Self {
        let read = Binding::StorageRead { min_bytes: 4 };
        let write = Binding::StorageReadWrite { min_bytes: 4 };
        let kernel = |name, bindings: &[Binding]| {
            let constants = [(name, Constant::Bool(true))];
            let text = wgsl::compose(KERNELS, &[indirect::MODULE], &constants)
                .expect("the text of the example composes");
            Kernel::new(device, name, &text, "main", bindings)
        };
        Self {
            sort: Sort::new(device),
            scan: Scan::new(device),
            bounds: kernel("GROUPING_BOUNDS", &[read, read, write]),
            count: kernel("GROUPING_COUNT", &[read, read, write]),
            scatter: kernel("GROUPING_SCATTER", &[read, read, write, read, write]),
        }
    }
}

/// Everything to group one set of pairs in each way.
pub struct Bench<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    stages: &'a Stages,
    groups: u64,
    given: [wgpu::Buffer; 2],
    /// The sort works in these.
    keys: wgpu::Buffer,
    values: wgpu::Buffer,
    sort: SortBuffers,
    ends: wgpu::Buffer,
    grouped: wgpu::Buffer,
    scan: ScanBuffers,
    bounds: wgpu::BindGroup,
    count: wgpu::BindGroup,
    scatter: wgpu::BindGroup,
    timer: Option<Timer>,
}

impl<'a> Bench<'a> {
    pub fn new(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        stages: &'a Stages,
        pairs: &Pairs,
        timed: bool,
    ) -> Self {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let words = |words: &[u32]| gpu::buffer_with(device, bytemuck::cast_slice(words), usage);
        let length = pairs.keys.len() as u64;
        let given = [words(&pairs.keys), words(&pairs.values)];
        let (keys, values) = (words(&pairs.keys), words(&pairs.values));
        let (pair_count, slot_count) = (words(&[length as u32]), words(&[pairs.slots]));
        let ends = words(&vec![0; pairs.slots as usize]);
        let grouped = words(&pairs.values);

        let ledger = Ledger::new();
        let plan = Sort::plan(length, pairs.slots.ilog2());
        let sort = SortBuffers::new(
            device,
            &ledger,
            &stages.sort,
            &plan,
            &keys,
            &values,
            (&pair_count, 0),
        );
        let plan = Scan::plan(u64::from(pairs.slots));
        let scan = ScanBuffers::new(device, &ledger, &stages.scan, &plan, &ends, &slot_count, 0);
        let bind = |kernel: &Kernel, buffers: &[&wgpu::Buffer]| {
            let resources: Vec<_> =
                buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
            kernel.bind(device, "grouping", &resources)
        };
        let [given_keys, given_values] = &given;
        Self {
            bounds: bind(&stages.bounds, &[&pair_count, sort.keys(), &ends]),
            count: bind(&stages.count, &[&pair_count, given_keys, &ends]),
            scatter: bind(
                &stages.scatter,
                &[&pair_count, given_keys, &ends, given_values, &grouped],
            ),
            timer: timed.then(|| Timer::new(device, queue.get_timestamp_period())),
            groups: length.div_ceil(LANES),
            device,
            queue,
            stages,
            given,
            keys,
            values,
            sort,
            ends,
            grouped,
            scan,
        }
    }

    /// Groups the pairs and gives the time in milliseconds.
    pub fn run(&self, way: Way) -> f64 {
        let mut encoder = self.encoder();
        for (from, to) in self.given.iter().zip([&self.keys, &self.values]) {
            encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        }
        gpu::submit_and_wait(self.device, self.queue, encoder);

        let mut encoder = self.encoder();
        if let Some(timer) = &self.timer {
            timer.start(&mut encoder);
        }
        if way != Way::Sort {
            encoder.clear_buffer(&self.ends, 0, None);
        }
        let timestamp_writes = self.timer.as_ref().map(Timer::end);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("grouping"),
            timestamp_writes,
        });
        self.record(&mut pass, way);
        drop(pass);
        if let Some(timer) = &self.timer {
            timer.resolve(&mut encoder);
        }
        let start = Instant::now();
        gpu::submit_and_wait(self.device, self.queue, encoder);
        let elapsed = 1e3 * start.elapsed().as_secs_f64();
        self.timer.as_ref().map_or(elapsed, |timer| timer.milliseconds(self.device, self.queue))
    }

    fn record(&self, pass: &mut wgpu::ComputePass<'_>, way: Way) {
        let stages = self.stages;
        if way == Way::CountingScatter {
            stages.count.dispatch(pass, &self.count, self.groups);
            stages.scan.record_in(pass, &self.scan);
            stages.scatter.dispatch(pass, &self.scatter, self.groups);
            return;
        }
        stages.sort.record_in(pass, &self.sort);
        if way == Way::SortAndEnds {
            stages.bounds.dispatch(pass, &self.bounds, self.groups);
        }
    }

    /// Both ways put every pair into its slot's group, and the sort keeps the order of the pairs.
    pub fn check(&self, pairs: &Pairs) -> Result<(), Failure> {
        let read = |buffer| gpu::read_u32s(self.device, self.queue, buffer);
        let (keys, values) = cpu::sort::sort(&pairs.keys, &pairs.values, 32);
        self.run(Way::SortAndEnds);
        let sorted = read(self.sort.keys()) == keys && read(self.sort.values()) == values;
        let ends = read(&self.ends);
        let counted = (1u32..).zip(&keys).filter(|&(end, key)| keys.get(end as usize) != Some(key));
        let mut expected = vec![0; pairs.slots as usize];
        counted.for_each(|(end, &key)| expected[key as usize] = end);
        if !sorted || ends != expected {
            return Err("the sort does not group the pairs".into());
        }

        self.run(Way::CountingScatter);
        let mut start = 0;
        let mut grouped = read(&self.grouped);
        let ends = read(&self.ends);
        for &end in &ends {
            // Within a group the order is not determined.
            grouped[start..end as usize].sort_unstable();
            start = end as usize;
        }
        if grouped != values || start != values.len() {
            return Err("counting scatter does not group the pairs".into());
        }
        Ok(())
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }
}

/// Time between two places of an encoder.
struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    nanoseconds_per_tick: f32,
}

impl Timer {
    fn new(device: &wgpu::Device, nanoseconds_per_tick: f32) -> Self {
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("grouping"),
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let resolved = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("grouping"),
            size: 16,
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Self { queries, resolved, nanoseconds_per_tick }
    }

    /// An empty pass that takes the first time, so that copies after it count.
    fn start(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("grouping"),
            timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                query_set: &self.queries,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: None,
            }),
        });
    }

    fn end(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: None,
            end_of_pass_write_index: Some(1),
        }
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
    }

    fn milliseconds(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> f64 {
        let bytes = gpu::read_buffer(device, queue, &self.resolved);
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        ticks[1].saturating_sub(ticks[0]) as f64 * f64::from(self.nanoseconds_per_tick) * 1e-6
    }
}
