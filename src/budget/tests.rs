//! Settings that follow from made-up times.

use super::*;
use proptest::prelude::*;
use wavefront::Camera;

const SIZE: [u32; 2] = [640, 360];
const GRID: [u32; 3] = [200, 200, 200];

fn budget(mode: BudgetMode) -> Budget {
    let grid = Grid::new(GRID);
    let mut budget = Budget::new(mode, &Ledger::new(), grid, false);
    // Active for isovalues from 0 to 1: a cell in three.
    let active = |i: u64| if i.is_multiple_of(3) { [0.0, 1.0] } else { [2.0, 3.0] };
    let ranges = (0..grid.coarse_count()).map(active).collect();
    budget.pre_pass = Some(PrePass::new(grid, ranges));
    budget
}

fn view(azimuth: f64, distance: f64) -> FrameView {
    let unit = [1.0, 0.0, 0.0, 0.0];
    let world = [unit, [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let camera = Camera::orbit([100.0; 3], 170.0 * distance, azimuth, 20.0, 50.0, 16.0 / 9.0);
    FrameView::new(&camera, SIZE, world, GRID).unwrap_or_else(|e| panic!("{e}"))
}

/// Without previews or pixels that are filled.
fn request(view: &FrameView, target_ms: f64) -> Request<'_> {
    Request { view, size: SIZE, steps: &[1], isovalue: 0.5, look_ahead: 2, fills: false, target_ms }
}

fn outlook(budget: &mut Budget, request: &Request<'_>) -> Outlook {
    let Request { view, size, isovalue, .. } = *request;
    let work = budget.pre_pass.as_mut().map(|pre| pre.estimate(view, size, isovalue)).unwrap();
    Outlook::new(request, &work, false)
}

/// Shows `frames` frames of a moving camera to a renderer whose times are `cost` of density and
/// frame number, and returns densities and times.
fn show(
    budget: &mut Budget,
    frames: u32,
    target_ms: f64,
    fills: bool,
    cost: impl Fn(f64, u32) -> f64,
) -> Vec<(f64, f64)> {
    let frame = |number: u32| {
        let distance = 0.8 + 0.3 * (f64::from(number) * 0.1).sin();
        let view = view(3.0 * f64::from(number), distance);
        let request = Request { fills, ..request(&view, target_ms) };
        let choice = budget.choose(&request);
        let ms = cost(choice.asked, number);
        budget.learn(&choice, ms);
        (choice.asked, ms)
    };
    (0..frames).map(frame).collect()
}

#[test]
fn times_come_near_the_target_from_below() {
    let cost = |density: f64, _| 4.0 + 90.0 * density;
    let shown = show(&mut budget(BudgetMode::Predicted), 120, 30.0, false, cost);
    for (i, (density, ms)) in shown.iter().enumerate().skip(20) {
        assert!((22.0..31.0).contains(ms), "frame {i}: {ms} ms with a density of {density}");
    }
}

#[test]
fn a_frame_that_decodes_too_much_does_not_look_ahead() {
    let mut budget = budget(BudgetMode::Predicted);
    budget.cached = true;
    // Decoding what is new takes a millisecond for every step of looking ahead; the rest nothing of note.
    let mut look = |azimuth: f64, target_ms: f64| {
        let view = view(azimuth, 1.0);
        let request = Request { look_ahead: 4, ..request(&view, target_ms) };
        let choice = budget.choose(&request);
        budget.learn(&choice, 10.0 + f64::from(choice.look_ahead));
        choice.look_ahead
    };
    assert_eq!(look(0.0, 1e-3), 4, "nothing is known yet");
    assert_eq!(look(1.0, 1e6), 4);
    assert_eq!(look(2.0, 1e-3), 1);
    assert_eq!(look(3.0, 1e6), 4);
}

#[test]
fn a_density_rises_by_a_quarter_at_most() {
    for mode in [BudgetMode::Predicted, BudgetMode::LastFrame] {
        let shown = show(&mut budget(mode), 60, 1e6, false, |density, _| 100.0 * density);
        for pair in shown.windows(2) {
            assert!(pair[1].0 <= pair[0].0 / MOST_STEP * (1.0 + 1e-9), "{mode:?}: {pair:?}");
        }
        assert_eq!(shown[59].0.to_bits(), 1.0_f64.to_bits(), "{mode:?}: all rays fit");
    }
}

#[test]
fn what_does_not_fit_gets_the_least_density() {
    for mode in [BudgetMode::Predicted, BudgetMode::LastFrame] {
        let shown = show(&mut budget(mode), 30, 1e-3, false, |density, _| 100.0 * density);
        assert!((shown[29].0 - LEAST_SHARE).abs() < 1e-3, "{mode:?}: {:?}", shown[29]);
    }
}

#[test]
fn what_takes_as_long_with_fewer_rays_is_tried_with_fewer_all_the_same() {
    // As where filling takes as long as casting: rises again from the least density, too.
    let mut budget = budget(BudgetMode::Predicted);
    show(&mut budget, 40, 200.0, true, |density, _| 110.0 - 10.0 * density);
    let shown = show(&mut budget, 20, 50.0, true, |density, _| 110.0 - 10.0 * density);
    let least = shown.iter().map(|shown| shown.0).fold(1.0, f64::min);
    assert!(least <= LEAST_SHARE * 1.01, "{shown:?}");
}

#[test]
fn an_unusable_clock_ends_adaptation_and_a_usable_one_resumes_it() {
    for broken in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut budget = budget(BudgetMode::Predicted);
        let cost = |density: f64, number| {
            if (10..20).contains(&number) { broken } else { 100.0 * density }
        };
        let shown = show(&mut budget, 40, 20.0, false, cost);
        assert!(shown[9].0 < 0.5, "{shown:?}");
        for (density, _) in &shown[13..20] {
            assert_eq!(density.to_bits(), 1.0_f64.to_bits(), "{broken}: {shown:?}");
        }
        assert!(shown[39].0 < 0.5, "{broken}: {shown:?}");
    }
}

proptest! {
    #[test]
    fn whatever_frames_take_a_density_is_one_and_rises_slowly_but_not_from_a_frame_that_took_too_long(
        mode in prop::sample::select(vec![BudgetMode::Predicted, BudgetMode::LastFrame]),
        target_ms in 0.1..300.0,
        fixed_ms in 0.01..100.0,
        all_rays_ms in 0.0..1e3,
        fills in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let scatter = std::cell::RefCell::new(noise(seed));
        // Every tenth frame or so takes ten times as long.
        let cost = |density: f64, _| {
            let factor = if scatter.borrow_mut()() > 0.9 { 10.0 } else { 1.0 };
            (fixed_ms + all_rays_ms * density) * factor
        };
        let shown = show(&mut budget(mode), 60, target_ms, fills, cost);
        prop_assert!(shown.iter().all(|(density, _)| (LEAST_SHARE..=1.0).contains(density)), "{shown:?}");
        for pair in shown.windows(2) {
            let growth = if pair[0].1 > target_ms { 1.0 } else { 1.0 / MOST_STEP };
            prop_assert!(pair[1].0 <= pair[0].0 * growth * (1.0 + 1e-9), "{pair:?}");
        }
    }

    #[test]
    fn a_target_within_reach_is_kept(
        target_ms in 1.0..300.0,
        fixed_share in 0.02..0.6,
        density in 0.04..0.9,
    ) {
        let fixed_ms = fixed_share * target_ms;
        let cost = |chosen: f64, _| fixed_ms + (target_ms - fixed_ms) * chosen / density;
        let shown = show(&mut budget(BudgetMode::Predicted), 80, target_ms, false, cost);
        for (i, (chosen, ms)) in shown.iter().enumerate().skip(40) {
            prop_assert!(*ms <= 1.1 * target_ms, "frame {i}: {ms} of {target_ms} ms, density {chosen}");
            prop_assert!(*ms >= 0.6 * target_ms, "frame {i}: {ms} of {target_ms} ms, density {chosen}");
        }
    }

    #[test]
    fn a_clock_that_stays_unusable_ends_adaptation(
        mode in prop::sample::select(vec![BudgetMode::Predicted, BudgetMode::LastFrame, BudgetMode::TwoPass]),
        broken in prop::sample::select(vec![0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
        from in 0_u32..20,
    ) {
        let cost = |density: f64, number| if number >= from { broken } else { 100.0 * density };
        let shown = show(&mut budget(mode), from + 8, 20.0, false, cost);
        for (density, _) in &shown[from as usize + MOST_UNUSABLE as usize..] {
            prop_assert_eq!(density.to_bits(), 1.0_f64.to_bits(), "{:?}", shown);
        }
    }
}

#[test]
fn a_second_pass_casts_what_the_first_one_leaves_time_for() {
    let mut budget = budget(BudgetMode::TwoPass);
    let view = view(0.0, 1.0);
    let request = request(&view, 20.0);
    let choice = budget.choose(&request);
    let first = choice.setting.first_sampling();
    assert_eq!(budget.second(&choice), first, "nothing is known of it yet");
    budget.learn(&choice, 5.0);
    let second = budget.second(&choice).map(|s| f64::from(s.foveation.base_density));
    let expected = 1.0 - (1.0 - 4.0 * choice.asked).sqrt();
    assert!(second.is_some_and(|d| (d - expected).abs() < 1e-6), "{second:?}: {expected}");
}

#[test]
fn what_was_slow_once_is_tried_again() {
    for slow in [1, 2] {
        let mut budget = budget(BudgetMode::Predicted);
        let (view, mut seen, mut settings) = (view(0.0, 1.0), 0, Vec::new());
        for _ in 0..120 {
            let request = Request { steps: &[1, 2, 4], fills: true, ..request(&view, 60.0) };
            let choice = budget.choose(&request);
            let Setting { first, last, share } = choice.setting;
            let fixed = |step: u32| 30.0 / f64::from(step * step);
            let goes_on = if last < first { fixed(last) } else { 0.0 };
            let ms = fixed(first) + goes_on + 60.0 * share;
            // The first frames that go on from a preview to this step take long for another reason.
            seen += u32::from((first, last) == (2 * slow, slow));
            let hiccup = (first, last) == (2 * slow, slow) && (2..4).contains(&seen);
            budget.learn(&choice, if hiccup { 4.0 * ms } else { ms });
            settings.push(choice.setting);
        }
        // 30 / 4 + 30 + 60 share: a third of the rays fits, and some is kept free.
        let kept = settings[100..].iter().filter(|setting| setting.last == 1).count();
        assert!(kept > 15, "hiccups at {slow}: {:?}", &settings[60..]);
    }
}

#[test]
fn a_first_frame_with_a_preview_counts_if_it_takes_less_than_predicted() {
    let mut budget = budget(BudgetMode::Predicted);
    let view = view(0.0, 1.0);
    let choice = budget.choose(&Request { steps: &[1, 2, 4], ..request(&view, 30.0) });
    let ms_after = |budget: &mut Budget, share: f64, predicted_ms, ms| {
        let mut choice = choice;
        (choice.setting, choice.predicted_ms) = (Setting::new(share, &[1, 2, 4]), predicted_ms);
        budget.learn(&choice, ms);
        budget.last.map(|last| last.ms)
    };
    assert_eq!(ms_after(&mut budget, 0.05, None, 5.0), None, "nothing was predicted");
    assert_eq!(ms_after(&mut budget, 0.05, None, 6.0), Some(6.0), "the second one");
    assert_eq!(ms_after(&mut budget, 0.1, Some(10.0), 11.0), Some(6.0), "it may be compiling");
    assert_eq!(ms_after(&mut budget, 0.1, Some(10.0), 12.0), Some(12.0), "the second one");
    assert_eq!(
        ms_after(&mut budget, 0.25, Some(10.0), 9.0),
        Some(9.0),
        "nothing else is this quick"
    );
    budget.mode = BudgetMode::LastFrame;
    assert_eq!(
        ms_after(&mut budget, 0.5, Some(10.0), 8.0),
        Some(9.0),
        "predictions decide nothing"
    );
    // Without previews nothing runs for the first time.
    assert_eq!(ms_after(&mut budget, 1.0, Some(10.0), 14.0), Some(14.0));
}

#[test]
fn what_is_new_is_tried_with_the_least_share() {
    let mut budget = budget(BudgetMode::Predicted);
    let view = view(0.0, 1.0);
    let request = Request { steps: &[1, 2, 4], fills: true, ..request(&view, 30.0) };
    let outlook = outlook(&mut budget, &request);
    let setting = |asked| (asked, Setting::new(asked, request.steps));
    // After all rays of every second pixel, at whose cost 0.3 of all rays take what there is.
    let (_, known) = setting(0.25);
    let wanted = [0.33, 0.3, 0.27, 0.251, 0.24].map(setting);
    let work = 0.5 * outlook.units(&wanted[1].1);
    budget.level = Some(0.0);
    budget.last = Some(Measured { asked: 0.25, ms: 15.0, work });
    budget.model.learn(&outlook.features(&known), 0.0);
    let tried =
        |budget: &Budget| budget.trial(&outlook, 30.0 * budget.kept_free(), wanted.into_iter());
    assert_eq!(tried(&budget), Some(0.251));
    // What is known, with as many rays as fit.
    budget.model.learn(&outlook.features(&wanted[2].1), 0.0);
    assert_eq!(tried(&budget), Some(0.3));
    budget.trial_in = 1;
    assert_eq!(tried(&budget), None);
}

#[test]
fn what_was_never_tried_costs_as_much_for_its_work_as_what_was() {
    let (mut budget, mut scatter) = (budget(BudgetMode::Predicted), noise(3));
    let other = Setting::new(0.3, &[1, 2, 4]);
    assert_eq!([other.first, other.last], [2, 1]);
    for i in 0..40 {
        // At first nothing is in sight, which costs a tenth for its work.
        let (distance, isovalue, cost) = if i == 0 { (1.6, 5.0, 1e-6) } else { (0.9, 0.5, 1e-5) };
        let view = view(2.0 * f64::from(i), distance + 0.1 * (f64::from(i) * 0.3).sin());
        let request = Request { steps: &[1, 2, 4], fills: true, isovalue, ..request(&view, 1e3) };
        let choice = budget.choose(&request);
        let outlook = outlook(&mut budget, &request);
        let of = |setting: &Setting| (outlook.features(setting), outlook.units(setting));
        if i > 10 {
            let (ms, _) = budget.predict(&outlook, &other).unwrap();
            let expected = cost * of(&other).1;
            let error = (ms / expected).ln();
            assert!(error.abs() < 0.15, "seed 3, frame {i}: {ms} for {expected} ms");
        }
        // Up to whole pictures of every second pixel, in times that scatter by 15 %.
        let known = Setting::new((0.06 * 1.25_f64.powi(i)).min(0.25), &[1, 2, 4]);
        let (features, work) = of(&known);
        let ms = cost * work * (0.3 * (scatter() - 0.5)).exp();
        budget.learn(&Choice { features, work, setting: known, ..choice }, ms);
    }
}

#[test]
fn every_kind_of_work_has_a_cost_of_its_own() {
    let (mut budget, mut scatter) = (budget(BudgetMode::Predicted), noise(4));
    // Starting and going on are cheap, rays are not.
    let costs = [4e-6, 2e-6, 1e-5, 2e-5, 1e-5, 1e-5];
    for i in 0..60 {
        let view = view(2.0 * f64::from(i), 0.9 + 0.1 * (f64::from(i) * 0.3).sin());
        let request = Request { steps: &[1, 2, 4], fills: true, ..request(&view, 1e3) };
        let choice = budget.choose(&request);
        let outlook = outlook(&mut budget, &request);
        let ms_of = |setting: &Setting| -> f64 {
            outlook.parts(setting).iter().zip(costs).map(|(part, cost)| part * cost).sum()
        };
        if i > 30 {
            // More rays than ever.
            let more = Setting::new(0.45, &[1, 2, 4]);
            let (ms, _) = budget.predict(&outlook, &more).unwrap();
            let error = (ms / ms_of(&more)).ln();
            assert!(error.abs() < 0.1, "seed 4, frame {i}: {ms} for {} ms", ms_of(&more));
        }
        // From a part of every fourth pixel to a few more than every second one.
        let known = Setting::new(0.04 * 8.0_f64.powf(scatter()), &[1, 2, 4]);
        let ms = ms_of(&known) * (0.1 * (scatter() - 0.5)).exp();
        let (features, work) = (outlook.features(&known), outlook.units(&known));
        budget.learn(&Choice { features, work, setting: known, ..choice }, ms);
    }
}

#[test]
fn a_machine_that_becomes_slower_is_followed_within_three_frames() {
    let mut budget = budget(BudgetMode::Predicted);
    for i in 0..60 {
        let view = view(3.0 * f64::from(i), 0.8 + 0.3 * (f64::from(i) * 0.1).sin());
        let choice = budget.choose(&request(&view, 30.0));
        let slower = if i < 40 { 1.0 } else { 1.3 };
        let ms = slower * (4.0 + 90.0 * choice.asked);
        if i >= 43 {
            let predicted = choice.predicted_ms.unwrap();
            assert!((predicted / ms).ln().abs() < 0.06, "frame {i}: {predicted} for {ms} ms");
        }
        budget.learn(&choice, ms);
    }
}
