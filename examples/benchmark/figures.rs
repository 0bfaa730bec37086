//! The plots of a run.

use std::path::Path;

use crate::frame::FrameRow;
use crate::rows::Row;
use crate::support::plot::{Axis, Bars, Lines, Scale, Series};
use crate::support::{Failure, write_file};

/// Writes `cold.svg`, `warm.svg` and, for every volume and size, `progress-*.svg`; of the set
/// "scaling" `scaling.svg` alone.
pub fn write(folder: &Path, rows: &[Row], frames: &[FrameRow]) -> Result<(), Failure> {
    if rows.iter().any(|row| row.key.volume.starts_with("patch")) {
        return write_file(&folder.join("scaling.svg"), scaling(rows).svg().as_bytes());
    }
    for (state, title) in [("cold", "Cold frame"), ("warm", "The same view again")] {
        let chart = bars(rows, state, title);
        if !chart.groups.is_empty() {
            write_file(&folder.join(format!("{state}.svg")), chart.svg().as_bytes())?;
        }
    }
    let mut done: Vec<String> = Vec::new();
    for frame in frames.iter().filter(|frame| frame.key.state == "cold") {
        let name = group(&frame.key.volume, frame.key.size).replace(' ', "-");
        if !done.contains(&name) {
            let path = folder.join(format!("progress-{name}.svg"));
            write_file(&path, progress(frames, frame).svg().as_bytes())?;
            done.push(name);
        }
    }
    Ok(())
}

/// Milliseconds over the volume's edge.
fn scaling(rows: &[Row]) -> Lines {
    let mut series: Vec<Series> = Vec::new();
    let mut edges: Vec<f64> = Vec::new();
    for row in rows {
        let Some((name, edge)) = row.key.volume.rsplit_once('-') else { continue };
        let Ok(edge) = edge.parse::<f64>() else { continue };
        let what = if name == "patch" { "patch" } else { "whole field" };
        let setting = row.key.setting.split(',').next().unwrap_or_default();
        let label = format!("{setting}, {what}, {}", row.key.state);
        let points = match series.iter_mut().find(|series| series.label == label) {
            Some(series) => &mut series.points,
            None => {
                series.push(Series { label, points: Vec::new(), steps: false });
                let last = series.len() - 1;
                &mut series[last].points
            }
        };
        points.push([edge, row.ms_100]);
        edges.push(edge);
    }
    edges.sort_by(f64::total_cmp);
    edges.dedup();
    series.sort_by(|a, b| b.label.cmp(&a.label));
    let all = || series.iter().flat_map(|series| &series.points);
    Lines {
        title: "A patch of 256^3 voxels in larger volumes, and the whole field".into(),
        x_label: "voxels on each axis of the volume".into(),
        y_label: "ms to the finished picture (median)".into(),
        x: Axis::around(Scale::Log, all().map(|p| p[0])),
        y: Axis::around(Scale::Log, all().map(|p| p[1])),
        x_ticks: edges,
        series,
    }
}

fn group(volume: &str, [width, height]: [u32; 2]) -> String {
    format!("{volume} {width}x{height}")
}

/// Milliseconds to the finished picture for every volume and setting.
fn bars(rows: &[Row], state: &str, title: &str) -> Bars {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.key.state == state).collect();
    let (mut groups, mut settings): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
    for row in &rows {
        let (group, setting) = (group(&row.key.volume, row.key.size), row.key.setting.clone());
        if !groups.contains(&group) {
            groups.push(group);
        }
        if !settings.contains(&setting) {
            settings.push(setting);
        }
    }
    settings.sort_by_key(|setting| (setting.starts_with("CPU"), setting.starts_with("Block")));
    let time = |setting: &str, wanted: &str| {
        let mut found = rows.iter().filter(|row| row.key.setting == setting);
        found.find(|row| group(&row.key.volume, row.key.size) == wanted).map(|row| row.ms_100)
    };
    let series = settings
        .into_iter()
        .map(|setting| {
            let values = groups.iter().map(|group| time(&setting, group)).collect();
            (setting, values)
        })
        .collect();
    Bars {
        title: title.into(),
        y_label: "ms to the finished picture (median)".into(),
        groups,
        series,
    }
}

/// Finished pixels over time of all settings, cold, at the view of `first`.
fn progress(frames: &[FrameRow], first: &FrameRow) -> Lines {
    let same_view = |frame: &&FrameRow| {
        frame.key.state == "cold"
            && (&frame.key.volume, frame.key.size) == (&first.key.volume, first.key.size)
            && (frame.isovalue, frame.position) == (first.isovalue, first.position)
    };
    let mut series: Vec<Series> = frames
        .iter()
        .filter(same_view)
        .map(|frame| Series {
            label: frame.key.setting.clone(),
            points: frame.progress.iter().map(|p| [p.ms, 100.0 * p.pixels]).collect(),
            steps: true,
        })
        .collect();
    series.sort_by_key(|series| series.label.starts_with("Block"));
    let all = || series.iter().flat_map(|series| &series.points);
    let lowest = all().map(|p| p[1]).fold(100.0, f64::min);
    Lines {
        title: format!("{}, cold, one view", group(&first.key.volume, first.key.size)),
        x_label: "ms since the frame was set".into(),
        y_label: "finished pixels in %".into(),
        x: Axis::around(Scale::Log, all().map(|p| p[0])),
        y: Axis::linear([(lowest / 10.0).floor() * 10.0, 100.0]),
        x_ticks: Vec::new(),
        series,
    }
}
