use nalgebra::Matrix3;
use proptest::prelude::*;

use super::*;
use crate::simulate::fault::InjectedFault;
use crate::simulate::fault::{Channels, RecordedSamples};
use crate::simulate::grade::SensorGrade;
use crate::simulate::grade::TriadGrade;
use crate::simulate::sensor::{Geometry, REFERENCE_TEMPERATURE};
use crate::simulate::table::TablePose;
use crate::simulate::table_turn::{TurnLimits, TurnProfile};
use crate::simulate::unit::ClockSetup;
use crate::simulate::unit::{Ageing, ClockTruth, Warming};

fn six_faces() -> Vec<TablePose> {
    let faces = [0, 1, 2].into_iter().flat_map(|axis| [(axis, 1.0), (axis, -1.0)]);
    faces
        .map(|(axis, sign)| {
            let mut up = Vector3::zeros();
            up[axis] = sign;
            TablePose { up, tip: 0.0 }
        })
        .collect()
}

fn unit(grade: SensorGrade) -> UnitSetup {
    UnitSetup {
        grade,
        geometry: Geometry::Drawn,
        rate: 200.0,
        package_from_case: RotationSetup::Angle(0.02),
        biases: [None; 2],
        ageing: [Ageing::NONE; 2],
        lever_arm: Vector3::zeros(),
        clock: ClockSetup::Given(ClockTruth::SESSION),
        latency: 0.0,
        faults: vec![],
    }
}

fn scenario(seed: u64) -> TurntableScenario {
    let table = Table {
        poses: six_faces(),
        rest_duration: 5.0,
        profile: TurnProfile::Smooth,
        limits: TurnLimits {
            rate: 1.5,
            acceleration: 3.0,
        },
        heading_turn: 0.0,
        rates: Vec::new(),
        rate_duration: 0.0,
        error: 1e-3,
        gravity: 9.81,
        latitude: Some(0.84),
    };
    let warming = Warming {
        start: REFERENCE_TEMPERATURE,
        rise: 0.0,
        time_constant: 300.0,
    };
    TurntableScenario {
        conditions: Conditions {
            seed,
            warming,
            bias_instability: false,
            quantisation: false,
            g_sensitivity: true,
        },
        table,
        mounting: RotationSetup::Angle(0.02),
        reference: UnitSetup {
            package_from_case: RotationSetup::Given(Vector3::zeros()),
            ..unit(SensorGrade::reference())
        },
        targets: vec![unit(SensorGrade::consumer()), unit(SensorGrade::tactical())],
    }
}

fn with_bias_instability(scenario: TurntableScenario) -> TurntableScenario {
    TurntableScenario {
        conditions: Conditions {
            bias_instability: true,
            ..scenario.conditions
        },
        ..scenario
    }
}

fn noiseless(triad: TriadGrade) -> TriadGrade {
    TriadGrade {
        noise_density: 0.0,
        quantisation: 0.0,
        ..triad
    }
}

fn noiseless_unit(grade: SensorGrade) -> UnitSetup {
    let accelerometer = noiseless(grade.accelerometer);
    let gyroscope = noiseless(grade.gyroscope);
    unit(SensorGrade {
        accelerometer,
        gyroscope,
        ..grade
    })
}

fn mean(rows: &[[f64; 3]]) -> Vector3<f64> {
    rows.iter().map(|row| Vector3::from(*row)).sum::<Vector3<f64>>() / rows.len() as f64
}

fn window(samples: &RecordedSamples, from: f64, to: f64) -> core::ops::Range<usize> {
    samples.time.partition_point(|&t| t < from)..samples.time.partition_point(|&t| t <= to)
}

#[test]
fn a_seed_always_gives_the_same_session_and_others_another() {
    let first = simulate(&scenario(1)).unwrap();
    let again = simulate(&scenario(1)).unwrap();
    assert_eq!(first.reference, again.reference);
    assert_eq!(first.targets, again.targets);
    assert_ne!(first.targets, simulate(&scenario(2)).unwrap().targets);
}

#[test]
fn one_more_target_changes_nothing_for_the_others() {
    let mut more = scenario(3);
    more.targets.push(unit(SensorGrade::industrial()));
    let (two, three) = (simulate(&scenario(3)).unwrap(), simulate(&more).unwrap());
    assert_eq!(two.reference, three.reference);
    assert_eq!(two.targets[..], three.targets[..2]);
}

#[test]
fn bias_instability_comes_on_top_of_the_same_white_noise() {
    let white = simulate(&scenario(4)).unwrap();
    let both = simulate(&with_bias_instability(scenario(4))).unwrap();
    let (a, b) = (&white.targets[0], &both.targets[0]);
    assert_eq!(a.truth.accelerometer.model, b.truth.accelerometer.model);
    let moved = mean(&b.samples.gyroscope) - mean(&a.samples.gyroscope);
    assert!(b.truth.gyroscope_drift.norm() > 0.0);
    assert!((moved - b.truth.gyroscope_drift).norm() < 1e-12);
}

#[test]
fn a_unit_at_rest_reads_m_times_truth_plus_bias_within_noise() {
    let session = simulate(&scenario(5)).unwrap();
    for record in session.targets.iter().chain([&session.reference]) {
        for rest in session.motion.rests() {
            let truth = session.motion.at_rest(&rest.level_from_table);
            let rows = window(&record.samples, rest.start, rest.end);
            let triads = [
                (
                    &record.truth.accelerometer,
                    truth.specific_force,
                    mean(&record.samples.accelerometer[rows.clone()]),
                ),
                (
                    &record.truth.gyroscope,
                    truth.angular_rate,
                    mean(&record.samples.gyroscope[rows.clone()]),
                ),
            ];
            for (triad, u, found) in triads {
                let expected = triad.model.measure(&u) + triad.g_sensitivity * truth.specific_force;
                let sigma = triad.noise_density / 5.0_f64.sqrt();
                assert!(
                    (found - expected).amax() < 5.0 * sigma,
                    "{found} {expected} {sigma}"
                );
            }
        }
    }
}

#[test]
fn the_gyroscope_integrates_a_turn_by_its_error_model() {
    let mut scenario = scenario(6);
    scenario.table.latitude = None;
    let grade = SensorGrade::industrial();
    let gyroscope = TriadGrade {
        g_sensitivity: 0.0,
        ..grade.gyroscope
    };
    scenario.targets = vec![noiseless_unit(SensorGrade { gyroscope, ..grade })];
    let session = simulate(&scenario).unwrap();
    let record = &session.targets[0];
    for pair in session.motion.rests().windows(2) {
        let rows = window(&record.samples, pair[0].end - 0.5, pair[1].start + 0.5);
        let period = 1.0 / 200.0;
        let integral = mean(&record.samples.gyroscope[rows.clone()]) * (period * rows.len() as f64);
        let turned = pair[0].level_from_table.inverse() * pair[1].level_from_table;
        // One axis per turn: the rotation vector is the integral of the rate, here in the case frame.
        let mut rotation =
            session.case_from_table * UnitQuaternion::from_rotation_matrix(&turned).scaled_axis();
        let model = record.truth.gyroscope.model;
        let found =
            model.matrix.try_inverse().unwrap() * (integral - model.bias * (period * rows.len() as f64));
        if found.dot(&rotation) < 0.0 {
            // Beyond half a turn the logarithm goes the other way round.
            rotation *= (rotation.norm() - core::f64::consts::TAU) / rotation.norm();
        }
        assert!((found - rotation).norm() < 2e-5, "{found} {rotation}");
    }
}

#[test]
fn a_clock_with_an_offset_stamps_samples_by_its_own_time() {
    let clock = ClockTruth {
        offset: 7.5,
        skew: 200e-6,
        phase: 0.4,
    };
    let mut scenario = scenario(7);
    scenario.targets = vec![UnitSetup {
        clock: ClockSetup::Given(clock),
        ..noiseless_unit(SensorGrade::tactical())
    }];
    let session = simulate(&scenario).unwrap();
    let record = &session.targets[0];
    let steps: Vec<f64> = record
        .samples
        .time
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .collect();
    assert!(
        steps.iter().all(|step| (step - 1.0 / 200.0).abs() < 1e-12),
        "its own clock ticks evenly"
    );
    for (time, reading) in record.samples.time.iter().zip(&record.samples.accelerometer) {
        let session_time = (time - clock.offset) / (1.0 + clock.skew);
        let truth = session.motion.truth(session_time);
        let expected = record.truth.accelerometer.model.measure(&truth.specific_force);
        assert!((Vector3::from(*reading) - expected).norm() < 1e-9);
    }
    let last = record.samples.time[record.samples.len() - 1];
    assert!(
        (clock.own(session.motion.duration()) - last) < 1.0 / 200.0,
        "it records to the end"
    );
}

#[test]
fn a_lever_arm_adds_centripetal_force_in_turns_only() {
    let mut scenario = scenario(8);
    scenario.table.latitude = None;
    let with = |lever_arm| UnitSetup {
        geometry: Geometry::Perfect,
        package_from_case: RotationSetup::Given(Vector3::zeros()),
        lever_arm,
        ..noiseless_unit(SensorGrade::tactical())
    };
    scenario.targets = vec![with(Vector3::zeros()), with(Vector3::new(0.1, 0.2, 0.3))];
    let session = simulate(&scenario).unwrap();
    let bias = |target: usize| session.targets[target].truth.accelerometer.model.bias;
    let force = |target: usize, row: usize| {
        Vector3::from(session.targets[target].samples.accelerometer[row]) - bias(target)
    };
    for rest in session.motion.rests() {
        let row = window(&session.targets[0].samples, rest.start, rest.end).start;
        assert!((force(1, row) - force(0, row)).norm() < 1e-12);
    }
    let turn = session.motion.rests()[0].end..session.motion.rests()[1].start;
    let middle = (turn.start + turn.end) / 2.0;
    let row = window(&session.targets[0].samples, middle, turn.end).start;
    let w = session
        .motion
        .truth(session.targets[0].samples.time[row])
        .turn_rate;
    let arm = Vector3::new(0.1, 0.2, 0.3);
    // At the middle of a smooth turn the angular acceleration passes zero.
    let expected = -(arm * w.norm_squared() - w * w.dot(&arm));
    assert!((force(1, row) - force(0, row) - expected).norm() < 2e-2 * expected.norm());
}

#[test]
fn a_slipped_unit_reads_the_turned_truth_afterwards() {
    let mut scenario = scenario(9);
    let mut target = noiseless_unit(SensorGrade::tactical());
    target.faults = vec![InjectedFault::Moved {
        start: 2.0,
        axis: 1,
        size: 0.01,
    }];
    scenario.targets = vec![target];
    let session = simulate(&scenario).unwrap();
    let record = &session.targets[0];
    let force = session.motion.truth(0.0).specific_force;
    let model = &record.truth.accelerometer.model;
    let slip = Rotation3::new(Vector3::y() * 0.01);
    assert!((Vector3::from(record.samples.accelerometer[0]) - model.measure(&force)).norm() < 1e-9);
    assert!(
        (Vector3::from(record.samples.accelerometer[500]) - model.measure(&(slip * force))).norm() < 1e-9
    );
}

#[test]
fn a_unit_out_of_scale_says_so_in_its_truth() {
    let mut scenario = scenario(10);
    scenario.targets[0].faults = vec![InjectedFault::Scale {
        channels: Channels::Gyroscope,
        axis: 2,
        size: 1.1,
    }];
    let session = simulate(&scenario).unwrap();
    let scale = session.targets[0]
        .truth
        .gyroscope
        .model
        .decompose()
        .unwrap()
        .scale;
    assert!(scale.z > 1.05 && scale.y < 1.05);
}

#[test]
fn warming_moves_the_bias_and_is_reported_as_drift() {
    let mut scenario = scenario(11);
    scenario.conditions.warming = Warming {
        start: 25.0,
        rise: 10.0,
        time_constant: 20.0,
    };
    scenario.targets = vec![noiseless_unit(SensorGrade::consumer())];
    let session = simulate(&scenario).unwrap();
    let record = &session.targets[0];
    let last = record.samples.len() - 1;
    let rise = record.samples.temperature[last] - record.samples.temperature[0];
    assert!((rise - 10.0 * (1.0 - (-record.samples.time[last] / 20.0).exp())).abs() < 0.01);
    let (triad, truth) = (
        &record.truth.accelerometer,
        session.motion.truth(record.samples.time[last]),
    );
    let moved =
        Vector3::from(record.samples.accelerometer[last]) - triad.model.measure(&truth.specific_force);
    assert!((moved - triad.temperature_coefficient * rise).norm() < 1e-2 * moved.norm());
    assert!(record.truth.accelerometer_drift.norm() > 0.0);
}

#[test]
fn a_perfect_geometry_leaves_bias_and_noise_only() {
    let mut scenario = scenario(12);
    scenario.reference.geometry = Geometry::Perfect;
    let truth = simulate(&scenario).unwrap().reference.truth;
    assert_eq!(truth.accelerometer.model.matrix, Matrix3::identity());
    assert_eq!(truth.gyroscope.model.matrix, Matrix3::identity());
    assert!(truth.accelerometer.model.bias.norm() > 0.0);
}

#[test]
fn a_scenario_that_makes_no_sense_is_refused_with_its_figure() {
    let refused = |spoil: fn(&mut TurntableScenario)| {
        let mut scenario = scenario(13);
        spoil(&mut scenario);
        simulate(&scenario).unwrap_err().to_string()
    };
    assert_eq!(refused(|s| s.table.poses.clear()), "there is no pose to turn to");
    assert_eq!(
        refused(|s| s.table.poses[1].up *= 2.0),
        "up of pose 2 is not a unit vector"
    );
    assert_eq!(
        refused(|s| s.table.rest_duration = -1.0),
        "time at rest, s, has to be positive, found -1"
    );
    assert_eq!(
        refused(|s| s.targets[0].rate = f64::NAN),
        "sample rate, Hz, has to be positive, found NaN"
    );
    assert!(refused(|s| s.table.rest_duration = 1e12).contains("do not fit into memory"));
    assert_eq!(
        refused(|s| s.targets[0].faults = vec![InjectedFault::LeftHanded { axis: 3 }]),
        "a fault names axis 3, there are 0, 1 and 2"
    );
}

/// A change of these numbers changes every benchmark: it has to be meant.
#[test]
fn a_seed_gives_the_same_numbers_on_every_machine() {
    let session = simulate(&with_bias_instability(scenario(42))).unwrap();
    let record = &session.targets[0];
    let found = [
        record.truth.accelerometer.model.matrix[(0, 1)],
        record.truth.gyroscope.model.bias.x,
        record.samples.accelerometer[1234][2],
        record.samples.gyroscope[4321][0],
        session.reference.samples.accelerometer[777][1],
    ];
    let expected = [
        -0.010093934240133846,
        -0.23409835389956102,
        3.440281033305132,
        -0.22806038182979751,
        0.15660410504448308,
    ];
    for (found, expected) in found.iter().zip(&expected) {
        assert!(
            (found - expected).abs() <= 1e-13 * expected.abs(),
            "{found:.17e} {expected:.17e}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn every_column_of_every_unit_is_as_long_as_its_time(seed in any::<u64>(), rate in 20.0..300.0f64) {
        let mut scenario = scenario(seed);
        scenario.table.rest_duration = 0.5;
        scenario.targets[0].rate = rate;
        scenario.targets[0].clock = ClockSetup::Drawn { offset: 5.0, skew: 50e-6 };
        let session = simulate(&scenario).unwrap();
        let samples = &session.targets[0].samples;
        prop_assert_eq!(samples.len(), samples.accelerometer.len());
        prop_assert_eq!(samples.len(), samples.gyroscope.len());
        prop_assert_eq!(samples.len(), samples.temperature.len());
        let expected = session.motion.duration() * rate;
        prop_assert!((samples.len() as f64 - expected).abs() < 2.0);
    }
}
