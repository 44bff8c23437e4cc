//! Outcomes of a calibration: it is refused, replaced, restored, or its secondary replaces a primary that failed.

use tumble_core::real::Real;
use tumble_core::redundancy::fit::adoption::{AdoptionRefusal, RefusalReason};
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::event::{Abandoned, EventKind};
use tumble_core::redundancy::platform::{MountedUnit, Range};
use tumble_core::redundancy::selection::SelectionReason;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::{Adoption, RedundancySettings};

use crate::common::{apart, double};
use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, SECOND, assert_holds, assert_told, fly, platform, seconds, settings, units,
};
use crate::redundancy_modes::learned;

const SEED: u64 = 11;

fn aged() -> [Part; 2] {
    [Part::exact(), Part::aged()]
}

fn flown<T: Real>(settings: RedundancySettings<T>, parts: [Part; 2], mission: &Mission) -> Flight<T, 2> {
    fly(&platform(settings, units(&parts)), mission)
}

#[test]
fn an_error_that_grows_again_is_replaced_and_counted() {
    let turn = [(12.0, Phase::Free(1.0)), (3.0, Phase::Rest)];
    let phases = [&[(2.5, Phase::Rest)], &turn[..], &turn[..]].concat();
    let mission = Mission::new(SEED, &aged())
        .phases(&phases)
        .spoilt(|unit, time, sample| {
            if unit == 1 && time > 14.3 {
                sample.specific_force.z += 0.4;
            }
            true
        });
    let flight = flown::<f64>(settings(), aged(), &mission);
    let adopted = flight.adopted(1, Sensor::Accelerometer);
    let sequences: Vec<u32> = adopted.iter().map(|record| record.sequence).collect();
    assert_eq!(sequences, [1, 2], "{}", flight.story());
    let grown = adopted[1].model.bias.z - adopted[0].model.bias.z;
    assert!((grown - 0.4).abs() < 0.02, "{}", flight.story());
}

#[test]
fn a_record_that_comes_during_a_calibration_ends_it() {
    let platform = platform(settings(), units(&aged()));
    let phases = [(2.5, Phase::Rest), (12.0, Phase::Free(1.0))];
    let arrivals = Mission::new(SEED, &aged()).phases(&phases).samples();
    let mut flight = Flight::<f64, 2>::new(SEED);
    let mut interrupted = None;
    let mut steps = 0;
    for arrival in &arrivals {
        let is_fitting = flight.monitor.is_fitting();
        let before = flight.events.len();
        if is_fitting && steps == 0 {
            let mut other = Flight::<f64, 2>::new(SEED);
            other.monitor = flight.monitor;
            interrupted = Some(other);
        }
        steps += usize::from(is_fitting);
        flight.take(&platform, std::slice::from_ref(arrival));
        let fitted = flight.events[before..]
            .iter()
            .filter(|event| matches!(event.kind, EventKind::Fitted { .. }));
        assert!(fitted.count() <= usize::from(is_fitting), "{}", flight.story());
    }
    assert!((12..=36).contains(&steps), "{steps} steps\n{}", flight.story());
    assert_eq!(
        (
            flight.adopted(1, Sensor::Accelerometer).len(),
            flight.adopted(1, Sensor::Gyroscope).len()
        ),
        (1, 1)
    );
    let mut interrupted = interrupted.expect("it was fitted");
    let [good, _] = learned::<f64>();
    interrupted.restore(&platform, &good);
    assert!(!interrupted.monitor.is_fitting());
    assert_told!(interrupted, 1, 1 x EventKind::Abandoned { why: Abandoned::RecordReplaced });
}

#[test]
fn an_unusable_record_is_rejected_and_the_stored_one_stays() {
    let [good, _] = learned::<f64>();
    let platform = platform(settings(), units(&aged()));
    let mut flight = Flight::<f64, 2>::new(SEED);
    flight.restore(&platform, &good);
    let stored = *flight.monitor.stored(1).expect("there is a unit 1");
    assert!(stored[0].calibrated);
    let mut bad = [good; 4];
    bad[0].identity = 99;
    bad[1].model.bias.y = f64::NAN;
    bad[2].model.bias.y = 3.5;
    bad[3].model.matrix[(0, 1)] = 0.2;
    for record in bad {
        flight.restore(&platform, &record);
        assert_eq!(flight.monitor.stored(1), Some(&stored), "{record:?}");
    }
    let rejected = flight
        .events
        .iter()
        .filter(|event| matches!(event.kind, EventKind::RecordRejected { .. }));
    assert_eq!(rejected.count(), bad.len(), "{}", flight.story());
}

fn takes_over<T: Real>() {
    let parts = aged();
    let dead = 15.0..16.5;
    let phases = [(2.5, Phase::Rest), (14.0, Phase::Free(1.0)), (6.0, Phase::Rest)];
    let mission = Mission::new(SEED, &parts)
        .phases(&phases)
        .spoilt(move |unit, time, _| unit != 0 || !dead.contains(&time));
    for return_after in [None, Some(2 * SECOND)] {
        let mut settings = settings::<T>();
        settings.selection.return_after = return_after;
        let flight = flown(settings, parts, &mission);
        assert_told!(flight, 1, 1 x EventKind::Selected { reason: SelectionReason::PrimaryFailed });
        let returned = flight.told(0, |kind| {
            matches!(
                kind,
                EventKind::Selected {
                    reason: SelectionReason::PrimaryProven
                }
            )
        });
        assert_eq!(
            returned,
            usize::from(return_after.is_some()),
            "{}",
            flight.story()
        );
        let replaced = flight.outputs.iter().filter(|output| output.source == 1);
        let mut squares = (0.0, 0_u32);
        for output in replaced {
            let passed = seconds(output.time - mission.start);
            if passed < 16.4 {
                let [f, _] = mission.truth(passed);
                let error = apart(&output.specific_force.map(double), &f);
                squares = (squares.0 + error * error, squares.1 + 1);
            }
        }
        let error = (squares.0 / f64::from(squares.1)).sqrt();
        assert!(
            squares.1 > 50 && error < 0.1,
            "error {error} m/s^2 of {}\n{}",
            squares.1,
            flight.story()
        );
    }
}

#[test]
fn a_calibrated_secondary_replaces_a_failed_primary() {
    takes_over::<f32>();
    takes_over::<f64>();
}

#[test]
fn a_fit_that_leaves_too_large_a_residual_is_refused() {
    let mut settings = settings::<f64>();
    settings.adoption.residual.specific_force = 1e-4;
    let flight = flown(settings, aged(), &Mission::new(SEED, &aged()));
    assert_told!(
        flight,
        1,
        EventKind::Refused {
            sensor: Sensor::Accelerometer,
            why: AdoptionRefusal::Exceeds(RefusalReason::ResidualTooLarge, _)
        }
    );
    assert!(flight.adopted(1, Sensor::Accelerometer).is_empty());
}

#[test]
fn before_calibration_a_secondary_that_agreed_takes_over() {
    let parts = [Part::exact(), Part::aged(), Part::exact()];
    let mission = Mission::new(SEED, &parts)
        .phases(&[(3.0, Phase::Rest), (3.0, Phase::Free(1.0))])
        .spoilt(|unit, time, _| unit != 0 || time < 4.0);
    let flight: Flight<f64, 3> = fly(&platform(settings(), units(&parts)), &mission);
    assert_told!(flight, 2, 1 x EventKind::Selected { reason: SelectionReason::PrimaryFailed });
    assert_told!(flight, 1, 0 x EventKind::Selected { .. });
}

#[test]
fn a_calibration_without_motion_is_triggered_again() {
    let mut settings = settings::<f64>();
    settings.collection.motion_timeout = 4 * SECOND;
    let parts = [Part::exact(), Part::aged()];
    let mission =
        Mission::new(5, &parts).phases(&[(10.0, Phase::Rest), (12.0, Phase::Free(1.0)), (2.5, Phase::Rest)]);
    let flight = fly(&platform(settings, units(&parts)), &mission);
    assert_told!(
        flight,
        1,
        EventKind::Abandoned {
            why: Abandoned::NoMotion
        }
    );
    assert_told!(flight, 1, 2 x EventKind::Adopted { .. });
}

#[test]
fn a_trigger_outlasts_a_unit_that_says_no_numbers_for_a_while() {
    let parts = [Part::exact(), Part::aged()];
    let mission = Mission::new(6, &parts)
        .phases(&[
            (2.5, Phase::Rest),
            (5.0, Phase::Free(1.0)),
            (4.0, Phase::Rest),
            (12.0, Phase::Free(1.0)),
            (2.5, Phase::Rest),
        ])
        .spoilt(|unit, time, sample| {
            if unit == 1 && (4.0..5.0).contains(&time) {
                sample.angular_rate.y = f64::NAN;
            }
            true
        });
    let flight = fly::<f64, 2>(&platform(settings(), units(&parts)), &mission);
    assert_told!(flight, 1, 1 x EventKind::Abandoned { why: Abandoned::SecondaryUnhealthy });
    assert_told!(flight, 1, 2 x EventKind::Triggered { .. });
    assert_told!(flight, 1, 2 x EventKind::Adopted { .. });
}

#[test]
fn brief_saturation_costs_windows_and_not_the_calibration() {
    let parts = [Part::exact(), Part::aged()];
    let mission = Mission::new(7, &parts).spoilt(|unit, time, sample| {
        if unit == 1 && (8.0..8.3).contains(&time) {
            sample.specific_force.x = 40.0;
        }
        true
    });
    let [primary, secondary] = units::<f64, 2>(&parts);
    let secondary = MountedUnit {
        range: Range {
            specific_force: Some(40.0),
            angular_rate: None,
        },
        ..secondary
    };
    let flight = fly(&platform(settings(), [primary, secondary]), &mission);
    assert_told!(flight, 1, 1 x EventKind::Unhealthy { fault: HealthFault::Saturated { .. } });
    assert_told!(flight, 1, 0 x EventKind::Abandoned { .. });
    for record in flight.adopted(1, Sensor::Accelerometer) {
        assert_holds(&record, &parts[1], 7);
    }
    assert_told!(flight, 1, 2 x EventKind::Adopted { .. });
}

#[test]
fn a_calibration_replaces_the_last_only_as_adoption_allows() {
    let parts = [Part::exact(), Part::exact()];
    for (adoption, adopted) in [(Adoption::IfBetter, 0), (Adoption::Always, 2)] {
        let mut settings = settings::<f64>();
        settings.adoption.adoption = adoption;
        let thresholds = &mut settings.evaluation.thresholds.secondary;
        thresholds.accelerometer = Threshold::Fixed(1e-6);
        thresholds.gyroscope = Threshold::Fixed(1e-6);
        let flight = fly(&platform(settings, units(&parts)), &Mission::new(8, &parts));
        assert_told!(flight, 1, EventKind::Triggered { .. });
        let found = flight.told(1, |kind| matches!(kind, EventKind::Adopted { .. }));
        assert_eq!(found, adopted, "{adoption:?} {}", flight.story());
    }
}
