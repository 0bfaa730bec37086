//! What is measured.

use clap::ValueEnum;
use progressive_iso::{BlockSortedOptions, FrameOptions, TraversalStrategy};

use crate::library::Wanted;
use crate::support::subject::{BRAIN, Subject, cube, turbulence};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Set {
    /// Under a minute on two cores with a software adapter.
    Quick,
    /// Every kind of volume; under an hour.
    Ci,
    /// Large volumes and every setting too.
    Full,
    /// A patch of fixed size in volumes that grow.
    Scaling,
    /// From the compressed stream in memory to a picture, for a comparison with VTK.
    Vtk,
}

/// One volume in one picture size.
#[derive(Clone, Debug)]
pub struct Case {
    pub subject: Subject,
    /// Pixels.
    pub size: [u32; 2],
    /// Isovalues as factors of the suggested one.
    pub isovalues: &'static [f64],
    /// Orbit positions: azimuth and elevation in degrees.
    pub positions: &'static [[f64; 2]],
    /// Further frames of a short orbit after each warm one.
    pub steps: u32,
    /// Most bytes of GPU memory of each renderer.
    pub budget_bytes: u64,
}

/// Degrees of azimuth between the frames of a short orbit.
pub const STEP_DEGREES: f64 = 3.6;

/// One way of rendering.
#[derive(Clone, Debug)]
pub struct Setting {
    pub label: String,
    pub strategy: TraversalStrategy,
    /// 0 where it does not apply.
    pub start_factor: u32,
    pub look_ahead: u32,
    pub residency: Wanted,
}

impl Setting {
    pub fn runs_ahead(&self) -> bool {
        self.strategy == TraversalStrategy::RunAhead
    }

    pub fn strategy_name(&self) -> &'static str {
        if self.runs_ahead() { "run-ahead" } else { "block-sorted" }
    }
}

pub fn run_ahead(look_ahead: u32) -> Setting {
    let mark = if look_ahead == default_look_ahead() { " (default)" } else { "" };
    Setting {
        label: format!("RunAhead, look-ahead {look_ahead}{mark}"),
        strategy: TraversalStrategy::RunAhead,
        start_factor: 0,
        look_ahead,
        residency: Wanted::Cached,
    }
}

pub fn default_look_ahead() -> u32 {
    FrameOptions::default().look_ahead
}

fn full_residency() -> Setting {
    Setting {
        label: "RunAhead, full residency".into(),
        residency: Wanted::Full,
        ..run_ahead(default_look_ahead())
    }
}

pub fn block_sorted(start_factor: u32, speculation: bool) -> Setting {
    let options = BlockSortedOptions { start_factor, speculation };
    Setting {
        label: if speculation {
            format!("BlockSorted, start factor {start_factor}")
        } else {
            "BlockSorted, no speculation".into()
        },
        strategy: TraversalStrategy::BlockSorted(options),
        start_factor,
        look_ahead: 1,
        residency: Wanted::Cached,
    }
}

/// The ways of rendering a case, in the order in which they take turns.
pub fn settings(set: Set, case: &Case) -> Vec<Setting> {
    let voxels: u64 = case.subject.dims.iter().map(|&n| u64::from(n)).product();
    let other_default = default_look_ahead() != 1;
    let mut settings = vec![run_ahead(1), block_sorted(1, true)];
    settings.extend(other_default.then(|| run_ahead(default_look_ahead())));
    if voxels > 1 << 27 {
        // Loading takes minutes for each.
        return settings;
    }
    settings.push(block_sorted(2, true));
    settings.extend((voxels <= 1 << 24).then(full_residency));
    settings.extend([block_sorted(4, true), block_sorted(8, true)]);
    if set == Set::Full {
        settings.push(block_sorted(1, false));
        let more = [2, 4, 8].into_iter().filter(|&n| n != default_look_ahead());
        settings.extend(more.map(run_ahead));
    }
    settings
}

pub const TWO_POSITIONS: &[[f64; 2]] = &[[20.0, 15.0], [200.0, -25.0]];
pub const FIVE_POSITIONS: &[[f64; 2]] =
    &[[20.0, 15.0], [92.0, -10.0], [164.0, 35.0], [236.0, -25.0], [308.0, 5.0]];

pub const SMALL: [u32; 2] = [640, 368];
pub const MIDDLE: [u32; 2] = [1280, 720];
const LARGE: [u32; 2] = [1920, 1088];

/// The cases of a set. Those of one volume follow each other, so that it is made once.
pub fn cases(set: Set) -> Vec<Case> {
    match set {
        Set::Quick => quick(),
        Set::Ci => ci(),
        Set::Full => full(),
        Set::Scaling | Set::Vtk => Vec::new(),
    }
}

/// Two isovalues from five positions, from two if the volume is large.
fn thorough(subject: Subject, size: [u32; 2]) -> Case {
    let large = subject.dims.iter().any(|&n| n > 256);
    Case {
        subject,
        size,
        isovalues: &[1.0, 0.9],
        positions: if large { TWO_POSITIONS } else { FIVE_POSITIONS },
        steps: 5,
        budget_bytes: 1 << 30,
    }
}

/// One isovalue from two positions.
fn brief(subject: Subject, size: [u32; 2]) -> Case {
    Case { isovalues: &[1.0], positions: TWO_POSITIONS, ..thorough(subject, size) }
}

fn quick() -> Vec<Case> {
    [BRAIN, turbulence(128)].map(|subject| Case { steps: 2, ..brief(subject, SMALL) }).into()
}

fn ci() -> Vec<Case> {
    vec![
        thorough(BRAIN, SMALL),
        thorough(cube("shells", 128, 2.0), SMALL),
        thorough(cube("shells", 256, 2.0), SMALL),
        thorough(turbulence(128), SMALL),
        thorough(turbulence(256), SMALL),
        brief(turbulence(256), MIDDLE),
        brief(turbulence(256), LARGE),
        thorough(turbulence(512), SMALL),
        thorough(cube("rough-solid", 128, 4.0), SMALL),
        thorough(cube("rough-solid", 256, 4.0), SMALL),
    ]
}

fn full() -> Vec<Case> {
    let mut cases = ci();
    let large = |subject, size, gigabytes: u64| Case {
        budget_bytes: gigabytes << 30,
        ..brief(subject, size)
    };
    let huge = Subject { volume: "mixing-layer", dims: [2048, 2048, 1920], rate: 1.0 };
    cases.extend([
        brief(turbulence(512), MIDDLE),
        brief(cube("shells", 512, 2.0), MIDDLE),
        brief(cube("rough-solid", 512, 4.0), LARGE),
        large(turbulence(1024), MIDDLE, 2),
        large(huge, LARGE, 3),
    ]);
    cases
}
