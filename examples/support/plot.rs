//! Small charts as SVG.

use std::fmt::Write as _;

const WIDTH: f64 = 1100.0;
const HEIGHT: f64 = 520.0;
/// Left, top, right and bottom of the area inside the axes; the legend is on its right.
const AREA: [f64; 4] = [76.0, 44.0, 810.0, 420.0];

/// Told apart by people with any kind of colour vision (Okabe and Ito, 2008).
const COLORS: [&str; 8] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999933"];
const DASHES: [&str; 3] = ["none", "7 4", "2 3"];

/// How values become positions.
#[derive(Clone, Copy, PartialEq)]
pub enum Scale {
    Linear,
    Log,
}

/// An axis with its ends.
#[derive(Clone, Copy)]
pub struct Axis {
    scale: Scale,
    ends: [f64; 2],
}

impl Axis {
    /// Holds all values; a logarithmic one ends at round numbers.
    pub fn around(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let usable = |v: &f64| v.is_finite() && (scale == Scale::Linear || *v > 0.0);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(usable) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (1.0, 10.0);
        }
        let ends = match scale {
            Scale::Linear => [low.min(0.0), high * 1.05],
            Scale::Log => [round_below(low * 0.95), round_above(high * 1.05)],
        };
        Self { scale, ends }
    }

    pub fn linear(ends: [f64; 2]) -> Self {
        Self { scale: Scale::Linear, ends }
    }

    /// 0 at the low end, 1 at the high one.
    fn place(&self, value: f64) -> f64 {
        let [low, high] = self.ends;
        match self.scale {
            Scale::Linear => (value - low) / (high - low),
            Scale::Log => (value.max(low) / low).ln() / (high / low).ln(),
        }
    }

    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.ends;
        let inside = |v: &f64| *v >= low * 0.999 && *v <= high * 1.001;
        match self.scale {
            Scale::Linear => {
                let step = round_above((high - low) / 6.0);
                (0..=12).map(|i| i as f64 * step).filter(inside).collect()
            }
            Scale::Log => {
                let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
                let round = |decade| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(decade));
                decades.flat_map(round).filter(inside).collect()
            }
        }
    }
}

/// The largest of ..., 1, 2, 5, 10, ... that is not above the value.
fn round_below(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0].map(|digit| digit * decade).into_iter().find(|v| *v <= value).unwrap_or(decade)
}

fn round_above(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade);
    round.into_iter().find(|v| *v >= value).unwrap_or(10.0 * decade)
}

/// Named points that a line connects.
pub struct Series {
    pub label: String,
    pub points: Vec<[f64; 2]>,
    /// Values change at the points only.
    pub steps: bool,
}

/// A chart of lines.
pub struct Lines {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    pub x: Axis,
    pub y: Axis,
    /// Marks on the x axis; empty: round numbers.
    pub x_ticks: Vec<f64>,
    pub series: Vec<Series>,
}

/// A chart of bars in groups; every series has a value, or none, for every group.
pub struct Bars {
    pub title: String,
    pub y_label: String,
    pub groups: Vec<String>,
    pub series: Vec<(String, Vec<Option<f64>>)>,
}

/// The text of an SVG file while it grows. Writing to a String does not fail.
struct Svg(String);

impl Svg {
    fn new(title: &str) -> Self {
        let mut svg = Self(String::new());
        svg.add(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
             viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">"
        ));
        svg.add("<rect width=\"100%\" height=\"100%\" fill=\"white\"/>");
        svg.text([(AREA[0] + AREA[2]) / 2.0, 24.0], "middle", "font-size=\"15\"", title);
        svg
    }

    fn add(&mut self, element: &str) {
        writeln!(self.0, "{element}").unwrap_or_default();
    }

    fn text(&mut self, [x, y]: [f64; 2], anchor: &str, more: &str, text: &str) {
        let text = text.replace('&', "&amp;").replace('<', "&lt;");
        self.add(&format!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" {more}>{text}</text>"
        ));
    }

    fn line(&mut self, from: [f64; 2], to: [f64; 2], style: &str) {
        self.add(&format!(
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" {style}/>",
            from[0], from[1], to[0], to[1]
        ));
    }

    /// The y axis with its grid.
    fn y_axis(&mut self, axis: &Axis, label: &str) {
        let [left, top, right, bottom] = AREA;
        for tick in axis.ticks() {
            let y = y_place(axis, tick);
            self.line([left, y], [right, y], "stroke=\"#dddddd\"");
            self.text([left - 6.0, y + 4.0], "end", "", &tick_label(tick));
        }
        let middle = (top + bottom) / 2.0;
        let turned = format!("transform=\"rotate(-90 18 {middle})\"");
        self.text([18.0, middle], "middle", &turned, label);
        self.line([left, top], [left, bottom], "stroke=\"black\"");
        self.line([left, bottom], [right, bottom], "stroke=\"black\"");
    }

    fn legend(&mut self, index: usize, label: &str, bar: bool) {
        let (x, y) = (AREA[2] + 16.0, AREA[1] + 10.0 + 20.0 * index as f64);
        if bar {
            let color = color(index);
            self.add(&format!(
                "<rect x=\"{x}\" y=\"{}\" width=\"22\" height=\"10\" fill=\"{color}\"/>",
                y - 5.0
            ));
        } else {
            self.line([x, y], [x + 22.0, y], &stroke(index));
        }
        self.text([x + 28.0, y + 4.0], "start", "", label);
    }

    fn finish(mut self) -> String {
        self.add("</svg>");
        self.0
    }
}

fn color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

fn stroke(index: usize) -> String {
    let dash = DASHES[index / COLORS.len() % DASHES.len()];
    format!("stroke=\"{}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\"", color(index))
}

fn tick_label(tick: f64) -> String {
    format!("{}", (tick * 1e6).round() / 1e6)
}

fn x_place(axis: &Axis, value: f64) -> f64 {
    AREA[0] + axis.place(value) * (AREA[2] - AREA[0])
}

fn y_place(axis: &Axis, value: f64) -> f64 {
    AREA[3] - axis.place(value) * (AREA[3] - AREA[1])
}

impl Lines {
    pub fn svg(&self) -> String {
        let mut svg = Svg::new(&self.title);
        svg.y_axis(&self.y, &self.y_label);
        let [left, top, right, bottom] = AREA;
        let ticks = if self.x_ticks.is_empty() { self.x.ticks() } else { self.x_ticks.clone() };
        for tick in ticks {
            let x = x_place(&self.x, tick);
            svg.line([x, top], [x, bottom], "stroke=\"#dddddd\"");
            svg.text([x, bottom + 18.0], "middle", "", &tick_label(tick));
        }
        svg.text([(left + right) / 2.0, bottom + 40.0], "middle", "", &self.x_label);
        for (index, series) in self.series.iter().enumerate() {
            self.draw(&mut svg, index, series);
            svg.legend(index, &series.label, false);
        }
        svg.finish()
    }

    fn draw(&self, svg: &mut Svg, index: usize, series: &Series) {
        let mut path = String::new();
        // Steps rise from the axis.
        let mut last = series.steps.then_some(AREA[3]);
        for &[x, y] in &series.points {
            let (x, y) = (x_place(&self.x, x), y_place(&self.y, y));
            if let (true, Some(last)) = (series.steps, last) {
                write!(path, "{x:.1},{last:.1} ").unwrap_or_default();
            }
            write!(path, "{x:.1},{y:.1} ").unwrap_or_default();
            last = Some(y);
        }
        svg.add(&format!("<polyline points=\"{path}\" fill=\"none\" {}/>", stroke(index)));
        for &[x, y] in &series.points {
            svg.add(&format!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{}\"/>",
                x_place(&self.x, x),
                y_place(&self.y, y),
                color(index)
            ));
        }
    }
}

impl Bars {
    pub fn svg(&self) -> String {
        let mut svg = Svg::new(&self.title);
        let values = self.series.iter().flat_map(|(_, values)| values.iter().flatten().copied());
        let mut y = Axis::around(Scale::Log, values);
        // A bar's length says nothing on a logarithmic axis; the lowest one should still be seen.
        y.ends[0] = round_below(y.ends[0] * 0.7);
        svg.y_axis(&y, &self.y_label);
        let room = (AREA[2] - AREA[0]) / self.groups.len().max(1) as f64;
        for (number, group) in self.groups.iter().enumerate() {
            let left = AREA[0] + room * number as f64;
            self.draw_group(&mut svg, &y, number, [left, room]);
            let [x, y] = [left + room / 2.0, AREA[3] + 16.0];
            let turned = format!("transform=\"rotate(-20 {x:.1} {y:.1})\"");
            svg.text(
                [x, y],
                if self.groups.len() > 4 { "end" } else { "middle" },
                if self.groups.len() > 4 { &turned } else { "" },
                group,
            );
        }
        for (index, (label, _)) in self.series.iter().enumerate() {
            svg.legend(index, label, true);
        }
        svg.finish()
    }

    fn draw_group(&self, svg: &mut Svg, y: &Axis, number: usize, [left, room]: [f64; 2]) {
        let width = room * 0.84 / self.series.len().max(1) as f64;
        for (index, (_, values)) in self.series.iter().enumerate() {
            let Some(value) = values.get(number).copied().flatten() else { continue };
            let (x, top) = (left + room * 0.08 + width * index as f64, y_place(y, value));
            svg.add(&format!(
                "<rect x=\"{x:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
                width * 0.92,
                AREA[3] - top,
                color(index)
            ));
        }
    }
}
