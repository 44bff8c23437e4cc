//! Channels that cannot be trusted.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::STANDARD;
use tumble_lab::acquisition::Acquired;
use tumble_lab::acquisition::channels::ChannelFaultKind;

use super::common::{Draws, cases};
use super::stream::{Phase, Unit};
use super::unit::{Recording, on_the_grid, six_faces};

fn recording(seed: u64) -> Recording {
    Recording::of(&six_faces(2.5), &Unit::noisy(0.02, 0.002), &mut Draws::new(seed))
}

fn faults(found: &Acquired) -> Vec<(usize, ChannelFaultKind, f64)> {
    found
        .faults
        .iter()
        .map(|fault| (fault.channel, fault.kind, fault.value))
        .collect()
}

/// Turns of four seconds about z, one way and back, with a rest before, between and after.
fn even_turns(rate: f64, back: f64) -> Vec<Phase> {
    let rest = Phase::Rest(2.5);
    let spin = |rate: f64| Phase::Spin(Vector3::z() * rate, 4.0);
    on_the_grid(vec![rest, spin(rate), rest, spin(-back), rest])
}

/// One channel changed from some time on.
fn spoil(mut recording: Recording, channel: usize, from: f64, change: impl Fn(f64) -> f64) -> Recording {
    for (k, time) in recording.time.iter().enumerate() {
        if *time >= from {
            let y = if channel < 3 {
                &mut recording.force[k][channel]
            } else {
                &mut recording.rate[k][channel - 3]
            };
            *y = change(*y);
        }
    }
    recording
}

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn a_channel_that_shows_one_value_throughout_is_stuck(channel in 0..6_usize, value in -5.0..5.0_f64, seed in any::<u64>()) {
        let found = spoil(recording(seed), channel, -1.0, |_| value).acquire();
        prop_assert_eq!(faults(&found), vec![(channel, ChannelFaultKind::Stuck, value)]);
        prop_assert!(found.faults[0].span.0 < 0.1 && found.faults[0].span.1 > 20.0);
    }

    #[test]
    fn a_channel_that_falls_silent_is_stuck_from_then_on(channel in 0..6_usize, value in -0.3..0.3_f64, seed in any::<u64>()) {
        // From the middle of the third rest to the end: four turns.
        let found = spoil(recording(seed), channel, 9.0, |_| value).acquire();
        prop_assert_eq!(faults(&found), vec![(channel, ChannelFaultKind::Stuck, value)]);
        prop_assert!((found.faults[0].span.0 - 9.0).abs() < 0.2, "{:?}", found.faults);
    }

    #[test]
    fn a_channel_at_the_end_of_its_range_at_one_pose_is_saturated(channel in 0..3_usize, high in prop::bool::ANY, seed in any::<u64>()) {
        // A range below gravity.
        let limit = if high { 9.5 } else { -9.5 };
        let clip = |y: f64| if high { y.min(limit) } else { y.max(limit) };
        let found = spoil(recording(seed), channel, -1.0, clip).acquire();
        prop_assert_eq!(faults(&found), vec![(channel, ChannelFaultKind::SaturatedAtRest, limit)]);
    }

    #[test]
    fn a_gyroscope_clipped_in_its_turns_is_saturated_in_motion(limit in 0.6..1.8_f64, seed in any::<u64>()) {
        let clip = |y: f64| y.clamp(-limit, limit);
        let found = recording(seed).change(|f| f, |w| w.map(clip)).acquire();
        // Turns about every axis reach two rad/s and more, all of them one way.
        let found: Vec<_> = faults(&found);
        prop_assert_eq!(found.len(), 3, "{:?}", found);
        prop_assert!(found.iter().all(|(channel, kind, value)| *channel >= 3 && *kind == ChannelFaultKind::SaturatedInMotion && (value - limit).abs() < 1e-12));
    }

    #[test]
    fn a_coarse_gyroscope_that_clips_in_the_hand_is_saturated(limit in 0.6..1.5_f64, noise in 0.01..2.0_f64, seed in any::<u64>()) {
        let step = limit / 64.0;
        let clip = |y: f64| ((y / step).round() * step).clamp(-limit, limit);
        // Askew: an axis that feels no turn looks stuck where noise is less than a step.
        let unit = Unit { mounting: Rotation3::new(Vector3::new(0.3, 0.2, 0.25)), ..Unit::noisy(0.02, noise * step) };
        let found = Recording::of(&six_faces(2.5), &unit, &mut Draws::new(seed)).change(|f| f, |w| w.map(clip)).acquire();
        let found: Vec<_> = found.faults.iter().filter(|fault| fault.kind == ChannelFaultKind::SaturatedInMotion).collect();
        prop_assert_eq!(found.len(), 3, "{:?}", found);
    }

    #[test]
    fn an_even_turn_of_a_coarse_gyroscope_is_no_end_of_its_range(
        rate in 0.6..2.1_f64, back in 0.6..2.1_f64, steps in 20.0..2000.0_f64, noise in 0.0..0.3_f64, seed in any::<u64>(),
    ) {
        let schedule = even_turns(rate, back);
        let step = rate / steps;
        let coarse = |y: f64| (y / step).round() * step;
        let unit = Unit { bias: (Vector3::zeros(), Vector3::new(0.31, -0.73, 0.17) * step), ..Unit::noisy(0.02, noise * step) };
        let found = Recording::of(&schedule, &unit, &mut Draws::new(seed)).change(|f| f, |w| w.map(coarse)).acquire();
        prop_assert!(found.faults.iter().all(|fault| fault.kind != ChannelFaultKind::SaturatedInMotion), "{:?}", found.faults);
    }

    #[test]
    fn plateaus_at_a_full_scale_are_its_end_however_long(gyroscope in prop::bool::ANY, noise in 0.01..2.0_f64, seed in any::<u64>()) {
        let (end, step) = if gyroscope { (2000_f64.to_radians(), 1_f64.to_radians()) } else { (2.0 * STANDARD, 0.04) };
        let clip = move |y: f64| ((y / step).round() * step).clamp(-end, end);
        let unit = Unit::noisy(if gyroscope { 0.02 } else { noise * step }, if gyroscope { noise * step } else { 0.002 });
        let recording = Recording::of(&even_turns(1.0, 1.0), &unit, &mut Draws::new(seed));
        // Readings of a turn at 2300 deg/s, or of a push up with 2.3 g during the turn.
        let pushed = recording.rate.clone();
        let mut recording = if gyroscope {
            recording.change(|f| f, |w| w.map(|w| clip(40.0 * w)))
        } else { recording };
        if !gyroscope {
            for (f, w) in recording.force.iter_mut().zip(&pushed) {
                *f = f.map(|y| clip(y + 1.3 * STANDARD * w[2].abs()));
            }
        }
        let found = recording.acquire();
        let channel = if gyroscope { 5 } else { 2 };
        prop_assert!(found.faults.iter().any(|fault| fault.channel == channel && fault.kind != ChannelFaultKind::Stuck), "{:?}", found.faults);
    }

    #[test]
    fn quantisation_up_to_four_times_the_noise_is_no_fault(step in 0.001..0.08_f64, rate_step in 1e-4..0.004_f64, seed in any::<u64>()) {
        // A step larger than the noise holds its value all through a rest.
        let coarse = |step: f64| move |y: Vector3<f64>| y.map(|y| (y / step).round() * step);
        let found = recording(seed).change(coarse(step), coarse(rate_step)).acquire();
        prop_assert_eq!(faults(&found), vec![]);
        // Noise that hardly ever crosses a step looks like none, and the rare crossing like motion.
        prop_assert!(found.rests.len() == 7 || step > 0.03 || rate_step > 0.003, "{}", found.rests.len());
    }

    #[test]
    fn a_good_unit_has_no_fault(scale in -2.0..0.5_f64, bias in -0.3..0.3_f64, seed in any::<u64>()) {
        let scale = 10_f64.powf(scale);
        let unit = Unit { bias: (Vector3::repeat(bias), Vector3::repeat(bias)), ..Unit::noisy(0.02 * scale, 0.002 * scale) };
        let found = Recording::of(&six_faces(2.5), &unit, &mut Draws::new(seed)).acquire();
        prop_assert_eq!(faults(&found), vec![]);
    }
}

#[test]
fn a_sensor_without_any_noise_has_no_fault() {
    // Askew, so that every axis feels every turn: an axis that truly feels nothing looks like a stuck one.
    let unit = Unit {
        mounting: Rotation3::new(Vector3::new(0.3, 0.2, 0.5)),
        ..Unit::perfect()
    };
    let found = Recording::of(&six_faces(2.5), &unit, &mut Draws::new(0)).acquire();
    assert_eq!(faults(&found), vec![]);
}

#[test]
fn a_unit_that_only_rested_is_not_said_to_be_saturated() {
    let coarse = |y: Vector3<f64>| y.map(|y| (y / 0.05).round() * 0.05);
    let recording = Recording::of(
        &[Phase::Rest(10.0)],
        &Unit::noisy(0.02, 0.002),
        &mut Draws::new(1),
    );
    let found = recording.change(coarse, |w| w).acquire();
    assert!(
        found
            .faults
            .iter()
            .all(|fault| fault.kind != ChannelFaultKind::SaturatedAtRest),
        "{:?}",
        found.faults
    );
}
