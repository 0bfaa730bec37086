//! A device with what the tests of the stages share.

use std::cell::OnceCell;
use std::rc::Rc;

use gpu_primitives::memory::Ledger;
use gpu_primitives::upload::UploadRing;
use gpu_testkit::gpu::{buffer_with, device, read_f32s, sentinel_buffer, submit_and_wait};
use zfp_gpu::{Decode, DecodeBuffers, Payload, SLOT_BYTES, StreamLayout};

use super::Random;

/// Bits of every float that no kernel has written.
pub(crate) const SENTINEL: u32 = 0x7e57_7e57;

pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) ledger: Ledger,
    pub(crate) upload: UploadRing,
    /// Pipelines for 1 to 3 cache pages; compiling them takes longer than running them.
    decodes: [OnceCell<Rc<Decode>>; 3],
}

impl Gpu {
    pub(crate) fn new() -> Self {
        let (device, queue) = device();
        let ledger = Ledger::new();
        let upload = UploadRing::new(&ledger, "test.upload", 1 << 20);
        Self { device, queue, ledger, upload, decodes: Default::default() }
    }

    pub(crate) fn decode(&self, cache_pages: u32) -> Rc<Decode> {
        let make = || Rc::new(Decode::new(&self.device, cache_pages).unwrap());
        self.decodes[cache_pages as usize - 1].get_or_init(make).clone()
    }

    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    pub(crate) fn storage(&self, words: &[u32]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT;
        buffer_with(&self.device, bytemuck::cast_slice(words), usage)
    }

    /// Uploads in chunks of irregular size, so that words are cut everywhere.
    pub(crate) fn payload(
        &mut self,
        layout: &StreamLayout,
        stream: &[u8],
        page_bytes: u64,
    ) -> Payload {
        let limits = wgpu::Limits { max_buffer_size: page_bytes, ..wgpu::Limits::default() };
        let plan = Payload::plan(layout, &limits).unwrap();
        let mut payload = Payload::new(&self.device, &self.ledger, &plan);
        let mut encoder = self.encoder();
        let mut random = Random::new(stream.len() as u64);
        let mut first = 0;
        while first < stream.len() {
            let step = [1, 2, 3, 5, 64, 1021, 4096, 30_001][random.below(8) as usize];
            let end = (first + step).min(stream.len());
            payload
                .record_upload(
                    &self.device,
                    &mut encoder,
                    &mut self.upload,
                    first as u64,
                    &stream[first..end],
                )
                .unwrap();
            first = end;
        }
        assert!(payload.is_complete());
        submit_and_wait(&self.device, &self.queue, encoder);
        payload
    }
}

/// A cache of `pages` pages and what decoding jobs into it gives.
pub(crate) struct Cache {
    pub(crate) decode: Rc<Decode>,
    pub(crate) buffers: Vec<wgpu::Buffer>,
    pub(crate) slots_per_page: u32,
}

impl Cache {
    pub(crate) fn new(gpu: &Gpu, pages: u32, slots: u32) -> Self {
        let slots_per_page = slots.div_ceil(pages);
        let bytes = u64::from(slots_per_page) * SLOT_BYTES;
        let buffers = (0..pages).map(|_| sentinel_buffer(&gpu.device, bytes, SENTINEL)).collect();
        Self { decode: gpu.decode(pages), buffers, slots_per_page }
    }

    pub(crate) fn bind(
        &self,
        gpu: &Gpu,
        payload: &Payload,
        jobs: &wgpu::Buffer,
        count: (&wgpu::Buffer, u64),
    ) -> DecodeBuffers {
        let pages: Vec<_> = self.buffers.iter().collect();
        DecodeBuffers::new(
            &gpu.device,
            &gpu.ledger,
            &self.decode,
            payload,
            jobs,
            count,
            &pages,
            self.slots_per_page,
        )
        .unwrap()
    }

    /// Runs the first `count` jobs with a dispatch for all of them; all slots in order.
    pub(crate) fn run(
        &self,
        gpu: &Gpu,
        payload: &Payload,
        jobs: &[[u32; 2]],
        count: u32,
    ) -> Vec<f32> {
        let list = gpu.storage(jobs.as_flattened());
        let count = gpu.storage(&[7, 7, count]);
        let buffers = self.bind(gpu, payload, &list, (&count, 8));
        let mut encoder = gpu.encoder();
        self.decode.record(&mut encoder, &buffers, jobs.len() as u32);
        submit_and_wait(&gpu.device, &gpu.queue, encoder);
        self.read(gpu)
    }

    pub(crate) fn read(&self, gpu: &Gpu) -> Vec<f32> {
        let pages = self.buffers.iter().map(|page| read_f32s(&gpu.device, &gpu.queue, page));
        pages.collect::<Vec<_>>().concat()
    }
}
