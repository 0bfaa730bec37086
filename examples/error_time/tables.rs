//! The tables of `error_time.md`.

use gpu_testkit::picture::PictureErrors;

use crate::best::{GOALS, first_to_reach};
use crate::curve::Curve;
use crate::sets::Memory;
use crate::support::{Origin, Table};

pub fn all(origin: &Origin, curves: &[Curve]) -> String {
    let Origin { adapter, commit, date, command } = origin;
    format!(
        "`error_time {command}`, {adapter}, commit {commit}, {date}. Errors against the f64 renderer on \
         the uncompressed samples unless another reference is named.\n\n{}{}{}{}",
        best("The fastest setting for an error", curves, |_| true),
        best("The same with the smallest budget", curves, |c| c.residency == Memory::Smallest),
        sources(curves),
        progress(curves)
    )
}

/// Volumes and sizes, in the order of the curves.
pub fn pictures(curves: &[Curve]) -> Vec<(&str, [u32; 2])> {
    let mut pictures = Vec::new();
    for curve in curves {
        let picture = (&*curve.volume, curve.size);
        if !pictures.contains(&picture) {
            pictures.push(picture);
        }
    }
    pictures
}

/// The curves of a volume in one size, all views.
fn of_picture<'a>(curves: &'a [Curve], (volume, size): (&str, [u32; 2])) -> Vec<&'a Curve> {
    curves.iter().filter(|curve| curve.volume == volume && curve.size == size).collect()
}

/// "For an error below X use Y", of some settings.
fn best(title: &str, curves: &[Curve], some: fn(&Curve) -> bool) -> String {
    let pictures = pictures(curves);
    let heads: Vec<String> =
        pictures.iter().map(|(volume, [w, h])| format!("{volume}, {w}x{h}")).collect();
    let heads: Vec<&str> =
        std::iter::once("for an error within").chain(heads.iter().map(String::as_str)).collect();
    let mut table = Table::new(title, &heads, heads.len());
    for goal in GOALS {
        let mut line = vec![goal.name.to_owned()];
        for &picture in &pictures {
            let mut curves = of_picture(curves, picture);
            curves.retain(|curve| some(curve));
            let best = first_to_reach(&curves, goal);
            let cell = best.map(|(label, ms)| format!("{label}: {ms:.0} ms"));
            line.push(cell.unwrap_or_else(|| "not reached".into()));
        }
        table.line(&line);
    }
    table.finish()
}

/// Where the error of the finished picture comes from.
fn sources(curves: &[Curve]) -> String {
    let heads = [
        "volume",
        "pixels",
        "view",
        "bits",
        "source",
        "PSNR",
        "SSIM",
        "mask %",
        "depth median",
        "99 %",
        "worst",
        "normal median",
        "99 %",
    ];
    let mut table = Table::new("Compression and arithmetic, finished pictures", &heads, 3);
    for curve in curves {
        // All settings show the same finished picture, bit for bit.
        if curve.residency != Memory::Full {
            continue;
        }
        for (source, errors) in
            [("compression", &curve.compression), ("arithmetic", &curve.arithmetic)]
        {
            let [width, height] = curve.size;
            let mut line = vec![
                curve.volume.clone(),
                format!("{width}x{height}"),
                format!("{}, {}", curve.view[0], curve.view[1]),
                format!("{}", curve.rate),
                source.to_owned(),
            ];
            line.extend(cells(errors));
            table.line(&line);
        }
    }
    table.finish()
}

/// PSNR, SSIM, mask, depths in voxels, angles in degrees.
fn cells(errors: &PictureErrors) -> Vec<String> {
    let small = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v:.2e}"));
    vec![
        if errors.psnr.is_finite() { format!("{:.1}", errors.psnr) } else { "equal".into() },
        format!("{:.4}", errors.ssim),
        format!("{:.3}", 100.0 * errors.mask_disagreement),
        small(errors.depth_p50_voxels),
        small(errors.depth_p99_voxels),
        small(errors.depth_max_voxels),
        small(errors.normal_p50_degrees),
        small(errors.normal_p99_degrees),
    ]
}

/// Every point.
fn progress(curves: &[Curve]) -> String {
    let heads = [
        "volume",
        "pixels",
        "view",
        "setting",
        "pass",
        "ms",
        "complete %",
        "open voxels",
        "PSNR",
        "PSNR against finished",
        "SSIM",
        "mask %",
        "depth 99 %",
        "depth worst",
        "best",
    ];
    let mut table = Table::new("After every pass", &heads, 4);
    for curve in curves {
        for point in &curve.points {
            let [width, height] = curve.size;
            let [errors, finished] = [&point.errors, &point.against_finished].map(cells);
            table.line(&[
                curve.volume.clone(),
                format!("{width}x{height}"),
                format!("{}, {}", curve.view[0], curve.view[1]),
                curve.label(),
                point.pass.to_string(),
                format!("{:.0}", point.ms),
                format!("{:.2}", 100.0 * point.completeness),
                format!("{:.1}", point.open_depth_voxels),
                errors[0].clone(),
                finished[0].clone(),
                errors[1].clone(),
                errors[2].clone(),
                errors[4].clone(),
                errors[5].clone(),
                if point.on_front { "*".into() } else { String::new() },
            ]);
        }
    }
    table.finish()
}
