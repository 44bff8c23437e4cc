//! Vibration is learnt from windows: no fault hides in the effect of vibration that is possible but absent.

use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::{Event, EventKind};
use tumble_core::redundancy::sensor::Sensor;

use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, assert_told, fly, platform, seconds, settings, units,
};

/// s after the start at which a unit jumps, ten after the vibration began.
const JUMPS: f64 = 30.0;

/// Three units, the secondaries calibrated before a vibration begins of so many m/s^2, of which one jumps by so much.
fn shaken(seed: u64, vibration: f64, faulty: usize, jump: f64) -> Flight<f32, 3> {
    shaken_at([5000, 5000, 4000], seed, vibration, faulty, jump)
}

/// The same with these times from sample to sample, microseconds.
fn shaken_at(period: [u64; 3], seed: u64, vibration: f64, faulty: usize, jump: f64) -> Flight<f32, 3> {
    let mut parts = [Part::exact(), Part::aged(), Part::aged()];
    for (part, period) in parts.iter_mut().zip(period) {
        part.period = period;
    }
    let mission = Mission::new(seed, &parts)
        .phases(&[
            (3.0, Phase::Rest),
            (14.0, Phase::Free(1.0)),
            (3.0, Phase::Rest),
            (15.0, Phase::Vibrating(vibration)),
        ])
        .spoilt(move |number, time, sample| {
            if number == faulty && time >= JUMPS {
                sample.specific_force.x += jump;
            }
            true
        });
    fly(&platform(settings(), units(&parts)), &mission)
}

#[test]
fn a_jump_smaller_than_the_vibration_is_isolated() {
    for (vibration, jump, within) in [
        (1.0, 0.3, 2.0),
        (3.0, 0.5, 2.0),
        (10.0, 1.0, 0.5),
        (30.0, 3.0, 0.5),
    ] {
        for seed in 0..3 {
            let faulty = seed as usize % 3;
            let flight = shaken(seed, vibration, faulty, jump);
            let named = |kind: &EventKind<f32>| {
                matches!(
                    kind,
                    EventKind::Unhealthy {
                        fault: HealthFault::OutOfFamily {
                            sensor: Sensor::Accelerometer,
                            ..
                        }
                    }
                )
            };
            let found = flight.events.iter().find(|event| named(&event.kind));
            let since = found.map(|event| seconds(event.time - 40_000_000) - JUMPS);
            assert!(
                found.is_some_and(|event| event.unit == faulty)
                    && since.is_some_and(|since| (0.0..within).contains(&since)),
                "vibration {vibration}, {since:?}\n{}",
                flight.story()
            );
        }
    }
}

#[test]
fn nobody_is_named_where_a_vibration_begins_and_goes_on() {
    for vibration in [1.0, 3.0, 10.0, 30.0] {
        for seed in 10..13 {
            let flight = shaken(seed, vibration, 0, 0.0);
            for unit in 0..3 {
                assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
            }
        }
    }
}

/// Sampled every 12 ms, a line at 80 Hz looks like one at 3.3 Hz.
const ALIASING: u64 = 12_000;

#[test]
fn only_the_unit_that_aliases_a_vibration_is_named() {
    for vibration in [1.0, 3.0, 10.0, 30.0] {
        for seed in 20..23 {
            let flight = shaken_at([5000, 5000, ALIASING], seed, vibration, 0, 0.0);
            for unit in 0..2 {
                assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
            }
            assert_eq!(flight.monitor.source(), Some(0), "{}", flight.story());
        }
    }
}

#[test]
fn a_jump_of_all_of_an_aliased_vibration_is_told() {
    for vibration in [1.0, 3.0, 10.0] {
        let flight = shaken_at([5000, 5000, ALIASING], 20, vibration, 0, vibration);
        assert_told!(flight, 1, 0 x EventKind::Unhealthy { .. });
        // With the unit that aliases out, two are left, of which none can be known in motion.
        let told = |event: &Event<f32>| match event.kind {
            EventKind::Unhealthy { .. } => event.unit == 0,
            EventKind::Disagree { .. } => true,
            _ => false,
        };
        let after = |event: &Event<f32>| seconds(event.time - 40_000_000) >= JUMPS;
        assert!(
            flight.events.iter().any(|event| after(event) && told(event)),
            "{}",
            flight.story()
        );
    }
}
