use super::*;
use crate::simulate::stream::{StreamPurpose, stream};
use proptest::prelude::*;
use tumble_core::gravity::EARTH_RATE;

const GRAVITY: f64 = 9.81;

fn table(ups: &[[f64; 3]], profile: TurnProfile, heading_turn: f64, error: f64) -> Table {
    let poses = ups
        .iter()
        .map(|up| TablePose {
            up: Vector3::from(*up).normalize(),
            tip: 0.0,
        })
        .collect();
    let limits = TurnLimits {
        rate: 1.5,
        acceleration: 3.0,
    };
    let latitude = Some(0.84);
    Table {
        poses,
        rest_duration: 2.0,
        profile,
        limits,
        heading_turn,
        rates: Vec::new(),
        rate_duration: 0.0,
        error,
        gravity: GRAVITY,
        latitude,
    }
}

const SIX: [[f64; 3]; 6] = [
    [1., 0., 0.],
    [-1., 0., 0.],
    [0., 1., 0.],
    [0., -1., 0.],
    [0., 0., 1.],
    [0., 0., -1.],
];

fn session(table: &Table, seed: u64) -> TableMotion {
    let mounting = Rotation3::new(Vector3::new(0.02, -0.01, 0.03));
    TableMotion::new(table, mounting, &mut stream(seed, 0, StreamPurpose::Table))
}

/// Attitude after `from` when the true angular rate is followed for the time from `start` to `end`.
///
/// Magnus integration of the angular rate in small steps: fourth order, second at the corners of a trapezoid, which
/// leaves a few 1e-7 rad.
fn followed(motion: &TableMotion, from: Rotation3<f64>, start: f64, end: f64) -> Rotation3<f64> {
    let steps = 4000;
    let h = (end - start) / f64::from(steps);
    let gauss = 3.0_f64.sqrt() / 6.0;
    let mut attitude = from;
    for i in 0..steps {
        let middle = start + (f64::from(i) + 0.5) * h;
        let w1 = motion.truth(middle - gauss * h).angular_rate;
        let w2 = motion.truth(middle + gauss * h).angular_rate;
        let exponent = (w1 + w2) * (h / 2.0) + w1.cross(&w2) * (h * h * 3.0_f64.sqrt() / 12.0);
        attitude *= Rotation3::new(exponent);
    }
    attitude
}

fn assert_turns_follow_the_exponential_map(table: &Table, seed: u64) {
    let motion = session(table, seed);
    for pair in motion.rests().windows(2) {
        let inertial_from_case = |rest: &TableRest, t: f64| {
            // The level frame turns with the Earth.
            Rotation3::new(motion.earth_rate() * t) * rest.level_from_table * motion.case_from_table.inverse()
        };
        let start = inertial_from_case(&pair[0], pair[0].end);
        let end = inertial_from_case(&pair[1], pair[1].start);
        let miss = followed(&motion, start, pair[0].end, pair[1].start).inverse() * end;
        let miss = UnitQuaternion::from_rotation_matrix(&miss).angle();
        assert!(miss < 1e-6, "pose {}: {miss} rad", pair[1].pose);
    }
}

#[test]
fn the_rate_of_a_turn_integrates_to_the_rotation_between_rests() {
    for profile in [TurnProfile::Smooth, TurnProfile::Trapezoid] {
        assert_turns_follow_the_exponential_map(&table(&SIX, profile, 0.0, 0.0), 1);
        assert_turns_follow_the_exponential_map(&table(&SIX, profile, 0.7, 1e-3), 2);
        assert_turns_follow_the_exponential_map(&table(&SIX, profile, core::f64::consts::TAU, 1e-3), 3);
    }
}

#[test]
fn six_faces_in_turn_rotate_about_all_three_axes() {
    let motion = session(&table(&SIX, TurnProfile::Smooth, 0.0, 1e-3), 4);
    let mut turned = Vector3::zeros();
    for i in 0..10_000 {
        let rate = motion
            .truth(motion.duration() * f64::from(i) / 10_000.0)
            .turn_rate;
        turned = turned.sup(&rate.abs());
    }
    assert!(turned.min() > 0.9, "{turned}");
}

#[test]
fn a_half_turn_with_table_errors_goes_round_the_way_it_was_told() {
    for seed in 0..50 {
        let motion = session(&table(&SIX[..2], TurnProfile::Smooth, 0.0, 1e-2), seed);
        let middle = motion.duration() / 2.0;
        let turn_rate = motion.case_from_table.inverse() * motion.truth(middle).turn_rate;
        assert!(turn_rate.y > 1.4, "seed {seed}: {turn_rate}");
    }
}

#[test]
fn a_tipped_pose_misses_up_by_the_angle_given() {
    let mut table = table(&SIX, TurnProfile::Smooth, 0.0, 0.0);
    table.poses[2].tip = 0.05;
    let motion = session(&table, 1);
    for (rest, pose) in motion.rests().iter().zip(&table.poses) {
        let up = rest.level_from_table.inverse() * Vector3::z();
        assert!((up.angle(&pose.up) - pose.tip).abs() < 1e-7);
    }
}

proptest! {
    #[test]
    fn at_rest_force_is_gravity_at_the_pose_and_rate_is_the_earths(
        x in -1.0..1.0f64, y in -1.0..1.0f64, z in 0.1..1.0f64, seed in any::<u64>(), heading in -7.0..7.0f64,
    ) {
        let ups = [[0.3, -0.2, 0.9], [x, y, z], [-x, -y, -z], [x, y, z]];
        let table = table(&ups, TurnProfile::Smooth, heading, 0.0);
        let motion = session(&table, seed);
        for (rest, pose) in motion.rests().iter().zip(&table.poses) {
            let truth = motion.truth((rest.start + rest.end) / 2.0);
            let expected = motion.case_from_table * pose.up * GRAVITY;
            prop_assert!((truth.specific_force - expected).norm() < 1e-9);
            prop_assert!((truth.angular_rate.norm() - EARTH_RATE).abs() < 1e-15);
            // Earth rate and up enclose the same angle everywhere: 90 degrees less latitude.
            let sine = truth.angular_rate.dot(&truth.specific_force) / EARTH_RATE / GRAVITY;
            prop_assert!((sine - 0.84_f64.sin()).abs() < 1e-9);
        }
    }

    #[test]
    fn table_errors_have_the_stated_sigma_and_tilt_the_force(seed in any::<u64>()) {
        let table = table(&SIX, TurnProfile::Smooth, 0.0, 1e-3);
        let motion = session(&table, seed);
        for (rest, pose) in motion.rests().iter().zip(&table.poses) {
            let force = motion.case_from_table.inverse() * motion.truth(rest.start + 1.0).specific_force;
            let expected = rest.table_error.inverse() * pose.up * GRAVITY;
            prop_assert!((force - expected).norm() < 1e-9);
            prop_assert!(rest.table_error_vector().amax() < 7e-3, "seven sigma");
        }
    }

    #[test]
    fn the_magnitude_of_the_force_never_changes(t in -5.0..60.0f64, seed in any::<u64>()) {
        let motion = session(&table(&SIX, TurnProfile::Trapezoid, 0.4, 1e-3), seed);
        prop_assert!((motion.truth(t).specific_force.norm() - GRAVITY).abs() < 1e-9);
    }
}
