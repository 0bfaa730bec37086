//! The browser's GPU.

use std::sync::{Arc, Mutex, PoisonError};

use progressive_iso::wgpu;
use wasm_bindgen::prelude::*;
use web_sys::HtmlCanvasElement;

/// A device and the canvas that it presents to.
#[derive(Debug)]
pub(super) struct Gpu {
    pub(super) adapter: wgpu::Adapter,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    /// None where pictures are read back instead of presented.
    pub(super) surface: Option<wgpu::Surface<'static>>,
    trouble: Trouble,
}

/// What the device says outside of calls; the first thing counts.
#[derive(Clone, Debug, Default)]
struct Trouble(Arc<Mutex<Option<String>>>);

impl Trouble {
    fn tell(&self, message: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
    }

    fn told(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Gpu {
    /// A device with WebGPU's default limits. `canvas` is left alone unless it is presented to.
    pub(super) async fn new(canvas: HtmlCanvasElement, presents: bool) -> Result<Self, JsError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::BROWSER_WEBGPU,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let surface = presents
            .then(|| instance.create_surface(wgpu::SurfaceTarget::Canvas(canvas)))
            .transpose()?;
        let request = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface.as_ref(),
            ..Default::default()
        };
        let adapter = instance.request_adapter(&request).await?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("web.device"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            ..Default::default()
        };
        let (device, queue) = adapter.request_device(&descriptor).await?;
        let trouble = Trouble::default();
        let heard = trouble.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            heard.tell(error.to_string());
        }));
        let heard = trouble.clone();
        device.set_device_lost_callback(move |reason, message| {
            heard.tell(format!("the GPU device is lost ({reason:?}): {message}"));
        });
        Ok(Self { adapter, device, queue, surface, trouble })
    }

    /// What went wrong outside of calls, if anything did.
    pub(super) fn check(&self) -> Result<(), JsError> {
        self.trouble.told().map_or(Ok(()), |message| Err(JsError::new(&message)))
    }

    /// Name of the adapter, as far as the browser tells.
    pub(super) fn name(&self) -> String {
        let info = self.adapter.get_info();
        let parts = [info.name, info.driver];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", ")
    }

    pub(super) fn submit(&self, encoder: wgpu::CommandEncoder) {
        #[expect(clippy::disallowed_methods, reason = "the page owns the queue")]
        self.queue.submit([encoder.finish()]);
    }

    pub(super) fn encoder(&self) -> wgpu::CommandEncoder {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("web.present") };
        self.device.create_command_encoder(&descriptor)
    }
}
