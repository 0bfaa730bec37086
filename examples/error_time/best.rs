//! Which setting is best for a given time or error.

use gpu_testkit::statistics::pareto_front;

use crate::curve::{Curve, Point};

/// Marks the points of every scene that no other one beats: at most as late and at least as good, by
/// the PSNR against the uncompressed samples.
pub fn mark_fronts(curves: &mut [Curve]) {
    for scene in scenes(curves) {
        let mut all = Vec::new();
        for (number, curve) in curves.iter().enumerate() {
            if curve.scene() == (&*scene.0, scene.1, scene.2) {
                all.extend((0..curve.points.len()).map(|point| (number, point)));
            }
        }
        let cost = |&(curve, point): &(usize, usize)| {
            let point: &Point = &curves[curve].points[point];
            [point.ms, -point.errors.psnr]
        };
        let costs: Vec<[f64; 2]> = all.iter().map(cost).collect();
        for i in pareto_front(&costs) {
            let (curve, point) = all[i];
            curves[curve].points[point].on_front = true;
        }
    }
}

/// Volumes, views and sizes, in the order of the curves.
pub fn scenes(curves: &[Curve]) -> Vec<(String, [f64; 2], [u32; 2])> {
    let mut scenes = Vec::new();
    for curve in curves {
        let (volume, view, size) = curve.scene();
        let scene = (volume.to_owned(), view, size);
        if !scenes.contains(&scene) {
            scenes.push(scene);
        }
    }
    scenes
}

/// An error that a user can live with.
#[derive(Clone, Copy)]
pub struct Goal {
    pub name: &'static str,
    /// Whether a point reaches it.
    pub reached: fn(&Point) -> bool,
}

/// What the table of best settings asks for.
pub const GOALS: &[Goal] = &[
    Goal { name: "PSNR of 20 dB", reached: |p| p.errors.psnr >= 20.0 },
    Goal { name: "PSNR of 25 dB", reached: |p| p.errors.psnr >= 25.0 },
    Goal { name: "PSNR of 30 dB", reached: |p| p.errors.psnr >= 30.0 },
    Goal { name: "PSNR of 40 dB", reached: |p| p.errors.psnr >= 40.0 },
    Goal { name: "mask wrong on 1 % of the rays", reached: |p| p.errors.mask_disagreement <= 0.01 },
    Goal {
        name: "mask wrong on 0.1 % of the rays",
        reached: |p| p.errors.mask_disagreement <= 0.001,
    },
    Goal { name: "99 % of depths within 1 voxel", reached: |p| depths_within(p, 1.0) },
    Goal { name: "99 % of depths within 0.1 voxel", reached: |p| depths_within(p, 0.1) },
];

/// Of nearly the whole picture: depths of the pixels shown so far say little.
fn depths_within(point: &Point, voxels: f64) -> bool {
    point.errors.mask_disagreement <= 0.05
        && point.errors.depth_p99_voxels.is_some_and(|depth| depth <= voxels)
}

/// Times that differ by less than this factor count as equal: runs on a shared machine do.
const SAME_TIME: f64 = 1.1;

/// The setting that reaches a goal first, and when: the latest time over the views of a volume. Of
/// settings that are as fast as that one, the one with the lowest rate, since it needs least memory.
pub fn first_to_reach(curves: &[&Curve], goal: &Goal) -> Option<(String, f64)> {
    let time = |curve: &Curve| curve.points.iter().find(|p| (goal.reached)(p)).map(|p| p.ms);
    let slowest_view = |label: &str| {
        let views = curves.iter().filter(|curve| curve.label() == label);
        views.map(|curve| time(curve)).try_fold(0.0, |most: f64, ms| Some(most.max(ms?)))
    };
    let reached: Vec<(f64, String, f64)> = curves
        .iter()
        .filter_map(|curve| {
            let label = curve.label();
            slowest_view(&label).map(|ms| (curve.rate, label, ms))
        })
        .collect();
    let least = reached.iter().map(|setting| setting.2).reduce(f64::min)?;
    let fast = reached.into_iter().filter(|setting| setting.2 <= SAME_TIME * least);
    let best = fast.min_by(|a, b| a.0.total_cmp(&b.0).then(a.2.total_cmp(&b.2)))?;
    Some((best.1, best.2))
}
