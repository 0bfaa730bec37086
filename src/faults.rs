//! What the device reports of this library's own work, without blocking.

use std::fmt;
use std::pin::Pin;
use std::sync::{Mutex, PoisonError};
use std::task::{Context, Poll, Waker};

use gpu_primitives::readback::Lost;

use crate::{Error, wgpu};

#[cfg(not(target_arch = "wasm32"))]
type Outcome = Pin<Box<dyn Future<Output = Option<wgpu::Error>> + Send>>;
#[cfg(target_arch = "wasm32")]
type Outcome = Pin<Box<dyn Future<Output = Option<wgpu::Error>>>>;

/// What a piece of work makes; decides what a refusal is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
    /// Shaders and pipelines.
    Pipelines,
    /// Memory, bind groups, commands.
    Other,
}

/// Error scopes around a piece of work: its errors come here and not to the caller's handler.
#[derive(Debug)]
#[must_use]
pub(crate) struct Scopes {
    device: wgpu::Device,
    task: Task,
    // Closed, and dropped where an error leads out of the work, in this order: that of opening, backwards.
    memory: wgpu::ErrorScopeGuard,
    validation: wgpu::ErrorScopeGuard,
    internal: wgpu::ErrorScopeGuard,
}

impl Scopes {
    pub(crate) fn open(device: &wgpu::Device, task: Task) -> Self {
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        Self { device: device.clone(), task, memory, validation, internal }
    }

    /// What comes of them. Want of memory comes first: what else is refused is refused because of it.
    fn outcomes(self) -> [Outcome; 3] {
        let Self { internal, validation, memory, .. } = self;
        [Box::pin(memory.pop()), Box::pin(validation.pop()), Box::pin(internal.pop())]
    }
}

/// The first thing that went wrong, and the scopes whose outcome is not known yet.
#[derive(Default)]
pub(crate) struct Faults {
    first: Option<Error>,
    /// Empty but in browsers, which answer later.
    pending: Mutex<Vec<(Task, Outcome)>>,
}

impl Faults {
    /// Does a task within scopes; its own error gives way to what the device says, which is the cause.
    pub(crate) fn guard<T>(
        &mut self,
        device: &wgpu::Device,
        task: Task,
        does: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let scopes = Scopes::open(device, task);
        let done = does();
        self.close(scopes)?;
        done
    }

    /// Ends the work that `scopes` were opened for.
    ///
    /// # Errors
    /// As [`Faults::check`].
    pub(crate) fn close(&mut self, scopes: Scopes) -> Result<(), Error> {
        let (device, task) = (scopes.device.clone(), scopes.task);
        self.pending().extend(scopes.outcomes().map(|outcome| (task, outcome)));
        let known = self.first.is_some();
        let found = self.check();
        // A lost device makes nothing without a word, and then refuses what is done with it.
        let refused = matches!(found, Err(Error::Refused { .. } | Error::ShaderRefused { .. }));
        if !known && refused && is_lost(&device) {
            self.first = Some(Error::DeviceLost);
        }
        self.check()
    }

    /// # Errors
    /// The first fault, if one is known: it stays.
    pub(crate) fn check(&mut self) -> Result<(), Error> {
        let mut found = None;
        self.pending().retain_mut(|(task, outcome)| match poll(outcome) {
            Poll::Pending => true,
            Poll::Ready(None) => false,
            Poll::Ready(Some(error)) => {
                found.get_or_insert_with(|| typed(*task, error));
                false
            }
        });
        self.first = self.first.take().or(found);
        self.first.clone().map_or(Ok(()), Err)
    }

    /// Whether the outcome of everything done so far is known.
    pub(crate) fn all_known(&mut self) -> bool {
        self.pending().is_empty()
    }

    /// Keeps a fault that no scope sees.
    ///
    /// # Errors
    /// As [`Faults::check`].
    pub(crate) fn keep(&mut self, error: Error) -> Result<(), Error> {
        self.first.get_or_insert(error);
        self.check()
    }

    fn pending(&mut self) -> &mut Vec<(Task, Outcome)> {
        // Whole between any two statements, so a poisoned lock does no harm.
        self.pending.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Faults").field("first", &self.first).finish_non_exhaustive()
    }
}

fn poll(outcome: &mut Outcome) -> Poll<Option<wgpu::Error>> {
    outcome.as_mut().poll(&mut Context::from_waker(Waker::noop()))
}

fn typed(task: Task, error: wgpu::Error) -> Error {
    match (error, task) {
        (wgpu::Error::OutOfMemory { source }, _) => Error::OutOfMemory { message: chain(&*source) },
        (
            wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. },
            Task::Pipelines,
        ) => Error::ShaderRefused { message: description },
        (
            wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. },
            Task::Other,
        ) => Error::Refused { message: description },
    }
}

impl From<Lost> for Error {
    fn from(lost: Lost) -> Self {
        match lost {
            Lost::Dropped => Self::LoadDropped,
            Lost::NotRun => Self::NotRun,
            _ => Self::MapFailed,
        }
    }
}

/// An error and what led to it.
fn chain(error: &dyn std::error::Error) -> String {
    std::iter::successors(error.source(), |cause| cause.source())
        .fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// Whether the device is lost: it makes nothing any more and reports no error for it. Browsers make
/// mapped buffers even then and do not tell.
pub(crate) fn is_lost(device: &wgpu::Device) -> bool {
    let scopes = Scopes::open(device, Task::Other);
    // Gone at the end of this function, so not counted.
    let probe = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("progressive-iso.probe"),
        size: 4,
        usage: wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    });
    let mapped = probe.get_mapped_range_mut(..).is_ok();
    let refused = |mut outcome| matches!(poll(&mut outcome), Poll::Ready(Some(_)));
    let refused = scopes.outcomes().into_iter().any(refused);
    !mapped && !refused
}
