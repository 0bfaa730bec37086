//! P21: the counters of passes add up, and no more blocks are decoded than can be active.

use macrocell::Grid;
use macrocell::cpu::ranges;
use progressive_iso::{PassReport, PixelStatus, RendererOptions};

use crate::support::{Gpu, Scene, hit_count, options};

const SIZE: [u32; 2] = [80, 60];

/// Active blocks and those on their plus sides, by the ranges of the decoded samples.
fn most_needed(scene: &Scene) -> u32 {
    let (dims, samples) = (scene.volume.dims, scene.volume.decode());
    let grid = Grid::new(dims);
    let masks = ranges::activate(&grid, &ranges::build(&grid, &samples), scene.isovalue);
    let [bx, by, bz] = grid.blocks();
    let blocks =
        || (0..bz).flat_map(move |z| (0..by).flat_map(move |y| (0..bx).map(move |x| [x, y, z])));
    let needed = |block: [u32; 3]| {
        (0..8u32).any(|n| {
            let before = [0, 1, 2].map(|a| block[a].checked_sub(n >> a & 1));
            matches!(before, [Some(x), Some(y), Some(z)] if masks.block_active(&grid, [x, y, z]))
        })
    };
    blocks().filter(|&block| needed(block)).count() as u32
}

/// What holds after every pass of a frame, given the report of the pass before.
fn check(report: &PassReport, before: &PassReport, slots: u32) -> Result<(), String> {
    let resident = i64::from(report.blocks_decoded) - i64::from(report.blocks_evicted);
    let checks = [
        ("rays", report.entered_rays <= report.rays),
        ("active rays and hits", {
            // Either may be wrong alone, so their sum is not taken in 32 bits.
            let answered = u64::from(report.active_rays) + u64::from(report.hits);
            answered <= u64::from(report.entered_rays)
        }),
        ("resident blocks", (0..=i64::from(slots)).contains(&resident)),
        ("requests", report.blocks_requested >= report.blocks_decoded),
        ("decodes grow", report.blocks_decoded >= before.blocks_decoded),
        ("hits grow", report.hits >= before.hits),
        ("active rays fall", before.pass == 0 || report.active_rays <= before.active_rays),
    ];
    match checks.iter().find(|check| !check.1) {
        None => Ok(()),
        Some((name, _)) => Err(format!("{name}: {report:?} after {before:?}")),
    }
}

/// The first frame on an empty cache of so many slots.
fn reports(scene: &Scene, slots: u64) -> (Vec<PassReport>, progressive_iso::Capture) {
    let gpu = Gpu::new();
    let options = RendererOptions { most_slots: Some(slots), ..options(SIZE) };
    let mut renderer = gpu.renderer(scene, options);
    renderer.set_frame(&scene.frame(scene.orbit(40.0, 25.0, SIZE))).unwrap();
    let mut reports = vec![PassReport::default()];
    let each = |_: &_, report: &PassReport| {
        if report.pass > 0 {
            reports.push(*report);
        }
        true
    };
    renderer.render_to_completion(&gpu.device, &gpu.queue, each).unwrap();
    (reports, renderer.capture_blocking(&gpu.device, &gpu.queue).unwrap())
}

#[test]
fn counters_of_passes_add_up() {
    let scene = Scene::generated("gyroid", [46, 39, 42], 8.0);
    let most = most_needed(&scene);
    for slots in [48, 200, 100_000] {
        let (reports, picture) = reports(&scene, slots);
        for pair in reports.windows(2) {
            check(&pair[1], &pair[0], slots as u32).unwrap();
        }
        let last = reports.last().unwrap();
        println!("{slots} slots: {} passes, {last:?}, at most {most} blocks needed", reports.len());
        let status = picture.status.as_ref().unwrap();
        assert_eq!(last.hits as usize, hit_count(&picture));
        assert_eq!(last.rays as usize, status.len());
        assert!(!status.contains(&PixelStatus::Unfinished) && last.active_rays == 0);
        if last.blocks_evicted == 0 {
            // Without evictions every decode is of another block.
            assert!(last.blocks_decoded <= most, "{last:?}, {most} can be needed");
        }
        assert_eq!(slots < 1000, last.blocks_evicted > 0, "{last:?}");
    }
}

#[test]
fn counters_that_do_not_add_up_are_noticed() {
    let scene = Scene::generated("gyroid", [46, 39, 42], 8.0);
    let (reports, _) = reports(&scene, 200);
    let (last, before) = (*reports.last().unwrap(), PassReport::default());
    check(&last, &before, 200).unwrap();
    let bad: [fn(&mut PassReport); 5] = [
        |r| r.entered_rays = r.rays + 1,
        |r| r.active_rays = r.entered_rays + 1,
        |r| r.hits = r.entered_rays + 1,
        |r| r.blocks_evicted = r.blocks_decoded + 1,
        |r| r.blocks_requested = r.blocks_decoded - 1,
    ];
    for (n, change) in bad.iter().enumerate() {
        let mut report = last;
        change(&mut report);
        assert!(check(&report, &before, 200).is_err(), "{n}");
    }
    assert!(check(&last, &last, 1).is_err());
}
