//! Isolation ends where its cause ends: a unit that agrees again is reinstated, a dispute that ceases is settled; and a
//! clock that drifts is found without any reading being wrong.

use nalgebra::Vector3;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::unit_count::{UnitCount, Units};
use tumble_core::sample::Sample;

use crate::redundancy_mission::{Flight, Mission, Part, Phase, assert_told};
use crate::redundancy_physics::since;

const SEED: u64 = 33;

/// Calibrated units without errors, of which the last is disturbed, in motion for this long after a rest.
fn flown<const N: usize>(motion: f64, spoil: impl Fn(f64, &mut Sample<f64>) + 'static) -> Flight<f32, N>
where
    Units<N>: UnitCount,
{
    let parts = [Part::exact(); N];
    let mission = Mission::new(SEED, &parts)
        .phases(&[(3.0, Phase::Rest), (motion, Phase::Free(1.0))])
        .spoilt(move |unit, time, sample| {
            if unit + 1 == N {
                spoil(time, sample);
            }
            true
        });
    since(&mission)
}

/// Shifts a reading between two times.
fn shift(from: f64, until: f64) -> impl Fn(f64, &mut Sample<f64>) {
    move |time, sample| {
        if (from..until).contains(&time) {
            sample.specific_force += Vector3::new(0.5, 0.0, 0.0);
        }
    }
}

#[test]
fn an_excluded_unit_that_agrees_with_the_others_is_reinstated() {
    let flight = flown::<3>(60.0, shift(20.0, 28.0));
    assert_told!(
        flight,
        2,
        EventKind::Unhealthy {
            fault: HealthFault::OutOfFamily { .. }
        }
    );
    assert_told!(flight, 2, EventKind::Healthy);
    for unit in 0..2 {
        assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
    }
}

#[test]
fn two_units_that_agree_again_have_settled_their_dispute() {
    let flight = flown::<2>(60.0, shift(20.0, 24.0));
    assert_told!(flight, 0, EventKind::Disagree { .. });
    assert_told!(flight, 0, EventKind::Agree { .. });
}

#[test]
fn the_crystal_of_a_unit_is_followed() {
    let flight = flown::<3>(120.0, |time, sample| {
        sample.time += (60.0 * (time - 3.0).max(0.0)) as u64
    });
    for unit in 0..3 {
        assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
    }
}
