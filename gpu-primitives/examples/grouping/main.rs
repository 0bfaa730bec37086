//! Two ways of grouping pairs by slot, timed on the same data: the sort, and counting scatter
//! (an atomic addition per pair, a scan over the slots, and another atomic addition per pair).
//!
//! `cargo run -p gpu-primitives --example grouping -- [--out FILE.json] [--runs N]`

#![allow(clippy::print_stdout, reason = "a command-line program")]
#![allow(unreachable_pub, reason = "a program has no public items")]

mod data;
mod ways;

use data::{Order, Pairs};
use gpu_primitives::wgpu;
use gpu_testkit::gpu;
use ways::{Bench, Stages, Way};

const COUNTS: [u32; 3] = [1 << 16, 1 << 18, 1 << 20];
const SLOTS: [u32; 2] = [1 << 14, 1 << 17];
const DEFAULT_RUNS: usize = 15;

type Failure = Box<dyn std::error::Error>;

/// Medians and least times of the ways, in milliseconds, for one set of pairs.
struct Row {
    pairs: u32,
    slots: u32,
    order: Order,
    times: Vec<(Way, f64, f64)>,
}

fn main() -> Result<(), Failure> {
    let (out, runs) = arguments()?;
    let info = gpu::adapter_info();
    let timed = gpu::adapter().features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let features = if timed { wgpu::Features::TIMESTAMP_QUERY } else { wgpu::Features::empty() };
    let (device, queue) = gpu::device_with(features, wgpu::Limits::default());
    let timer = if timed { "timestamp queries" } else { "submit until done" };
    println!("adapter: {} ({}, {:?})", info.name, info.driver_info, info.backend);
    println!("medians of {runs} interleaved runs, milliseconds, by {timer}\n");

    let stages = Stages::new(&device);
    let mut rows = Vec::new();
    println!("{}", header());
    for pairs in COUNTS {
        for slots in SLOTS {
            for order in Order::ALL {
                let data = Pairs::new(pairs, slots, order);
                let bench = Bench::new(&device, &queue, &stages, &data, timed);
                bench.check(&data)?;
                let row = Row { pairs, slots, order, times: measure(&bench, runs) };
                println!("{}", row.markdown());
                rows.push(row);
            }
        }
    }
    if let Some(path) = out {
        std::fs::write(path, json(&info, timer, runs, &rows))?;
    }
    Ok(())
}

fn arguments() -> Result<(Option<std::path::PathBuf>, usize), Failure> {
    let (mut out, mut runs) = (None, DEFAULT_RUNS);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{argument} needs a value"))?;
        match argument.as_str() {
            "--out" => out = Some(value.into()),
            "--runs" => runs = value.parse::<usize>()?.max(1),
            _ => return Err(format!("{argument} is neither --out nor --runs").into()),
        }
    }
    Ok((out, runs))
}

/// All ways in turn, so that what else the machine does meets all of them alike.
fn measure(bench: &Bench<'_>, runs: usize) -> Vec<(Way, f64, f64)> {
    let mut times = Way::ALL.map(|way| (way, Vec::new()));
    for run in 0..=runs {
        for (way, times) in &mut times {
            let time = bench.run(*way);
            // The first one warms up.
            if run > 0 {
                times.push(time);
            }
        }
    }
    times
        .into_iter()
        .map(|(way, mut times)| {
            times.sort_by(f64::total_cmp);
            (way, times[times.len() / 2], times[0])
        })
        .collect()
}

fn header() -> String {
    let names: Vec<&str> = Way::ALL.iter().map(|way| way.name()).collect();
    let rule = "---: | ".repeat(names.len());
    format!(
        "| pairs | slots | order | {} |\n| ---: | ---: | --- | {}",
        names.join(" | "),
        rule.trim()
    )
}

impl Row {
    fn markdown(&self) -> String {
        let times: Vec<String> =
            self.times.iter().map(|(_, median, _)| format!("{median:.2}")).collect();
        let Self { pairs, slots, order, .. } = self;
        format!("| {pairs} | {slots} | {} | {} |", order.name(), times.join(" | "))
    }

    fn json(&self) -> String {
        let times: Vec<String> = self
            .times
            .iter()
            .map(|(way, median, least)| {
                format!(
                    "{:?}: {{\"median_ms\": {median:.4}, \"least_ms\": {least:.4}}}",
                    way.name()
                )
            })
            .collect();
        let Self { pairs, slots, order, .. } = self;
        let order = order.name();
        let times = times.join(", ");
        format!("    {{\"pairs\": {pairs}, \"slots\": {slots}, \"order\": {order:?}, {times}}}")
    }
}

/// Names have no characters that JSON and Rust write differently.
fn json(info: &wgpu::AdapterInfo, timer: &str, runs: usize, rows: &[Row]) -> String {
    let rows: Vec<String> = rows.iter().map(Row::json).collect();
    format!(
        "{{\n  \"adapter\": {:?},\n  \"driver\": {:?},\n  \"backend\": \"{:?}\",\n  \
         \"timer\": {timer:?},\n  \"runs\": {runs},\n  \"rows\": [\n{}\n  ]\n}}\n",
        info.name,
        info.driver_info,
        info.backend,
        rows.join(",\n")
    )
}
