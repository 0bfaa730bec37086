//! One sequence of frames, filled in every way.

use std::path::Path;

use progressive_iso::{BlockSortedOptions, InfillWeights, TraversalStrategy};

use crate::contender::{Contender, Cut, WAYS};
use crate::rows::{Frame, Row};
use crate::subject::{Motion, Subject};
#[cfg(feature = "published-network")]
use crate::support::published::PublishedNetwork;
use crate::support::shown::{self, Shown, holes, nearest};
use crate::support::{Failure, Gpu};

/// The renderers for one volume.
pub struct Sequence {
    /// In the order of [`WAYS`].
    contenders: Vec<Contender>,
    #[cfg(feature = "published-network")]
    published: Option<PublishedNetwork>,
    size: [u32; 2],
}

/// A picture by a method, with what it cost.
struct Made {
    method: &'static str,
    shown: Shown,
    ms: f64,
    bytes: u64,
}

impl Sequence {
    pub fn new(
        gpu: &Gpu,
        subject: &Subject,
        size: [u32; 2],
        weights: &'static InfillWeights,
        published: Option<&Path>,
    ) -> Result<Self, Failure> {
        let strategy = TraversalStrategy::BlockSorted(BlockSortedOptions::default());
        let contenders = WAYS
            .iter()
            .map(|way| Contender::new(gpu, &subject.volume, size, *way, weights, strategy))
            .collect::<Result<Vec<_>, _>>()?;
        if published.is_some() && !cfg!(feature = "published-network") {
            return Err("--published needs the feature published-network".into());
        }
        let sequence = Self {
            contenders,
            #[cfg(feature = "published-network")]
            published: None,
            size,
        };
        sequence.with_published(gpu, published)
    }

    #[cfg(feature = "published-network")]
    fn with_published(mut self, gpu: &Gpu, weights: Option<&Path>) -> Result<Self, Failure> {
        if let Some(weights) = weights {
            let renderer = &self.contenders[0].renderer;
            self.published = Some(PublishedNetwork::new(gpu, renderer, self.size, weights)?);
        }
        Ok(self)
    }

    #[cfg(not(feature = "published-network"))]
    fn with_published(self, _gpu: &Gpu, _weights: Option<&Path>) -> Result<Self, Failure> {
        Ok(self)
    }

    /// Means over the frames of a sequence, one row per method; the last frame's pictures go to `out`.
    pub fn measure(
        &mut self,
        gpu: &Gpu,
        subject: &Subject,
        motion: Motion,
        cut: f64,
        frames: u32,
        out: &Path,
    ) -> Result<Vec<Row>, Failure> {
        let (mut measured, mut before): (Vec<Frame>, Option<Vec<Shown>>) = (Vec::new(), None);
        let mut last_isovalue = None;
        for frame in 0..frames {
            let (camera, isovalue) = subject.view(motion, frame, frames, self.size);
            let cuts = self
                .contenders
                .iter_mut()
                .map(|contender| contender.cut(gpu, camera, isovalue, cut))
                .collect::<Result<Vec<_>, _>>()?;
            let holes = holes(&cuts[0].capture);
            if cuts.iter().any(|c| shown::holes(&c.capture) != holes) {
                return Err("the renderers have finished different pixels".into());
            }
            let new_start = last_isovalue != Some(isovalue);
            let made = self.pictures(gpu, &cuts, &holes, new_start)?;
            let truth = Shown::from(&self.contenders[0].finish(gpu)?);
            let old = before.take().filter(|_| !new_start);
            let is_last = frame + 1 == frames;
            let share = cuts[0].report.completeness_pixels();
            let size = self.size;
            // The measures take longer than the pictures.
            measured.extend(
                std::thread::scope(|scope| {
                    let of = |(i, made): (usize, &Made)| {
                        let previous = old.as_ref().map(|old| (&old[i], &old[old.len() - 1]));
                        let shown = (&made.shown, &truth, &holes[..]);
                        let cost = (made.ms, made.bytes);
                        Frame::new(made.method, shown, previous, size, cost, is_last, share)
                    };
                    let threads: Vec<_> =
                        made.iter().enumerate().map(|made| scope.spawn(move || of(made))).collect();
                    threads.into_iter().map(|thread| thread.join()).collect::<Result<Vec<_>, _>>()
                })
                .map_err(|_panic| "a measure failed")?,
            );
            if is_last {
                let name = format!("{}-{}-{}-{cut}", subject.name, motion.name(), motion.degrees());
                self.write(out, &name, &made, &truth)?;
            }
            last_isovalue = Some(isovalue);
            before = Some(made.into_iter().map(|made| made.shown).chain([truth]).collect());
        }
        Ok(Row::means(&measured, subject.name, cut, motion))
    }

    /// What every method makes of a cut frame.
    fn pictures(
        &mut self,
        gpu: &Gpu,
        cuts: &[Cut],
        holes: &[bool],
        new_start: bool,
    ) -> Result<Vec<Made>, Failure> {
        let plain_bytes = cuts[0].report.bytes;
        let mut made: Vec<Made> = WAYS
            .iter()
            .zip(cuts)
            .map(|(way, cut)| Made {
                method: way.name,
                shown: Shown::from(&cut.capture),
                ms: (cut.last_pass_ms - cuts[0].last_pass_ms).max(0.0),
                bytes: cut.report.bytes.saturating_sub(plain_bytes),
            })
            .collect();
        let shown = nearest(&made[0].shown, holes, self.size);
        made.push(Made { method: "nearest", shown, ms: 0.0, bytes: 0 });
        made.extend(self.published(gpu, new_start)?);
        let network_ms = made.iter().find(|m| m.method == "network").map_or(0.0, |m| m.ms);
        let capture = self.contenders[0].go_on(gpu, network_ms)?;
        let shown = Shown::from(&capture);
        made.push(Made { method: "more-passes", shown, ms: network_ms, bytes: 0 });
        Ok(made)
    }

    #[cfg(feature = "published-network")]
    fn published(&self, gpu: &Gpu, new_start: bool) -> Result<Option<Made>, Failure> {
        let Some(network) = &self.published else { return Ok(None) };
        let (shown, ms) = network.picture(gpu, new_start)?;
        Ok(Some(Made { method: "published", shown, ms, bytes: network.bytes }))
    }

    #[cfg(not(feature = "published-network"))]
    fn published(&self, _gpu: &Gpu, _new_start: bool) -> Result<Option<Made>, Failure> {
        Ok(None)
    }

    fn write(&self, out: &Path, name: &str, made: &[Made], truth: &Shown) -> Result<(), Failure> {
        let pictures = made.iter().map(|m| (m.method, &m.shown)).chain([("truth", truth)]);
        for (method, shown) in pictures {
            shown.write(&out.join(format!("{name}-{method}.png")), self.size)?;
        }
        Ok(())
    }
}
