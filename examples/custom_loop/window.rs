//! The loop in a window: one frame of the host per refresh of the display, until it is closed.

use std::sync::Arc;

use progressive_iso::wgpu;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::window::{Window, WindowId};

use crate::scene::Scene;
use crate::support::{Failure, Gpu};
use crate::{Arguments, orbit_degrees};

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let event_loop = EventLoop::new()?;
    let mut application = Application { arguments, shown: None, failure: None };
    event_loop.run_app(&mut application)?;
    application.failure.map_or(Ok(()), Err)
}

struct Application<'a> {
    arguments: &'a Arguments,
    shown: Option<Shown>,
    failure: Option<Failure>,
}

/// Everything that a window brings.
struct Shown {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    gpu: Gpu,
    scene: Scene,
    frame: u32,
}

impl ApplicationHandler for Application<'_> {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.shown.is_none() {
            let shown = Shown::new(event_loop, self.arguments);
            self.shown = self.keep(event_loop, shown);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        let result = match event {
            WindowEvent::CloseRequested => {
                event_loop.exit();
                return;
            }
            WindowEvent::Resized(size) => shown.resize([size.width, size.height]),
            WindowEvent::RedrawRequested => shown.redraw(),
            _ => Ok(()),
        };
        let frame = shown.frame;
        let finished = self.arguments.frames.is_some_and(|frames| frame >= frames);
        if self.keep(event_loop, result).is_none() || finished {
            event_loop.exit();
        }
    }
}

impl Application<'_> {
    /// The value, or the failure kept for the end of the loop.
    fn keep<T>(&mut self, event_loop: &ActiveEventLoop, result: Result<T, Failure>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(failure) => {
                self.failure = Some(failure);
                event_loop.exit();
                None
            }
        }
    }
}

impl Shown {
    fn new(event_loop: &ActiveEventLoop, arguments: &Arguments) -> Result<Self, Failure> {
        let attributes = Window::default_attributes().with_title("progressive-iso: custom_loop");
        let window = Arc::new(event_loop.create_window(attributes)?);
        let display = Box::new(event_loop.owned_display_handle());
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle(display));
        let surface = instance.create_surface(Arc::clone(&window))?;
        let request = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&request))?;
        let gpu = Gpu::open(std::slice::from_ref(&adapter))?;
        println!("adapter  {}", gpu.name());

        let size = window.inner_size();
        let mut config = surface
            .get_default_config(&adapter, size.width.max(1), size.height.max(1))
            .ok_or("the adapter cannot draw into this window")?;
        let formats = surface.get_capabilities(&adapter).formats;
        config.format =
            formats.into_iter().find(wgpu::TextureFormat::is_srgb).unwrap_or(config.format);
        surface.configure(&gpu.device, &config);
        let scene_size = [config.width, config.height];
        let scene = Scene::new(&gpu, config.format, scene_size, arguments.budget << 20)?;
        window.request_redraw();
        Ok(Self { window, surface, config, gpu, scene, frame: 0 })
    }

    fn resize(&mut self, size: [u32; 2]) -> Result<(), Failure> {
        if size.contains(&0) || size == [self.config.width, self.config.height] {
            return Ok(()); // Minimised, or nothing new.
        }
        [self.config.width, self.config.height] = size;
        self.surface.configure(&self.gpu.device, &self.config);
        self.scene.resize(&self.gpu, size)
    }

    fn redraw(&mut self) -> Result<(), Failure> {
        self.window.request_redraw();
        let target = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(target)
            | wgpu::CurrentSurfaceTexture::Suboptimal(target) => target,
            wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                self.surface.configure(&self.gpu.device, &self.config);
                return Ok(());
            }
            _ => return Ok(()), // Hidden or late: the next redraw tries again.
        };
        let view = target.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("host.frame") });
        self.scene.record(&self.gpu, &mut encoder, &view, orbit_degrees(self.frame))?;
        self.gpu.queue.submit([encoder.finish()]);
        self.window.pre_present_notify();
        self.gpu.queue.present(target);
        self.frame += 1;
        Ok(())
    }
}
