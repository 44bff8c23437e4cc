//! Time as units have it: jumps, wraps, different rates, any order of arrival; the same samples, the same decisions.

use nalgebra::Vector3;
use proptest::prelude::*;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::monitor::event::{Abandoned, EventKind};
use tumble_core::redundancy::platform::Platform;
use tumble_core::redundancy::samples::clock::Unwrapper;
use tumble_core::redundancy::sensor::SENSORS;
use tumble_core::sample::Sample;

use crate::common::{cases, double};
use crate::redundancy_mission::{
    Arrivals, Flight, Mission, Part, Phase, assert_holds, assert_told, fly, platform, settings, units,
};

const SEED: u64 = 21;

fn parts() -> [Part; 2] {
    [Part::exact(), Part::aged()]
}

fn set<T: Real>() -> Platform<T, 2> {
    platform(settings(), units(&parts()))
}

/// Fails unless two monitors decided alike and found the same, but for a share of sigma.
fn assert_alike<A: Real, B: Real>(a: &Flight<A, 2>, b: &Flight<B, 2>, share: f64) {
    assert_eq!(a.kinds(), b.kinds(), "{}\n{}", a.story(), b.story());
    for sensor in SENSORS {
        let (a, b) = (a.adopted(1, sensor), b.adopted(1, sensor));
        assert!(!a.is_empty());
        for (a, b) in a.iter().zip(&b) {
            let numbers = a.model.bias.iter().chain(&a.model.matrix);
            let others = b.model.bias.iter().chain(&b.model.matrix);
            let sigmas = a.bias_sigma.iter().chain(&a.matrix_sigma);
            for ((x, y), sigma) in numbers.zip(others).zip(sigmas) {
                let (apart, allowed) = ((double(*x) - double(*y)).abs(), share * double(*sigma));
                assert!(
                    apart <= allowed,
                    "{apart:e} > {allowed:e}, seed {SEED}: {a:?} {b:?}"
                );
            }
        }
    }
}

#[test]
fn a_monitor_that_flew_and_is_reset_is_a_new_one() {
    let set = set::<f64>();
    let mut monitor = Monitor::<f64, 2, 1, 1>::new();
    let still = text_of(&monitor);
    monitor.set_temperature(1, 40.0);
    let mut event = |_| {};
    for (unit, sample) in Mission::new(SEED, &parts()).samples().iter().take(20_000) {
        monitor.push(&set, *unit, sample, &mut event);
    }
    assert!(text_of(&monitor) != still);
    monitor.reset();
    assert_eq!(text_of(&monitor), still);
}

/// All that a monitor holds, as text: NaN equals nothing.
fn text_of(monitor: &Monitor<f64, 2, 1, 1>) -> String {
    format!("{monitor:?}")
}

#[test]
fn the_same_samples_give_the_same_events_bit_by_bit() {
    let samples = Mission::new(SEED, &parts()).samples();
    let fly = || {
        let mut flight = Flight::<f32, 2>::new(SEED);
        flight.take(&set(), &samples);
        flight
    };
    assert_eq!(format!("{:?}", fly()), format!("{:?}", fly()));
}

#[test]
fn both_precisions_decide_alike_and_agree_to_0_01_sigma() {
    let mission = Mission::new(SEED, &parts());
    assert_alike(
        &fly::<f64, 2>(&set(), &mission),
        &fly::<f32, 2>(&set(), &mission),
        0.01,
    );
}

#[test]
fn units_of_other_rates_are_calibrated_as_well() {
    let [primary, secondary] = parts();
    let faster = Part {
        period: 6_250,
        phase: 1_300,
        ..secondary
    };
    let flight = fly::<f64, 2>(&set(), &Mission::new(SEED, &[primary, faster]));
    for sensor in SENSORS {
        assert_eq!(flight.adopted(1, sensor).len(), 1, "{}", flight.story());
        assert_holds(&flight.adopted(1, sensor)[0], &faster, SEED);
    }
}

/// The secondary's samples come late by less than a window, or several at once.
fn delayed(samples: &Arrivals, delay: impl Fn(u64) -> u64) -> Arrivals {
    let mut arrivals = samples.clone();
    arrivals.sort_by_key(|(unit, sample)| match unit {
        0 => (sample.time, 0, sample.time),
        _ => (delay(sample.time), 1, sample.time),
    });
    arrivals
}

#[test]
fn the_order_of_samples_within_a_window_changes_nothing() {
    let samples = Mission::new(SEED, &parts()).samples();
    let flown = |samples: &Arrivals| {
        let mut flight = Flight::<f64, 2>::new(SEED);
        flight.take(&set(), samples);
        flight
    };
    let in_order = flown(&samples);
    let late = flown(&delayed(&samples, |time| time + 35_000));
    let bursts = flown(&delayed(&samples, |time| time.div_ceil(40_000) * 40_000));
    for other in [late, bursts] {
        assert_alike(&in_order, &other, 1e-6);
    }
}

#[test]
fn counters_of_32_bits_that_wrap_in_mid_mission_change_nothing() {
    let mut mission = Mission::new(SEED, &parts());
    mission.start = (1 << 32) - 8_000_000;
    let samples = mission.samples();
    let mut unwrappers = [Unwrapper::new(); 2];
    let mut wrapped = samples.clone();
    for (unit, sample) in &mut wrapped {
        let counter = u32::try_from(sample.time % (1 << 32)).expect("32 bits");
        sample.time = unwrappers[*unit].extend(counter);
    }
    let (mut plain, mut extended) = (Flight::<f64, 2>::new(SEED), Flight::<f64, 2>::new(SEED));
    plain.take(&set(), &samples);
    extended.take(&set(), &wrapped);
    assert!(!plain.adopted(1, SENSORS[0]).is_empty(), "{}", plain.story());
    assert_eq!(format!("{plain:?}"), format!("{extended:?}"));
}

#[test]
fn a_jump_of_all_clocks_is_told_and_no_pairs_across_it_are_used() {
    for by in [5_000_000_i64, -5_000_000] {
        let mission = Mission::new(SEED, &parts()).spoilt(move |_, time, sample| {
            if time > 7.0 {
                sample.time = sample.time.saturating_add_signed(by);
            }
            true
        });
        let flight = fly::<f64, 2>(&set(), &mission);
        assert_told!(flight, 0, 1 x EventKind::TimeJumped { by: told } if told.signum() == by.signum());
        assert_told!(flight, 1, 1 x EventKind::Abandoned { why: Abandoned::TimeJumped });
        assert_told!(flight, 1, 0 x EventKind::Adopted { .. });
    }
}

#[test]
fn a_jump_of_one_clock_is_a_fault_of_its_unit_alone() {
    for by in [5_000_000_i64, -5_000_000] {
        let parts = [Part::exact(), Part::aged(), Part::aged()];
        let mission = Mission::new(SEED, &parts).spoilt(move |unit, time, sample| {
            if unit == 2 && time > 7.0 {
                sample.time = sample.time.saturating_add_signed(by);
            }
            true
        });
        let flight = fly::<f64, 3>(&platform(settings(), units(&parts)), &mission);
        assert_told!(flight, 0, 0 x EventKind::TimeJumped { .. });
        assert_told!(
            flight,
            2,
            EventKind::Unhealthy {
                fault: HealthFault::ClockJumped | HealthFault::Late { .. }
            }
        );
        assert_told!(flight, 2, 1 x EventKind::Abandoned { why: Abandoned::SecondaryUnhealthy });
        assert_holds(&flight.adopted(1, SENSORS[0])[0], &parts[1], SEED);
    }
}

fn hostile_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -20.0..20.0_f64,
        1 => Just(f64::NAN),
        1 => Just(f64::NEG_INFINITY),
        1 => prop::num::f64::ANY,
    ]
}

/// Step of a time from the one before, or its place.
fn hostile_time() -> impl Strategy<Value = (bool, u64)> {
    prop_oneof![
        8 => (Just(false), 0..30_000_u64),
        1 => (Just(false), any::<u64>()),
        1 => (Just(true), any::<u64>()),
        1 => (Just(true), Just(u64::MAX)),
        1 => (Just(true), Just(0_u64)),
    ]
}

fn withstands<T: Real>(pushes: &[(usize, (bool, u64), [f64; 6])]) -> Result<(), TestCaseError> {
    let platform = set::<T>();
    let mut monitor = Monitor::<T, 2, 1>::new();
    let mut time = 0_u64;
    for (unit, (absolute, step), y) in pushes {
        time = if *absolute {
            *step
        } else {
            time.wrapping_add(*step)
        };
        let [fx, fy, fz, wx, wy, wz] = y.map(real);
        let sample = Sample {
            time,
            specific_force: Vector3::new(fx, fy, fz),
            angular_rate: Vector3::new(wx, wy, wz),
        };
        let output = monitor.push(&platform, *unit, &sample, &mut |_| {});
        if let Some(output) = output {
            prop_assert_eq!(output.source, *unit);
            prop_assert_eq!(monitor.source(), Some(*unit));
            let mut numbers = output.specific_force.iter().chain(output.angular_rate.iter());
            prop_assert!(numbers.all(|x| x.is_finite()), "{:?} of {:?}", output, sample);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn any_samples_of_any_unit_cause_no_panic_nor_infinite_output(
        pushes in prop::collection::vec(
            (prop_oneof![8 => 0..2_usize, 1 => 2..9_usize, 1 => Just(usize::MAX)], hostile_time(),
             prop::array::uniform6(hostile_number())), 0..400)
    ) {
        withstands::<f64>(&pushes)?;
        withstands::<f32>(&pushes)?;
    }
}

#[test]
fn units_at_ten_hertz_are_calibrated_beside_a_fast_one() {
    for slow in [50_000, 100_000] {
        for number in 0..2 {
            let mut parts = parts();
            parts[number].period = slow;
            let phases = [(6.0, Phase::Rest), (16.0, Phase::Free(0.5)), (4.0, Phase::Rest)];
            let flight = fly::<f32, 2>(&set(), &Mission::new(SEED, &parts).phases(&phases));
            for sensor in SENSORS {
                assert_eq!(flight.adopted(1, sensor).len(), 1, "{}", flight.story());
            }
            for unit in 0..2 {
                assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
            }
        }
    }
}
