//! Every mode a setting has, and motion that shows little: what triggers, what is calibrated, how far a fit goes.

use tumble_core::real::{Real, real};
use tumble_core::redundancy::gate::Withheld;
use tumble_core::redundancy::monitor::Command;
use tumble_core::redundancy::monitor::event::{Abandoned, Check, EventKind};
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::{Axes, Sensor};
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::{Data, FitModel, ForceAndRate, RedundancySettings, Scope};

use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, SECOND, assert_holds, assert_told, fly, platform, settings, units,
};

const SEED: u64 = 11;

fn aged() -> [Part; 2] {
    [Part::exact(), Part::aged()]
}

fn flown<T: Real>(settings: RedundancySettings<T>, parts: [Part; 2], mission: &Mission) -> Flight<T, 2> {
    fly(&platform(settings, units(&parts)), mission)
}

/// Records of an aged secondary, as they are adopted.
pub fn learned<T: Real>() -> [Record<T>; 2] {
    let flight = flown::<T>(settings(), aged(), &Mission::new(SEED, &aged()));
    [Sensor::Accelerometer, Sensor::Gyroscope].map(|sensor| {
        *flight
            .adopted(1, sensor)
            .first()
            .expect("an aged secondary is calibrated")
    })
}

#[test]
fn the_vector_check_alone_sees_an_error_across_gravity() {
    let parts = [Part::exact(), Part::exact().biased([0.3, 0.0, 0.0], [0.0; 3])];
    let mission = Mission::new(SEED, &parts).phases(&[(2.5, Phase::Rest)]);
    for vector_check in [true, false] {
        let mut settings = settings::<f64>();
        settings.evaluation.vector_check = vector_check;
        let flight = flown(settings, parts, &mission);
        let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
        let compared = flight.told(1, |kind| {
            matches!(
                kind,
                EventKind::Evaluated {
                    check: Check::Vector,
                    ..
                }
            )
        });
        assert_eq!(
            (triggered > 0, compared > 0),
            (vector_check, vector_check),
            "{}",
            flight.story()
        );
    }
}

#[test]
fn known_errors_in_raw_data_do_not_trigger_again() {
    let records = learned::<f64>();
    let mission = Mission::new(SEED + 1, &aged()).phases(&[(2.5, Phase::Rest)]);
    let cases = [
        (Threshold::Fixed(0.1), Threshold::Fixed(0.01), 1),
        (
            Threshold::VariableByMargin(0.1),
            Threshold::VariableByMargin(0.01),
            0,
        ),
        (
            Threshold::VariableByRatio(1.5),
            Threshold::VariableByRatio(1.5),
            0,
        ),
    ];
    for (force, rate, triggers) in cases {
        let mut settings = settings();
        settings.evaluation.data = Data::Raw;
        settings.evaluation.thresholds.secondary.accelerometer = force;
        settings.evaluation.thresholds.secondary.gyroscope = rate;
        let platform = platform(settings, units(&aged()));
        let mut flight = Flight::<f64, 2>::new(mission.seed);
        records
            .iter()
            .for_each(|record| flight.restore(&platform, record));
        flight.take(&platform, &mission.samples());
        assert_told!(flight, 1, EventKind::Evaluated { .. });
        let triggered = flight.told(1, |kind| matches!(kind, EventKind::Triggered { .. }));
        assert_eq!(triggered, triggers, "{force:?} {}", flight.story());
    }
}

#[test]
fn a_known_error_is_no_fault_of_a_unit_in_raw_data_either() {
    for data in [Data::Raw, Data::Compensated] {
        let mut settings = settings::<f64>();
        settings.evaluation.data = data;
        // Below the error of the aged secondary, and far above the residual of its calibration.
        settings.health.rest = ForceAndRate {
            specific_force: 0.05,
            angular_rate: 0.005,
        };
        let platform = platform(settings, units(&aged()));
        let mission = Mission::new(SEED + 1, &aged()).phases(&[(2.5, Phase::Rest)]);
        let mut flight = Flight::<f64, 2>::new(mission.seed);
        learned()
            .iter()
            .for_each(|record| flight.restore(&platform, record));
        flight.take(&platform, &mission.samples());
        assert_told!(flight, 1, EventKind::Evaluated { .. });
        assert_told!(flight, 1, 0 x EventKind::Unhealthy { .. });
    }
}

#[test]
fn a_restored_secondary_is_within_fixed_thresholds() {
    let platform = platform(settings(), units(&aged()));
    let mission = Mission::new(SEED + 1, &aged()).phases(&[(2.5, Phase::Rest)]);
    let mut flight = Flight::<f64, 2>::new(mission.seed);
    learned()
        .iter()
        .for_each(|record| flight.restore(&platform, record));
    flight.take(&platform, &mission.samples());
    assert_told!(flight, 1, 2 x EventKind::Restored { sequence: 1, .. });
    assert_told!(flight, 1, EventKind::Evaluated { .. });
    assert_told!(flight, 1, 0 x EventKind::Triggered { .. });
}

#[test]
fn rests_are_evaluated_after_start_at_intervals_or_on_command() {
    let mission = Mission::new(SEED, &[Part::exact(); 2]).phases(&[(12.0, Phase::Rest)]);
    let samples = mission.samples();
    let (before, after) = samples.split_at(samples.len() / 2);
    let cases = [
        (true, None, false, 1),
        (false, None, false, 0),
        (false, None, true, 1),
        (true, None, true, 2),
        (true, Some(3 * SECOND), false, 4),
        (false, Some(3 * SECOND), false, 3),
    ];
    for (start, every, command, times) in cases {
        let mut settings = settings::<f64>();
        settings.evaluation.evaluate_after_start = start;
        settings.evaluation.evaluate_every = every;
        let platform = platform(settings, units(&[Part::exact(); 2]));
        let mut flight = Flight::<f64, 2>::new(SEED);
        flight.take(&platform, before);
        if command {
            flight.monitor.command(Command::Evaluate);
        }
        flight.take(&platform, after);
        let evaluated = flight.told(0, |kind| {
            matches!(
                kind,
                EventKind::Evaluated {
                    sensor: Sensor::Gyroscope,
                    ..
                }
            )
        });
        assert_eq!(
            evaluated,
            times,
            "{start} {every:?} {command}\n{}",
            flight.story()
        );
    }
}

#[test]
fn the_scope_decides_whether_both_sensors_are_calibrated() {
    let parts = [Part::exact(), Part::exact().biased([0.3, 0.0, 0.3], [0.0; 3])];
    let mission = Mission::new(SEED, &parts);
    for (scope, both) in [(Scope::AllSensors, true), (Scope::TriggeringSensor, false)] {
        let mut settings = settings::<f64>();
        settings.collection.scope = scope;
        let flight = flown(settings, parts, &mission);
        assert_told!(flight, 1, EventKind::Triggered { sensors } if *sensors == [true, both]);
        let fitted = flight.told(1, |kind| {
            matches!(
                kind,
                EventKind::Fitted {
                    sensor: Sensor::Gyroscope,
                    ..
                }
            )
        });
        assert_eq!(fitted > 0, both, "{}", flight.story());
        assert_eq!(
            flight.adopted(1, Sensor::Accelerometer).len(),
            1,
            "{}",
            flight.story()
        );
    }
}

fn fit_model_reached<T: Real>(highest: FitModel, arm_known: bool) -> FitModel {
    let mut settings = settings::<T>();
    settings.fit.largest_fit_model = highest;
    // A model that leaves out an error leaves a residual; here it may.
    settings.adoption.residual.specific_force = real(5.0);
    settings.adoption.drift.specific_force = real(5.0);
    let mut set = units::<T, 2>(&aged());
    if !arm_known {
        set[1].lever_arm = None;
    }
    let flight = fly(&platform(settings, set), &Mission::new(SEED, &aged()));
    let adopted = flight.adopted(1, Sensor::Accelerometer);
    assert_eq!(adopted.len(), 1, "{highest:?} {arm_known}\n{}", flight.story());
    if !arm_known && highest == FitModel::AffineAndLeverArm {
        assert_holds(&adopted[0], &Part::aged(), SEED);
        let apart = adopted[0].lever_arm - crate::common::cast(&Part::aged().lever_arm);
        assert!(apart.norm() < real(0.003), "{}", flight.story());
    }
    adopted[0].fit_model
}

#[test]
fn a_fit_reaches_the_highest_model_and_finds_the_lever_arm() {
    for fit_model in [FitModel::Offset, FitModel::Gain, FitModel::Affine] {
        for known in [true, false] {
            assert_eq!(fit_model_reached::<f32>(fit_model, known), fit_model);
            assert_eq!(fit_model_reached::<f64>(fit_model, known), fit_model);
        }
    }
    assert_eq!(
        fit_model_reached::<f32>(FitModel::AffineAndLeverArm, false),
        FitModel::AffineAndLeverArm
    );
    assert_eq!(
        fit_model_reached::<f64>(FitModel::AffineAndLeverArm, false),
        FitModel::AffineAndLeverArm
    );
    assert_eq!(
        fit_model_reached::<f64>(FitModel::AffineAndLeverArm, true),
        FitModel::Affine
    );
}

fn about_one_axis<T: Real>() {
    let phases = [(2.5, Phase::Rest), (12.0, Phase::AboutZ), (3.0, Phase::Rest)];
    let flight = flown::<T>(settings(), aged(), &Mission::new(SEED, &aged()).phases(&phases));
    let adopted = flight.adopted(1, Sensor::Gyroscope);
    assert_eq!(adopted.len(), 1, "{}", flight.story());
    assert_eq!(adopted[0].directions, 1);
    for axis in 0..3 {
        let (x, z) = (
            adopted[0].matrix_sigma[(axis, 0)],
            adopted[0].matrix_sigma[(axis, 2)],
        );
        assert!(!x.is_finite() && z.is_finite(), "{}", flight.story());
        // Unobserved elements are left as they were: without error.
        let identity = if axis == 0 { T::one() } else { T::zero() };
        let left = adopted[0].model.matrix[(axis, 0)] - identity;
        assert!(left.abs() < real(1e-3), "{}", flight.story());
    }
}

#[test]
fn motion_about_one_axis_shows_one_direction_only() {
    about_one_axis::<f32>();
    about_one_axis::<f64>();
}

#[test]
fn gentle_motion_shows_offsets_only_and_gentler_motion_nothing() {
    let mission = |size| {
        let phases = [(2.5, Phase::Rest), (30.0, Phase::Free(size))];
        Mission::new(SEED, &aged()).phases(&phases)
    };
    let flight = flown::<f64>(settings(), aged(), &mission(0.12));
    assert_told!(flight, 1, EventKind::MotionBegan);
    assert_told!(
        flight,
        1,
        EventKind::Fitted {
            sensor: Sensor::Gyroscope,
            fit_model: FitModel::Offset,
            ..
        }
    );
    let flight = flown::<f64>(settings(), aged(), &mission(0.04));
    assert_told!(flight, 1, 0 x EventKind::MotionBegan);
    assert_told!(flight, 1, 1 x EventKind::Abandoned { why: Abandoned::NoMotion });
}

#[test]
fn vibration_is_no_motion() {
    let phases = [(2.5, Phase::Rest), (25.0, Phase::Shaken)];
    let flight = flown::<f64>(settings(), aged(), &Mission::new(SEED, &aged()).phases(&phases));
    assert_told!(flight, 0, EventKind::RestEnded);
    assert_told!(flight, 1, 0 x EventKind::MotionBegan);
    assert_told!(flight, 1, 1 x EventKind::Abandoned { why: Abandoned::NoMotion });
}

#[test]
fn too_little_time_in_motion_ends_in_a_time_out_without_a_fit() {
    let phases = [(2.5, Phase::Rest), (3.0, Phase::Free(1.0)), (30.0, Phase::Rest)];
    let flight = flown::<f64>(settings(), aged(), &Mission::new(SEED, &aged()).phases(&phases));
    assert_told!(flight, 1, 1 x EventKind::Abandoned { why: Abandoned::TimedOut });
    assert_told!(flight, 1, 0 x EventKind::Fitted { .. });
}

#[test]
fn a_gyroscope_of_one_axis_is_calibrated_along_it_alone() {
    let mut set = units::<f64, 2>(&aged());
    set[1].axes = Axes([false, false, false, false, false, true]);
    let mission = Mission::new(SEED, &aged()).spoilt(|unit, _, sample| {
        if unit == 1 {
            // Whatever a driver writes where there is nothing to be read.
            sample.specific_force.fill(f64::NAN);
            sample.angular_rate.x = f64::NAN;
            sample.angular_rate.y = f64::INFINITY;
        }
        true
    });
    let flight = fly(&platform(settings(), set), &mission);
    assert_told!(flight, 1, 0 x EventKind::Evaluated { sensor: Sensor::Accelerometer, .. });
    let adopted = flight.adopted(1, Sensor::Gyroscope);
    assert_eq!(adopted.len(), 1, "{}", flight.story());
    assert_eq!(
        (adopted[0].fit_model, adopted[0].model.bias.x),
        (FitModel::Gain, 0.0)
    );
    assert!(
        (adopted[0].model.bias.z - 0.015).abs() < 0.002,
        "{}",
        flight.story()
    );
}

#[test]
fn with_one_calibration_at_a_time_the_second_secondary_waits() {
    let parts = [Part::exact(), Part::aged(), Part::aged()];
    let platform = platform(settings(), units(&parts));
    let turn = [(12.0, Phase::Free(1.0)), (3.0, Phase::Rest)];
    let phases = [&[(2.5, Phase::Rest)], &turn[..], &turn[..]].concat();
    let mission = Mission::new(SEED, &parts).phases(&phases);
    let mut flight = Flight::<f64, 3, 1>::new(SEED);
    flight.take(&platform, &mission.samples());
    assert_told!(
        flight,
        2,
        EventKind::Withheld {
            why: Withheld::AlreadyCalibrating,
            ..
        }
    );
    let when = |unit| {
        let mut triggers = flight.events.iter();
        triggers.find(|event| event.unit == unit && matches!(event.kind, EventKind::Triggered { .. }))
    };
    let times = [1, 2].map(|unit| when(unit).map(|event| event.time));
    assert!(times[0].is_some() && times[0] < times[1], "{}", flight.story());
    assert_holds(&flight.adopted(2, Sensor::Accelerometer)[0], &parts[2], SEED);
}
