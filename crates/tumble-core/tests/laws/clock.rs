//! Which turn of the target is which of the reference, when their clocks differ.

use nalgebra::{Rotation3, SVector, Vector3};
use proptest::prelude::*;
use tumble_core::noise::Noise;
use tumble_core::real::Real;
use tumble_core::turntable::clock::{ClockFit, TurnMark, centre_sigma, fit_clock, search_offset};

use crate::common::{Calibration, Draws, double};
use crate::stream::{Phase, Unit, samples, segments, turns};

fn mark<T: Real>(centre: f64, angle: f64, sigma: f64) -> TurnMark<T> {
    TurnMark {
        centre: nalgebra::convert(centre),
        sigma: nalgebra::convert(sigma),
        angle: nalgebra::convert(angle),
    }
}

/// Turns at irregular times through irregular angles.
fn turns_of() -> impl Strategy<Value = Vec<(f64, f64)>> {
    prop::collection::vec((4.0..12.0_f64, 0.3..3.1_f64), 4..20).prop_map(|steps| {
        let mut time = 0.0;
        steps
            .into_iter()
            .map(|(pause, angle)| {
                time += pause;
                (time, angle)
            })
            .collect()
    })
}

fn marks<T: Real>(turns: &[(f64, f64)], sigma: f64) -> Vec<TurnMark<T>> {
    turns
        .iter()
        .map(|(centre, angle)| mark(*centre, *angle, sigma))
        .collect()
}

/// The same turns on another clock, of which a target may have missed some, and its scale is not quite right.
fn seen(turns: &[(f64, f64)], offset: f64, skew: f64, scale: f64, missed: &[bool]) -> Vec<(f64, f64)> {
    let kept = turns.iter().zip(missed.iter().chain(core::iter::repeat(&false)));
    kept.filter(|(_, missed)| !**missed)
        .map(|((centre, angle), _)| (centre * (1.0 + skew) + offset, angle * scale))
        .collect()
}

proptest! {
    #[test]
    fn offset_and_skew_are_found_whatever_turns_were_missed(
        turns in turns_of(), offset in -500.0..500.0_f64, skew in -2e-4..2e-4_f64, scale in 0.97..1.03_f64,
        missed in prop::collection::vec(prop::bool::weighted(0.25), 0..20)
    ) {
        let other = seen(&turns, offset, skew, scale, &missed);
        prop_assume!(other.len() >= 3);
        let (reference, target) = (marks::<f64>(&turns, 1e-4), marks::<f64>(&other, 1e-4));
        let first = search_offset(&reference, &target);
        prop_assert!(first.is_some_and(|first| (first - offset).abs() < 0.05), "{:?}", first);
        let fit = fit_clock(&reference, &target, first.unwrap_or_default()).expect("turns meet");
        prop_assert_eq!(fit.turns as usize, other.len());
        // Without noise, but with a prior on skew of 1e-3 against what marks of 1e-4 s show over the session.
        prop_assert!((fit.skew - skew).abs() < 0.02 * skew.abs() + 1e-9, "{:?}", fit);
        for (centre, _) in &turns {
            prop_assert!((fit.offset_at(*centre).0 - (offset + skew * centre)).abs() < 1e-4);
        }
        let start = 0.37;
        prop_assert!((fit.to_reference(start * (1.0 + skew) + offset) - start).abs() < 2e-4);
    }

    #[test]
    fn the_same_clock_in_single_precision(turns in turns_of(), offset in -100.0..100.0_f64) {
        let other = seen(&turns, offset, 0.0, 1.0, &[]);
        let (reference, target) = (marks::<f32>(&turns, 1e-3), marks::<f32>(&other, 1e-3));
        let first = search_offset(&reference, &target).expect("all turns meet");
        let fit = fit_clock(&reference, &target, first).expect("all turns meet");
        // Times up to 300 s are known to 3e-5 s in f32.
        prop_assert!((double(fit.offset) - offset).abs() < 2e-4, "{:?}", fit);
        prop_assert!(double(fit.skew).abs() < 2e-5);
    }

    #[test]
    fn a_periodic_schedule_seen_whole_is_not_mistaken_by_a_period(
        count in 2..12_usize, period in 4.0..12.0_f64, offset in -100.0..100.0_f64, jitter in any::<u64>()
    ) {
        let mut draws = Draws::new(jitter);
        let turns: Vec<_> = (0..count).map(|k| (period * k as f64, 1.57)).collect();
        let mut other = seen(&turns, offset, 1e-5, 1.0, &[]);
        other.iter_mut().for_each(|(centre, _)| *centre += 1e-3 * draws.normal());
        let first = search_offset(&marks::<f64>(&turns, 1e-3), &marks(&other, 1e-3));
        prop_assert!(first.is_some_and(|first| (first - offset).abs() < 0.02), "{:?}", first);
    }

    #[test]
    fn a_periodic_schedule_seen_in_part_is_matched_by_its_odd_turn(
        period in 4.0..12.0_f64, offset in -100.0..100.0_f64, odd in 2..6_usize, late in 0..2_usize
    ) {
        let turns: Vec<_> = (0..8).map(|k| (period * k as f64, if k == odd { 3.1 } else { 1.57 })).collect();
        let missed: Vec<bool> = (0..8).map(|k| k < late).collect();
        let other = seen(&turns, offset, 0.0, 1.0, &missed);
        let first = search_offset(&marks::<f64>(&turns, 1e-3), &marks(&other, 1e-3));
        prop_assert!(first.is_some_and(|first| (first - offset).abs() < 1e-9), "{:?}", first);
    }

    #[test]
    fn units_that_turned_by_different_angles_have_no_turn_in_common(turns in turns_of(), scale in 1.4..3.0_f64) {
        // Half a radian apart from the largest of the others on.
        let small: Vec<_> = turns.iter().map(|(centre, angle)| (*centre, 0.3 * angle)).collect();
        let large: Vec<_> = turns.iter().map(|(centre, angle)| (*centre, scale + 0.5 * angle)).collect();
        prop_assert_eq!(search_offset(&marks::<f64>(&small, 1e-3), &marks(&large, 1e-3)), None);
    }

    #[test]
    fn times_go_to_the_reference_and_back(offset in -1e3..1e3_f64, skew in -1e-3..1e-3_f64, epoch in 0.0..1e3_f64, t in -1e3..1e4_f64) {
        let clock = ClockFit { offset, skew, epoch, ..ClockFit::known(0.0) };
        let there = t + offset + skew * (t - epoch);
        prop_assert!((clock.to_reference(there) - t).abs() < 1e-8);
        prop_assert!((clock.offset_at(t).0 - (there - t)).abs() < 1e-8);
    }
}

#[test]
fn no_turns_have_no_offset() {
    let one = [mark::<f64>(5.0, 1.0, 1e-3)];
    assert_eq!(search_offset::<f64>(&[], &[]), None);
    assert_eq!(search_offset(&one, &[]), None);
    assert_eq!(search_offset(&[], &one), None);
    assert!(fit_clock::<f64>(&[], &[], 0.0).is_err());
    assert_eq!(search_offset(&one, &[mark(7.0, 1.0, 1e-3)]), Some(2.0));
}

#[test]
fn one_turn_in_common_of_many_is_no_proof() {
    let reference = marks::<f64>(&[(5.0, 1.0), (15.0, 2.0), (22.0, 3.0)], 1e-3);
    let target = marks::<f64>(&[(5.0, 1.0), (35.0, 0.3), (57.0, 0.5)], 1e-3);
    assert_eq!(search_offset(&reference, &target), None);
}

#[test]
fn offset_and_skew_err_as_their_covariance_says() {
    let mut draws = Draws::new(131);
    let (offset, skew) = (12.5, 3e-5);
    let turns: Vec<_> = (0..60)
        .map(|k| (7.0 * f64::from(k), 0.5 + 0.04 * f64::from(k)))
        .collect();
    let mut calibration = Calibration::<2>::new();
    for _ in 0..1000 {
        let (mut reference, mut target) = (
            marks::<f64>(&turns, 1e-3),
            marks::<f64>(&seen(&turns, offset, skew, 1.0, &[]), 3e-3),
        );
        for mark in reference.iter_mut().chain(&mut target) {
            mark.centre += mark.sigma * draws.normal();
        }
        let fit = fit_clock(&reference, &target, offset + 0.01).expect("all turns meet");
        let error = [fit.offset - (offset + skew * fit.epoch), fit.skew - skew];
        calibration.push(SVector::from(error), &fit.covariance);
    }
    calibration.check_errors("clock", draws.seed);
}

#[test]
fn the_centre_of_a_turn_errs_as_its_sigma_says() {
    let (seed, runs, scatter) = (132, 300_u32, 0.02);
    let mut draws = Draws::new(seed);
    let angle: f64 = 1.2;
    let schedule = [
        Phase::Rest(2.0),
        Phase::Turn(Vector3::x() * angle, 1.0),
        Phase::Rest(2.0),
    ];
    let unit = Unit {
        mounting: Rotation3::new(Vector3::new(0.4, 0.2, -0.3)),
        ..Unit::noisy(0.01, scatter)
    };
    let mut errors = 0.0;
    let mut sigma: f64 = 0.0;
    for _ in 0..runs {
        let stream = samples(&schedule, &Vector3::z(), &unit, &mut draws);
        let turn = turns(&segments::<f64>(&stream))[1];
        let centre = turn.centre_of_turn(&Vector3::zeros()).expect("a turn") + turn.start as f64 * 1e-6;
        errors += (centre - (2.5 - 0.0025)).powi(2) / f64::from(runs);
        // Density from the scatter of samples at 200 Hz.
        let white = Noise {
            white: scatter * scatter / 200.0,
            ..Noise::none()
        };
        sigma = sigma.max(centre_sigma(&white, turn.duration(), angle));
    }
    let ratio = errors.sqrt() / sigma;
    println!(
        "centre of turn, seed {seed}: RMSE {:.2e} s, sigma {sigma:.2e} s",
        errors.sqrt()
    );
    assert!((0.85..1.1).contains(&ratio), "seed {seed}: {ratio}");
}
