//! Motion of the table: rests at poses and turns between them, as truth at any time.
//!
//! Frames: *level* (x east, y north, z up), *table* (turns with the table) and *case* (the reference's, bolted to the
//! table with `case_from_table`). Rotations are named `to_from`.
//!
//! At rest the specific force is `case_from_table * table_from_level * [0, 0, g]`. Each turn is about one axis that
//! stands still in the table frame and in the level frame alike, so that the attitude during it is
//! `start * exp(axis angle(t))` and the rate of the table is `axis d(angle)/dt`, exactly. The Earth's rate comes on top.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::simulate::stream::{RandomStream, normal_vector};
use crate::simulate::table_turn::{TableTurn, TurnLimits, TurnProfile};
use crate::simulate::trajectory::{Trajectory, TrueMotion, earth_rate};

/// Pose to which the table is sent.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TablePose {
    /// Direction of `up` in the table frame, unit length.
    pub up: Vector3<f64>,
    /// Angle, rad, by which the table misses this pose about a level axis without reporting it; 0 for none.
    pub tip: f64,
}

/// The table, its commanded poses, and its errors.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Poses in the order they are taken.
    pub poses: Vec<TablePose>,
    /// Time at rest at each pose, s.
    pub rest_duration: f64,
    /// Shape of the angular rate over a turn.
    pub profile: TurnProfile,
    /// Limits of the speed of its turns.
    pub limits: TurnLimits,
    /// Turn about the vertical after each change of pose, rad; 0 for none.
    pub heading_turn: f64,
    /// Rates, rad/s, at which the table turns about the vertical after the rest at each pose, both ways, before it rests again.
    #[serde(default)]
    pub rates: Vec<f64>,
    /// Time at each rate, s.
    #[serde(default)]
    pub rate_duration: f64,
    /// Error of the table at each pose, rad, 1 sigma about each of its axes.
    pub error: f64,
    /// Gravity, m/s^2.
    pub gravity: f64,
    /// Latitude, rad; `None` for an Earth that does not turn.
    pub latitude: Option<f64>,
}

/// The table at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableRest {
    /// Index of the pose.
    pub pose: usize,
    /// Begin, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Rotation by which the table misses the commanded pose: `level_from_table = told * table_error`.
    pub table_error: Rotation3<f64>,
    /// Attitude the table has.
    pub level_from_table: Rotation3<f64>,
}

impl TableRest {
    /// Rotation vector of the table's error, rad, table frame.
    pub fn table_error_vector(&self) -> Vector3<f64> {
        UnitQuaternion::from_rotation_matrix(&self.table_error).scaled_axis()
    }
}

impl Trajectory for TableMotion {
    fn truth(&self, t: f64) -> TrueMotion {
        TableMotion::truth(self, t)
    }

    fn duration(&self) -> f64 {
        TableMotion::duration(self)
    }
}

#[derive(Clone, Copy, Debug)]
enum TableSegment {
    Rest {
        end: f64,
        truth: TrueMotion,
        level_from_table: Rotation3<f64>,
    },
    Turning {
        start: f64,
        end: f64,
        turn: TableTurn,
        level_from_table: Rotation3<f64>,
    },
}

impl TableSegment {
    fn end(&self) -> f64 {
        match self {
            TableSegment::Rest { end, .. } | TableSegment::Turning { end, .. } => *end,
        }
    }
}

/// The motion of a whole session, from time 0 on.
#[derive(Clone, Debug)]
pub struct TableMotion {
    segments: Vec<TableSegment>,
    rests: Vec<TableRest>,
    gravity: Vector3<f64>,
    earth_rate: Vector3<f64>,
    case_from_table: Rotation3<f64>,
}

impl TableMotion {
    /// Lays the session out in time; the errors of the table come from `stream`.
    pub fn new(table: &Table, case_from_table: Rotation3<f64>, stream: &mut RandomStream) -> Self {
        let mut motion = Self {
            segments: Vec::new(),
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
            if !table.rates.is_empty() {
                motion.push_rates(table, target, &pose.up);
                motion.push_rest(index, table.rest_duration, table_error, target);
            }
            reached = Some(target);
        }
        motion
    }

    /// End of the session, s.
    pub fn duration(&self) -> f64 {
        self.segments.last().map_or(0.0, TableSegment::end)
    }

    /// The rests in order of time.
    pub fn rests(&self) -> &[TableRest] {
        &self.rests
    }

    /// Rate of the Earth in the level frame, rad/s.
    pub fn earth_rate(&self) -> Vector3<f64> {
        self.earth_rate
    }

    /// Truth at an attitude in which the table stands still.
    pub fn at_rest(&self, level_from_table: &Rotation3<f64>) -> TrueMotion {
        let case_from_level = self.case_from_table * level_from_table.inverse();
        TrueMotion {
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
    pub fn truth(&self, t: f64) -> TrueMotion {
        match self.segment_at(t) {
            TableSegment::Rest { truth, .. } => *truth,
            TableSegment::Turning {
                start,
                turn,
                level_from_table,
                ..
            } => self.turning(turn, level_from_table, t - start),
        }
    }

    /// A vector of the level frame as the case sees it at time `t`, s.
    ///
    /// # Panics
    /// Where the session has no pose.
    pub fn in_case(&self, t: f64, level: &Vector3<f64>) -> Vector3<f64> {
        match self.segment_at(t) {
            TableSegment::Rest { level_from_table, .. } => {
                self.case_from_table * level_from_table.inverse_transform_vector(level)
            }
            TableSegment::Turning {
                start,
                turn,
                level_from_table,
                ..
            } => {
                let (sin, cos) = libm::sincos(turn.progress(t - start).angle);
                let at_start = level_from_table.inverse_transform_vector(level);
                self.case_from_table * rotated(&at_start, &turn.axis, -sin, cos)
            }
        }
    }

    fn segment_at(&self, t: f64) -> &TableSegment {
        let segment = self
            .segments
            .partition_point(|segment| segment.end() < t)
            .min(self.segments.len() - 1);
        &self.segments[segment]
    }

    fn turning(&self, turn: &TableTurn, level_from_table: &Rotation3<f64>, elapsed: f64) -> TrueMotion {
        let progress = turn.progress(elapsed);
        let (sin, cos) = libm::sincos(progress.angle);
        let to_case = |level: &Vector3<f64>| {
            let at_start = level_from_table.inverse_transform_vector(level);
            self.case_from_table * rotated(&at_start, &turn.axis, -sin, cos)
        };
        let axis = self.case_from_table * turn.axis;
        TrueMotion {
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
        self.segments.push(TableSegment::Rest {
            end,
            truth: self.at_rest(&level_from_table),
            level_from_table,
        });
        self.rests.push(TableRest {
            pose,
            start,
            end,
            table_error,
            level_from_table,
        });
    }

    /// Each rate both ways about an axis, after which the table stands as before.
    fn push_rates(&mut self, table: &Table, level_from_table: Rotation3<f64>, axis: &Vector3<f64>) {
        let mut here = level_from_table;
        for rate in &table.rates {
            let limits = TurnLimits {
                rate: rate.abs(),
                acceleration: table.limits.acceleration,
            };
            let ramps = rate * limits.rate / limits.acceleration;
            let rotation = axis * (rate * table.rate_duration + ramps);
            for rotation in [rotation, -rotation] {
                let turn = TableTurn::new(rotation, TurnProfile::Trapezoid, &limits);
                self.push_turning(turn, here);
                here *= Rotation3::new(rotation);
            }
            here = level_from_table;
        }
    }

    fn push_turn(&mut self, table: &Table, level_from_table: Rotation3<f64>, rotation: Vector3<f64>) {
        // Rounding alone does not turn a table.
        if rotation.norm() > 1e-12 {
            let turn = TableTurn::new(rotation, table.profile, &table.limits);
            self.push_turning(turn, level_from_table);
        }
    }

    fn push_turning(&mut self, turn: TableTurn, level_from_table: Rotation3<f64>) {
        let start = self.duration();
        self.segments.push(TableSegment::Turning {
            start,
            end: start + turn.duration,
            turn,
            level_from_table,
        });
    }
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

fn tip(pose: &TablePose) -> Rotation3<f64> {
    Rotation3::new(level_axis(&pose.up) * pose.tip)
}

/// Rotation vector from one attitude to another, the one that goes round the same way as `like`.
///
/// About half a turn, the shorter way can be opposite to the commanded one.
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
#[path = "table_tests.rs"]
mod tests;
