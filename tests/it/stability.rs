//! The example `stability` in small: cases with known answers, rays from within closed surfaces, many
//! frames on one renderer; and that each of its measures notices a fault.

use gpu_testkit::gpu;
use progressive_iso::PixelStatus;

use crate::suite::case::{Case, Volume};
use crate::suite::cases::{self, distance};
use crate::suite::measure::{self, Painter, cracks};
use crate::suite::random::Random;
use crate::suite::row::Row;
use crate::suite::views::{self, Effort};
use crate::suite::{long_run, mass, refusals};

fn check(group: &str) {
    let (device, queue) = gpu::device();
    let cases = cases::all(Effort::Reduced).into_iter().filter(|case| case.group == group);
    let rows: Vec<Row> =
        cases.map(|case| measure::measure(&device, &queue, &case, Effort::Reduced)).collect();
    let bad: Vec<&Row> = rows.iter().filter(|row| !row.ok).collect();
    assert!(bad.is_empty(), "{bad:#?}");
    let rays: u64 = rows.iter().map(|row| row.compared).sum();
    let ties: u64 = rows.iter().map(|row| row.ties).sum();
    println!("{group}: {} cases, {rays} rays compared, {ties} ties", rows.len());
    assert!(rows.len() >= 10 && ties * 50 < rays);
}

#[test]
fn stiff_fields() {
    check("stiff");
}

#[test]
fn special_isovalues() {
    check("isovalue");
}

#[test]
fn large_and_small_values() {
    check("scale");
    let (device, queue) = gpu::device();
    let row = refusals::measure(&device, &queue);
    assert!(row.ok, "{row:#?}");
}

#[test]
fn special_rays_cameras_and_sizes() {
    check("geometry");
}

#[test]
fn every_ray_from_within_a_closed_surface_hits() {
    let (device, queue) = gpu::device();
    let report = mass::sample(&device, &queue, [512, 256], 2, 7).unwrap();
    println!("{report:?}");
    assert!(report.ok() && report.rays == report.hits && report.rays == report.entered);
    assert!(report.rays > 2_000_000);
}

#[test]
fn many_frames_on_one_renderer() {
    let (device, queue) = gpu::device();
    let run = long_run::run(&device, &queue, 300, 5).unwrap();
    println!("{run}");
    assert!(run.ok && run.checkpoints >= 1 && run.hits > 10_000, "{run:?}");
}

/// A hole in the surface is counted, and not even admitted as a closed one.
#[test]
fn a_ray_that_leaves_through_a_hole_is_noticed() {
    let (device, queue) = gpu::device();
    let open = Case::new("mass", "open", [23, 21, 25], |[x, ..]| x - 3.0).at(&[0.0]);
    assert!(mass::sealed(&open).is_err());
    let volume = open.volume().unwrap();
    let (mut report, mut random) = (mass::MassReport::default(), Random::new(3));
    mass::field(&device, &queue, &volume, &open, [64, 64], 8, &mut random, &mut report).unwrap();
    assert!(report.violations > 0 && !report.ok(), "{report:?}");
}

/// A ball seen from within, and its picture.
struct Sample {
    case: Case,
    volume: Volume,
    view: crate::suite::case::View,
    picture: progressive_iso::Capture,
    entered: u32,
}

impl Sample {
    fn new() -> Self {
        let (device, queue) = gpu::device();
        let case = Case::new("test", "ball", [21; 3], |p| distance(p, [10.1, 9.8, 10.3]))
            .at(&[6.5])
            .closed()
            .all_hit();
        let volume = case.volume().unwrap();
        let view = views::looking(&volume, [10.0, 10.0, 10.5], [3.0, 7.0, 5.0], 70.0, [21, 17]);
        let mut painter = Painter::new(&device, &queue, &volume, view.size).unwrap();
        let (picture, entered) = painter.picture(&view, 6.5).unwrap();
        Self { case, volume, view, picture, entered }
    }

    fn row(&self) -> Row {
        let mut row = Row::new("test", "ball");
        measure::whole_picture(&self.case, &self.picture, self.entered, &mut row);
        measure::compare(&self.case, &self.volume, &self.view, 6.5, &self.picture, &mut row)
            .unwrap();
        row.finish()
    }
}

#[test]
fn a_corrupted_pixel_is_counted() {
    let mut sample = Sample::new();
    let good = sample.row();
    assert!(good.ok && good.hits == 21 * 17 && good.root_steps_worst > 0, "{good:?}");
    let pixel = 21 * 8 + 10;
    let depth = sample.picture.depth.as_ref().unwrap()[pixel];
    sample.picture.depth.as_mut().unwrap()[pixel] = depth + 0.01;
    let moved = sample.row();
    assert!(!moved.ok && moved.wrong_hits == 1, "{moved:?}");
    sample.picture.depth.as_mut().unwrap()[pixel] = depth;
    sample.picture.status.as_mut().unwrap()[pixel] = PixelStatus::Background;
    let missed = sample.row();
    assert!(!missed.ok && missed.mask_disagreement == 1 && missed.cracks == 1, "{missed:?}");
    // One miss of a picture that must hit everywhere, one ray whose ends differ.
    assert_eq!(missed.watertight_violations, 2, "{missed:?}");
    sample.picture.status.as_mut().unwrap()[pixel] = PixelStatus::Unfinished;
    assert!(!sample.row().ok);
}

#[test]
fn cracks_are_misses_among_hits() {
    let mut hit = vec![true; 35];
    assert_eq!(cracks([7, 5], &hit), 0);
    hit[7 * 2 + 3] = false;
    assert_eq!(cracks([7, 5], &hit), 1);
    hit[7 * 2 + 2] = false;
    assert_eq!(cracks([7, 5], &hit), 0, "a larger hole may be a true one");
    assert_eq!(cracks([1, 1], &[false]), 0);
    assert_eq!(cracks([35, 1], &hit), 0);
}

#[test]
fn another_picture_has_other_bits() {
    let mut sample = Sample::new();
    let good = long_run::bits(&sample.picture);
    assert_eq!(good, long_run::bits(&sample.picture));
    sample.picture.depth.as_mut().unwrap()[5] += 1e-6;
    assert_ne!(good, long_run::bits(&sample.picture));
}
