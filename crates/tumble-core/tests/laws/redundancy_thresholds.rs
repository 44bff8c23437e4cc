//! Origins of thresholds, and the deviations that are compared with them.

use nalgebra::Vector3;
use tumble_core::model::ErrorModel;
use tumble_core::real::Real;
use tumble_core::redundancy::gate::Withheld;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::monitor::Command;
use tumble_core::redundancy::monitor::event::{Check, EventKind};
use tumble_core::redundancy::platform::MountedUnit;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::{Axes, Sensor};
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::{Data, RedundancySettings};

use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, SECOND, assert_told, fly, platform, settings, units,
};
use crate::redundancy_modes::learned;

const SEED: u64 = 23;

fn off(specific_force: [f64; 3]) -> Part {
    Part::exact().biased(specific_force, [0.0; 3])
}

/// A record of a secondary's accelerometer with a bias alone.
fn stored<T: Real>(bias: [f64; 3]) -> Record<T> {
    let [record, _] = learned::<f64>();
    let record = Record {
        model: ErrorModel {
            bias: Vector3::from(bias),
            ..ErrorModel::identity()
        },
        ..record
    };
    record.in_numbers(tumble_core::real::real)
}

/// Deviations of a unit's accelerometer and their thresholds, in order.
fn deviations<T: Real>(flight: &Flight<T, 2>, unit: usize, wanted: Check) -> Vec<(T, T)> {
    let found = flight.events.iter().filter(|event| event.unit == unit);
    let each = found.filter_map(|event| match event.kind {
        EventKind::Evaluated {
            sensor: Sensor::Accelerometer,
            check,
            deviation,
            threshold,
        } if check == wanted => Some((deviation, threshold)),
        _ => None,
    });
    each.collect()
}

fn raw(settings: &mut RedundancySettings<f64>) {
    settings.evaluation.data = Data::Raw;
    settings.evaluation.vector_check = false;
    settings.evaluation.thresholds.secondary.accelerometer = Threshold::VariableByMargin(0.1);
}

fn rested(settings: RedundancySettings<f64>, parts: [Part; 2], records: &[Record<f64>]) -> Flight<f64, 2> {
    let platform = platform(settings, units(&parts));
    let mission = Mission::new(SEED, &parts).phases(&[(2.5, Phase::Rest)]);
    let mut flight = Flight::new(SEED);
    records
        .iter()
        .for_each(|record| flight.restore(&platform, record));
    flight.take(&platform, &mission.samples());
    flight
}

#[test]
fn the_norm_check_uses_the_threshold_as_it_was_set() {
    let parts = [off([0.0, 0.0, 0.05]), off([0.0, 0.0, 0.117])];
    let flight = rested(settings(), parts, &[]);
    let found = deviations(&flight, 1, Check::Norm);
    assert!(
        !found.is_empty() && found.iter().all(|(_, threshold)| *threshold == 0.1),
        "{}",
        flight.story()
    );
    assert_told!(flight, 1, 1 x EventKind::Triggered { .. });
}

#[test]
fn in_raw_data_a_new_error_across_a_known_one_is_detected() {
    for (actual, triggers) in [([0.5, 0.0, 0.4], 1), ([0.5, 0.0, 0.05], 0), ([0.5, 0.0, -0.4], 1)] {
        let mut settings = settings();
        raw(&mut settings);
        let flight = rested(settings, [off([0.0; 3]), off(actual)], &[stored([0.5, 0.0, 0.0])]);
        let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
        assert_eq!(triggered, triggers, "{actual:?} {}", flight.story());
    }
}

#[test]
fn the_vector_check_subtracts_a_known_error_along_the_deviation() {
    for (actual, triggers) in [([0.3, 0.4, 0.0], 1), ([-0.4, 0.0, 0.0], 1), ([0.55, 0.0, 0.0], 0)] {
        let mut settings = settings();
        raw(&mut settings);
        settings.evaluation.vector_check = true;
        let flight = rested(settings, [off([0.0; 3]), off(actual)], &[stored([0.5, 0.0, 0.0])]);
        let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
        assert_eq!(triggered, triggers, "{actual:?} {}", flight.story());
    }
}

#[test]
fn a_drifting_primary_exceeds_a_threshold_from_its_calibration() {
    let mut settings = settings::<f64>();
    settings.evaluation.evaluate_every = Some(2 * SECOND);
    settings.evaluation.thresholds.primary.accelerometer = Threshold::VariableByMargin(0.1);
    let parts = [Part::exact(); 2];
    let mission = Mission::new(SEED, &parts)
        .phases(&[(20.0, Phase::Rest)])
        .spoilt(|unit, time, sample| {
            sample.specific_force.z += if unit == 0 { 0.02 * time } else { 0.0 };
            true
        });
    let platform = platform(settings, units(&parts));
    let mut flight = Flight::<f64, 2>::new(SEED);
    flight.take(&platform, &mission.samples());
    let found = deviations(&flight, 0, Check::Norm);
    assert!(
        found.iter().all(|(_, threshold)| *threshold == 0.1),
        "{}",
        flight.story()
    );
    assert!(
        found.iter().any(|(deviation, threshold)| deviation > threshold),
        "{}",
        flight.story()
    );
}

#[test]
fn a_factory_threshold_stays_after_a_later_calibration() {
    let mut settings = settings();
    raw(&mut settings);
    settings.evaluation.thresholds.secondary.accelerometer = Threshold::FactoryByMargin(0.1);
    let parts = [off([0.0; 3]), off([0.0, 0.0, 0.9])];
    let platform = platform(settings, units(&parts));
    let mut flight = Flight::<f64, 2>::new(SEED);
    flight.restore(&platform, &stored([0.0, 0.0, 0.9]));
    flight
        .monitor
        .restore_factory(&platform, &stored([0.0, 0.0, 0.2]));
    flight.take(
        &platform,
        &Mission::new(SEED, &parts).phases(&[(2.5, Phase::Rest)]).samples(),
    );
    for (_, threshold) in deviations(&flight, 1, Check::Norm) {
        assert!((threshold - 0.3).abs() < 1e-12, "{threshold}");
    }
    assert_told!(flight, 1, EventKind::Triggered { .. });
}

#[test]
fn a_unit_with_a_threshold_of_its_own_is_compared_with_that() {
    let parts = [off([0.0; 3]), off([0.0, 0.0, 0.2])];
    for (own, triggers) in [(None, 1), (Some(Threshold::Fixed(0.5)), 0)] {
        let [primary, secondary] = units::<f64, 2>(&parts);
        let secondary = MountedUnit {
            thresholds: [own, None],
            ..secondary
        };
        let platform = platform(settings(), [primary, secondary]);
        let mut flight = Flight::<f64, 2>::new(SEED);
        let mission = Mission::new(SEED, &parts).phases(&[(2.5, Phase::Rest)]);
        flight.take(&platform, &mission.samples());
        let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
        assert_eq!(triggered, triggers, "{own:?} {}", flight.story());
    }
}

#[test]
fn without_evaluation_only_a_command_calibrates() {
    let parts = [off([0.0; 3]), off([0.3, 0.0, 0.3])];
    let mission = Mission::new(SEED, &parts).phases(&[
        (2.5, Phase::Rest),
        (12.0, Phase::Free(1.0)),
        (3.0, Phase::Rest),
    ]);
    for commanded in [false, true] {
        let mut settings = settings::<f64>();
        settings.evaluation.evaluate_every = None;
        let platform = platform(settings, units(&parts));
        let mut flight = Flight::<f64, 2>::new(SEED);
        if commanded {
            flight.monitor.command(Command::Evaluate);
        }
        flight.take(&platform, &mission.samples());
        let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
        assert_eq!(triggered, usize::from(commanded), "{}", flight.story());
        let why = Withheld::OnCommandOnly;
        let withheld = flight.told(
            1,
            |kind| matches!(kind, EventKind::Withheld { why: found, .. } if *found == why),
        );
        assert_eq!(withheld > 0, !commanded, "{}", flight.story());
    }
}

#[test]
fn health_is_judged_at_every_rest_even_without_evaluation() {
    let mut settings = settings::<f64>();
    settings.evaluation.evaluate_every = None;
    let parts = [Part::exact(); 2];
    let mission = Mission::new(SEED, &parts)
        .phases(&[(4.0, Phase::Rest), (4.0, Phase::Free(1.0)), (4.0, Phase::Rest)])
        .spoilt(|unit, time, sample| {
            // A unit that never agreed is compared for the worst only, and one that does not step has nothing but its rests
            // against it.
            let off = 0.3 + 5.7 * ((time - 5.0) / 2.0).clamp(0.0, 1.0);
            sample.specific_force.z += if unit == 1 { off } else { 0.0 };
            true
        });
    let platform = platform(settings, units(&parts));
    let mut flight = Flight::<f64, 2>::new(SEED);
    flight.take(&platform, &mission.samples());
    assert_told!(
        flight,
        1,
        EventKind::Unhealthy {
            fault: HealthFault::ImplausibleAtRest { .. }
        }
    );
}

#[test]
fn one_accelerometer_axis_is_compared_with_its_share_of_gravity() {
    let only_z = Axes([false, false, true, true, true, true]);
    for data in [Data::Compensated, Data::Raw] {
        for (bias, triggers) in [(0.05, 0), (0.3, 1)] {
            let parts = [off([0.0; 3]), off([0.0, 0.0, bias])];
            let mut settings = settings::<f64>();
            settings.evaluation.vector_check = false;
            settings.evaluation.data = data;
            let thresholds = &mut settings.evaluation.thresholds.secondary;
            thresholds.accelerometer = Threshold::VariableByMargin(0.1);
            let [primary, secondary] = units::<f64, 2>(&parts);
            let secondary = MountedUnit {
                axes: only_z,
                ..secondary
            };
            let flight = fly(
                &platform(settings, [primary, secondary]),
                &Mission::new(SEED, &parts),
            );
            let found = deviations(&flight, 1, Check::Norm);
            assert!((found[0].0 - bias).abs() < 0.01, "{found:?}");
            let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
            assert_eq!(triggered, triggers, "{bias} {}", flight.story());
            if triggers > 0 && data == Data::Compensated {
                let last = found.last().expect("the last rest is evaluated");
                assert!(last.0 < 0.03, "{found:?} {}", flight.story());
            }
        }
    }
}

#[test]
fn an_invalid_primary_judges_no_accelerometer_that_lacks_axes() {
    let parts = [off([0.0, 0.0, 0.5]), off([0.0, 0.0, 0.3])];
    let mut settings = settings::<f64>();
    settings.evaluation.vector_check = false;
    let [primary, secondary] = units::<f64, 2>(&parts);
    let secondary = MountedUnit {
        axes: Axes([false, false, true, true, true, true]),
        ..secondary
    };
    let flight = fly(
        &platform(settings, [primary, secondary]),
        &Mission::new(SEED, &parts),
    );
    assert!(
        deviations(&flight, 1, Check::Norm).is_empty(),
        "{}",
        flight.story()
    );
}
