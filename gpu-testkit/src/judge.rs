//! Whether a pixel's answer is one that arithmetic in f32 may give: hit mask, first hit, residual
//! and parameter against the f64 reference, within the bounds of `docs/numerics.md`.

use crate::bounds::{Around, Sight, reach};
use crate::reference::{Hit, Scene, Trace};

/// The volume and isovalue that pictures show.
#[derive(Clone, Debug)]
pub struct Judge<'a> {
    scene: Scene<'a>,
    samples: &'a [f32],
    dims: [u32; 3],
    isovalue: f64,
}

/// The reference's answer for one pixel, with what f32 may make of it.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// The reference's answer.
    pub trace: Trace,
    /// Whether f32 may miss the hit: the field between it and the next turn, or the ray at the box's
    /// silhouette, stays within the error.
    pub may_miss: bool,
    /// How far before and behind the hit f32 may find it, voxels; `None` where that is over a voxel.
    reaches: [Option<f64>; 2],
    /// Error of the parameter as such, voxels.
    slack: f64,
}

/// How a pixel's answer compares with the reference's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The same: both miss, or both hit at parameters that are within the bound.
    Agrees,
    /// Another, where the reference itself hangs on less than the error.
    Tie,
    /// No hit where there must be one.
    Missing {
        /// The true parameter.
        expected: f64,
    },
    /// A hit behind the first one.
    Late {
        /// The parameter found.
        found: f64,
        /// The true one.
        expected: f64,
    },
    /// A hit before the ray's start, or at no number.
    Outside {
        /// The parameter found.
        found: f64,
    },
    /// A hit where the field is too far from the isovalue.
    OffSurface {
        /// The parameter found.
        found: f64,
        /// |field - isovalue| there.
        residual: f64,
        /// What is allowed.
        bound: f64,
        /// Whether the reference has a hit on this ray at all.
        has_hit: bool,
    },
}

/// A number and what it may be at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// What was found.
    pub found: f64,
    /// The bound.
    pub bound: f64,
}

impl Measured {
    /// Share of the bound that is used.
    #[must_use]
    pub fn share(self) -> f64 {
        if self.found == 0.0 { 0.0 } else { self.found / self.bound }
    }
}

/// What is said about a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// Mask and first hit.
    pub answer: Answer,
    /// The parameter found.
    pub t: Option<f64>,
    /// |field - isovalue| at the hit.
    pub residual: Option<Measured>,
    /// Distance of the hit from the reference's, voxels, where they are the same crossing.
    pub parameter: Option<Measured>,
}

impl Answer {
    /// Whether f32 may not give this answer.
    #[must_use]
    pub fn is_wrong(self) -> bool {
        !matches!(self, Self::Agrees | Self::Tie)
    }

    /// Whether the picture shows a surface where there is none, or none where there is one.
    #[must_use]
    pub fn mask_differs(self) -> bool {
        matches!(self, Self::Missing { .. } | Self::OffSurface { has_hit: false, .. })
    }
}

impl<'a> Judge<'a> {
    /// `samples` holds `dims` values, x fastest, as they are on the GPU.
    ///
    /// # Panics
    /// As [`Scene::new`].
    #[must_use]
    pub fn new(dims: [u32; 3], samples: &'a [f32], isovalue: f64) -> Self {
        Self { scene: Scene::new(dims, samples, isovalue), samples, dims, isovalue }
    }

    /// The reference.
    #[must_use]
    pub fn scene(&self) -> &Scene<'a> {
        &self.scene
    }

    /// The answers that a pixel may give. `trace` is the reference's for `sight.ray`.
    #[must_use]
    pub fn truth(&self, sight: &Sight, trace: Trace) -> Truth {
        let mut truth =
            Truth { trace, may_miss: self.grazes(sight, &trace), reaches: [None; 2], slack: 0.0 };
        if let Some(hit) = trace.hit {
            let allowed = self.value_error(sight, &hit);
            let side = |sign| reach(&self.scene, &sight.ray, hit.t, sign, allowed);
            truth.may_miss |= trace.turning_margin <= allowed;
            truth.reaches = [side(-1.0), side(1.0)];
            truth.slack = sight.parameter_error(hit.t);
        }
        truth
    }

    /// Compares a pixel's answer, `None` where it shows no surface, with the reference's.
    #[must_use]
    pub fn verdict(&self, sight: &Sight, truth: &Truth, depth: Option<f32>) -> Verdict {
        let mut verdict =
            Verdict { answer: Answer::Agrees, t: None, residual: None, parameter: None };
        let Some(depth) = depth else {
            verdict.answer = match truth.trace.hit {
                Some(hit) if !truth.may_miss => Answer::Missing { expected: hit.t },
                Some(_) => Answer::Tie,
                None => Answer::Agrees,
            };
            return verdict;
        };
        let t = sight.parameter(depth);
        verdict.t = Some(t);
        let slack = sight.parameter_error(t.max(0.0));
        if !(t >= -slack && t.is_finite()) {
            verdict.answer = Answer::Outside { found: t };
            return verdict;
        }
        let residual = self.residual(sight, t, slack);
        verdict.residual = Some(residual);
        (verdict.answer, verdict.parameter) = first_hit(truth, t);
        if residual.found > residual.bound {
            verdict.answer = Answer::OffSurface {
                found: t,
                residual: residual.found,
                bound: residual.bound,
                has_hit: truth.trace.hit.is_some(),
            };
        }
        verdict
    }

    fn value_error(&self, sight: &Sight, hit: &Hit) -> f64 {
        let around = Around::new(self.dims, self.samples, self.isovalue, hit.position);
        around.value_error(sight.error.position(hit.t))
    }

    fn grazes(&self, sight: &Sight, trace: &Trace) -> bool {
        let diagonal = self.dims.map(f64::from).iter().map(|n| n * n).sum::<f64>().sqrt();
        let farthest = sight.error.position(2.0 * diagonal).into_iter().fold(0.0, f64::max);
        trace.silhouette_distance.abs() <= farthest
    }

    /// The true field at a hit is the isovalue, up to rounding.
    fn residual(&self, sight: &Sight, t: f64, slack: f64) -> Measured {
        let position = sight.ray.at(t);
        let around = Around::new(self.dims, self.samples, self.isovalue, position);
        let along: f64 = (0..3).map(|a| around.steps[a] * sight.ray.direction[a].abs()).sum();
        let bound = around.value_error(sight.error.position(t)) + along * slack;
        Measured { found: self.scene.value(position).abs(), bound }
    }
}

/// Whether a hit at `t` is the first.
fn first_hit(truth: &Truth, t: f64) -> (Answer, Option<Measured>) {
    // Without a true hit the residual says that the field touches the isovalue here.
    let Some(hit) = truth.trace.hit else { return (Answer::Tie, None) };
    let reach = truth.reaches[usize::from(t > hit.t)];
    let bound = truth.slack + reach.unwrap_or(0.0);
    let found = (t - hit.t).abs();
    if found <= bound {
        (Answer::Agrees, Some(Measured { found, bound }))
    } else if t < hit.t || truth.may_miss || reach.is_none() {
        (Answer::Tie, None)
    } else {
        (Answer::Late { found: t, expected: hit.t }, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bounds::RayErrors;

    const DIMS: [u32; 3] = [8, 8, 8];

    /// Sheets at x = 2.5 and 4.5, seen along x from x = -1; depth 10 at the start.
    fn samples() -> Vec<f32> {
        (0..512).map(|n| if [3, 4].contains(&(n % 8)) { 1.0 } else { -1.0 }).collect()
    }

    fn sight(y: f64) -> Sight {
        let ray = |[px, py]: [u32; 2]| {
            let origin = [-1.0, y + 0.01 * f64::from(px), 3.3 + 0.01 * f64::from(py)];
            (origin, [1.0, 0.0, 0.0], 1.0)
        };
        RayErrors::new([1, 1], 10.0, ray).sight([0, 0], ray([0, 0]))
    }

    fn answer(y: f64, depth: Option<f32>) -> Answer {
        let samples = samples();
        let judge = Judge::new(DIMS, &samples, 0.0);
        let sight = sight(y);
        let truth = judge.truth(&sight, judge.scene().trace(&sight.ray));
        judge.verdict(&sight, &truth, depth).answer
    }

    #[test]
    fn only_the_first_hit_agrees() {
        assert_eq!(answer(3.2, Some(13.5)), Answer::Agrees);
        assert_eq!(answer(3.2, Some(13.5 + 1e-6)), Answer::Agrees);
        assert_eq!(answer(20.0, None), Answer::Agrees);
    }

    #[test]
    fn every_other_answer_is_wrong() {
        assert!(matches!(answer(3.2, None), Answer::Missing { .. }));
        assert!(matches!(answer(3.2, Some(15.5)), Answer::Late { .. }));
        assert!(matches!(answer(3.2, Some(9.0)), Answer::Outside { .. }));
        assert!(matches!(answer(3.2, Some(f32::NAN)), Answer::Outside { .. }));
        assert!(matches!(answer(3.2, Some(13.6)), Answer::OffSurface { has_hit: true, .. }));
        let phantom = answer(20.0, Some(13.6));
        assert!(phantom.is_wrong() && phantom.mask_differs(), "{phantom:?}");
        assert!(!answer(3.2, Some(15.5)).mask_differs());
        assert!(!Answer::Tie.is_wrong() && Answer::Missing { expected: 1.0 }.mask_differs());
    }

    #[test]
    fn at_the_silhouette_either_answer_will_do() {
        assert_eq!(answer(7.0, None), Answer::Tie);
        assert_eq!(answer(7.0, Some(13.5)), Answer::Agrees);
    }
}
