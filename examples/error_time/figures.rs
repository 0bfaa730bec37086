//! The plots of a run.

use std::path::Path;

use gpu_testkit::statistics::{pareto_front, quantile};

use crate::best::scenes;
use crate::curve::{Curve, Point};
use crate::sets::Memory;
use crate::support::plot::{Axis, Lines, Scale, Series};
use crate::support::{Failure, write_file};
use crate::tables::pictures;

/// An error that a plot shows.
struct Quantity {
    name: &'static str,
    label: &'static str,
    value: fn(&Point) -> f64,
}

const QUANTITIES: &[Quantity] = &[
    Quantity {
        name: "color",
        label: "colour: root mean square error in 255ths",
        value: |p| p.errors.color_rms,
    },
    Quantity {
        name: "mask",
        label: "share of rays with the wrong answer (none: half a ray)",
        value: |p| p.errors.mask_disagreement,
    },
];

/// Writes, for the first view of every volume in its largest size, the rates of RunAhead with a cache
/// and the settings at the middle rate.
pub fn write(folder: &Path, curves: &[Curve]) -> Result<(), Failure> {
    for (volume, size) in pictures(curves) {
        let Some(scene) = scenes(curves).into_iter().find(|s| s.0 == volume && s.2 == size) else {
            continue;
        };
        let all: Vec<&Curve> =
            curves.iter().filter(|curve| curve.scene() == (&*scene.0, scene.1, scene.2)).collect();
        let rates = |c: &&&Curve| c.strategy == "run-ahead" && c.residency == Memory::Cached;
        let rate = middle_rate(&all);
        let settings = |c: &&&Curve| c.rate.to_bits() == rate.to_bits();
        let [width, height] = size;
        for quantity in QUANTITIES {
            let picture = format!("{volume}-{width}x{height}-{}", quantity.name);
            for (kind, some) in [
                ("rates", all.iter().filter(rates).copied().collect::<Vec<_>>()),
                ("settings", all.iter().filter(settings).copied().collect()),
            ] {
                let title =
                    format!("{volume}, {width}x{height}: error against time, set-up counted");
                let chart = lines(title, quantity, &some, &all);
                write_file(&folder.join(format!("{kind}-{picture}.svg")), chart.svg().as_bytes())?;
            }
        }
    }
    Ok(())
}

/// The rate at which the settings are compared with each other.
fn middle_rate(curves: &[&Curve]) -> f64 {
    let rates: Vec<f64> = curves.iter().map(|curve| curve.rate).collect();
    quantile(&rates, 0.5).unwrap_or_default()
}

/// Curves, and the front of all settings.
fn lines(title: String, quantity: &Quantity, some: &[&Curve], all: &[&Curve]) -> Lines {
    let places = |curve: &Curve| -> Vec<[f64; 2]> {
        // A logarithmic axis has no 0.
        let least = 0.5 / curve.size.map(f64::from).iter().product::<f64>();
        curve.points.iter().map(|p| [p.ms, (quantity.value)(p).max(least)]).collect()
    };
    let line = |label: String, points| Series { label, points, steps: false };
    let mut series: Vec<Series> =
        some.iter().map(|curve| line(curve.label(), places(curve))).collect();
    let points: Vec<[f64; 2]> = all.iter().flat_map(|curve| places(curve)).collect();
    let front = pareto_front(&points).into_iter().map(|i| points[i]).collect();
    series.push(line("best of all settings and rates".into(), front));
    let places = || series.iter().flat_map(|series| &series.points);
    Lines {
        title,
        x_label: "ms, set-up counted".into(),
        y_label: quantity.label.into(),
        x: Axis::around(Scale::Log, places().map(|p| p[0])),
        y: Axis::around(Scale::Log, places().map(|p| p[1])),
        x_ticks: Vec::new(),
        series,
    }
}
