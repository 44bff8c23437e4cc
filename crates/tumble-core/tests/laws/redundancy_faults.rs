//! Wrong calibrations are not adopted: of a primary that is wrong, or becomes wrong; of two wrong alike; of a bias that
//! jumps.

use nalgebra::{Matrix3, Vector3};
use tumble_core::real::Real;
use tumble_core::redundancy::fit::adoption::{AdoptionRefusal, RefusalReason};
use tumble_core::redundancy::gate::Withheld;
use tumble_core::redundancy::monitor::event::{Abandoned, EventKind};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::{Gate, RedundancySettings};

use crate::common::cast;
use crate::redundancy_mission::{
    Flight, Mission, Part, Phase, assert_holds, assert_told, fly, platform, settings, units,
};

const SEED: u64 = 4;

fn gated<T: Real>(gate: Gate) -> RedundancySettings<T> {
    let mut settings = settings();
    settings.evaluation.gate = gate;
    settings
}

fn flown<T: Real>(settings: RedundancySettings<T>, parts: [Part; 2], mission: &Mission) -> Flight<T, 2> {
    fly(&platform(settings, units(&parts)), mission)
}

fn aged_beside(primary: Part) -> [Part; 2] {
    [primary, Part::aged()]
}

/// A law in both precisions.
macro_rules! in_both {
    ($name:ident, $law:ident) => {
        #[test]
        fn $name() {
            $law::<f32>();
            $law::<f64>();
        }
    };
}

fn calibrates<T: Real>() {
    for seed in SEED..SEED + 3 {
        let parts = aged_beside(Part::exact());
        let flight = flown::<T>(settings(), parts, &Mission::new(seed, &parts));
        for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
            let adopted = flight.adopted(1, sensor);
            assert_eq!(adopted.len(), 1, "{}", flight.story());
            assert_holds(&adopted[0], &parts[1], seed);
        }
    }
}
in_both!(
    a_secondary_beside_a_sound_primary_is_found_as_it_is_within_five_sigma,
    calibrates
);

fn withholds<T: Real>() {
    let wrong = Part::exact().biased([0.0, 0.0, 0.5], [0.0; 3]);
    let parts = aged_beside(wrong);
    let mission = Mission::new(SEED, &parts);
    for gate in [Gate::WholePrimary, Gate::SensorBySensor] {
        let flight = flown::<T>(gated(gate), parts, &mission);
        let why = Withheld::PrimaryInvalid;
        assert_told!(flight, 1, EventKind::Withheld { sensor: Sensor::Accelerometer, why: found } if *found == why);
        assert!(
            flight.adopted(1, Sensor::Accelerometer).is_empty(),
            "{}",
            flight.story()
        );
        let gyroscopes = flight.adopted(1, Sensor::Gyroscope).len();
        assert_eq!(
            gyroscopes,
            usize::from(gate == Gate::SensorBySensor),
            "{}",
            flight.story()
        );
    }
    let flight = flown::<T>(gated(Gate::SecondaryAlone), parts, &mission);
    assert_told!(
        flight,
        1,
        EventKind::Triggered {
            sensors: [true, true]
        }
    );
    assert_eq!(
        flight.adopted(1, Sensor::Accelerometer).len(),
        1,
        "{}",
        flight.story()
    );
}
in_both!(
    with_the_primary_wrong_at_the_trigger_only_the_secondary_alone_gate_calibrates_against_it,
    withholds
);

fn abandons_at_rest<T: Real>() {
    let parts = aged_beside(Part::exact());
    let moves = (4.0, Phase::Free(1.0));
    let mission = Mission::new(SEED, &parts)
        .phases(&[(2.5, Phase::Rest), moves, (3.0, Phase::Rest), moves])
        .spoilt(|unit, time, sample| {
            if unit == 0 && time > 5.0 {
                sample.specific_force.z += 0.4;
            }
            true
        });
    let flight = flown::<T>(settings(), parts, &mission);
    assert_told!(flight, 1, EventKind::MotionBegan);
    assert_told!(flight, 1, 1 x EventKind::Abandoned { why: Abandoned::PrimaryInvalid });
    assert_told!(flight, 1, 0 x EventKind::Adopted { .. });
}
in_both!(
    pairs_are_thrown_away_when_a_rest_between_shows_the_primary_wrong,
    abandons_at_rest
);

fn abandons_in_ill_health<T: Real>(unit: usize, why: Abandoned) {
    let parts = aged_beside(Part::exact());
    let mission = Mission::new(SEED, &parts).spoilt(move |number, time, sample| {
        if number == unit && time > 6.0 {
            sample.angular_rate.y = f64::NAN;
        }
        true
    });
    let flight = flown::<T>(settings(), parts, &mission);
    assert_told!(flight, unit, EventKind::Unhealthy { .. });
    assert_told!(flight, 1, 1 x EventKind::Abandoned { why: found } if *found == why);
    assert_told!(flight, 1, 0 x EventKind::Adopted { .. });
}

#[test]
fn pairs_are_dropped_when_either_unit_fails_while_they_collect() {
    for (unit, why) in [
        (0, Abandoned::PrimaryUnhealthy),
        (1, Abandoned::SecondaryUnhealthy),
    ] {
        abandons_in_ill_health::<f32>(unit, why);
        abandons_in_ill_health::<f64>(unit, why);
    }
}

#[test]
fn pairs_are_kept_where_a_unit_pauses_for_a_while() {
    for unit in [0, 1] {
        let parts = aged_beside(Part::exact());
        let mission = Mission::new(SEED, &parts)
            .spoilt(move |number, time, _| number != unit || !(6.0..6.4).contains(&time));
        let flight = flown::<f32>(settings(), parts, &mission);
        assert_told!(flight, unit, 1 x EventKind::Unhealthy { .. });
        assert_told!(flight, 1, 0 x EventKind::Abandoned { .. });
        for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
            assert_eq!(flight.adopted(1, sensor).len(), 1, "{}", flight.story());
        }
    }
}

fn refuses_a_jump<T: Real>() {
    for unit in [0, 1] {
        for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
            let parts = aged_beside(Part::exact());
            let mission = Mission::new(SEED, &parts).spoilt(move |number, time, sample| {
                if number == unit && time > 7.0 {
                    match sensor {
                        Sensor::Accelerometer => sample.specific_force.y += 0.4,
                        Sensor::Gyroscope => sample.angular_rate.y += 0.04,
                    }
                }
                true
            });
            let flight = flown::<T>(settings(), parts, &mission);
            assert_told!(flight, 1, EventKind::Refused {
                sensor: found, why: AdoptionRefusal::Exceeds(RefusalReason::Drifting | RefusalReason::DisagreesWithRest, _)
            } if *found == sensor);
            assert!(flight.adopted(1, sensor).is_empty(), "{}", flight.story());
        }
    }
}
in_both!(
    a_bias_that_jumps_in_motion_whosever_it_is_is_never_adopted,
    refuses_a_jump
);

fn wrong_alike<T: Real>() {
    let wrong = Part::exact().biased([0.0, 0.0, 0.4], [0.0, 0.0, 0.03]);
    let parts = [wrong, wrong];
    let mission = Mission::new(SEED, &parts);
    let flight = flown::<T>(gated(Gate::WholePrimary), parts, &mission);
    for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
        assert_told!(flight, 1, EventKind::Withheld { sensor: found, why: Withheld::PrimaryInvalid } if *found == sensor);
    }
    assert_told!(flight, 1, 0 x EventKind::Triggered { .. });
    let flight = flown::<T>(gated(Gate::SecondaryAlone), parts, &mission);
    for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
        assert_told!(flight, 1, EventKind::Refused { sensor: found, why: AdoptionRefusal::Exceeds(RefusalReason::NotBetter, _) } if *found == sensor);
    }
    assert_told!(flight, 1, 0 x EventKind::Adopted { .. });
}
in_both!(
    two_units_wrong_alike_are_withheld_by_the_primary_gates_and_refused_as_not_better_without,
    wrong_alike
);

fn missing<T: Real>() {
    let parts = [Part::exact(), Part::aged(), Part::aged()];
    let mission = Mission::new(SEED, &parts).spoilt(|unit, _, _| unit != 2);
    let flight = fly::<T, 3>(&platform(settings(), units(&parts)), &mission);
    assert_told!(flight, 2, 1 x EventKind::Unhealthy { .. });
    assert_told!(flight, 2, 0 x EventKind::Evaluated { .. });
    assert_holds(&flight.adopted(1, Sensor::Accelerometer)[0], &parts[1], SEED);
}
in_both!(
    a_unit_missing_from_the_start_is_late_and_keeps_nobody_else_from_being_calibrated,
    missing
);

fn rotated<T: Real>() {
    // A quarter turn about z after half a turn about x.
    let turn = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    let mut secondary = Part::aged();
    for model in &mut secondary.errors {
        model.matrix *= turn;
        model.bias = turn * model.bias;
    }
    let parts = aged_beside(Part::exact());
    let parts = [parts[0], secondary];
    let mission = Mission::new(SEED, &parts);
    let mut set = units::<T, 2>(&parts);
    let flight = fly(&platform(settings(), set), &mission);
    for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
        assert_told!(flight, 1, EventKind::Refused {
            sensor: found, why: AdoptionRefusal::Exceeds(RefusalReason::ImplausibleMisalignment, _)
        } if *found == sensor);
    }
    assert_told!(flight, 1, 0 x EventKind::Adopted { .. });
    set[1].sensor_from_primary = cast(&turn);
    let flight = fly(&platform(settings(), set), &mission);
    for sensor in [Sensor::Accelerometer, Sensor::Gyroscope] {
        let adopted = flight.adopted(1, sensor);
        assert_eq!(adopted.len(), 1, "{}", flight.story());
        assert_holds(&adopted[0], &secondary, SEED);
    }
}
in_both!(
    a_rotated_secondary_is_refused_unless_its_rotation_is_given_and_then_recorded_whole,
    rotated
);

#[test]
fn a_mission_has_its_lever_arm_in_the_secondary_alone() {
    let part = Part {
        noise: [0.0; 2],
        ..Part::exact()
    };
    let away = Part {
        lever_arm: Vector3::new(0.5, 0.0, 0.0),
        ..part
    };
    let samples = Mission::new(SEED, &[part, away]).samples();
    let apart = |(a, b): (&Vector3<f64>, &Vector3<f64>)| (a - b).norm();
    let pairs = samples.chunks(2).map(|two| (&two[0].1, &two[1].1));
    let forces = pairs
        .clone()
        .map(|(a, b)| apart((&a.specific_force, &b.specific_force)));
    let rates = pairs.map(|(a, b)| apart((&a.angular_rate, &b.angular_rate)));
    assert!(forces.fold(0.0, f64::max) > 1.0);
    assert!(rates.fold(0.0, f64::max) < 1e-12);
}
