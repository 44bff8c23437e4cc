//! Secondaries follow their primary as far as a rest proves it right, and up to a cap beyond that.

use nalgebra::Vector3;
use tumble_core::model::ErrorModel;
use tumble_core::real::{Real, real};
use tumble_core::redundancy::fit::adoption::{AdoptionRefusal, RefusalReason};
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::{FitModel, RedundancySettings};
use tumble_core::redundancy::unit_count::{UnitCount, Units};

use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, SECOND, assert_told, fly, platform, settings, units,
};

const SEED: u64 = 21;
const CAP: f64 = 0.15;

/// The record of a sensor that was calibrated, had no error then, and has followed the primary that far since.
fn stored<T: Real>(identity: u64, sensor: Sensor, followed: [f64; 3]) -> Record<T> {
    Record {
        model: ErrorModel::identity(),
        matrix_sigma: nalgebra::Matrix3::repeat(real(1e-3)),
        bias_sigma: Vector3::repeat(real(1e-3)),
        lever_arm_sigma: Vector3::zeros(),
        fit_model: FitModel::Affine,
        directions: 3,
        residual: real(0.01),
        pairs: 400,
        sequence: 1,
        followed: Vector3::from(followed.map(real)),
        ..Record::unknown(identity, sensor)
    }
}

/// A secondary that came calibrated and has changed by so much since, beside an exact primary, at rest level.
fn changed<T: Real>(specific_force: [f64; 3], angular_rate: [f64; 3], followed: [f64; 3]) -> Flight<T, 2> {
    let parts = [Part::exact(), Part::exact().biased(specific_force, angular_rate)];
    let platform = platform(settings(), units(&parts));
    let mut flight = Flight::new(SEED);
    for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
        flight.restore(&platform, &stored(12, sensor, followed));
    }
    flight.take(&platform, &Mission::new(SEED, &parts).samples());
    flight
}

fn beyond<T: Real>(flight: &Flight<T, 2>) -> Option<(T, T)> {
    flight.events.iter().find_map(|event| match event.kind {
        EventKind::Refused {
            why: AdoptionRefusal::Exceeds(RefusalReason::BeyondSupport, excess),
            ..
        } => Some((excess.value, excess.limit)),
        _ => None,
    })
}

#[test]
fn a_used_up_cap_stops_following_across_gravity() {
    let flight = changed::<f64>([0.12, 0.0, 0.0], [0.0; 3], [0.14, 0.0, 0.0]);
    let (value, limit) = beyond(&flight).expect("it is refused");
    assert!((value - 0.26).abs() < 0.01, "{}", flight.story());
    assert!((limit - CAP).abs() < 1e-12);
    assert!(flight.adopted(1, Sensor::Accelerometer).is_empty());
    let single = changed::<f32>([0.12, 0.0, 0.0], [0.0; 3], [0.14, 0.0, 0.0]);
    assert_eq!(flight.kinds(), single.kinds());
}

#[test]
fn following_adds_up_with_its_sign_and_stays_in_the_record() {
    for (before, after) in [(0.0, 0.12), (-0.1, 0.02), (0.02, 0.14)] {
        let flight = changed::<f64>([0.12, 0.0, 0.0], [0.0; 3], [before, 0.0, 0.0]);
        let adopted = flight.adopted(1, Sensor::Accelerometer);
        assert_eq!(adopted.len(), 1, "{}", flight.story());
        assert!((adopted[0].followed.x - after).abs() < 0.01, "{}", flight.story());
    }
}

#[test]
fn a_rest_proves_the_primary_and_following_adds_up_nowhere() {
    let used_up = [0.0, 0.0, 0.14];
    let flight = changed::<f64>([0.0, 0.0, 0.3], [0.03, 0.0, 0.02], used_up);
    for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
        let adopted = flight.adopted(1, sensor);
        assert_eq!(adopted.len(), 1, "{}", flight.story());
        assert!(adopted[0].followed.norm() < 0.01, "{}", flight.story());
    }
}

#[test]
fn a_first_calibration_goes_wherever_its_pairs_say() {
    let parts = [Part::exact(), Part::aged()];
    let platform = platform(settings::<f64>(), units(&parts));
    let flight = fly(&platform, &Mission::new(SEED, &parts));
    let adopted = flight.adopted(1, Sensor::Accelerometer);
    assert_eq!(adopted[0].followed, Vector3::zeros(), "{}", flight.story());
}

#[test]
fn a_secondary_outvoted_by_the_others_is_calibrated_anyway() {
    let parts = [Part::exact(); 3];
    let platform = platform(settings::<f64>(), units(&parts));
    let mut flight = Flight::<f64, 3>::new(SEED);
    for identity in [12, 13] {
        for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
            flight.restore(&platform, &stored(identity, sensor, [0.0; 3]));
        }
    }
    let turn = (12.0, Phase::Free(1.0));
    let mission = Mission::new(SEED, &parts)
        .phases(&[
            (2.5, Phase::Rest),
            turn,
            (4.0, Phase::Rest),
            turn,
            (3.0, Phase::Rest),
        ])
        .spoilt(|unit, time, sample| {
            if unit == 1 && time > 6.0 {
                sample.specific_force.x += 0.5;
            }
            true
        });
    flight
        .monitor
        .command(tumble_core::redundancy::monitor::Command::Evaluate);
    flight.take(&platform, &mission.samples()[..0]);
    let mut samples = mission.samples();
    let later = samples.split_off(samples.partition_point(|(_, s)| s.time < mission.start + 14 * SECOND));
    flight.take(&platform, &samples);
    flight
        .monitor
        .command(tumble_core::redundancy::monitor::Command::Evaluate);
    flight.take(&platform, &later);
    assert_told!(flight, 1, EventKind::Unhealthy { .. });
    let adopted = flight.adopted(1, Sensor::Accelerometer);
    assert_eq!(adopted.len(), 1, "{}", flight.story());
    assert!((adopted[0].model.bias.x - 0.5).abs() < 0.02);
    assert_eq!(adopted[0].followed, Vector3::zeros());
}

/// The primary's accelerometer drifts along x by so much a second, level at every rest; seen at 25 Hz.
fn drifting<T: Real, const UNITS: usize>(slope: f64, duration: f64) -> Flight<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    let part = Part {
        period: 40_000,
        ..Part::exact()
    };
    let parts = [part; UNITS];
    let mut settings: RedundancySettings<T> = settings();
    settings.evaluation.evaluate_every = Some(60 * SECOND);
    let platform = platform(settings, units(&parts));
    let mut flight = Flight::new(SEED);
    for identity in 12..11 + UNITS as u64 {
        for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
            flight.restore(&platform, &stored(identity, sensor, [0.0; 3]));
        }
    }
    let cycle = [(8.0, Phase::Rest), (22.0, Phase::Free(1.0))];
    let cycles = (duration / 30.0) as usize;
    let mission =
        Mission::new(SEED, &parts)
            .phases(&cycle.repeat(cycles))
            .spoilt(move |unit, time, sample| {
                if unit == 0 {
                    sample.specific_force.x += slope * time;
                }
                true
            });
    flight.take(&platform, &mission.samples());
    flight
}

/// Largest shift of the accelerometers of the secondaries.
fn moved<T: Real, const UNITS: usize>(flight: &Flight<T, UNITS>) -> T
where
    Units<UNITS>: UnitCount,
{
    (1..UNITS).fold(T::zero(), |most, number| {
        let stored = flight.monitor.stored(number).expect("there is such a unit");
        most.max(stored[0].error.bias.norm())
    })
}

#[test]
fn a_slowly_drifting_primary_takes_its_secondary_to_the_cap() {
    let flight = drifting::<f32, 2>(1.5e-4, 3000.0);
    assert!(
        !flight.adopted(1, Sensor::Accelerometer).is_empty(),
        "{}",
        flight.story()
    );
    assert!(beyond(&flight).is_some(), "{}", flight.story());
    assert!(f64::from(moved(&flight)) < CAP + 0.01, "{}", flight.story());
}

#[test]
fn secondaries_that_all_leave_a_drifting_primary_do_not_follow() {
    let flight = drifting::<f32, 3>(9e-5, 1800.0);
    for unit in [1, 2] {
        assert_told!(flight, unit, EventKind::Refused {
            sensor: Sensor::Accelerometer,
            why: AdoptionRefusal::Exceeds(RefusalReason::SharedBySiblings, excess)
        } if excess.value > excess.limit);
    }
    assert!(f64::from(moved(&flight)) < 0.06, "{}", flight.story());
}

#[test]
fn of_three_units_none_follows_a_primary_that_ramps() {
    for slope in [5e-4, 2e-3] {
        let flight = drifting::<f32, 3>(slope, 240.0);
        assert!(f64::from(moved(&flight)) < 0.06, "{slope}: {}", flight.story());
    }
}
