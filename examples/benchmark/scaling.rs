//! Does a frame cost more in a larger volume? A patch of fixed size in constant volumes that grow, with
//! the same camera and the same cache; and the whole field at growing sizes beside it.

use progressive_iso::{ScenePlan, wgpu};
use serde::Serialize;

use crate::measure::{Measured, Results, Skipped, options};
use crate::scene::{Scene, View};
use crate::sets::{FIVE_POSITIONS, SMALL, Setting, block_sorted, default_look_ahead, run_ahead};
use crate::support::median;
use crate::support::subject::{Subject, cube, turbulence};
use crate::support::{Failure, Gpu};

/// Slots of every cache, where the volume has as many blocks.
const SLOTS: u64 = 131_072;

/// Most bytes that a budget may come to.
const MOST_BYTES: u64 = 8 << 30;

/// Times that every view is measured.
const REPEATS: usize = 2;

/// How much longer a frame takes in the largest volume than in the smallest one.
#[derive(Clone, Debug, Serialize)]
pub struct Ratio {
    pub setting: String,
    pub state: &'static str,
    pub ms_smallest: f64,
    pub ms_largest: f64,
    /// Median over the views.
    pub ratio: f64,
}

/// Measures the patch and the whole field where `wants` agrees to the volume's name.
pub fn measure(gpu: &Gpu, wants: impl Fn(&str) -> bool) -> Result<Results, Failure> {
    let mut results = Results::default();
    let patches = [256, 512, 768, 1024].map(|edge| cube("patch", edge, 4.0));
    let software = gpu.info.device_type == wgpu::DeviceType::Cpu;
    let edges = if software { &[64, 128, 256, 512][..] } else { &[64, 128, 256, 512, 1024] };
    let fields: Vec<Subject> = edges.iter().map(|&edge| turbulence(edge)).collect();
    for subjects in [&patches[..], &fields] {
        let wanted: Vec<Subject> =
            subjects.iter().copied().filter(|subject| wants(&subject.name())).collect();
        turns(gpu, &wanted, &mut results)?;
    }
    results.scaling = ratios(&results);
    Ok(results)
}

fn settings() -> [Setting; 2] {
    [run_ahead(default_look_ahead()), block_sorted(1, true)]
}

/// The volumes take turns at every view.
fn turns(gpu: &Gpu, subjects: &[Subject], results: &mut Results) -> Result<(), Failure> {
    let mut renderers: Vec<(Scene, Vec<Measured>)> = Vec::new();
    for subject in subjects {
        println!("{}", subject.name());
        let scene = Scene::new(*subject, false)?;
        let measured = all_settings(gpu, &scene, results)?;
        renderers.push((scene, measured));
    }
    for &position in FIVE_POSITIONS.iter().cycle().take(FIVE_POSITIONS.len() * REPEATS) {
        for (scene, measured) in &mut renderers {
            let view = View { isovalue: scene.isovalue, position, size: SMALL };
            for measured in measured {
                measured.turn(gpu, scene, &view, 0, None, &mut results.frames)?;
            }
        }
    }
    Ok(())
}

/// A renderer for every setting that the library does not refuse.
fn all_settings(gpu: &Gpu, scene: &Scene, results: &mut Results) -> Result<Vec<Measured>, Failure> {
    let mut measured = Vec::new();
    for setting in settings() {
        match budget(gpu, scene, &setting) {
            Ok(budget) => measured.push(Measured::new(gpu, scene, setting, SMALL, budget)?),
            Err(error) => results.skipped.push(Skipped {
                volume: scene.subject.name(),
                size: SMALL,
                setting: setting.label,
                reason: error.to_string(),
            }),
        }
    }
    Ok(measured)
}

/// The smallest budget whose plan has [`SLOTS`] slots, or one for every block.
fn budget(gpu: &Gpu, scene: &Scene, setting: &Setting) -> Result<u64, progressive_iso::Error> {
    let limits = gpu.device.limits();
    let plan = |budget| ScenePlan::new(&scene.volume, &options(setting, SMALL, budget), &limits);
    let wanted = SLOTS.min(plan(MOST_BYTES)?.blocks());
    let (mut low, mut high) = (0, MOST_BYTES);
    while high - low > 1 << 16 {
        let middle = low + (high - low) / 2;
        if plan(middle).is_ok_and(|plan| plan.slots() >= wanted) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(high)
}

fn ratios(results: &Results) -> Vec<Ratio> {
    let mut ratios = Vec::new();
    for setting in settings() {
        for state in ["cold", "warm"] {
            let times = |volume: &str| -> Vec<f64> {
                let frames = results.frames.iter().filter(|frame| {
                    let key = &frame.key;
                    (&*key.volume, &key.setting, key.state) == (volume, &setting.label, state)
                });
                frames.map(|frame| frame.times.ms_100).collect()
            };
            let (smallest, largest) = (times("patch-256"), times("patch-1024"));
            if !smallest.is_empty() && smallest.len() == largest.len() {
                ratios.push(Ratio {
                    setting: setting.label.clone(),
                    state,
                    // Of frames that followed each other, so that the machine was the same for both.
                    ratio: median(
                        largest.iter().zip(&smallest).map(|(large, small)| large / small),
                    ),
                    ms_smallest: median(smallest.into_iter()),
                    ms_largest: median(largest.into_iter()),
                });
            }
        }
    }
    ratios
}
