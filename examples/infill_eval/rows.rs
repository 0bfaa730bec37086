//! Measures of pictures, their means and tables.

use gpu_testkit::image::{flip, intersection_over_union, psnr, psnr_of_change, psnr_where, ssim};
use serde::Serialize;

use crate::subject::Motion;
use crate::support::shown::Shown;
use crate::support::{Table, distinct, mean, median};

/// Measures of one picture.
#[derive(Clone, Debug)]
pub struct Frame {
    method: &'static str,
    psnr: f64,
    ssim: f64,
    psnr_holes: Option<f64>,
    iou_holes: Option<f64>,
    tpsnr: Option<f64>,
    flip: Option<f64>,
    ms: f64,
    bytes: u64,
    completeness_pixels: f64,
}

/// Means over the frames of a sequence. JSON: null where no frame has the measure.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub method: String,
    pub volume: String,
    pub cut: f64,
    pub motion: String,
    pub degrees: f64,
    pub frames: usize,
    pub completeness_pixels: f64,
    /// Share of the frames whose picture equals the finished one; they have no PSNR.
    pub exact: f64,
    pub psnr: Option<f64>,
    pub ssim: Option<f64>,
    pub psnr_holes: Option<f64>,
    pub iou_holes: Option<f64>,
    pub tpsnr: Option<f64>,
    /// Of the last frame.
    pub flip: Option<f64>,
    /// Median wall time of filling.
    pub ms: f64,
    /// Memory beside that of the renderer that does not fill.
    pub bytes: u64,
}

impl Frame {
    /// `previous`: this method's and the true picture of the frame before.
    pub fn new(
        method: &'static str,
        (shown, truth, holes): (&Shown, &Shown, &[bool]),
        previous: Option<(&Shown, &Shown)>,
        size: [u32; 2],
        (ms, bytes): (f64, u64),
        with_flip: bool,
        completeness_pixels: f64,
    ) -> Self {
        let size = size.map(|s| s as usize);
        let (colors, expected) = (&shown.colors, &truth.colors);
        let surfaces = shown.surface.as_ref().zip(truth.surface.as_ref());
        Self {
            method,
            psnr: psnr(colors.as_flattened(), expected.as_flattened(), 1.0),
            ssim: ssim(&shown.luma(), &truth.luma(), size),
            psnr_holes: psnr_where(colors, expected, holes),
            iou_holes: surfaces.and_then(|(a, b)| intersection_over_union(a, b, holes)),
            tpsnr: previous.map(|(old, old_truth)| {
                psnr_of_change([&old.colors, colors], [&old_truth.colors, expected])
            }),
            flip: with_flip.then(|| flip(colors, expected, size)),
            ms,
            bytes,
            completeness_pixels,
        }
    }
}

impl Row {
    /// One row per method of a sequence.
    pub fn means(frames: &[Frame], volume: &str, cut: f64, motion: Motion) -> Vec<Self> {
        let row = |method: &'static str| {
            let own: Vec<&Frame> = frames.iter().filter(|f| f.method == method).collect();
            Self {
                method: method.into(),
                volume: volume.into(),
                cut,
                motion: motion.name().into(),
                degrees: motion.degrees(),
                frames: own.len(),
                completeness_pixels: own.iter().map(|f| f.completeness_pixels).sum::<f64>()
                    / own.len() as f64,
                exact: own.iter().filter(|f| f.psnr == f64::INFINITY).count() as f64
                    / own.len() as f64,
                psnr: mean(own.iter().map(|f| Some(f.psnr))),
                ssim: mean(own.iter().map(|f| Some(f.ssim))),
                psnr_holes: mean(own.iter().map(|f| f.psnr_holes)),
                iou_holes: mean(own.iter().map(|f| f.iou_holes)),
                tpsnr: mean(own.iter().map(|f| f.tpsnr)),
                flip: mean(own.iter().map(|f| f.flip)),
                ms: median(own.iter().map(|f| f.ms)),
                bytes: own.iter().map(|f| f.bytes).max().unwrap_or(0),
            }
        };
        distinct(frames.iter().map(|f| f.method)).into_iter().map(row).collect()
    }

    /// One line of progress.
    pub fn line(&self) -> String {
        let Self { volume, cut, motion, degrees, method, .. } = self;
        let cells = [self.psnr, self.ssim, self.psnr_holes, self.tpsnr, self.flip].map(cell);
        format!(
            "{volume:<11} {cut:.2} {motion:<13} {degrees:1} {method:<18} {} {:7.1} ms",
            cells.join(" "),
            self.ms
        )
    }
}

fn cell(value: Option<f64>) -> String {
    value.map_or("-".into(), |v| if v.abs() < 2.0 { format!("{v:.4}") } else { format!("{v:.2}") })
}

/// For every cut a table of the means over volumes and motions, then of the holes of every volume.
pub fn tables(rows: &[Row]) -> String {
    let mut text = String::new();
    let volumes = distinct(rows.iter().map(|r| r.volume.as_str()));
    for cut in distinct(rows.iter().map(|r| r.cut)) {
        let mut heads = vec![
            "method",
            "exact, %",
            "PSNR",
            "SSIM",
            "PSNR of holes",
            "IoU of holes",
            "tPSNR",
            "FLIP",
            "ms",
            "bytes",
        ];
        heads.extend(&volumes);
        let title =
            format!("Cut at {} % of the pixels; of the volumes the PSNR of holes", 100.0 * cut);
        let mut table = Table::new(&title, &heads, 1);
        for method in distinct(rows.iter().map(|r| r.method.as_str())) {
            let own: Vec<&Row> =
                rows.iter().filter(|r| r.cut == cut && r.method == method).collect();
            let of = |value: fn(&Row) -> Option<f64>| {
                // Every volume counts the same.
                let per_volume = volumes
                    .iter()
                    .map(|v| mean(own.iter().filter(|r| r.volume == *v).map(|r| value(r))));
                cell(mean(per_volume))
            };
            let exact = own.iter().map(|r| r.exact).sum::<f64>() / own.len() as f64;
            let mut cells = vec![method.to_owned(), format!("{:.0}", 100.0 * exact)];
            cells.extend([
                of(|r| r.psnr),
                of(|r| r.ssim),
                of(|r| r.psnr_holes),
                of(|r| r.iou_holes),
            ]);
            cells.extend([of(|r| r.tpsnr), of(|r| r.flip)]);
            cells.push(format!("{:.1}", median(own.iter().map(|r| r.ms))));
            cells.push(own.iter().map(|r| r.bytes).max().unwrap_or(0).to_string());
            cells.extend(
                volumes.iter().map(|v| {
                    cell(mean(own.iter().filter(|r| r.volume == *v).map(|r| r.psnr_holes)))
                }),
            );
            table.line(&cells);
        }
        text += &table.finish();
    }
    text
}
