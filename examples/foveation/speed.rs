//! Times of full and of foveated frames, nothing missing.

use std::collections::BTreeMap;
use std::time::Instant;

use progressive_iso::{Foveation, Outputs, RendererOptions, Residency};
use serde::{Deserialize, Serialize};

use crate::filler::{
    Filler, OFF, PUSH_PULL, SPARSE, SPARSE_HALF, SPARSE_NO_COARSE, SPARSE_NO_COARSE_HALF, Way,
    options,
};
use crate::sets::{Plan, SIGMA};
use crate::support::{Failure, Gpu, median};
use crate::view::{Place, Volume};

/// What is measured of a volume.
struct Case<'a> {
    place: Place,
    residency: Residency,
    name: &'static str,
    densities: &'a [f32],
    fills: &'static [Way],
}

/// Without the coarse field at full resolution, which takes longer than the full frame.
const FILLS: &[Way] = &[PUSH_PULL, SPARSE_NO_COARSE, SPARSE_NO_COARSE_HALF, SPARSE_HALF];
const ALL_FILLS: &[Way] =
    &[PUSH_PULL, SPARSE_NO_COARSE, SPARSE_NO_COARSE_HALF, SPARSE_HALF, SPARSE];

/// Medians of wall times from setting a frame to its report, and of how many times faster frames were than the full one
/// before them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Speed {
    pub volume: String,
    pub place: Place,
    /// "full" or "cached", with all blocks in the cache.
    pub residency: String,
    pub size: [u32; 2],
    pub base_density: f32,
    /// Mean density, whose inverse is the most that tracing can be faster where every ray takes as long.
    pub c_max: f64,
    /// Share of the pixels that the mask had.
    pub sampled: f64,
    /// Share of the pixels whose rays enter the volume.
    pub entered: f64,
    /// The finished frame without foveation, colour alone.
    pub full_ms: f64,
    /// The first pass of the foveated one, colour alone, not filled.
    pub traced_ms: f64,
    pub traced_speedup: f64,
    /// Tracing against 1 / `c_max`.
    pub efficiency: f64,
    pub fills: Vec<Fill>,
    /// With the feature `wgpu-profiler`: GPU times by stage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<Stages>,
}

/// Medians of the GPU times of one frame's stages.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Stages {
    /// "full", "traced" or a filler's name.
    pub frame: String,
    pub ms: BTreeMap<String, f64>,
    /// Wall time less all stages.
    pub rest_ms: f64,
}

/// The first pass with filling, depth and normals included.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Fill {
    pub method: String,
    pub ms: f64,
    pub speedup: f64,
}

/// A renderer with the frames of which it takes the times.
struct Clocked {
    /// Its own: renderers that share a device of a software adapter make each other slower.
    gpu: Gpu,
    filler: Filler,
    place: Place,
    size: [u32; 2],
    foveated: bool,
    ms: Vec<f64>,
    stage_ms: BTreeMap<String, Vec<f64>>,
    sampled: f64,
    entered: f64,
}

/// Adds a row for every density, with a warm cache and with everything resident.
pub fn measure(
    adapter: Option<&str>,
    volume: &Volume,
    plan: &Plan,
    rows: &mut Vec<Speed>,
) -> Result<(), Failure> {
    let near = Case {
        place: Place::Near,
        residency: Residency::Cached,
        name: "cached",
        densities: plan.speed_densities,
        fills: FILLS,
    };
    let middle = std::slice::from_ref(&plan.middle_density);
    let full = Case {
        residency: Residency::Full,
        name: "full",
        densities: middle,
        fills: ALL_FILLS,
        ..near
    };
    let far = Case { place: Place::Far, densities: middle, ..near };
    for case in [near, full, far] {
        measure_case(adapter, volume, plan, &case, rows)?;
    }
    Ok(())
}

fn measure_case(
    adapter: Option<&str>,
    volume: &Volume,
    plan: &Plan,
    case: &Case<'_>,
    rows: &mut Vec<Speed>,
) -> Result<(), Failure> {
    let clocked = |way, foveated| {
        let residency = case.residency;
        let options = RendererOptions { residency, ..options(plan.speed_size, way, foveated) };
        Clocked::new(adapter, volume, case.place, way, options)
    };
    let mut contenders = vec![clocked(OFF, false)?, clocked(OFF, true)?];
    for way in case.fills {
        contenders.push(clocked(*way, true)?);
    }
    for &base_density in case.densities {
        let foveation = Foveation { sigma: SIGMA, base_density, ..Foveation::default() };
        for run in 0..=plan.runs {
            for contender in &mut contenders {
                contender.run(volume, run, foveation)?;
            }
        }
        let row = Speed::new(volume, case.name, foveation, &mut contenders);
        println!("{}", row.line());
        rows.push(row);
    }
    Ok(())
}

impl Clocked {
    /// Renders a frame to its end, so that whatever it needs is decoded.
    fn new(
        adapter: Option<&str>,
        volume: &Volume,
        place: Place,
        way: Way,
        options: RendererOptions,
    ) -> Result<Self, Failure> {
        let options = RendererOptions { outputs: Outputs::default(), capture: false, ..options };
        let (size, foveated) = (options.size, options.foveation.is_some());
        let gpu = Gpu::new(adapter)?;
        let mut filler = Filler::new(&gpu, volume, way, options)?;
        filler.set_frame(volume.camera(place, 0, size), None)?;
        filler.finish(&gpu)?;
        let (ms, stage_ms) = Default::default();
        Ok(Self { gpu, filler, place, size, foveated, ms, stage_ms, sampled: 1.0, entered: 0.0 })
    }

    /// One frame; the first of a series does not count.
    fn run(&mut self, volume: &Volume, run: u32, foveation: Foveation) -> Result<(), Failure> {
        let camera = volume.camera(self.place, 0, self.size);
        let start = Instant::now();
        self.filler.set_frame(camera, self.foveated.then_some(foveation))?;
        let report = if self.foveated {
            self.filler.pass(&self.gpu)?
        } else {
            self.filler.finish(&self.gpu)?
        };
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let share = |count: u32| f64::from(count) / f64::from(report.rays);
        (self.sampled, self.entered) = (share(report.sampled_rays), share(report.entered_rays));
        if run > 0 {
            self.ms.push(ms);
            self.note_stages();
        }
        Ok(())
    }

    /// Full frames have one pass, too, as nothing is missing.
    fn note_stages(&mut self) {
        #[cfg(feature = "wgpu-profiler")]
        {
            let mut sums = BTreeMap::<String, f64>::new();
            for stage in self.filler.renderer.stage_times() {
                *sums.entry(stage.label.clone()).or_default() += stage.ms;
            }
            for (label, ms) in sums {
                self.stage_ms.entry(label).or_default().push(ms);
            }
        }
    }

    fn take_stages(&mut self, frame: &str, wall_ms: f64) -> Option<Stages> {
        let stages = std::mem::take(&mut self.stage_ms);
        let ms: BTreeMap<_, _> =
            stages.into_iter().map(|(label, ms)| (label, median(ms.into_iter()))).collect();
        let rest_ms = wall_ms - ms.values().sum::<f64>();
        (!ms.is_empty()).then(|| Stages { frame: frame.to_owned(), ms, rest_ms })
    }

    fn median(&self) -> f64 {
        median(self.ms.iter().copied())
    }

    /// How many times faster than `full`: the median over the runs, in which they took turns, since the machine's speed
    /// changes between them.
    fn speedup(&self, full: &Self) -> f64 {
        median(full.ms.iter().zip(&self.ms).map(|(full, own)| full / own))
    }
}

impl Speed {
    /// From the runs of the full frame, the traced one and the filled ones.
    fn new(
        volume: &Volume,
        residency: &'static str,
        foveation: Foveation,
        contenders: &mut [Clocked],
    ) -> Self {
        let ms: Vec<f64> = contenders.iter().map(Clocked::median).collect();
        let speedups: Vec<f64> = contenders.iter().map(|own| own.speedup(&contenders[0])).collect();
        let (full_ms, traced_ms, traced_speedup) = (ms[0], ms[1], speedups[1]);
        let stages =
            contenders.iter_mut().zip(&ms).enumerate().filter_map(|(i, (clocked, &ms))| {
                let name = ["full", "traced"].get(i).copied();
                clocked.take_stages(name.unwrap_or(clocked.filler.way.name), ms)
            });
        let stages = stages.collect();
        let Clocked { place, size, sampled, entered, .. } = contenders[1];
        let c_max = foveation.mean_density(size);
        let fills = contenders.iter().zip(&ms).zip(&speedups).skip(2);
        let fills = fills.map(|((contender, &ms), &speedup)| Fill {
            method: contender.filler.way.name.into(),
            ms,
            speedup,
        });
        let fills = fills.collect();
        for contender in contenders {
            contender.ms.clear();
        }
        Self {
            volume: volume.name.clone(),
            place,
            residency: residency.into(),
            size,
            base_density: foveation.base_density,
            c_max,
            sampled,
            entered,
            full_ms,
            traced_ms,
            traced_speedup,
            efficiency: traced_speedup * c_max,
            fills,
            stages,
        }
    }

    /// One line of progress.
    fn line(&self) -> String {
        let Self { volume, place, residency, base_density, full_ms, traced_ms, .. } = self;
        let fills: Vec<String> = self.fills.iter().map(|fill| format!("{:.1}", fill.ms)).collect();
        format!(
            "{volume:<16} {place:?} {residency:<6} {base_density:.3} full {full_ms:.1} traced {traced_ms:.1} \
             filled {} ms, {:.2} x of at most {:.2} x",
            fills.join(", "),
            self.traced_speedup,
            1.0 / self.c_max
        )
    }
}
