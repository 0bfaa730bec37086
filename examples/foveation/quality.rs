//! Pictures after one pass of foveated frames, filled in every way.

use std::path::Path;

use progressive_iso::Capture;
use serde::{Deserialize, Serialize};

use crate::Arguments;
use crate::filler::{Filler, OFF, WAYS, Way, options};
use crate::measures::{Measures, Picture, means, tpsnr};
use crate::sets::Plan;
#[cfg(feature = "published-network")]
use crate::support::published::PublishedNetwork;
use crate::support::shown::{Shown, holes, nearest};
use crate::support::{Failure, Gpu};
use crate::view::{Place, Volume, fovea, foveation};

/// Means over the frames of an orbit with a moving gaze.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Quality {
    pub volume: String,
    pub method: String,
    pub base_density: f32,
    pub size: [u32; 2],
    pub frames: u32,
    /// Share of the pixels that the sampling mask had.
    pub sampled: f64,
    /// Share of the pixels that were finished: those, and what lies beside the volume.
    pub finished: f64,
    pub all: Measures,
    /// Within a standard deviation of the gaze.
    pub fovea: Measures,
    pub periphery: Measures,
    /// dB; null for a single frame.
    pub tpsnr: Option<f64>,
    /// Gaze of every frame, in shares of the edges.
    pub gaze: Vec<[f32; 2]>,
}

type Methods = Vec<(&'static str, Shown)>;

/// The renderers of one volume.
struct Contest<'a> {
    gpu: &'a Gpu,
    volume: &'a Volume,
    size: [u32; 2],
    /// Those of [`WAYS`] that are wanted, and the first.
    fillers: Vec<Filler>,
    exact: Filler,
    with_nearest: bool,
    #[cfg(feature = "published-network")]
    published: Option<PublishedNetwork>,
}

/// Adds a row for every method and density.
pub fn measure(
    gpu: &Gpu,
    volume: &Volume,
    plan: &Plan,
    arguments: &Arguments,
    rows: &mut Vec<Quality>,
) -> Result<(), Failure> {
    for &base_density in plan.densities {
        let mut contest = Contest::new(gpu, volume, plan.quality_size, arguments)?;
        let found = contest.measure(base_density, plan.frames, arguments)?;
        found.iter().for_each(|row| println!("{}", row.line()));
        rows.extend(found);
    }
    Ok(())
}

impl<'a> Contest<'a> {
    fn new(
        gpu: &'a Gpu,
        volume: &'a Volume,
        size: [u32; 2],
        arguments: &Arguments,
    ) -> Result<Self, Failure> {
        let published = arguments.published.as_deref();
        if published.is_some() && !cfg!(feature = "published-network") {
            return Err("--published needs the feature published-network".into());
        }
        let filler = |way| Filler::new(gpu, volume, way, options(size, way, true));
        // The first is what others are compared with, and what some fill.
        let wanted = |(i, way): &(usize, Way)| *i == 0 || arguments.wants_method(way.name);
        let ways = WAYS.into_iter().enumerate().filter(wanted);
        let fillers = ways.map(|(_, way)| filler(way)).collect::<Result<Vec<_>, _>>()?;
        let exact = Filler::new(gpu, volume, OFF, options(size, OFF, false))?;
        #[cfg(feature = "published-network")]
        let published = published
            .map(|path| PublishedNetwork::new(gpu, &fillers[0].renderer, size, path))
            .transpose()?;
        Ok(Self {
            gpu,
            volume,
            size,
            fillers,
            exact,
            with_nearest: arguments.wants_method("nearest"),
            #[cfg(feature = "published-network")]
            published,
        })
    }

    fn measure(
        &mut self,
        base_density: f32,
        frames: u32,
        arguments: &Arguments,
    ) -> Result<Vec<Quality>, Failure> {
        let mut pictures: Vec<Picture> = Vec::new();
        let mut before: Option<(Methods, Shown)> = None;
        let (mut sampled, mut finished, mut gaze) = (0.0, 0.0, Vec::new());
        for frame in 0..frames {
            let view = foveation(frame, base_density);
            let exact = Shown::from(&self.exact_picture(frame)?);
            let (methods, shares) = self.pictures(frame, base_density, &exact)?;
            let fovea = fovea(&view, self.size);
            for (i, (method, shown)) in methods.iter().enumerate() {
                let old = before.as_ref().map(|(old, exact)| (&old[i].1, exact));
                pictures.push(Picture::new(method, (shown, &exact), old, &fovea, self.size));
            }
            if arguments.films || frame + 1 == frames {
                self.write(&arguments.out, (base_density, frame), &methods, &exact)?;
            }
            sampled += shares[0] / f64::from(frames);
            finished += shares[1] / f64::from(frames);
            gaze.push(view.gaze);
            before = Some((methods, exact));
        }
        let Some((mut methods, _)) = before else { return Ok(Vec::new()) };
        methods.retain(|(method, _)| arguments.wants_method(method));
        let row = |(method, _): &(&'static str, Shown)| {
            let own: Vec<&Picture> = pictures.iter().filter(|p| p.method == *method).collect();
            let [all, fovea, periphery] = means(&own);
            Quality {
                volume: self.volume.name.clone(),
                method: (*method).into(),
                base_density,
                size: self.size,
                frames,
                sampled,
                finished,
                all,
                fovea,
                periphery,
                tpsnr: tpsnr(&own),
                gaze: gaze.clone(),
            }
        };
        Ok(methods.iter().map(row).collect())
    }

    fn exact_picture(&mut self, frame: u32) -> Result<Capture, Failure> {
        self.exact.set_frame(self.volume.camera(Place::Near, frame, self.size), None)?;
        self.exact.finish(self.gpu)?;
        self.exact.capture(self.gpu)
    }

    /// What every method shows, and the shares of the pixels that were sampled and finished.
    fn pictures(
        &mut self,
        frame: u32,
        base_density: f32,
        exact: &Shown,
    ) -> Result<(Methods, [f64; 2]), Failure> {
        let (mut made, mut known, mut shares) = (Methods::new(), Vec::new(), [0.0; 2]);
        for filler in &mut self.fillers {
            let camera = self.volume.camera(Place::Near, frame, self.size);
            filler.set_frame(camera, Some(foveation(frame, base_density)))?;
            let report = filler.pass(self.gpu)?;
            let capture = filler.capture(self.gpu)?;
            let shown = Shown::from(&capture);
            let open = holes(&capture);
            if known.is_empty() {
                shares = [report.sampled_rays, report.exact_pixels()]
                    .map(|count| f64::from(count) / f64::from(report.rays));
                known = open;
            } else if known != open {
                return Err("the renderers have finished different pixels".into());
            }
            check_finished(&shown, exact, &known)?;
            made.push((filler.way.name, shown));
        }
        if self.with_nearest {
            made.push(("nearest", nearest(&made[0].1, &known, self.size)));
        }
        made.extend(self.published(frame)?.map(|shown| ("published", shown)));
        Ok((made, shares))
    }

    #[cfg(feature = "published-network")]
    fn published(&self, frame: u32) -> Result<Option<Shown>, Failure> {
        let Some(network) = &self.published else { return Ok(None) };
        Ok(Some(network.picture(self.gpu, frame == 0)?.0))
    }

    #[cfg(not(feature = "published-network"))]
    fn published(&self, _frame: u32) -> Result<Option<Shown>, Failure> {
        Ok(None)
    }

    fn write(
        &self,
        out: &Path,
        (base_density, frame): (f32, u32),
        methods: &Methods,
        exact: &Shown,
    ) -> Result<(), Failure> {
        let all = methods.iter().map(|(name, shown)| (*name, shown));
        for (method, shown) in all.chain([("exact", exact)]) {
            let name = format!("{}-{base_density}-{method}-{frame:02}.png", self.volume.name);
            shown.write(&out.join(name), self.size)?;
        }
        Ok(())
    }
}

/// Sampled pixels are those of the exact picture, bit for bit.
fn check_finished(shown: &Shown, exact: &Shown, holes: &[bool]) -> Result<(), Failure> {
    let differs = (0..holes.len()).filter(|&i| !holes[i] && shown.colors[i] != exact.colors[i]);
    match differs.count() {
        0 => Ok(()),
        count => Err(format!("{count} sampled pixels are not exact").into()),
    }
}

impl Quality {
    /// One line of progress.
    fn line(&self) -> String {
        let Self { volume, base_density, method, all, fovea, periphery, tpsnr, .. } = self;
        let cell = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.2}"));
        let psnr = [all.psnr, fovea.psnr, periphery.psnr, *tpsnr].map(cell).join(" ");
        format!(
            "{volume:<16} {base_density:.2} {method:<15} {psnr} {:.4} {:.4}",
            all.ssim, all.flip
        )
    }
}
