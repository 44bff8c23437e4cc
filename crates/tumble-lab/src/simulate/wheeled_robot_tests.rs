use super::*;
use crate::simulate::attitude::mounted;
use crate::simulate::stream::{StreamPurpose, stream};
use proptest::prelude::*;
use tumble_core::gravity::EARTH_RATE;

const GRAVITY: f64 = 9.81;
const LATITUDE: f64 = 0.84;

fn plan(steps: Vec<RobotStep>) -> RobotPlan {
    RobotPlan {
        steps,
        floor: Floor {
            tilt: 0.05,
            uphill: 0.7,
        },
        acceleration: 2.0,
        unevenness: (0.3, 0.9),
        slips: 1.0,
        vibration: 0.0,
        disturbances: Vec::new(),
        case_from_floor: mounted(0.4, -0.2, 2.0),
        gravity: GRAVITY,
        latitude: Some(LATITUDE),
    }
}

fn played(plan: RobotPlan) -> RobotMotion {
    RobotMotion::new(plan, &mut stream(17, 1, StreamPurpose::Floor))
}

fn rest(duration: f64) -> RobotStep {
    RobotStep::Rest {
        duration,
        slow_turn: 0.0,
    }
}

fn turn(angle: f64, rate: f64) -> RobotStep {
    RobotStep::Turn { angle, rate }
}

const SPEED: f64 = 0.8;
const DRIVE: f64 = 6.0;

/// Rests, turns both ways, and a drive round a bend from one tilted floor to another.
fn everything() -> RobotPlan {
    let floor = Floor {
        tilt: 0.11,
        uphill: -2.0,
    };
    let drive = RobotStep::Drive {
        duration: DRIVE,
        speed: SPEED,
        bend: 0.9,
        floor,
    };
    plan(vec![
        rest(1.0),
        turn(5.0, 1.0),
        drive,
        rest(0.5),
        turn(-4.0, 2.0),
        rest(1.0),
    ])
}

/// Attitudes at times `k h`: the turning rate is integrated from the first, at which the accelerometers give up.
///
/// Magnus integration, fourth order.
fn followed(motion: &RobotMotion, h: f64) -> Vec<(f64, Rotation3<f64>)> {
    let up = motion.truth(0.0).specific_force;
    let first = Rotation3::rotation_between(&up, &Vector3::z()).expect("neither up nor down");
    let gauss = 3.0_f64.sqrt() / 6.0;
    let count = (motion.duration() / h) as usize;
    let mut attitudes = vec![(0.0, first)];
    for k in 0..count {
        let middle = (k as f64 + 0.5) * h;
        let w1 = motion.truth(middle - gauss * h).turn_rate;
        let w2 = motion.truth(middle + gauss * h).turn_rate;
        let exponent = (w1 + w2) * (h / 2.0) + w1.cross(&w2) * (h * h * 3.0_f64.sqrt() / 12.0);
        let last = attitudes[k].1;
        attitudes.push(((k + 1) as f64 * h, last * Rotation3::new(exponent)));
    }
    attitudes
}

/// When the drive of `motion` begins.
fn drive_start(motion: &RobotMotion) -> f64 {
    let drive = |timed: &&TimedStep| matches!(timed.step, RobotStep::Drive { .. });
    motion.steps.iter().find(drive).expect("a drive").span.start
}

#[test]
fn specific_force_is_gravity_and_the_change_of_world_velocity() {
    let motion = played(everything());
    let (start, forward) = (drive_start(&motion), motion.plan.case_from_floor * Vector3::x());
    let h = 1e-3;
    let velocity = |(t, world_from_case): &(f64, Rotation3<f64>)| {
        let part = ((t - start) / DRIVE).clamp(0.0, 1.0);
        world_from_case * forward * (SPEED / 2.0 * (1.0 - (TAU * part).cos()))
    };
    for three in followed(&motion, h).windows(3) {
        let [before, (t, world_from_case), after] = three else {
            unreachable!("windows of three")
        };
        let change = (velocity(after) - velocity(before)) / (2.0 * h);
        let expected = change + Vector3::z() * GRAVITY;
        let miss = (world_from_case * motion.truth(*t).specific_force - expected).amax();
        // The raised cosine bends sharply where a drive begins and ends.
        assert!(miss < 2e-4, "at {t} s: {miss} m/s^2");
    }
}

#[test]
fn a_lifted_robot_feels_changes_of_height_and_tilt() {
    let lifted = Disturbance {
        start: 2.5,
        duration: 1.2,
        tilt: 0.3,
        lift: 0.2,
    };
    let motion = played(RobotPlan {
        disturbances: vec![lifted],
        ..plan(vec![rest(1.0), turn(5.0, 1.0)])
    });
    let height = |t: f64| {
        let part = ((t - lifted.start) / lifted.duration).clamp(0.0, 1.0);
        lifted.lift * (PI * part).sin().powi(2)
    };
    let h = 1e-3;
    for (t, world_from_case) in followed(&motion, h) {
        let ends = [lifted.start, lifted.start + lifted.duration];
        if ends.iter().any(|end| (t - end).abs() < 2.0 * h) {
            continue;
        }
        let pull = (height(t + h) - 2.0 * height(t) + height(t - h)) / (h * h);
        let expected = Vector3::z() * (GRAVITY + pull);
        let miss = (world_from_case * motion.truth(t).specific_force - expected).amax();
        assert!(miss < 2e-4, "at {t} s: {miss} m/s^2");
    }
}

#[test]
fn angular_acceleration_is_the_derivative_of_the_angular_rate() {
    let motion = played(RobotPlan {
        disturbances: vec![Disturbance {
            start: 3.0,
            duration: 1.0,
            tilt: 0.3,
            lift: 0.1,
        }],
        ..everything()
    });
    let h = 1e-5;
    let count = 5000;
    for k in 0..count {
        let t = motion.duration() * (f64::from(k) + 0.5) / f64::from(count);
        let rate = |t| motion.truth(t).turn_rate;
        let miss = ((rate(t + h) - rate(t - h)) / (2.0 * h) - motion.truth(t).turn_acceleration).amax();
        // The acceleration steps by at most tilt 2 pi^2 / duration^2 where the disturbance begins and ends.
        let at_a_step = [3.0, 4.0].iter().any(|step: &f64| (t - step).abs() < h);
        assert!(at_a_step || miss < 1e-4, "at {t} s: {miss} rad/s^2");
    }
}

#[test]
fn the_earths_rate_is_constant_in_the_world_north_and_up() {
    let motion = played(plan(vec![rest(1.0), turn(5.0, 1.0), turn(-2.0, 1.0)]));
    let earth = |t: f64| {
        let truth = motion.truth(t);
        truth.angular_rate - truth.turn_rate
    };
    let attitudes = followed(&motion, 1e-2);
    let first = attitudes[0].1 * earth(0.0);
    assert!((first.norm() - EARTH_RATE).abs() < 1e-15);
    assert!((first.z - EARTH_RATE * LATITUDE.sin()).abs() < 1e-15);
    let ahead = attitudes[0].1 * (motion.plan.case_from_floor * Vector3::x());
    assert!(first.xy().perp(&ahead.xy()).abs() < 1e-15, "north is not ahead");
    for (t, world_from_case) in attitudes {
        assert!((world_from_case * earth(t) - first).amax() < 1e-9 * EARTH_RATE.sqrt());
    }
}

#[test]
fn a_robot_at_rest_feels_gravity_alone_on_either_floor() {
    let motion = played(RobotPlan {
        vibration: 3.0,
        ..everything()
    });
    for span in motion.rests() {
        let truth = motion.truth((span.start + span.end) / 2.0);
        assert!((truth.specific_force.norm() - GRAVITY).abs() < 1e-12);
        assert_eq!(truth.turn_rate.norm(), 0.0);
    }
    let normal = motion.plan.case_from_floor * Vector3::z();
    let tilt = |t: f64| motion.truth(t).specific_force.angle(&normal);
    assert!((tilt(0.5) - 0.05).abs() < 1e-9);
    assert!((tilt(motion.duration() - 0.5) - 0.11).abs() < 1e-9);
}

#[test]
fn wheels_turn_in_turns_drives_and_slow_turns_and_in_no_rest() {
    let motion = played(plan(vec![
        rest(1.0),
        RobotStep::Rest {
            duration: 1.0,
            slow_turn: 0.01,
        },
        turn(1.0, 1.0),
    ]));
    assert_eq!(
        [0.5, 1.5, 2.5].map(|t| motion.wheels_turn(t)),
        [false, true, true]
    );
    assert!((motion.turning(2.0).heading - 0.01).abs() < 1e-15);
}

proptest! {
    #[test]
    fn a_turn_never_reverses_and_its_rates_are_derivatives(
        angle in 0.1..20.0f64, left in any::<bool>(), rate in 0.1..4.0f64, depth in 0.0..0.9f64,
        slips in 0.0..3.0f64, part in 0.001..0.999f64,
    ) {
        let way = if left { 1.0 } else { -1.0 };
        let motion = played(RobotPlan { unevenness: (depth, 0.9), slips, ..plan(vec![turn(way * angle, rate)]) });
        let (t, h) = (part * motion.duration(), 1e-6);
        let (before, now, after) = (motion.turning(t - h), motion.turning(t), motion.turning(t + h));
        prop_assert!(now.rate * way >= 0.0, "{now:?}");
        prop_assert!((now.rate - (after.heading - before.heading) / (2.0 * h)).abs() < 1e-6);
        let bound = 1e-4 * (1.0 + now.acceleration.abs());
        prop_assert!((now.acceleration - (after.rate - before.rate) / (2.0 * h)).abs() < bound);
    }

    #[test]
    fn a_turn_makes_its_angle_less_slips_however_uneven(
        angle in 0.1..20.0f64, rate in 0.1..4.0f64, depth in 0.0..0.9f64,
    ) {
        let turned = |slips| {
            let steps = vec![turn(-angle, rate)];
            played(RobotPlan { unevenness: (depth, 0.9), slips, ..plan(steps) }).turns()[0].1
        };
        prop_assert!((turned(0.0) + angle).abs() < 1e-9);
        // Time at full rate for each of the slips.
        let (count, ramp) = ((angle * 2.0 / TAU).round(), FRAC_PI_2 * rate / 2.0);
        let room = count > 0.0 && angle / rate - ramp > count * (SHORTEST_SLIP + 1e-9);
        let lost = turned(2.0) + angle;
        prop_assert!(if room { lost > 0.0 } else { lost >= -1e-9 }, "{lost}");
        prop_assert!(lost < angle);
    }

    #[test]
    fn an_even_turn_keeps_within_its_limits_and_reaches_one_of_them(
        angle in 0.1..20.0f64, rate in 0.1..4.0f64, acceleration in 0.2..10.0f64,
    ) {
        let steps = vec![turn(angle, rate)];
        let motion = played(RobotPlan { unevenness: (0.0, 0.9), slips: 0.0, acceleration, ..plan(steps) });
        let along = (0..=2000).map(|k| motion.turning(motion.duration() * f64::from(k) / 2000.0));
        let (mut fastest, mut steepest) = (0.0_f64, 0.0_f64);
        for turning in along {
            fastest = fastest.max(turning.rate);
            steepest = steepest.max(turning.acceleration.abs());
        }
        prop_assert!(fastest < rate * (1.0 + 1e-9) && steepest < acceleration * (1.0 + 1e-9));
        prop_assert!(fastest > 0.99 * rate || steepest > 0.99 * acceleration);
    }

    #[test]
    fn the_bearing_reported_is_that_of_x_projected_onto_the_floor(
        roll in -3.0..3.0f64, pitch in -1.4..1.4f64, yaw in -3.0..3.0f64, bearing in -3.0..3.0f64,
    ) {
        let case_from_floor = mounted(roll, pitch, yaw);
        let direction = case_from_floor * Vector3::new(bearing.cos(), bearing.sin(), 0.0);
        let up = case_from_floor * Vector3::z();
        let ahead = (Vector3::x() - up * up.x).normalize();
        let reported = reported_bearing(&case_from_floor, bearing);
        let expected = ahead * reported.cos() + up.cross(&ahead) * reported.sin();
        prop_assert!((direction - expected).amax() < 1e-9);
    }
}
