use super::*;
use crate::simulate::attitude::mounted;
use crate::simulate::floor::Floor;
use crate::simulate::grade::SensorGrade;
use crate::simulate::sensor::Geometry;
use crate::simulate::unit::{Ageing, ClockSetup, ClockTruth, RotationSetup, Warming};
use nalgebra::UnitQuaternion;
use proptest::prelude::*;

const GRAVITY: f64 = 9.81;
const REST: f64 = 4.0;

fn unit(lever_arm: Vector3<f64>, package: Vector3<f64>) -> UnitOnBoard {
    let mut grade = SensorGrade::reference();
    for triad in [&mut grade.accelerometer, &mut grade.gyroscope] {
        triad.noise_density = 0.0;
        triad.turn_on_bias = 0.0;
        triad.range = 1e9;
    }
    let unit = UnitSetup {
        grade,
        geometry: Geometry::Perfect,
        rate: 100.0,
        package_from_case: RotationSetup::Given(package),
        biases: [None; 2],
        ageing: [Ageing::NONE; 2],
        lever_arm,
        clock: ClockSetup::Given(ClockTruth::SESSION),
        latency: 0.0,
        faults: vec![],
    };
    UnitOnBoard { unit, averaging: 0.0 }
}

/// A lively flight of two units without errors.
fn scenario(carrier: Carrier, seed: u64) -> FlightScenario {
    FlightScenario {
        conditions: Conditions {
            seed,
            warming: Warming {
                start: 25.0,
                rise: 0.0,
                time_constant: 1.0,
            },
            bias_instability: false,
            quantisation: false,
            g_sensitivity: false,
        },
        carrier,
        plan: CarrierPlan {
            flights: 2,
            rest: REST,
            moving: 30.0,
            stops: 1,
            stop: 2.0,
            intensity: 1.0,
            sway: [1.0; 3],
            turning: 1.0,
            ground: Floor {
                tilt: 0.06,
                uphill: 0.7,
            },
            gravity: GRAVITY,
        },
        vibration: VibrationSettings {
            specific_force: 0.0,
            angular_rate: 0.0,
            tones: vec![87.0],
            band: (60.0, 140.0),
        },
        vibration_at_rest: 0.0,
        flexing: 0.0,
        case_from_body: mounted(0.3, -0.2, 1.1),
        latitude: None,
        units: vec![
            unit(Vector3::zeros(), Vector3::zeros()),
            unit(Vector3::new(0.11, -0.07, 0.05), Vector3::new(2.0, 0.5, -0.4)),
        ],
    }
}

fn carrier() -> impl Strategy<Value = Carrier> {
    prop_oneof![Just(Carrier::Quadrotor), Just(Carrier::Vehicle)]
}

fn flight(scenario: &FlightScenario) -> Flight {
    Flight::new(scenario)
}

/// Rotation vector, exact for small angles too.
fn vector(rotation: &Rotation3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_rotation_matrix(rotation).scaled_axis()
}

fn shaken(carrier: Carrier) -> FlightScenario {
    let mut scenario = scenario(carrier, 9);
    scenario.vibration.specific_force = 3.0;
    scenario.vibration.angular_rate = 0.05;
    scenario
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn rate_and_acceleration_are_derivatives_of_the_attitude(
        carrier in carrier(), seed in any::<u64>(), part in 0.0..1.0f64,
    ) {
        let flight = flight(&scenario(carrier, seed));
        let (t, h) = (part * flight.duration(), 1e-4);
        let turned = flight.level_from_case(t - h).inverse() * flight.level_from_case(t + h);
        let truth = flight.truth(t);
        prop_assert!((vector(&turned) / (2.0 * h) - truth.angular_rate).amax() < 1e-5);
        let slope = (flight.truth(t + h).angular_rate - flight.truth(t - h).angular_rate) / (2.0 * h);
        prop_assert!((slope - truth.turn_acceleration).amax() < 1e-3, "{slope} {}", truth.turn_acceleration);
    }

    #[test]
    fn specific_force_is_change_of_velocity_less_gravity_in_case(
        carrier in carrier(), seed in any::<u64>(), part in 0.0..1.0f64,
    ) {
        let flight = flight(&scenario(carrier, seed));
        let (t, h) = (part * flight.duration(), 1e-4);
        let change = (flight.velocity(t + h) - flight.velocity(t - h)) / (2.0 * h);
        let level = flight.level_from_case(t) * flight.truth(t).specific_force;
        prop_assert!((change + Vector3::z() * GRAVITY - level).amax() < 1e-3, "{change} {level}");
    }

    #[test]
    fn velocity_and_attitude_advance_by_acceleration_and_rate(carrier in carrier(), seed in any::<u64>()) {
        let flight = flight(&scenario(carrier, seed));
        let h = 0.01;
        for index in (0..(flight.duration() / h) as usize).step_by(7) {
            let t = index as f64 * h;
            let (truth, middle) = (flight.truth(t + h / 2.0), flight.level_from_case(t + h / 2.0));
            let turned = flight.level_from_case(t).inverse() * flight.level_from_case(t + h);
            prop_assert!((vector(&turned) - truth.angular_rate * h).amax() < 1e-4, "at {t} s");
            let gained = flight.velocity(t + h) - flight.velocity(t);
            let expected = (middle * truth.specific_force - Vector3::z() * GRAVITY) * h;
            prop_assert!((gained - expected).amax() < 1e-3, "at {t} s");
        }
    }

    #[test]
    fn at_rest_nothing_moves_and_specific_force_is_gravity(
        carrier in carrier(), seed in any::<u64>(), part in 0.0..1.0f64,
    ) {
        let flight = flight(&scenario(carrier, seed));
        for rest in flight.carrier_motion().rests() {
            let truth = flight.truth(rest.start + part * rest.duration());
            prop_assert_eq!(truth, flight.truth(rest.start));
            prop_assert!((truth.specific_force.norm() - GRAVITY).abs() < 1e-12);
            prop_assert_eq!(truth.angular_rate, Vector3::zeros());
            prop_assert_eq!(truth.turn_acceleration, Vector3::zeros());
        }
        let first = flight.level_from_case(0.0) * mounted(0.3, -0.2, 1.1) * Vector3::z();
        prop_assert!((first.z.acos() - 0.06).abs() < 1e-9, "ground tilt {}", first.z.acos());
    }

    #[test]
    fn a_quadrotor_lands_at_ground_level_and_no_rotor_ever_pulls(seed in any::<u64>()) {
        let flight = flight(&scenario(Carrier::Quadrotor, seed));
        let up = |t| flight.level_from_case(t) * mounted(0.3, -0.2, 1.1) * Vector3::z();
        for rest in flight.carrier_motion().rests() {
            prop_assert!((up(rest.start) - up(0.0)).amax() < 1e-9);
        }
        for index in 0..(flight.duration() * 20.0) as usize {
            prop_assert!(up(index as f64 * 0.05).z > 0.0);
        }
    }

    #[test]
    fn units_without_errors_differ_by_lever_arm_and_mounting_alone(
        carrier in carrier(), seed in any::<u64>(),
    ) {
        let scenario = scenario(carrier, seed);
        let flown = simulate(&scenario).unwrap();
        let (arm, package) = (scenario.units[1].unit.lever_arm, Rotation3::new(Vector3::new(2.0, 0.5, -0.4)));
        let [primary, other] = [&flown.units[0].samples, &flown.units[1].samples];
        prop_assert_eq!(&primary.time, &other.time);
        for (row, t) in primary.time.iter().enumerate() {
            let truth = flown.flight.truth(*t);
            let w = Vector3::from(primary.gyroscope[row]);
            let pull = truth.turn_acceleration.cross(&arm) + w.cross(&w.cross(&arm));
            let force = package * (Vector3::from(primary.accelerometer[row]) + pull);
            prop_assert!((force - Vector3::from(other.accelerometer[row])).amax() < 1e-12);
            prop_assert!((package * w - Vector3::from(other.gyroscope[row])).amax() < 1e-12);
        }
    }
}

#[test]
fn motors_shake_in_motion_only_unless_it_is_never_still() {
    for carrier in [Carrier::Quadrotor, Carrier::Vehicle] {
        let (quiet, mut restless) = (shaken(carrier), shaken(carrier));
        restless.vibration_at_rest = 1.0;
        let scatter = |scenario: &FlightScenario, span: &crate::simulate::time_span::TimeSpan| {
            let (flight, calm) = (flight(scenario), self::scenario(carrier, 9));
            let calm = self::flight(&calm);
            let count = 2000;
            let times = (0..count).map(|i| span.start + span.duration() * f64::from(i) / f64::from(count));
            let square: f64 = times
                .map(|t| (flight.truth(t).specific_force - calm.truth(t).specific_force).norm_squared())
                .sum();
            (square / f64::from(3 * count)).sqrt()
        };
        let flight = flight(&quiet);
        let (rest, manoeuvre) = (
            flight.carrier_motion().rests()[1],
            flight.carrier_motion().manoeuvres()[0],
        );
        assert_eq!(scatter(&quiet, &rest), 0.0);
        assert!((scatter(&restless, &rest) / 3.0 - 1.0).abs() < 0.1);
        assert!((scatter(&quiet, &manoeuvre) / 3.0 - 1.0).abs() < 0.1);
    }
}

#[test]
fn each_place_but_the_primarys_has_vibration_of_its_own() {
    let mut scenario = shaken(Carrier::Quadrotor);
    scenario.units[1] = unit(Vector3::zeros(), Vector3::zeros());
    scenario.flexing = 0.1;
    let flown = simulate(&scenario).unwrap();
    let manoeuvre = flown.flight.carrier_motion().manoeuvres()[0];
    let [primary, other] = [&flown.units[0].samples, &flown.units[1].samples];
    let (mut square, mut count) = (0.0, 0);
    for (row, t) in primary.time.iter().enumerate() {
        let truth = flown.flight.truth(*t).specific_force;
        assert!((truth - Vector3::from(primary.accelerometer[row])).amax() < 1e-12);
        if *t > manoeuvre.start && *t < manoeuvre.end {
            square += (truth - Vector3::from(other.accelerometer[row])).norm_squared();
            count += 3;
        }
    }
    let found = (square / f64::from(count)).sqrt();
    assert!((found / 0.3 - 1.0).abs() < 0.1, "{found}");
}

#[test]
fn a_filtered_unit_reads_vibration_as_its_mean_over_the_period() {
    let mut scenario = shaken(Carrier::Quadrotor);
    scenario.units[0].averaging = 0.01;
    let flown = simulate(&scenario).unwrap();
    let samples = &flown.units[0].samples;
    let truths = flown.flight.truths(&samples.time, 0.01);
    for (row, truth) in truths.iter().enumerate() {
        assert!((truth.specific_force - Vector3::from(samples.accelerometer[row])).amax() < 1e-12);
    }
    let at_an_instant = flown.flight.truths(&samples.time, 0.0);
    let apart =
        |(mean, instant): (&TrueMotion, &TrueMotion)| (mean.specific_force - instant.specific_force).amax();
    assert!(truths.iter().zip(&at_an_instant).map(apart).fold(0.0, f64::max) > 1.0);
}

#[test]
fn less_intensity_is_less_motion_and_none_still_takes_off() {
    for carrier in [Carrier::Quadrotor, Carrier::Vehicle] {
        let liveliness = |intensity: f64| {
            let mut scenario = scenario(carrier, 5);
            scenario.plan.intensity = intensity;
            let flight = flight(&scenario);
            let times = (0..5000).map(|i| flight.duration() * f64::from(i) / 5000.0);
            times
                .map(|t| (flight.truth(t).angular_rate.norm(), flight.velocity(t).norm()))
                .fold((0.0_f64, 0.0_f64), |most, (rate, speed)| {
                    (most.0.max(rate), most.1.max(speed))
                })
        };
        let [none, some, most] = [0.0, 0.4, 1.0].map(liveliness);
        assert!(
            none.0 < 0.1 && none.0 < some.0 && some.0 < most.0,
            "{none:?} {some:?} {most:?}"
        );
        assert!(none.1 > 1.0);
    }
}

#[test]
fn a_quadrotor_keeps_its_heading_and_can_turn_about_up_alone() {
    let mut turning = scenario(Carrier::Quadrotor, 6);
    turning.plan.sway = [0.0; 3];
    turning.plan.ground.tilt = 0.0;
    turning.case_from_body = Rotation3::identity();
    let flight = flight(&turning);
    let manoeuvre = flight.carrier_motion().manoeuvres()[0];
    let middle = (manoeuvre.start + manoeuvre.end) / 2.0;
    let truth = flight.truth(middle);
    assert!((truth.specific_force - Vector3::z() * GRAVITY).amax() < 1e-12);
    assert!(truth.angular_rate.xy().amax() < 1e-12 && truth.angular_rate.z.abs() > 1e-3);
    let mut straight = scenario(Carrier::Quadrotor, 6);
    straight.plan.turning = 0.0;
    straight.case_from_body = Rotation3::identity();
    let forward = self::flight(&straight).level_from_case(middle) * Vector3::x();
    assert!(forward.y.abs() < 1e-12);
}

#[test]
fn one_more_unit_changes_nothing_for_the_others() {
    let two = scenario(Carrier::Vehicle, 8);
    let mut three = two.clone();
    three.units.push(unit(Vector3::x(), Vector3::zeros()));
    assert_eq!(
        simulate(&two).unwrap().units[..],
        simulate(&three).unwrap().units[..2]
    );
}

#[test]
fn ageing_moves_the_bias_as_stated_and_leaves_other_draws_alone() {
    let mut scenario = scenario(Carrier::Vehicle, 8);
    scenario.units[1].unit.grade = SensorGrade::consumer();
    scenario.units[1].unit.geometry = Geometry::Drawn;
    let young = simulate(&scenario).unwrap().units[1].clone();
    scenario.units[1].unit.ageing = [Ageing::Drawn(2.0), Ageing::Given(Vector3::new(0.1, 0.0, -0.2))];
    let old = simulate(&scenario).unwrap().units[1].clone();
    assert_eq!(young.truth.ageing, [Vector3::zeros(); 2]);
    assert_eq!(old.truth.ageing[1], Vector3::new(0.1, 0.0, -0.2));
    for (before, after, aged) in [
        (
            young.truth.accelerometer,
            old.truth.accelerometer,
            old.truth.ageing[0],
        ),
        (young.truth.gyroscope, old.truth.gyroscope, old.truth.ageing[1]),
    ] {
        assert!(aged.amax() > 1e-3);
        assert!((after.model.bias - before.model.bias - aged).amax() < 1e-15);
        assert_eq!(after.model.matrix, before.model.matrix);
    }
    let moved = Vector3::from(old.samples.gyroscope[7]) - Vector3::from(young.samples.gyroscope[7]);
    assert!((moved - old.truth.ageing[1]).amax() < 1e-12);
}

#[test]
fn a_scenario_that_makes_no_sense_is_refused_with_its_figure() {
    let mut scenario = scenario(Carrier::Vehicle, 8);
    scenario.units[1].unit.rate = 0.0;
    assert_eq!(
        simulate(&scenario).err().map(|error| error.to_string()),
        Some("sample rate, Hz, has to be positive, found 0".into())
    );
    scenario.units[1].unit.rate = 100.0;
    scenario.plan.rest = 1e9;
    assert!(matches!(simulate(&scenario), Err(ScenarioError::TooLong { .. })));
}
