//! Physics at rest overrides all else, and takes back conclusions from motion; an effect on all units at once is no
//! unit's fault.

use nalgebra::{Matrix3, Vector3};
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::fit::adoption::{AdoptionRefusal, RefusalReason};
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::isolation::attribution::Ground;
use tumble_core::redundancy::monitor::event::EventKind;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_core::redundancy::settings::FitModel;
use tumble_core::redundancy::unit_count::{UnitCount, Units};

use crate::common::Draws;
use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, SECOND, START, assert_told, fly, platform, seconds, settings, units,
};

/// Record of a sensor that had no error then.
fn without_error(identity: u64, sensor: Sensor) -> Record<f32> {
    Record {
        model: ErrorModel::identity(),
        matrix_sigma: Matrix3::repeat(1e-3),
        bias_sigma: Vector3::repeat(1e-3),
        lever_arm_sigma: Vector3::zeros(),
        fit_model: FitModel::Affine,
        directions: 3,
        residual: 0.01,
        pairs: 400,
        sequence: 1,
        ..Record::unknown(identity, sensor)
    }
}

/// Units that were calibrated, and have these biases since.
pub fn since<const N: usize>(mission: &Mission) -> Flight<f32, N>
where
    Units<N>: UnitCount,
{
    let parts: [Part; N] = core::array::from_fn(|number| mission.parts[number]);
    let platform = platform(settings(), units(&parts));
    let mut flight = Flight::new(mission.seed);
    for number in 1..N as u64 {
        for sensor in SENSORS {
            flight.restore(&platform, &without_error(11 + number, sensor));
        }
    }
    flight.take(&platform, &mission.samples());
    flight
}

fn off(specific_force: [f64; 3]) -> Part {
    Part::exact().biased(specific_force, [0.0; 3])
}

#[test]
fn secondaries_that_aged_differently_are_calibrated_again() {
    for seed in 0..12 {
        let mut draws = Draws::new(seed);
        let mut aged = || (draws.normals::<3>().normalize() * 0.15).into();
        let parts = [Part::exact(), off(aged()), off(aged())];
        let flight = since::<3>(&Mission::new(seed, &parts));
        for unit in 0..3 {
            assert_told!(flight, unit, 0 x EventKind::Disagree { .. });
            assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
        }
        for unit in 1..3 {
            assert_eq!(
                flight.adopted(unit, Sensor::Accelerometer).len(),
                1,
                "{}",
                flight.story()
            );
        }
    }
}

#[test]
fn two_secondaries_that_agree_at_the_first_rest_are_not_stale() {
    let parts = [off([0.5, 0.0, 0.0]), Part::exact(), Part::exact()];
    let flight = since::<3>(&Mission::new(1, &parts));
    for unit in 1..3 {
        assert!(
            flight.adopted(unit, Sensor::Accelerometer).is_empty(),
            "{}",
            flight.story()
        );
    }
    assert_told!(flight, 0, EventKind::Unhealthy { .. });
}

#[test]
fn physics_opens_the_cap_and_the_primary_alone_does_not() {
    let along = since::<2>(&Mission::new(2, &[Part::exact(), off([0.0, 0.0, 0.3])]));
    assert_eq!(
        along.adopted(1, Sensor::Accelerometer).len(),
        1,
        "{}",
        along.story()
    );
    let across = since::<2>(&Mission::new(2, &[Part::exact(), off([0.3, 0.0, 0.0])]));
    assert!(
        across.adopted(1, Sensor::Accelerometer).is_empty(),
        "{}",
        across.story()
    );
    assert_told!(
        across,
        1,
        EventKind::Refused {
            why: AdoptionRefusal::Exceeds(RefusalReason::BeyondSupport, _),
            ..
        }
    );
}

#[test]
fn a_vote_of_two_that_shift_alike_is_taken_back_at_rest() {
    for seed in 0..4 {
        let parts = [Part::exact(); 3];
        let mission = Mission::new(seed, &parts)
            .phases(&[(3.0, Phase::Rest), (15.0, Phase::Free(1.0)), (6.0, Phase::Rest)])
            .spoilt(|number, time, sample| {
                if number > 0 && time >= 10.0 {
                    sample.specific_force += Vector3::new(0.35, 0.0, 0.35);
                }
                true
            });
        let flight = since::<3>(&mission);
        assert_told!(
            flight,
            0,
            EventKind::Unhealthy {
                fault: HealthFault::OutOfFamily { .. }
            }
        );
        for unit in 1..3 {
            assert_told!(
                flight,
                unit,
                EventKind::Unhealthy {
                    fault: HealthFault::Isolated {
                        ground: Ground::Rest,
                        ..
                    }
                }
            );
        }
        assert_eq!(flight.monitor.source(), Some(0), "{}", flight.story());
    }
}

#[test]
fn a_secondary_outvoted_by_two_wrong_ones_is_cleared_at_rest() {
    for seed in 0..4 {
        let parts = [Part::exact(); 3];
        let mission = Mission::new(seed, &parts)
            .phases(&[(3.0, Phase::Rest), (15.0, Phase::Free(1.0)), (6.0, Phase::Rest)])
            .spoilt(|number, time, sample| {
                if number < 2 && time >= 10.0 {
                    sample.specific_force += Vector3::new(0.35, 0.0, 0.35);
                }
                true
            });
        let flight = since::<3>(&mission);
        assert_told!(
            flight,
            2,
            EventKind::Unhealthy {
                fault: HealthFault::OutOfFamily { .. }
            }
        );
        assert_told!(
            flight,
            0,
            EventKind::Unhealthy {
                fault: HealthFault::ImplausibleAtRest { .. }
            }
        );
        assert_eq!(flight.monitor.source(), Some(2), "{}", flight.story());
    }
}

#[test]
fn a_stall_of_all_units_costs_a_sample_and_the_primary_goes_on() {
    for stall in [0.11, 0.3, 0.6, 0.99] {
        for seed in 0..3 {
            let mut parts = [Part::exact(); 3];
            for (part, phase) in parts.iter_mut().zip([7_000, 0, 3_000]) {
                part.phase = phase;
            }
            let mission =
                Mission::new(seed, &parts).spoilt(move |_, time, _| !(8.0..8.0 + stall).contains(&time));
            let flight = since::<3>(&mission);
            for unit in 0..3 {
                assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
            }
            assert_told!(flight, 0, 1 x EventKind::TimeJumped { .. });
            let after = START + 8 * SECOND;
            let first = flight.outputs.iter().find(|output| output.time > after);
            let waited = first.map(|output| seconds(output.time - after) - stall);
            assert!(waited.is_some_and(|waited| waited < 0.025), "{waited:?}");
            assert!(
                flight.outputs.iter().all(|output| output.source == 0),
                "{}",
                flight.story()
            );
        }
    }
}

#[test]
fn begun_in_motion_a_gyroscope_that_jumps_is_named() {
    for seed in 0..3 {
        let parts = [Part::exact(); 3];
        let mission = Mission::new(seed, &parts)
            .phases(&[(70.0, Phase::Free(0.5))])
            .spoilt(|number, time, sample| {
                if time < 1.0 {
                    return false;
                }
                if number == 0 && time >= 60.0 {
                    sample.angular_rate.y += 0.05;
                }
                true
            });
        let flight = fly::<f32, 3>(&platform(settings(), units(&parts)), &mission);
        let found = flight
            .events
            .iter()
            .find(|event| matches!(event.kind, EventKind::Unhealthy { .. }));
        assert!(
            found.is_some_and(|event| event.unit == 0 && (60.0..62.0).contains(&seconds(event.time - START))),
            "{}",
            flight.story()
        );
    }
}

#[test]
fn an_accelerometer_turned_over_is_named_by_aged_secondaries() {
    for seed in 0..4 {
        let mut draws = Draws::new(seed);
        let mut aged = || (draws.normals::<3>().normalize() * 0.08).into();
        let parts = [Part::exact(), off(aged()), off(aged()), off(aged())];
        let mission = Mission::new(seed, &parts).spoilt(|number, _, sample| {
            if number == 0 {
                sample.specific_force = -sample.specific_force;
            }
            true
        });
        let flight = since::<4>(&mission);
        assert_told!(
            flight,
            0,
            EventKind::Unhealthy {
                fault: HealthFault::OutOfFamily { .. }
            }
        );
        for unit in 1..4 {
            assert_told!(flight, unit, 0 x EventKind::Unhealthy { .. });
        }
    }
}

#[test]
fn three_of_four_that_aged_and_shift_alike_are_named_at_rest() {
    for seed in 0..4 {
        let mut draws = Draws::new(seed);
        let mut aged = || off((draws.normals::<3>().normalize() * 0.06).into());
        let parts = [Part::exact(), aged(), aged(), aged()];
        let mission = Mission::new(seed, &parts)
            .phases(&[(3.0, Phase::Rest), (15.0, Phase::Free(1.0)), (6.0, Phase::Rest)])
            .spoilt(|number, time, sample| {
                if number > 0 && time >= 10.0 {
                    sample.specific_force += Vector3::new(0.35, 0.0, 0.35);
                }
                true
            });
        let flight = since::<4>(&mission);
        for unit in 1..4 {
            assert_told!(
                flight,
                unit,
                EventKind::Unhealthy {
                    fault: HealthFault::Isolated {
                        ground: Ground::Rest,
                        ..
                    }
                }
            );
        }
        assert_eq!(flight.monitor.source(), Some(0), "{}", flight.story());
    }
}

/// Three units that were never calibrated, of which the primary has an error of so much along gravity.
fn never_calibrated(primary: f64, secondaries: f64) -> Flight<f32, 3> {
    let parts = [
        off([0.0, 0.0, primary]),
        off([0.2, 0.1, secondaries]),
        off([-0.1, 0.2, -secondaries]),
    ];
    let mission = Mission::new(3, &parts);
    fly(&platform(settings(), units(&parts)), &mission)
}

#[test]
fn units_that_all_err_are_calibrated_relative_to_the_primary() {
    let flight = never_calibrated(0.5, 0.4);
    for unit in 1..3 {
        assert_eq!(
            flight.adopted(unit, Sensor::Accelerometer).len(),
            1,
            "{}",
            flight.story()
        );
    }
}

#[test]
fn a_primary_with_the_only_or_too_large_error_calibrates_none() {
    for (primary, secondaries) in [(0.5, 0.05), (1.2, 1.0)] {
        let flight = never_calibrated(primary, secondaries);
        for unit in 1..3 {
            assert_told!(flight, unit, 0 x EventKind::Adopted { .. });
        }
    }
}

#[test]
fn the_output_steps_little_where_units_drifted_and_rested() {
    let (mut forces, mut rates) = (Vec::new(), Vec::new());
    for seed in 0..6 {
        let parts = [Part::exact(); 2];
        let mut draws = Draws::new(seed);
        let (f, w) = (
            draws.normals::<3>().normalize() * 0.04,
            draws.normals::<3>().normalize() * 4e-3,
        );
        let fails = 103.0;
        let mission = Mission::new(seed, &parts)
            .phases(&[
                (3.0, Phase::Rest),
                (40.0, Phase::Free(0.3)),
                (4.0, Phase::Rest),
                (20.0, Phase::Free(0.3)),
                (4.0, Phase::Rest),
                (20.0, Phase::Free(0.3)),
                (4.0, Phase::Rest),
                (20.0, Phase::Free(0.3)),
            ])
            .spoilt(move |number, time, sample| {
                if number == 1 {
                    let share = (time / 40.0).min(1.0);
                    sample.specific_force += f * share;
                    sample.angular_rate += w * share;
                }
                number != 0 || time < fails
            });
        let flight = since::<2>(&mission);
        let mean = |source: usize| {
            let mut sums = [Vector3::<f64>::zeros(); 2];
            let mut count = 0.0;
            let outputs = flight.outputs.iter().filter(|output| {
                let time = seconds(output.time - START);
                output.source == source && (time - fails).abs() < 4.0
            });
            for output in outputs {
                let [true_force, true_rate] = mission.truth(seconds(output.time - START));
                sums[0] += output.specific_force.map(f64::from) - true_force;
                sums[1] += output.angular_rate.map(f64::from) - true_rate;
                count += 1.0;
            }
            assert!(count > 100.0, "{}", flight.story());
            sums.map(|sum| sum / count)
        };
        let ([before_force, before_rate], [after_force, after_rate]) = (mean(0), mean(1));
        forces.push((after_force - before_force).norm());
        rates.push((after_rate - before_rate).norm());
    }
    let mean = |steps: &[f64]| steps.iter().sum::<f64>() / steps.len() as f64;
    println!("{:.4} m/s^2, {:.5} rad/s", mean(&forces), mean(&rates));
    assert!(mean(&forces) < 0.005, "{forces:?}");
    assert!(mean(&rates) < 0.001, "{rates:?}");
}
