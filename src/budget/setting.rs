//! Settings of a frame: how many of its rays the first pass casts, and in how many previews.

use wavefront::Foveation;

/// What a frame's first pass casts.
///
/// It begins with the rays of every `first`-th pixel in both directions and shows what lies between as colours between theirs,
/// unless that is 1; where `last` is smaller, it goes on with rays of every `last`-th pixel. A step is a power of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) first: u32,
    pub(crate) last: u32,
    /// Share of the picture's rays in all.
    pub(crate) share: f64,
}

/// Share of its rays from which on a step's pictures are cast as a whole and at once: it takes no longer.
const WHOLE: f64 = 0.8;

impl Setting {
    /// All rays at once.
    pub(crate) const ALL: Self = Self { first: 1, last: 1, share: 1.0 };

    /// The setting for a share. Preview upon preview is made until the next one would have fewer rays than are wanted; `steps`
    /// are those that there may be, ascending from 1.
    pub(super) fn new(share: f64, steps: &[u32]) -> Self {
        let of = |first: u32, last, share| Self { first, last, share };
        for (i, &step) in steps.iter().enumerate() {
            if share * squared(step) >= WHOLE {
                return of(step, step, 1.0 / squared(step));
            }
            match steps.get(i + 1) {
                Some(&coarser) if share * squared(coarser) > 1.0 => {
                    return of(coarser, step, share);
                }
                Some(_) => {}
                None => return of(step, step, share),
            }
        }
        of(1, 1, share)
    }

    /// Which of its rays the first step casts; `None`: all.
    pub(crate) fn first_sampling(&self) -> Option<Sampling> {
        let goes_on = self.last < self.first;
        Sampling::even(if goes_on { 1.0 } else { self.share * squared(self.first) })
    }

    /// Which of its rays the last step casts, beside those of the first one.
    pub(crate) fn last_sampling(&self) -> Option<Sampling> {
        let lattice = self.first / self.last;
        let there = 1.0 / squared(lattice);
        let density = (self.share * squared(self.last) - there) / (1.0 - there);
        Some(Sampling { lattice, ..Sampling::even(density.max(0.0))? })
    }

    /// Of the newest of them.
    pub(super) fn newest_sampling(&self) -> Option<Sampling> {
        if self.last < self.first { self.last_sampling() } else { self.first_sampling() }
    }
}

/// Which rays a frame's passes cast: those of a mask and, with `lattice` above 1, every `lattice`-th pixel's in both directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sampling {
    pub(crate) foveation: Foveation,
    pub(crate) lattice: u32,
}

impl Sampling {
    /// A share of the rays, spread evenly; `None`: all of them at once.
    pub(super) fn even(share: f64) -> Option<Self> {
        // So that the passes after the first, which cast what is left, are about as long.
        let passes = (2.0 / share).ceil() as u32;
        let foveation = Foveation {
            sigma: 0.0,
            base_density: share as f32,
            passes: passes.clamp(1, Foveation::MOST_PASSES),
            ..Foveation::default()
        };
        (share < 1.0).then_some(Self { foveation, lattice: 1 })
    }
}

/// Steps that there may be: 1, 2 and 4.
pub(crate) const STEPS: usize = 3;

/// The place of a step among them.
pub(crate) fn step_index(step: u32) -> usize {
    (step.max(1).ilog2() as usize).min(STEPS - 1)
}

/// Pixels for one ray of a step.
pub(super) fn squared(step: u32) -> f64 {
    f64::from(step * step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Share of the picture's rays that a setting's masks have.
    fn cast(setting: &Setting) -> f64 {
        let density = |sampling: Option<Sampling>| {
            sampling.map_or(1.0, |sampling| f64::from(sampling.foveation.base_density))
        };
        let first = density(setting.first_sampling()) / squared(setting.first);
        if setting.last == setting.first {
            return first;
        }
        let Some(sampling) = setting.last_sampling() else { return 1.0 / squared(setting.last) };
        assert_eq!(sampling.lattice, setting.first / setting.last, "{setting:?}");
        let others = 1.0 / squared(setting.last) - first;
        first + others * density(Some(sampling))
    }

    proptest! {
        #[test]
        fn a_setting_casts_about_as_many_rays_as_are_asked_for(
            asked in 1.0_f64 / 64.0..=1.0,
            steps in prop::sample::select(vec![&[1][..], &[1, 2], &[1, 2, 4]]),
        ) {
            let setting = Setting::new(asked, steps);
            prop_assert!((cast(&setting) - setting.share).abs() < 1e-6, "{setting:?}");
            prop_assert!(setting.share >= WHOLE * asked && setting.share <= asked / WHOLE + 1e-12);
            let Setting { first, last, .. } = setting;
            prop_assert!(steps.contains(&first) && steps.contains(&last), "{setting:?}");
            prop_assert!(first == last || first == 2 * last, "{setting:?}");
            // No step of which next to nothing would be cast.
            let coarsest = steps.iter().all(|step| *step <= last);
            prop_assert!(coarsest || setting.share * squared(last) > 0.25, "{setting:?}");
        }

        #[test]
        fn more_that_is_asked_for_is_not_less_that_is_cast(
            asked in 1.0_f64 / 64.0..=1.0,
            more in 1.0_f64..1.5,
        ) {
            let [less, more] = [asked, asked * more].map(|asked| Setting::new(asked.min(1.0), &[1, 2, 4]));
            prop_assert!(more.share >= less.share, "{less:?}, {more:?}");
        }
    }
}
