//! Writes `stability.json`, `stability.md` and `mass.json`.

use std::path::Path;

use serde::Serialize;

use crate::suite::long_run::LongRun;
use crate::suite::mass::MassReport;
use crate::suite::row::Row;
use crate::support::{Failure, Origin, Table, write_file, write_json};

#[derive(Serialize)]
struct File<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    seconds: f64,
    ok: bool,
    rays: u64,
    compared: u64,
    watertight_violations: u64,
    mask_disagreement: u64,
    ties: u64,
    cases: &'a [Row],
    #[serde(skip_serializing_if = "Option::is_none")]
    long_run: Option<&'a LongRun>,
}

/// One line of the terminal, and the problems.
pub fn line(row: &Row) -> String {
    let mut line = format!(
        "{} {:9} {:62} {:9} rays, {:6} ties, depth {:.1e} of {:.1e} voxels",
        if row.ok { "ok  " } else { "BAD " },
        row.group,
        row.name,
        row.rays,
        row.ties,
        row.depth_error_max_voxels,
        row.bound,
    );
    for problem in &row.problems {
        line += &format!("\n       {problem}");
    }
    line
}

/// Writes the files; whether all is well.
pub fn write(
    folder: &Path,
    origin: &Origin,
    rows: &[Row],
    long_run: Option<&LongRun>,
    seconds: f64,
) -> Result<bool, Failure> {
    let sum = |of: fn(&Row) -> u64| rows.iter().map(of).sum();
    let ok = rows.iter().all(|row| row.ok) && long_run.is_none_or(|run| run.ok);
    let file = File {
        origin,
        seconds,
        ok,
        rays: sum(|row| row.rays),
        compared: sum(|row| row.compared),
        watertight_violations: sum(|row| row.watertight_violations),
        mask_disagreement: sum(|row| row.mask_disagreement),
        ties: sum(|row| row.ties),
        cases: rows,
        long_run,
    };
    write_json(folder, "stability.json", &file)?;
    let text = markdown(&file);
    write_file(&folder.join("stability.md"), text.as_bytes())?;
    let File { rays, compared, watertight_violations, mask_disagreement, ties, .. } = file;
    println!(
        "{} cases, {rays} rays, {compared} compared: {watertight_violations} watertightness violations, \
         {mask_disagreement} mask disagreements, {ties} ties; {seconds:.0} s",
        rows.len()
    );
    long_run.iter().for_each(|run| println!("{run}"));
    Ok(ok)
}

fn markdown(file: &File<'_>) -> String {
    let Origin { adapter, commit, date, command } = file.origin;
    let heads = [
        "case",
        "group",
        "rays",
        "violations",
        "mask",
        "wrong",
        "ties",
        "cracks",
        "residual / bound",
        "depth error, voxels",
        "ulps",
        "bound, voxels",
        "depth / bound",
        "root steps",
        "worst",
        "ok",
    ];
    let mut table = Table::new("Numerical stability", &heads, 2);
    for row in file.cases {
        table.line(&[
            row.name.clone(),
            row.group.into(),
            row.compared.to_string(),
            row.watertight_violations.to_string(),
            row.mask_disagreement.to_string(),
            row.wrong_hits.to_string(),
            row.ties.to_string(),
            row.cracks.to_string(),
            format!("{:.2}", row.residual_share),
            format!("{:.1e}", row.depth_error_max_voxels),
            format!("{:.0}", row.depth_error_max_ulps),
            format!("{:.1e}", row.bound),
            format!("{:.2}", row.depth_share),
            format!("{:.1}", row.root_steps_mean),
            row.root_steps_worst.to_string(),
            if row.ok { "yes".into() } else { "no".into() },
        ]);
    }
    let run = file.long_run.map(|run| format!("\n{run}\n")).unwrap_or_default();
    format!(
        "`stability {command}`, {adapter}, commit {commit}, {date}, {:.0} s\n\n{}{run}",
        file.seconds,
        table.finish()
    )
}

#[derive(Serialize)]
struct MassFile<'a> {
    #[serde(flatten)]
    origin: &'a Origin,
    seconds: f64,
    #[serde(flatten)]
    report: &'a MassReport,
}

pub fn write_mass(
    folder: &Path,
    origin: &Origin,
    report: &MassReport,
    seconds: f64,
) -> Result<(), Failure> {
    println!(
        "{} rays in {} pictures, {} entered, {} hit: {} violations; {seconds:.0} s",
        report.rays, report.pictures, report.entered, report.hits, report.violations
    );
    write_json(folder, "mass.json", &MassFile { origin, seconds, report })
}
