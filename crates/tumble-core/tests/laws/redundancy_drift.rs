//! Biases drift while units warm up: a drift within specification is no fault, and a ramp that is faster is one.

use nalgebra::Vector3;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::sample::Sample;

use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, START, assert_told, fly, platform, seconds, settings, units,
};

/// s since the start at which the primary dies, and at which a ramp begins.
const DIES: f64 = 60.0;
const BEGINS: f64 = 60.0;

/// Time constant of warming, s.
const WARMS: f64 = 120.0;

/// Three units of which the secondaries were calibrated half a minute before.
fn flown(seed: u64, spoil: impl Fn(usize, f64, &mut Sample<f64>) -> bool + 'static) -> Flight<f32, 3> {
    let parts = [Part::exact(), Part::aged(), Part::aged()];
    let mission = Mission::new(seed, &parts)
        .phases(&[
            (3.0, Phase::Rest),
            (14.0, Phase::Free(1.0)),
            (3.0, Phase::Rest),
            (140.0, Phase::Free(0.3)),
        ])
        .spoilt(spoil);
    fly(&platform(settings(), units(&parts)), &mission)
}

#[test]
fn units_that_warm_by_ten_kelvin_do_not_disagree() {
    for seed in 0..4 {
        let flight = flown(seed, |number, time, sample| {
            // 1.4 mrad/s and 4 mm/s^2 a kelvin along an axis, against each other.
            let warmed = 10.0 * (1.0 - (-time / WARMS).exp());
            let towards = [0.0, 1.0, -1.0][number];
            sample.angular_rate += Vector3::new(1.1e-3, -0.5e-3, 0.7e-3) * (warmed * towards);
            sample.specific_force += Vector3::new(2e-3, 3e-3, -2e-3) * (warmed * towards);
            number != 0 || time < DIES
        });
        for unit in 0..3 {
            assert_told!(flight, unit, 0 x EventKind::Disagree { .. });
        }
        for unit in 1..3 {
            assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
        }
    }
}

#[test]
fn a_ramp_ten_times_as_fast_as_drift_is_detected_early() {
    for seed in 0..3_u64 {
        let faulty = seed as usize;
        let flight = flown(seed, move |number, time, sample| {
            if number == faulty {
                sample.angular_rate.z += 7e-4 * (time - BEGINS).max(0.0);
            }
            true
        });
        let named = |kind: &EventKind<f32>| {
            let EventKind::Unhealthy { fault } = kind else {
                return false;
            };
            matches!(fault, HealthFault::OutOfFamily { .. })
        };
        let found = flight.events.iter().find(|event| named(&event.kind));
        let since = found.map(|event| seconds(event.time - START) - BEGINS);
        assert!(
            found.is_some_and(|event| event.unit == faulty)
                && since.is_some_and(|since| (0.0..25.0).contains(&since)),
            "{since:?}\n{}",
            flight.story()
        );
    }
}
