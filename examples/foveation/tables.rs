//! The tables of `foveation.md` and the plot.

use crate::measures::{Measures, REGIONS};
use crate::quality::Quality;
use crate::rest::Rest;
use crate::speed::Speed;
use crate::support::plot::{Axis, Lines, Scale, Series};
use crate::support::{Origin, Table, distinct, mean};
use crate::view::Place;

pub fn all(origin: &Origin, quality: &[Quality], rest: &[Rest], speed: &[Speed]) -> String {
    let Origin { adapter, commit, date, command } = origin;
    let head = format!("`foveation {command}`, {adapter}, commit {commit}, {date}.\n\n");
    [head, regions(quality), volumes(quality), resting(rest), times(speed)].concat()
}

fn decibels(value: Option<f64>) -> String {
    value.map_or("exact".into(), |v| format!("{v:.2}"))
}

/// Means over the volumes, a table for every density.
fn regions(rows: &[Quality]) -> String {
    let density = |base_density: f32| {
        let title = format!("Base density {base_density}, means over volumes");
        let measures = ["PSNR", "SSIM", "FLIP"];
        let heads: Vec<String> = REGIONS
            .iter()
            .flat_map(|region| measures.map(|measure| format!("{region}: {measure}")))
            .collect();
        let heads: Vec<&str> = std::iter::once("method")
            .chain(heads.iter().map(String::as_str))
            .chain(["tPSNR"])
            .collect();
        let mut table = Table::new(&title, &heads, 1);
        let of_density = || rows.iter().filter(move |r| r.base_density == base_density);
        for method in distinct(of_density().map(|r| &*r.method)) {
            let own = || of_density().filter(move |r| r.method == method);
            let mut line = vec![method.to_owned()];
            for region in 0..REGIONS.len() {
                let of = move |r: &Quality| -> Measures { [r.all, r.fovea, r.periphery][region] };
                line.push(decibels(mean(own().map(|r| of(r).psnr))));
                for value in
                    [mean(own().map(|r| Some(of(r).ssim))), mean(own().map(|r| Some(of(r).flip)))]
                {
                    line.push(value.map_or(String::new(), |v| format!("{v:.4}")));
                }
            }
            line.push(mean(own().map(|r| r.tpsnr)).map_or("-".into(), |v| format!("{v:.2}")));
            table.line(&line);
        }
        table.finish()
    };
    distinct(rows.iter().map(|r| r.base_density)).into_iter().map(density).collect()
}

/// PSNR of the whole picture for every volume and density.
fn volumes(rows: &[Quality]) -> String {
    let columns = distinct(rows.iter().map(|r| (&*r.volume, r.base_density)));
    let heads: Vec<String> =
        columns.iter().map(|(volume, density)| format!("{volume}, {density}")).collect();
    let heads: Vec<&str> =
        std::iter::once("method").chain(heads.iter().map(String::as_str)).collect();
    let mut table = Table::new("PSNR of the whole picture, volume and base density", &heads, 1);
    for method in distinct(rows.iter().map(|r| &*r.method)) {
        let mut line = vec![method.to_owned()];
        for column in &columns {
            let own =
                rows.iter().find(|r| r.method == method && (&*r.volume, r.base_density) == *column);
            line.push(own.map_or(String::new(), |r| decibels(r.all.psnr)));
        }
        table.line(&line);
    }
    table.finish()
}

fn resting(rows: &[Rest]) -> String {
    let mut table = Table::new(
        "Camera and gaze at rest",
        &["volume", "base density", "pass", "finished", "PSNR"],
        1,
    );
    for row in rows {
        table.line(&[
            row.volume.clone(),
            row.base_density.to_string(),
            row.pass.to_string(),
            format!("{:.1} %", 100.0 * row.finished),
            decibels(row.psnr),
        ]);
    }
    table.finish()
}

fn times(rows: &[Speed]) -> String {
    let mut heads: Vec<String> = [
        "volume",
        "camera",
        "samples",
        "base density",
        "rays that enter",
        "full ms",
        "traced ms",
        "1 / C_max",
        "tracing",
        "of 1 / C_max",
    ]
    .map(String::from)
    .into();
    let methods = distinct(rows.iter().flat_map(|row| row.fills.iter().map(|f| &*f.method)));
    heads.extend(methods.iter().map(|method| format!("{method} ms")));
    heads.extend(methods.iter().map(|method| (*method).to_owned()));
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new("Times and how many times faster", &heads, 3);
    for row in rows {
        let mut line = vec![
            row.volume.clone(),
            format!("{:?}", row.place).to_lowercase(),
            row.residency.clone(),
            row.base_density.to_string(),
            format!("{:.0} %", 100.0 * row.entered),
            format!("{:.1}", row.full_ms),
            format!("{:.1}", row.traced_ms),
            format!("{:.2}", 1.0 / row.c_max),
            format!("{:.2}", row.traced_speedup),
            format!("{:.0} %", 100.0 * row.efficiency),
        ];
        let fill = |method: &&str| row.fills.iter().find(|fill| fill.method == *method);
        let cell = |value: Option<f64>, digits| {
            value.map_or(String::new(), |value| format!("{value:.digits$}"))
        };
        line.extend(methods.iter().map(|method| cell(fill(method).map(|f| f.ms), 1)));
        line.extend(methods.iter().map(|method| cell(fill(method).map(|f| f.speedup), 2)));
        table.line(&line);
    }
    table.finish()
}

/// How many times faster, against the mean density.
pub fn speed_plot(rows: &[Speed]) -> Lines {
    let is_wanted = |row: &&Speed| row.residency == "cached" && row.place == Place::Near;
    let warm: Vec<&Speed> = rows.iter().filter(is_wanted).collect();
    let points = |volume: &str, of: fn(&Speed) -> f64| {
        let own = warm.iter().filter(|row| row.volume == volume);
        own.map(|row| [row.c_max, of(row)]).collect::<Vec<_>>()
    };
    let volumes = distinct(warm.iter().map(|row| &*row.volume));
    let mut series = vec![Series {
        label: "1 / C_max".into(),
        points: volumes.first().map_or(Vec::new(), |volume| points(volume, |r| 1.0 / r.c_max)),
        steps: false,
    }];
    type Curve = (&'static str, fn(&Speed) -> f64);
    let curves: [Curve; 2] =
        [("tracing", |r| r.traced_speedup), ("with network at half", |r| r.fills[2].speedup)];
    for (what, of) in curves {
        for volume in &volumes {
            let label = format!("{volume}, {what}");
            series.push(Series { label, points: points(volume, of), steps: false });
        }
    }
    let values = || series.iter().flat_map(|s| s.points.iter().copied());
    Lines {
        title: "Foveated frames with a warm cache: times faster than the full frame".into(),
        x_label: "mean density C_max".into(),
        y_label: "times faster".into(),
        x: Axis::around(Scale::Log, values().map(|p| p[0])),
        y: Axis::around(Scale::Log, values().map(|p| p[1])),
        x_ticks: Vec::new(),
        series,
    }
}
