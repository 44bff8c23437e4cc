//! What the table does: rests at poses and turns between them, as truth at any time.
//!
//! Frames: *level* (x east, y north, z up), *table* (turns with the table) and *case* (the reference's, bolted to the
//! table with `case_from_table`). Rotations are named `to_from`.
//!
//! At rest the specific force is `case_from_table * table_from_level * [0, 0, g]`. Each turn is about one axis that
//! stands still in the table frame and in the level frame alike, so that the attitude during it is
//! `start * exp(axis angle(t))` and the rate of the table is `axis d(angle)/dt`, exactly. The Earth's rate comes on top.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use tumble_core::gravity::EARTH_RATE;

use crate::simulate::stream::{Stream, normal_vector};
use crate::simulate::turn::{Limits, Profile, Turn};

/// Where the table is told to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Direction of `up` in the table frame, unit length.
    pub up: Vector3<f64>,
    /// Angle, rad, by which the table misses this pose about a level axis without saying so; 0 for none.
    pub tip: f64,
}

/// The table, what it is told, and how well it obeys.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Poses in the order they are taken.
    pub poses: Vec<Pose>,
    /// Time at rest at each pose, s.
    pub rest_duration: f64,
    /// Shape of the angular rate over a turn.
    pub profile: Profile,
    /// How fast the table turns.
    pub limits: Limits,
    /// Turn about the vertical after each change of pose, rad; 0 for none.
    pub heading_turn: f64,
    /// Error of the table at each pose, rad, 1 sigma about each of its axes.
    pub error: f64,
    /// Gravity, m/s^2.
    pub gravity: f64,
    /// Latitude, rad; `None` for an Earth that does not turn.
    pub latitude: Option<f64>,
}

/// The table at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Index of the pose.
    pub pose: usize,
    /// Begin, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Rotation by which the table misses the pose it was told: `level_from_table = told * table_error`.
    pub table_error: Rotation3<f64>,
    /// Attitude the table has.
    pub level_from_table: Rotation3<f64>,
}

/// What an ideal unit in the reference's place would say, in the case frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Specific force at the turning centre, m/s^2.
    pub specific_force: Vector3<f64>,
    /// Angular rate, that of the Earth included, rad/s.
    pub angular_rate: Vector3<f64>,
    /// Angular rate of the table alone, rad/s.
    pub turn_rate: Vector3<f64>,
    /// Angular acceleration of the table, rad/s^2.
    pub turn_acceleration: Vector3<f64>,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    Rest {
        end: f64,
        truth: Truth,
    },
    Turning {
        start: f64,
        end: f64,
        turn: Turn,
        level_from_table: Rotation3<f64>,
    },
}

impl Phase {
    fn end(&self) -> f64 {
        match self {
            Phase::Rest { end, .. } | Phase::Turning { end, .. } => *end,
        }
    }
}

/// The motion of a whole session, from time 0 on.
#[derive(Clone, Debug)]
pub struct Motion {
    phases: Vec<Phase>,
    rests: Vec<Rest>,
    gravity: Vector3<f64>,
    earth_rate: Vector3<f64>,
    case_from_table: Rotation3<f64>,
}

impl Motion {
    /// Lays the session out in time; the errors of the table come from `stream`.
    pub fn new(table: &Table, case_from_table: Rotation3<f64>, stream: &mut Stream) -> Self {
        let mut motion = Self {
            phases: Vec::new(),
            rests: Vec::new(),
            gravity: Vector3::z() * table.gravity,
            earth_rate: table.latitude.map_or_else(Vector3::zeros, earth_rate),
            case_from_table,
        };
        let mut told = Rotation3::identity();
        let mut reached: Option<Rotation3<f64>> = None;
        for (index, pose) in table.poses.iter().enumerate() {
            let change = turn_of_up(&(told.inverse() * Vector3::z()), &pose.up);
            let heading = if reached.is_some() {
                pose.up * table.heading_turn
            } else {
                Vector3::zeros()
            };
            told = told * Rotation3::new(change) * Rotation3::new(heading);
            let table_error = Rotation3::new(normal_vector(stream) * table.error) * tip(pose);
            let target = told * table_error;
            if let Some(from) = reached {
                let before_heading = target * Rotation3::new(-heading);
                motion.push_turn(table, from, relative_turn(&from, &before_heading, &change));
                motion.push_turn(table, before_heading, heading);
            }
            motion.push_rest(index, table.rest_duration, table_error, target);
            reached = Some(target);
        }
        motion
    }

    /// End of the session, s.
    pub fn duration(&self) -> f64 {
        self.phases.last().map_or(0.0, Phase::end)
    }

    /// The rests in order of time.
    pub fn rests(&self) -> &[Rest] {
        &self.rests
    }

    /// Rate of the Earth in the level frame, rad/s.
    pub fn earth_rate(&self) -> Vector3<f64> {
        self.earth_rate
    }

    /// Truth at an attitude in which the table stands still.
    pub fn at_rest(&self, level_from_table: &Rotation3<f64>) -> Truth {
        let case_from_level = self.case_from_table * level_from_table.inverse();
        Truth {
            specific_force: case_from_level * self.gravity,
            angular_rate: case_from_level * self.earth_rate,
            turn_rate: Vector3::zeros(),
            turn_acceleration: Vector3::zeros(),
        }
    }

    /// Truth at time `t`, s; before the begin and after the end the table is at rest.
    ///
    /// # Panics
    /// Where the session has no pose.
    pub fn truth(&self, t: f64) -> Truth {
        let phase = self
            .phases
            .partition_point(|phase| phase.end() < t)
            .min(self.phases.len() - 1);
        match &self.phases[phase] {
            Phase::Rest { truth, .. } => *truth,
            Phase::Turning {
                start,
                turn,
                level_from_table,
                ..
            } => self.turning(turn, level_from_table, t - start),
        }
    }

    fn turning(&self, turn: &Turn, level_from_table: &Rotation3<f64>, elapsed: f64) -> Truth {
        let progress = turn.progress(elapsed);
        let (sin, cos) = libm::sincos(progress.angle);
        let to_case = |level: &Vector3<f64>| {
            let at_start = level_from_table.inverse_transform_vector(level);
            self.case_from_table * rotated(&at_start, &turn.axis, -sin, cos)
        };
        let axis = self.case_from_table * turn.axis;
        Truth {
            specific_force: to_case(&self.gravity),
            angular_rate: to_case(&self.earth_rate) + axis * progress.rate,
            turn_rate: axis * progress.rate,
            turn_acceleration: axis * progress.acceleration,
        }
    }

    fn push_rest(
        &mut self,
        pose: usize,
        duration: f64,
        table_error: Rotation3<f64>,
        level_from_table: Rotation3<f64>,
    ) {
        let start = self.duration();
        let end = start + duration;
        self.phases.push(Phase::Rest {
            end,
            truth: self.at_rest(&level_from_table),
        });
        self.rests.push(Rest {
            pose,
            start,
            end,
            table_error,
            level_from_table,
        });
    }

    fn push_turn(&mut self, table: &Table, level_from_table: Rotation3<f64>, rotation: Vector3<f64>) {
        // Rounding alone does not turn a table.
        if rotation.norm() > 1e-12 {
            let turn = Turn::new(rotation, table.profile, &table.limits);
            let start = self.duration();
            self.phases.push(Phase::Turning {
                start,
                end: start + turn.duration,
                turn,
                level_from_table,
            });
        }
    }
}

/// Rate of the Earth at a latitude in rad, level frame, rad/s.
pub fn earth_rate(latitude: f64) -> Vector3<f64> {
    Vector3::new(0.0, libm::cos(latitude), libm::sin(latitude)) * EARTH_RATE
}

/// Rotation vector, table frame, of the shortest turn after which `wanted` points up where `up` did before.
///
/// A table that lies on its back turns over about the next of its axes (X over Y, Y over Z, Z over X), so that six
/// faces in turn rotate about all three.
fn turn_of_up(up: &Vector3<f64>, wanted: &Vector3<f64>) -> Vector3<f64> {
    // In the table frame the world turns the other way.
    let normal = wanted.cross(up);
    let sine = normal.norm();
    let angle = libm::atan2(sine, up.dot(wanted));
    // Sine of an angle too small to have an axis of its own.
    if sine > 1e-9 {
        normal * (angle / sine)
    } else {
        level_axis(up) * angle
    }
}

/// Unit vector at right angles to `up`, as close as can be to the axis after the one `up` is closest to.
fn level_axis(up: &Vector3<f64>) -> Vector3<f64> {
    let mut next = Vector3::zeros();
    next[(up.iamax() + 1) % 3] = 1.0;
    (next - up * up.dot(&next)).normalize()
}

fn tip(pose: &Pose) -> Rotation3<f64> {
    Rotation3::new(level_axis(&pose.up) * pose.tip)
}

/// Rotation vector from one attitude to another, the one that goes round the same way as `like`.
///
/// About half a turn, the shorter way can be the one opposite to what the table was told.
fn relative_turn(from: &Rotation3<f64>, to: &Rotation3<f64>, like: &Vector3<f64>) -> Vector3<f64> {
    let rotation = UnitQuaternion::from_rotation_matrix(&(from.inverse() * to));
    let backwards = like.dot(&rotation.imag()) < 0.0 && like.norm() > core::f64::consts::FRAC_PI_2;
    let (vector, scalar) = if backwards {
        (-rotation.imag(), -rotation.w)
    } else {
        (rotation.imag(), rotation.w)
    };
    let sine = vector.norm();
    if sine == 0.0 {
        vector
    } else {
        vector * (2.0 * libm::atan2(sine, scalar) / sine)
    }
}

/// `v` turned about a unit `axis` by the angle of that sine and cosine (Rodrigues).
fn rotated(v: &Vector3<f64>, axis: &Vector3<f64>, sin: f64, cos: f64) -> Vector3<f64> {
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::stream::{Purpose, stream};
    use proptest::prelude::*;

    const GRAVITY: f64 = 9.81;

    fn table(ups: &[[f64; 3]], profile: Profile, heading_turn: f64, error: f64) -> Table {
        let poses = ups
            .iter()
            .map(|up| Pose {
                up: Vector3::from(*up).normalize(),
                tip: 0.0,
            })
            .collect();
        let limits = Limits {
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

    fn session(table: &Table, seed: u64) -> Motion {
        let mounting = Rotation3::new(Vector3::new(0.02, -0.01, 0.03));
        Motion::new(table, mounting, &mut stream(seed, 0, Purpose::Table))
    }

    /// Attitude after `from` when the true angular rate is followed for the time from `start` to `end`.
    ///
    /// Fourth-order Magnus integration of the angular rate in small steps.
    fn followed(motion: &Motion, from: Rotation3<f64>, start: f64, end: f64) -> Rotation3<f64> {
        let steps = 40_000;
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
            let inertial_from_case = |rest: &Rest, t: f64| {
                // The level frame turns with the Earth.
                Rotation3::new(motion.earth_rate() * t)
                    * rest.level_from_table
                    * motion.case_from_table.inverse()
            };
            let start = inertial_from_case(&pair[0], pair[0].end);
            let end = inertial_from_case(&pair[1], pair[1].start);
            let miss = followed(&motion, start, pair[0].end, pair[1].start).inverse() * end;
            let miss = UnitQuaternion::from_rotation_matrix(&miss).angle();
            assert!(miss < 1e-8, "pose {}: {miss} rad", pair[1].pose);
        }
    }

    #[test]
    fn the_angular_rate_of_a_turn_integrates_to_the_rotation_between_its_rests() {
        for profile in [Profile::Smooth, Profile::Trapezoid] {
            assert_turns_follow_the_exponential_map(&table(&SIX, profile, 0.0, 0.0), 1);
            assert_turns_follow_the_exponential_map(&table(&SIX, profile, 0.7, 1e-3), 2);
            assert_turns_follow_the_exponential_map(&table(&SIX, profile, core::f64::consts::TAU, 1e-3), 3);
        }
    }

    #[test]
    fn six_faces_in_turn_rotate_about_all_three_axes() {
        let motion = session(&table(&SIX, Profile::Smooth, 0.0, 1e-3), 4);
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
            let motion = session(&table(&SIX[..2], Profile::Smooth, 0.0, 1e-2), seed);
            let middle = motion.duration() / 2.0;
            let turn_rate = motion.case_from_table.inverse() * motion.truth(middle).turn_rate;
            assert!(turn_rate.y > 1.4, "seed {seed}: {turn_rate}");
        }
    }

    #[test]
    fn a_tipped_pose_misses_up_by_the_angle_given() {
        let mut table = table(&SIX, Profile::Smooth, 0.0, 0.0);
        table.poses[2].tip = 0.05;
        let motion = session(&table, 1);
        for (rest, pose) in motion.rests().iter().zip(&table.poses) {
            let up = rest.level_from_table.inverse() * Vector3::z();
            assert!((up.angle(&pose.up) - pose.tip).abs() < 1e-7);
        }
    }

    proptest! {
        #[test]
        fn at_rest_the_force_is_gravity_along_the_pose_and_the_rate_is_the_earths(
            x in -1.0..1.0f64, y in -1.0..1.0f64, z in 0.1..1.0f64, seed in any::<u64>(), heading in -7.0..7.0f64,
        ) {
            let ups = [[0.3, -0.2, 0.9], [x, y, z], [-x, -y, -z], [x, y, z]];
            let table = table(&ups, Profile::Smooth, heading, 0.0);
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
        fn table_errors_have_the_sigma_asked_for_and_tilt_the_force_accordingly(seed in any::<u64>()) {
            let table = table(&SIX, Profile::Smooth, 0.0, 1e-3);
            let motion = session(&table, seed);
            for (rest, pose) in motion.rests().iter().zip(&table.poses) {
                let force = motion.case_from_table.inverse() * motion.truth(rest.start + 1.0).specific_force;
                let expected = rest.table_error.inverse() * pose.up * GRAVITY;
                prop_assert!((force - expected).norm() < 1e-9);
                prop_assert!(rest.table_error.angle() < 7e-3, "seven sigma");
            }
        }

        #[test]
        fn the_magnitude_of_the_force_never_changes(t in -5.0..60.0f64, seed in any::<u64>()) {
            let motion = session(&table(&SIX, Profile::Trapezoid, 0.4, 1e-3), seed);
            prop_assert!((motion.truth(t).specific_force.norm() - GRAVITY).abs() < 1e-9);
        }
    }
}
