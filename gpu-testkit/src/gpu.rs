//! Adapter, device and buffer helpers for tests. These block and submit, which the libraries
//! themselves never do.

use std::sync::{Arc, OnceLock};

use wgpu::util::DeviceExt as _;

/// Environment variable that selects an adapter: a substring of its name, case ignored.
pub const ADAPTER_VARIABLE: &str = "PROGRESSIVE_ISO_ADAPTER";

/// What [`find_adapter`] says when there is no adapter at all.
pub const NO_ADAPTER: &str = "no GPU adapter with WebGPU's default limits found: install a Vulkan driver \
                          (Debian/Ubuntu: apt-get install mesa-vulkan-drivers)";

static ADAPTER: OnceLock<wgpu::Adapter> = OnceLock::new();

/// A fresh device with WebGPU's default limits and no features, on the process-wide adapter.
///
/// # Panics
/// When there is no adapter; later, on any error that no error scope catches.
#[must_use]
pub fn device() -> (wgpu::Device, wgpu::Queue) {
    device_with(wgpu::Features::empty(), webgpu_limits())
}

/// A fresh device with exactly these features and limits, those of them that are WebGPU's, on the
/// process-wide adapter.
///
/// # Panics
/// When there is no adapter, or when it does not offer the features or limits; later, on any
/// error that no error scope catches.
#[must_use]
pub fn device_with(
    required_features: wgpu::Features,
    required_limits: wgpu::Limits,
) -> (wgpu::Device, wgpu::Queue) {
    let mut required_limits = required_limits;
    required_limits.zero_native_only();
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("gpu-testkit.device"),
        required_features,
        required_limits,
        ..Default::default()
    };
    let (device, queue) = match pollster::block_on(adapter().request_device(&descriptor)) {
        Ok(pair) => pair,
        Err(error) => panic!("{} refused the device: {error}", adapter().get_info().name),
    };
    panic_on_uncaptured(&device);
    (device, queue)
}

fn panic_on_uncaptured(device: &wgpu::Device) {
    device.on_uncaptured_error(Arc::new(|error: wgpu::Error| panic!("uncaptured GPU {error}")));
}

/// A device that accepts everything, copies buffers and runs no shader.
///
/// # Panics
/// On any error that no error scope catches.
#[must_use]
pub fn noop_device(required_limits: wgpu::Limits) -> (wgpu::Device, wgpu::Queue) {
    let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor {
        label: Some("gpu-testkit.noop"),
        required_limits,
        ..Default::default()
    });
    panic_on_uncaptured(&device);
    (device, queue)
}

/// Name, driver and back end of the adapter that every device of this process uses.
///
/// # Panics
/// When there is no adapter.
#[must_use]
pub fn adapter_info() -> wgpu::AdapterInfo {
    adapter().get_info()
}

/// The adapter that every device of this process uses.
///
/// # Panics
/// With the error of [`find_adapter`].
#[must_use]
pub fn adapter() -> &'static wgpu::Adapter {
    ADAPTER.get_or_init(|| match find_adapter() {
        Ok(adapter) => adapter,
        Err(problem) => panic!("{problem}"),
    })
}

/// The best adapter that offers WebGPU's default limits and whose name contains the value of
/// [`ADAPTER_VARIABLE`], if that is set.
///
/// # Errors
/// One line that says what was found instead, or what to install when nothing was found.
pub fn find_adapter() -> Result<wgpu::Adapter, String> {
    let wanted = std::env::var(ADAPTER_VARIABLE).unwrap_or_default();
    let adapters = adapters();
    let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
    match adapters.into_iter().find(|a| name_matches(&a.get_info().name, &wanted)) {
        Some(adapter) => Ok(adapter),
        None if names.is_empty() => Err(NO_ADAPTER.to_owned()),
        None => Err(format!("no GPU adapter matches {ADAPTER_VARIABLE}={wanted}; found {names:?}")),
    }
}

fn name_matches(name: &str, wanted: &str) -> bool {
    name.to_lowercase().contains(&wanted.to_lowercase())
}

/// Every adapter, best first: the primary back ends before OpenGL, hardware before software.
/// OpenGL is asked only where the others have nothing, since its start-up is slow and noisy.
fn adapters() -> Vec<wgpu::Adapter> {
    let found = adapters_of(wgpu::Backends::PRIMARY);
    if found.is_empty() { adapters_of(wgpu::Backends::GL) } else { found }
}

/// Adapters of an instance that takes nothing that is not WebGPU.
fn adapters_of(backends: wgpu::Backends) -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.flags |= wgpu::InstanceFlags::STRICT_WEBGPU_COMPLIANCE;
    descriptor.backends &= backends;
    let instance = wgpu::Instance::new(descriptor);
    let mut found = pollster::block_on(instance.enumerate_adapters(backends));
    found.retain(|adapter| webgpu_limits().check_limits(&adapter.limits()));
    found.sort_by_key(|adapter| type_rank(adapter.get_info().device_type));
    found
}

/// `wgpu::Limits::default()` without the one limit that is not WebGPU's: where wgpu is strict no adapter has it, and
/// nothing is checked against it.
#[must_use]
pub fn webgpu_limits() -> wgpu::Limits {
    let mut limits = wgpu::Limits::default();
    limits.zero_native_only();
    limits
}

fn type_rank(device_type: wgpu::DeviceType) -> u32 {
    match device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// Submits the commands and returns when they have run and every map callback has been called.
///
/// # Panics
/// When the device is lost.
#[expect(clippy::disallowed_methods, reason = "a test is the caller that submits and waits")]
pub fn submit_and_wait(device: &wgpu::Device, queue: &wgpu::Queue, encoder: wgpu::CommandEncoder) {
    queue.submit([encoder.finish()]);
    if let Err(error) = device.poll(wgpu::PollType::wait_indefinitely()) {
        panic!("waiting for the GPU failed: {error}");
    }
}

/// All bytes of a buffer that has the usage `COPY_SRC` and a length in whole words.
///
/// # Panics
/// When the length is not a multiple of 4, or when the device is lost.
#[must_use]
pub fn read_buffer(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u8> {
    let size = buffer.size();
    assert!(size.is_multiple_of(4), "a buffer of {size} bytes cannot be copied out as words");
    if size == 0 {
        return Vec::new();
    }
    let copy = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gpu-testkit.read.copy"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("gpu-testkit.read"),
    });
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, size);
    encoder.map_buffer_on_submit(&copy, wgpu::MapMode::Read, .., |result| {
        if let Err(error) = result {
            panic!("mapping for reading failed: {error}");
        }
    });
    submit_and_wait(device, queue, encoder);
    match copy.get_mapped_range(..) {
        Ok(view) => view.to_vec(),
        Err(error) => panic!("reading the mapped copy failed: {error}"),
    }
}

/// [`read_buffer`] as little-endian words.
///
/// # Panics
/// As [`read_buffer`].
#[must_use]
pub fn read_u32s(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&read_buffer(device, queue, buffer))
}

/// [`read_buffer`] as 32-bit floats.
///
/// # Panics
/// As [`read_buffer`].
#[must_use]
pub fn read_f32s(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(&read_buffer(device, queue, buffer))
}

/// A buffer with these contents and usages; the length is padded with zeros to whole words.
#[must_use]
pub fn buffer_with(
    device: &wgpu::Device,
    contents: &[u8],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("gpu-testkit.buffer"),
        contents,
        usage,
    })
}

/// A storage buffer filled with `pattern`, so that a test sees which words a kernel has written.
/// Usages: storage, indirect, copy source and destination.
///
/// # Panics
/// When `bytes` is not a multiple of 4.
#[must_use]
pub fn sentinel_buffer(device: &wgpu::Device, bytes: u64, pattern: u32) -> wgpu::Buffer {
    assert!(bytes.is_multiple_of(4), "a sentinel buffer holds whole words, not {bytes} bytes");
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gpu-testkit.sentinel"),
        size: bytes,
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::INDIRECT
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: true,
    });
    match buffer.get_mapped_range_mut(..) {
        Ok(mut view) => {
            let words = usize::try_from(bytes / 4).unwrap_or(usize::MAX);
            view.copy_from_slice(bytemuck::cast_slice(&vec![pattern; words]));
        }
        Err(error) => panic!("mapping the sentinel buffer failed: {error}"),
    }
    buffer.unmap();
    buffer
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATTERN: u32 = 0xDEAD_BEEF;

    #[test]
    fn the_device_offers_no_more_than_the_default_limits() {
        let (device, _queue) = device();
        assert_eq!(device.limits(), webgpu_limits());
        assert!(device.features().is_empty());
        assert!(!adapter_info().name.is_empty());
    }

    #[test]
    fn only_what_webgpu_has_is_offered() {
        let (device, _queue) = device();
        assert!(!adapter().features().contains(wgpu::Features::MAPPABLE_PRIMARY_BUFFERS));
        assert_eq!(device.limits().max_buffers_and_acceleration_structures_per_shader_stage, 0);
    }

    #[test]
    fn a_noop_device_copies_and_runs_nothing() {
        let (device, queue) = noop_device(wgpu::Limits::default());
        let source = buffer_with(&device, &[1, 2, 3, 4], wgpu::BufferUsages::COPY_SRC);
        assert_eq!(read_u32s(&device, &queue, &source), [0x0403_0201]);
    }

    #[test]
    fn sentinels_survive_where_nothing_is_written() {
        let (device, queue) = device();
        let target = sentinel_buffer(&device, 16, PATTERN);
        let source = buffer_with(&device, &[1, 2, 3], wgpu::BufferUsages::COPY_SRC);
        assert_eq!(source.size(), 4, "contents are padded to whole words");
        let mut encoder = device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&source, 0, &target, 8, 4);
        submit_and_wait(&device, &queue, encoder);
        assert_eq!(read_u32s(&device, &queue, &target), [PATTERN, PATTERN, 0x0003_0201, PATTERN]);
    }

    #[test]
    fn floats_come_back_bit_for_bit() {
        let (device, queue) = device();
        let values = [1.5f32, -0.0, f32::MIN_POSITIVE];
        let buffer =
            buffer_with(&device, bytemuck::cast_slice(&values), wgpu::BufferUsages::COPY_SRC);
        let back = read_f32s(&device, &queue, &buffer);
        assert_eq!(back.map_bits(), values.to_vec().map_bits());
    }

    trait MapBits {
        fn map_bits(&self) -> Vec<u32>;
    }

    impl MapBits for Vec<f32> {
        fn map_bits(&self) -> Vec<u32> {
            self.iter().map(|value| value.to_bits()).collect()
        }
    }

    #[test]
    #[should_panic(expected = "uncaptured GPU")]
    fn an_uncaptured_error_panics() {
        let (device, _queue) = device();
        let size = device.limits().max_buffer_size + 4;
        let usage = wgpu::BufferUsages::STORAGE;
        let _too_large = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        });
    }

    #[test]
    #[should_panic(expected = "whole words")]
    fn a_sentinel_buffer_of_part_words_is_refused() {
        let (device, _queue) = device();
        let _buffer = sentinel_buffer(&device, 6, PATTERN);
    }

    #[test]
    fn adapter_names_match_without_case() {
        assert!(name_matches("llvmpipe (LLVM 19)", "LLVMpipe"));
        assert!(name_matches("anything", ""));
        assert!(!name_matches("llvmpipe", "swiftshader"));
    }
}
