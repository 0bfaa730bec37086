//! The volume that is shown, and the one that is to take its place.

use progressive_iso::wgpu;
use volume_io::{FixedRateHeader, Geometry};

use crate::session::{Error, Session, Settings, Step};

/// Keeps what is shown until another volume has its first picture: whatever goes wrong before leaves
/// volume, view and settings as they are. Until then both are on the GPU, each within its own budget.
#[derive(Debug, Default)]
pub struct Exchange {
    settings: Settings,
    shown: Option<Session>,
    incoming: Option<Session>,
    has_ended: bool,
    failure: Option<Error>,
    refusal: Option<progressive_iso::Error>,
}

impl Exchange {
    /// No volume yet, and what is asked of those to come.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { settings, ..Self::default() }
    }

    /// Begins with a volume whose fixed-rate file starts with these bytes, which are to be pushed again
    /// with the others. Gives up the one that was on its way.
    ///
    /// # Errors
    /// If they are no such file's, or as [`Session::new`].
    pub fn open(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        start: &[u8],
        geometry: Geometry,
    ) -> Result<(), Error> {
        self.give_up();
        let header = FixedRateHeader::parse(start).ok_or(Error::NoFixedRate)?;
        self.incoming = Some(Session::new(device, queue, header, geometry, self.settings)?);
        Ok(())
    }

    /// Takes in the next bytes of the file and returns how many wait for the GPU.
    ///
    /// # Errors
    /// As [`Session::push`]; the volume is given up.
    pub fn push(&mut self, bytes: &[u8]) -> Result<u64, Error> {
        let pushed = self.incoming.as_mut().map_or(Ok(()), |session| session.push(bytes));
        self.check(pushed).map(|()| self.waiting_bytes())
    }

    /// Says that the file has ended.
    ///
    /// # Errors
    /// As [`Session::finish`]; the volume is given up.
    pub fn finish(&mut self) -> Result<(), Error> {
        let finished = self.incoming.as_mut().map_or(Ok(()), Session::finish);
        self.has_ended = finished.is_ok();
        self.check(finished)
    }

    fn check(&mut self, result: Result<(), Error>) -> Result<(), Error> {
        if result.is_err() {
            self.give_up();
        }
        result
    }

    /// Gives up the volume that is on its way.
    pub fn give_up(&mut self) {
        self.incoming = None;
        self.has_ended = false;
        self.failure = None;
    }

    /// Bytes that have arrived and are not on their way to the GPU.
    #[must_use]
    pub fn waiting_bytes(&self) -> u64 {
        self.incoming.as_ref().map_or(0, Session::waiting_bytes)
    }

    /// Why the volume that was on its way has been given up since the last call.
    pub fn take_failure(&mut self) -> Option<Error> {
        self.failure.take()
    }

    /// Goes on with both volumes.
    ///
    /// # Errors
    /// What went wrong with the device under the volume that is shown.
    pub fn advance(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Step, Error> {
        if let Some(mut incoming) = self.incoming.take() {
            match incoming.advance(device, queue) {
                Ok(step) if self.has_ended && incoming.has_picture() => {
                    self.shown = Some(incoming);
                    self.has_ended = false;
                    return Ok(Step { is_new: true, ..step });
                }
                Ok(_) => self.incoming = Some(incoming),
                Err(error) => {
                    self.give_up();
                    self.failure = Some(error);
                }
            }
        }
        let step = match &mut self.shown {
            Some(shown) => shown.advance(device, queue)?,
            None => Step { is_new: false, rests: true },
        };
        if let Some(error) = self.shown.as_mut().and_then(Session::take_refusal) {
            self.refusal = Some(error);
            self.settings = self.shown.as_ref().map_or(self.settings, |shown| *shown.settings());
            if let Some(incoming) = &mut self.incoming {
                incoming.set(self.settings);
            }
        }
        Ok(Step { rests: step.rests && self.incoming.is_none(), ..step })
    }

    /// What is asked of the volumes.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Asks for other settings, which a later step applies.
    pub fn set(&mut self, settings: Settings) {
        self.settings = settings;
        for session in [&mut self.shown, &mut self.incoming].into_iter().flatten() {
            session.set(settings);
        }
    }

    /// Why settings were refused since the last call; what was in force still is.
    pub fn take_refusal(&mut self) -> Option<progressive_iso::Error> {
        self.refusal.take()
    }

    /// The volume that is shown.
    #[must_use]
    pub fn shown(&self) -> Option<&Session> {
        self.shown.as_ref()
    }

    /// The volume that is shown.
    pub fn shown_mut(&mut self) -> Option<&mut Session> {
        self.shown.as_mut()
    }

    /// The volume that is on its way.
    #[must_use]
    pub fn incoming(&self) -> Option<&Session> {
        self.incoming.as_ref()
    }

    /// The volume that is on its way.
    pub fn incoming_mut(&mut self) -> Option<&mut Session> {
        self.incoming.as_mut()
    }
}
