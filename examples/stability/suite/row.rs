//! What is measured on a case.

use gpu_testkit::judge::{Answer, Verdict};
use serde::Serialize;

pub type Failure = Box<dyn std::error::Error>;

/// Problems that a row spells out.
const MOST_PROBLEMS: usize = 5;

/// One row of the table. `docs/testing.md` explains the keys.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    pub group: &'static str,
    pub name: String,
    pub pictures: u64,
    /// Pixels of all pictures.
    pub rays: u64,
    /// Rays that were compared with the reference and followed by the twin.
    pub compared: u64,
    pub hits: u64,
    /// Rays whose ends are on different sides but that have no hit; cells of the twin's walk whose sides
    /// do not join; rays without a hit where every ray must have one.
    pub watertight_violations: u64,
    /// Rays on which only one of picture and reference has a hit, ties apart.
    pub mask_disagreement: u64,
    /// Hits that are not the first, lie before the start or off the surface.
    pub wrong_hits: u64,
    /// Rays whose answer differs where the reference hangs on less than the error of f32.
    pub ties: u64,
    /// Misses all of whose neighbours hit, on closed surfaces.
    pub cracks: u64,
    /// Largest share of its bound that a residual takes.
    pub residual_share: f64,
    pub depth_error_max_voxels: f64,
    /// The same in steps of f32 at the hit's depth.
    pub depth_error_max_ulps: f64,
    /// What is allowed at the hit with the largest error, voxels.
    pub bound: f64,
    /// Largest share of its bound that a hit's depth takes.
    pub depth_share: f64,
    /// Evaluations of the field in the root search.
    pub root_steps_mean: f64,
    pub root_steps_worst: u32,
    pub ok: bool,
    /// The first problems in words.
    pub problems: Vec<String>,
    #[serde(skip)]
    root_steps: u64,
    #[serde(skip)]
    roots: u64,
}

impl Row {
    pub fn new(group: &'static str, name: &str) -> Self {
        Self { group, name: name.into(), ..Self::default() }
    }

    pub fn problem(&mut self, problem: impl FnOnce() -> String) {
        if self.problems.len() < MOST_PROBLEMS {
            self.problems.push(problem());
        }
    }

    /// Counts a pixel's verdict. `ulp_voxels` is one step of f32 at its depth, in voxels.
    pub fn add(&mut self, verdict: &Verdict, ulp_voxels: f64) {
        self.compared += 1;
        self.ties += u64::from(verdict.answer == Answer::Tie);
        let differs = verdict.answer.mask_differs();
        self.mask_disagreement += u64::from(differs);
        self.wrong_hits += u64::from(verdict.answer.is_wrong() && !differs);
        if let Some(residual) = verdict.residual {
            self.residual_share = self.residual_share.max(residual.share());
        }
        if let Some(parameter) = verdict.parameter {
            self.depth_share = self.depth_share.max(parameter.share());
            let ulps = parameter.found / ulp_voxels;
            self.depth_error_max_ulps = self.depth_error_max_ulps.max(ulps);
            if parameter.found >= self.depth_error_max_voxels {
                self.depth_error_max_voxels = parameter.found;
                self.bound = parameter.bound;
            }
        }
    }

    pub fn add_root(&mut self, steps: u32) {
        self.roots += 1;
        self.root_steps += u64::from(steps);
        self.root_steps_worst = self.root_steps_worst.max(steps);
        self.root_steps_mean = self.root_steps as f64 / self.roots as f64;
    }

    /// Whether everything that must be zero is.
    pub fn finish(mut self) -> Self {
        let wrong = self.watertight_violations
            + self.mask_disagreement
            + self.wrong_hits
            + self.cracks
            + self.problems.len() as u64;
        self.ok = wrong == 0;
        self
    }
}
