//! What a renderer tells about its passes.

/// The state of a frame after its newest pass that the GPU has finished.
///
/// Passes are reported one or more calls late, because nothing waits for the GPU; `frame` and
/// `pass` name the pass that the numbers describe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PassReport {
    /// Whether this call submitted a pass; false while two are in flight and once the frame is
    /// complete.
    pub submitted: bool,
    /// Share of the volume that is loaded, 0 to 1; rays start at 1.
    pub loaded: f32,
    /// The frame described, counted from 1 by `set_frame`; 0 when none has been seen yet.
    pub frame: u64,
    /// The newest frame set.
    pub newest_frame: u64,
    /// The pass described, counted from 1 within its frame; 0 when none has finished yet.
    pub pass: u32,
    /// Rounds of the frame up to and including that pass; those that found no ray to work on do not count.
    pub rounds: u32,
    /// Pixels, hence rays.
    pub rays: u32,
    /// Pixels whose rays the frame has had cast so far: all, or those of the sampling mask of a foveated frame; of a preview its
    /// own.
    pub sampled_rays: u32,
    /// Pixels from one of the pass's rays to the next in both directions: 1 (0 before any report), or 2 or 4 where the first pass of a frame that is
    /// held to a time is a preview. Its pixels are those of the finished picture. What it does not know of the others, this
    /// report has from it: `entered_rays` is an estimate, `active_rays` is what is not finished of that, at least 1, and
    /// `open_depth_voxels` is the volume's diagonal.
    pub step: u32,
    /// Share of the rays that the frame's first pass might cast: less than 1 where a frame is held to
    /// [`crate::FrameOptions::target_ms`].
    pub density: f32,
    /// How far the pass looked ahead: [`crate::FrameOptions::look_ahead`], or 1 where a frame that is held to a time had
    /// too much to decode.
    pub look_ahead: u32,
    /// What the frame's first pass was predicted to take, in milliseconds, if it was.
    pub predicted_ms: Option<f64>,
    /// CPU time of the frame-time budget for this frame: pre-pass, prediction and learning, in milliseconds.
    pub budget_ms: f64,
    /// Rays that enter the volume.
    pub entered_rays: u32,
    /// Rays that are not finished.
    pub active_rays: u32,
    /// Pixels that show the surface.
    pub hits: u32,
    /// Bound on the depth that is still open, in voxels along the ray. A ray that is not finished has no
    /// hit before the block that it waits for, so its first hit, if it has one, lies between there and
    /// where it leaves the volume; this is the longest such part of any ray. It never grows within a
    /// frame (while the picture has at most 2^21 rays: in larger ones it is the volume's diagonal until all
    /// have started) and is 0 when the frame is complete. Computed in f32 from the numbers that the rays
    /// themselves use; of finished pixels it says nothing, since they do not change any more.
    pub open_depth_voxels: f32,
    /// Unfinished pixels that show a guess: see [`crate::Infill`]. All of them where a preview was shown in the frame, and, once
    /// the frame is complete enough, with [`crate::InfillOptions::half_resolution`].
    pub filled_pixels: u32,
    /// Pixels that are final.
    pub(crate) exact: u32,
    /// Whether the frame is as complete as [`crate::FrameOptions::stop_at`] asks for.
    pub(crate) stopped: bool,
    /// Resident blocks that rays used in this frame, once per round each. With `blocks_requested`,
    /// the growth from pass to pass is the number of blocks that a pass needs (the published
    /// "active blocks", neighbours included).
    pub blocks_used: u32,
    /// Blocks requested in this frame, once per round each.
    pub blocks_requested: u32,
    /// Blocks decoded in this frame, repeats included.
    pub blocks_decoded: u32,
    /// Blocks evicted in this frame.
    pub blocks_evicted: u32,
    /// `RunAhead`: most cells that all rays of a round visited together in this frame.
    pub most_cells: u32,
    /// Most that they may visit, so that no dispatch takes long: calibrated by the time of passes in which rays
    /// were cut short, from frame to frame.
    pub cells_bound: u32,
    /// How often in this frame a ray was cut short by that bound and went on in the next round.
    pub cut_walks: u32,
    /// `BlockSorted`: blocks that every ray went ahead in the pass's last round; 0 otherwise.
    pub speculation: u32,
    /// `BlockSorted`: ray-block pairs of the pass's last round; 0 otherwise.
    pub ray_block_pairs: u32,
    /// `BlockSorted`: blocks intersected in the pass's last round; 0 otherwise.
    pub visible_blocks: u32,
    /// Dispatches recorded for the described pass.
    pub dispatches: u32,
    /// CPU time of recording the described pass, in milliseconds.
    pub cpu_ms: f64,
    /// GPU time of the described pass in milliseconds, where the device has timestamp queries.
    pub gpu_ms: Option<f64>,
    /// Bytes of GPU memory allocated now.
    pub bytes: u64,
    /// Most bytes allocated at any time.
    pub peak_bytes: u64,
}

impl PassReport {
    /// Finished share of the rays that enter the volume, 0 to 1; 1 when none enters.
    #[must_use]
    pub fn completeness(&self) -> f64 {
        self.share(self.entered_rays)
    }

    /// Finished share of all pixels, those that miss the volume included.
    #[must_use]
    pub fn completeness_pixels(&self) -> f64 {
        self.share(self.rays)
    }

    fn share(&self, of: u32) -> f64 {
        if self.pass == 0 || self.frame != self.newest_frame {
            0.0
        } else if of == 0 {
            1.0
        } else {
            1.0 - f64::from(self.active_rays) / f64::from(of)
        }
    }

    /// Pixels that are final.
    #[must_use]
    pub fn exact_pixels(&self) -> u32 {
        self.exact
    }

    /// Whether the newest frame is as complete as [`crate::FrameOptions::stop_at`] asks for, so that the caller may
    /// call for no more passes.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.pass > 0 && self.frame == self.newest_frame && self.stopped
    }

    /// Whether the newest frame is finished: every pixel is final.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.pass > 0 && self.frame == self.newest_frame && self.active_rays == 0
    }
}
