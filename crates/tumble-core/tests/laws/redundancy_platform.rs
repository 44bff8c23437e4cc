//! An effect on all units at once is the platform's, and the resolution of a sound unit is no fault: nobody is named.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::common::cases;
use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, SECOND, fly, platform, seconds, settings, units,
};

/// Units of the same set, each with noise, place and rate of its own.
fn parts<const N: usize>(periods: [u64; N]) -> [Part; N] {
    core::array::from_fn(|unit| Part {
        period: periods[unit],
        phase: 130 * unit as u64,
        lever_arm: Vector3::new(0.02, -0.01, 0.015) * unit as f64,
        ..Part::exact()
    })
}

fn named<const N: usize>(flight: &Flight<f32, N>) -> usize
where
    Units<N>: UnitCount,
{
    let unhealthy = |kind: &EventKind<f32>| matches!(kind, EventKind::Unhealthy { .. });
    (0..N).map(|unit| flight.told(unit, unhealthy)).sum()
}

/// The same of what a unit's own samples show, nobody else's.
fn named_by_itself<const N: usize>(flight: &Flight<f32, N>) -> usize
where
    Units<N>: UnitCount,
{
    let own = |kind: &EventKind<f32>| matches!(kind, EventKind::Unhealthy { fault } if !fault.is_found_by_comparison());
    (0..N).map(|unit| flight.told(unit, own)).sum()
}

fn disagreed<const N: usize>(flight: &Flight<f32, N>) -> usize
where
    Units<N>: UnitCount,
{
    let disagree = |kind: &EventKind<f32>| matches!(kind, EventKind::Disagree { .. });
    (0..N).map(|unit| flight.told(unit, disagree)).sum()
}

fn jumps<const N: usize>(flight: &Flight<f32, N>) -> usize
where
    Units<N>: UnitCount,
{
    flight.told(0, |kind| matches!(kind, EventKind::TimeJumped { .. }))
}

/// Periods from 10 to 1000 Hz, microseconds.
fn period() -> impl Strategy<Value = u64> {
    prop_oneof![
        Just(100_000),
        Just(50_000),
        Just(20_000),
        Just(10_000),
        Just(5_000),
        Just(1_000)
    ]
}

/// Steps of an accelerometer, m/s^2, and of a gyroscope, rad/s: from 16 bits to 11. Coarser ones exceed the scatter of a rest.
fn resolution() -> impl Strategy<Value = [f64; 2]> {
    (0.0..4.0_f64, 0.0..5.0_f64).prop_map(|(force, rate)| [0.005 * force.exp2(), 0.000_5 * rate.exp2()])
}

/// Counts smaller than the noise.
const FINE: [f64; 2] = [0.005, 0.000_5];

fn rounded(v: &Vector3<f64>, step: f64) -> Vector3<f64> {
    v.map(|x| (x / step).round() * step)
}

/// A set at rest, in motion and at rest, of units of these resolutions: beside a primary that shows whether it rests. Single
/// readings of units that fill no window do not.
fn is_left_alone<const N: usize>(
    periods: [u64; N],
    steps: [[f64; 2]; N],
    seed: u64,
) -> Result<(), TestCaseError>
where
    Units<N>: UnitCount,
{
    let mut periods = periods;
    periods[0] = periods[0].min(10_000);
    let parts = parts(periods);
    let mission = Mission::new(seed, &parts)
        .phases(&[(6.0, Phase::Rest), (5.0, Phase::Free(1.0)), (12.0, Phase::Rest)])
        .spoilt(move |unit, _, sample| {
            let [force, rate] = if unit == 0 || periods[unit] > 20_000 {
                FINE
            } else {
                steps[unit]
            };
            sample.specific_force = rounded(&sample.specific_force, force);
            sample.angular_rate = rounded(&sample.angular_rate, rate);
            true
        });
    let flight = fly(&platform(settings(), units(&parts)), &mission);
    prop_assert_eq!(named_by_itself(&flight), 0, "{}", flight.story());
    Ok(())
}

/// No sample of a set comes for a while.
fn pauses<const N: usize>(periods: [u64; N], begins: f64, lasts: f64, seed: u64) -> Result<(), TestCaseError>
where
    Units<N>: UnitCount,
{
    // A pause between two samples of a unit that is slow is none of it.
    let slowest = periods.iter().max().map_or(0.0, |period| seconds(*period));
    let lasts = lasts.max(2.2 * slowest);
    let parts = parts(periods);
    let mission = Mission::new(seed, &parts)
        .phases(&[(2.5, Phase::Rest), (6.0, Phase::Free(1.0)), (3.0, Phase::Rest)])
        .spoilt(move |_, time, _| !(begins..begins + lasts).contains(&time));
    let flight = fly(&platform(settings(), units(&parts)), &mission);
    prop_assert_eq!(named_by_itself(&flight), 0, "{}", flight.story());
    Ok(())
}

const RANGE: f64 = 160.0;

/// A shock, or a vibration, that takes the accelerometers of all units to the ends of their ranges for a time, s.
fn saturates<const N: usize>(
    periods: [u64; N],
    wave: Option<f64>,
    begins: f64,
    lasts: f64,
    seed: u64,
) -> Result<(), TestCaseError>
where
    Units<N>: UnitCount,
{
    let parts = parts(periods);
    let mission = Mission::new(seed, &parts).spoilt(move |_, time, sample| {
        if (begins..begins + lasts).contains(&time) {
            let swing = wave.map_or(1.0, |hertz| (core::f64::consts::TAU * hertz * time).cos());
            sample.specific_force += Vector3::new(4.0, -0.5, 1.0) * (RANGE * swing);
            sample.specific_force = sample.specific_force.map(|x| x.clamp(-RANGE, RANGE));
        }
        true
    });
    let ranged = units::<f32, N>(&parts).map(|mut unit| {
        unit.range.specific_force = Some(RANGE as f32);
        unit
    });
    let flight = fly(&platform(settings(), ranged), &mission);
    let all = flight.told(0, |kind| matches!(kind, EventKind::AllSaturated { .. }));
    let slowest = periods.iter().max().map_or(0.0, |period| seconds(*period));
    prop_assert_eq!(named_by_itself(&flight), 0, "{}", flight.story());
    prop_assert!(
        flight.outputs.iter().all(|output| output.source == 0),
        "{}",
        flight.story()
    );
    // Four readings show the end of a range.
    let shown = lasts > 0.06 + 5.0 * slowest;
    prop_assert!(
        all <= 1 && (!shown || all == 1),
        "{} times\n{}",
        all,
        flight.story()
    );
    Ok(())
}

/// Accelerometers of which one has a range that all others exceed.
#[test]
fn a_unit_that_saturates_alone_is_named() {
    let parts = parts([5_000; 3]);
    let mission = Mission::new(7, &parts).spoilt(|_, time, sample| {
        if (6.0..7.0).contains(&time) {
            sample.specific_force.x += 50.0;
        }
        true
    });
    let mut ranged = units::<f32, 3>(&parts);
    ranged[1].range.specific_force = Some(40.0);
    let flight = fly(&platform(settings(), ranged), &mission);
    assert_eq!(named_by_itself(&flight), 1, "{}", flight.story());
    assert_eq!(
        flight.told(0, |kind| matches!(kind, EventKind::AllSaturated { .. })),
        0
    );
}

proptest! {
    #![proptest_config(cases(16))]

    #[test]
    fn a_shock_that_saturates_two_units_is_the_platforms(
        periods in prop::array::uniform2(period()), begins in 3.0..8.0_f64, lasts in 0.05..1.5_f64, seed in any::<u64>()
    ) {
        saturates(periods, None, begins, lasts, seed)?;
    }

    #[test]
    fn a_shock_that_saturates_three_units_is_the_platforms(
        periods in prop::array::uniform3(period()), begins in 3.0..8.0_f64, lasts in 0.05..1.5_f64, seed in any::<u64>()
    ) {
        saturates(periods, None, begins, lasts, seed)?;
    }

    #[test]
    fn a_shock_that_saturates_six_units_is_the_platforms(
        periods in prop::array::uniform6(period()), begins in 3.0..8.0_f64, lasts in 0.05..1.5_f64, seed in any::<u64>()
    ) {
        saturates(periods, None, begins, lasts, seed)?;
    }

    #[test]
    fn shaking_that_saturates_four_units_is_the_platforms(
        period in prop_oneof![Just(20_000_u64), Just(5_000), Just(1_000)], hertz in 3.0..8.0_f64,
        begins in 3.0..8.0_f64, lasts in 0.5..1.5_f64, seed in any::<u64>()
    ) {
        saturates([period; 4], Some(hertz), begins, lasts, seed)?;
    }

    #[test]
    fn two_sound_units_are_left_alone_at_any_rate_and_resolution(
        periods in prop::array::uniform2(period()), steps in prop::array::uniform2(resolution()), seed in any::<u64>()
    ) {
        is_left_alone(periods, steps, seed)?;
    }

    #[test]
    fn three_sound_units_are_left_alone_at_any_rate_and_resolution(
        periods in prop::array::uniform3(period()), steps in prop::array::uniform3(resolution()), seed in any::<u64>()
    ) {
        is_left_alone(periods, steps, seed)?;
    }

    #[test]
    fn six_sound_units_are_left_alone_at_any_rate_and_resolution(
        periods in prop::array::uniform6(period()), steps in prop::array::uniform6(resolution()), seed in any::<u64>()
    ) {
        is_left_alone(periods, steps, seed)?;
    }

    #[test]
    fn a_pause_of_all_units_makes_none_of_two_late(
        periods in prop::array::uniform2(period()), begins in 3.0..8.0_f64, lasts in 0.02..0.99_f64, seed in any::<u64>()
    ) {
        pauses(periods, begins, lasts, seed)?;
    }

    #[test]
    fn a_pause_of_all_units_makes_none_of_four_late(
        periods in prop::array::uniform4(period()), begins in 3.0..8.0_f64, lasts in 0.02..0.99_f64, seed in any::<u64>()
    ) {
        pauses(periods, begins, lasts, seed)?;
    }

    #[test]
    fn all_clocks_that_go_back_are_an_event_of_no_unit(
        back in 100_000..5 * SECOND, period in prop_oneof![Just(1_000_u64), Just(5_000), Just(20_000)], seed in any::<u64>()
    ) {
        let parts = parts([period; 3]);
        let mission = Mission::new(seed, &parts).spoilt(move |_, time, sample| {
            sample.time -= if time > 6.0 { back } else { 0 };
            true
        });
        let flight = fly(&platform(settings(), units(&parts)), &mission);
        prop_assert_eq!(named(&flight), 0, "{}", flight.story());
        prop_assert_eq!(jumps(&flight), 1, "{}", flight.story());
    }

    #[test]
    fn vibration_that_meets_all_units_at_once_is_the_fault_of_none(
        size in 1.0..20.0_f64, begins in 5.0..10.0_f64, seed in any::<u64>()
    ) {
        let parts = parts([5_000; 3]);
        let mission = Mission::new(seed, &parts).spoilt(move |_, time, sample| {
            let shakes = if (begins..begins + 2.0).contains(&time) { size } else { 0.0 };
            let wave = (core::f64::consts::TAU * 73.0 * time).sin();
            sample.specific_force += Vector3::new(0.3, -0.5, 1.0) * (shakes * wave);
            sample.angular_rate += Vector3::new(0.02, 0.01, 0.03) * (shakes * wave);
            true
        });
        let flight = fly(&platform(settings(), units(&parts)), &mission);
        prop_assert_eq!(named(&flight), 0, "{}", flight.story());
    }
}

/// Units that warm up together drift each in a direction of its own, m/s^2 and rad/s when warm.
fn warming(seed: u64, told: bool) -> Flight<f32, 3> {
    const DRIFTS: [[[f64; 3]; 2]; 3] = [
        [[0.08, 0.0, 0.0], [0.008, 0.0, 0.0]],
        [[0.0, 0.08, 0.0], [0.0, 0.008, 0.0]],
        [[0.0, 0.0, 0.08], [0.0, 0.0, 0.008]],
    ];
    const KELVINS: f64 = 25.0;
    let warmth = |time: f64| 1.0 - (-time / 60.0).exp();
    let parts = [
        Part::exact(),
        Part::aged(),
        Part::aged().biased([-0.2, 0.3, 0.1], [0.02, 0.01, -0.03]),
    ];
    let mission = Mission::new(seed, &parts)
        .phases(&[
            (3.0, Phase::Rest),
            (60.0, Phase::Free(1.0)),
            (4.0, Phase::Rest),
            (60.0, Phase::Free(1.0)),
        ])
        .spoilt(move |unit, time, sample| {
            let [force, rate] = DRIFTS[unit].map(|drift| Vector3::from(drift) * warmth(time));
            sample.specific_force += force;
            sample.angular_rate += rate;
            true
        });
    let set = platform(settings(), units(&parts));
    let mut flight = Flight::new(seed);
    for (unit, sample) in mission.samples() {
        let time = seconds(sample.time - mission.start);
        if told {
            flight
                .monitor
                .set_temperature(unit, (20.0 + KELVINS * warmth(time)) as f32);
        }
        flight.take(&set, &[(unit, sample)]);
    }
    flight
}

#[test]
fn three_units_that_warm_up_together_are_sound() {
    for told in [false, true] {
        for seed in 0..4 {
            let flight = warming(seed, told);
            assert_eq!(named(&flight), 0, "told {told}\n{}", flight.story());
            if told {
                assert_eq!(disagreed(&flight), 0, "{}", flight.story());
            }
        }
    }
}

/// Secondaries 1 and 2 of which the second repeats the first, at the time of its own samples.
fn with_a_copy(seed: u64) -> Flight<f32, 3> {
    let parts = parts([5_000; 3]);
    let mission = Mission::new(seed, &parts);
    let set = platform(settings(), units(&parts));
    let mut flight = Flight::new(seed);
    let mut first: Option<Sample<f64>> = None;
    for (unit, sample) in mission.samples() {
        let said = match unit {
            1 => {
                first = Some(sample);
                sample
            }
            2 => Sample {
                time: sample.time,
                ..first.unwrap_or(sample)
            },
            _ => sample,
        };
        flight.take(&set, &[(unit, said)]);
    }
    flight
}

#[test]
fn a_copy_of_a_secondary_is_named_and_has_no_vote() {
    use tumble_core::redundancy::health::HealthFault;
    for seed in 0..3 {
        let flight = with_a_copy(seed);
        let copies = flight.told(2, |kind| {
            matches!(
                kind,
                EventKind::Unhealthy {
                    fault: HealthFault::Copy { of: 0b010 }
                }
            )
        });
        assert_eq!((copies, named(&flight)), (1, 1), "{}", flight.story());
    }
}

/// Every second sample of a unit, from a time on, has the readings of the one before it.
fn doubled<const N: usize>(faulty: usize, seed: u64) -> Flight<f32, N>
where
    Units<N>: UnitCount,
{
    let parts = parts([5_000; N]);
    let mission = Mission::new(seed, &parts);
    let set = platform(settings(), units(&parts));
    let mut flight = Flight::new(seed);
    let (mut before, mut number) = (None::<Sample<f64>>, 0_u32);
    for (unit, sample) in mission.samples() {
        let late = seconds(sample.time - mission.start) > 5.0;
        let mut said = sample;
        if unit == faulty {
            number += 1;
            if let Some(before) = before.filter(|_| late && number.is_multiple_of(2)) {
                said = Sample {
                    time: sample.time,
                    ..before
                };
            }
            before = Some(said);
        }
        flight.take(&set, &[(unit, said)]);
    }
    flight
}

fn is_found_doubled<const N: usize>()
where
    Units<N>: UnitCount,
{
    use tumble_core::redundancy::health::HealthFault;
    for faulty in 0..N {
        let flight = doubled::<N>(faulty, 3);
        let found = flight.told(faulty, |kind| {
            matches!(
                kind,
                EventKind::Unhealthy {
                    fault: HealthFault::Duplicated
                }
            )
        });
        assert_eq!(
            (found, named(&flight)),
            (1, 1),
            "{faulty} of {N}\n{}",
            flight.story()
        );
    }
}

#[test]
fn doubled_samples_are_named_in_sets_of_any_size() {
    is_found_doubled::<2>();
    is_found_doubled::<3>();
    is_found_doubled::<4>();
    is_found_doubled::<6>();
}
