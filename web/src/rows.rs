//! The page's read-outs: names and values, in order.

use progressive_iso::{Infill, Residency, TraversalStrategy};

use crate::session::Session;
use crate::text;

/// What is read out of a session: pairs of a name and a value.
#[must_use]
pub fn rows(session: &Session) -> Vec<(&'static str, String)> {
    let (report, renderer) = (session.report(), session.renderer());
    let (plan, dims) = (renderer.plan(), renderer.volume().dims());
    let [width, height] = session.settings().renderer.size;
    let kept = match plan.residency() {
        Residency::Full => "all decoded at load".to_owned(),
        _ => format!("{} of {} cached", text::count(plan.slots()), text::count(plan.blocks())),
    };
    let decoded = match plan.residency() {
        Residency::Full => text::count(plan.blocks()),
        _ => text::count(report.blocks_decoded.into()),
    };
    let strategy = match session.settings().renderer.strategy {
        TraversalStrategy::RunAhead => "run ahead",
        _ => "block sorted",
    };
    let last = session.passes().last();
    let mut rows = vec![
        ("complete", text::percent(report.completeness())),
        ("passes", text::count(report.pass.into())),
        ("time", last.map_or_else(|| "–".to_owned(), |pass| text::milliseconds(pass.ms))),
        ("last pass", pass_time(report)),
        ("exact pixels", text::count(report.exact_pixels().into())),
        ("filled pixels", text::count(report.filled_pixels.into())),
        ("in-fill", infill(session).to_owned()),
        ("blocks decoded", decoded),
        ("blocks kept", kept),
        ("strategy", strategy.to_owned()),
        ("volume", dims.map(|n| n.to_string()).join(" × ")),
        ("picture", format!("{width} × {height}")),
        ("GPU memory", text::bytes(report.bytes)),
        ("at most", text::bytes(report.peak_bytes)),
    ];
    let sums = text::by_purpose(&renderer.bytes_by_category());
    rows.extend(sums.into_iter().map(|(purpose, sum)| (purpose, text::bytes(sum))));
    rows
}

/// What unfinished pixels show, or why not what was asked for.
fn infill(session: &Session) -> &'static str {
    match (session.infill(), session.settings().infill, session.renderer().plan().residency()) {
        (Infill::Classical, ..) => "classical",
        (Infill::Network, ..) => "network",
        (_, Infill::Off, _) => "off",
        (.., Residency::Full) => "nothing to fill",
        _ => "no memory for it",
    }
}

fn pass_time(report: &progressive_iso::PassReport) -> String {
    match report.gpu_ms {
        Some(ms) => format!("{} GPU", text::milliseconds(ms)),
        None => format!("{} CPU", text::milliseconds(report.cpu_ms)),
    }
}
