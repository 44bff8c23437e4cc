//! A wheeled robot: it stands, turns on the spot, drives to another, and is treated badly, as truth at any time.
//!
//! Frames: *floor* (forward, left, up; turns with the robot), *case* (the IMU's, fixed to the robot by
//! `case_from_floor`). On a drive the floor bends from one tilt to the next, and the robot with it; its heading is turned
//! about the floor's normal alone.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;
use tumble_core::spin::axis::floor_frame;

use crate::simulate::attitude::roll_pitch_yaw;
use crate::simulate::floor::{BendingFloor, Floor, FloorMotion};
use crate::simulate::heading::{RobotHeading, WheelSlip, eased, ramped};
use crate::simulate::series::Series;
use crate::simulate::stream::RandomStream;
use crate::simulate::time_span::TimeSpan;
use crate::simulate::trajectory::{Trajectory, TrueMotion};

/// Next step of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum RobotStep {
    /// It stands.
    Rest {
        /// s.
        duration: f64,
        /// Rate it turns with all the same, rad/s: what looks like a rest and is none.
        slow_turn: f64,
    },
    /// It turns on the spot.
    Turn {
        /// Counter-clockwise positive, rad.
        angle: f64,
        /// Rate once it has got up to it, rad/s.
        rate: f64,
    },
    /// It drives to another spot, with another floor.
    Drive {
        /// s.
        duration: f64,
        /// Speed once it has got up to it, m/s.
        speed: f64,
        /// Bend on the way, counter-clockwise positive, rad.
        bend: f64,
        /// Floor at the end.
        floor: Floor,
    },
}

/// Something that lifts and tilts the robot for a while, and sets it down as it was: `sin^2` over its duration.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Begin, s.
    pub start: f64,
    /// s.
    pub duration: f64,
    /// Largest tilt about the robot's left axis, rad.
    pub tilt: f64,
    /// Largest height, m.
    pub lift: f64,
}

/// The robot, the floors and what happens.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotPlan {
    /// Steps in order of time.
    pub steps: Vec<RobotStep>,
    /// Floor at the first spot.
    pub floor: Floor,
    /// Largest angular acceleration, rad/s^2, as a turn begins and ends; unevenness and slips come on top.
    pub acceleration: f64,
    /// Share, below 1, by which the rate goes up and down, and how often at full rate, Hz.
    pub unevenness: (f64, f64),
    /// Slips of the wheels a turn.
    pub slips: f64,
    /// Vibration while the motors run, m/s^2.
    pub vibration: f64,
    /// Disturbances of the robot.
    pub disturbances: Vec<Disturbance>,
    /// Rotation of the IMU in the robot.
    #[serde(rename = "mounting", deserialize_with = "roll_pitch_yaw")]
    pub case_from_floor: Rotation3<f64>,
    /// m/s^2.
    pub gravity: f64,
    /// rad; `None` for an Earth that does not turn. The robot faces north at heading zero.
    pub latitude: Option<f64>,
}

#[derive(Clone, Debug)]
struct TimedStep {
    span: TimeSpan,
    step: RobotStep,
    heading: f64,
    floor: Floor,
    slips: Vec<WheelSlip>,
}

/// Room that a slip needs, s.
const SHORTEST_SLIP: f64 = 0.1;
/// Frequencies of the vibration, Hz, and its phases.
const VIBRATION: [(f64, f64); 3] = [(23.0, 0.4), (37.0, 2.1), (58.0, 4.4)];

/// The motion of the whole plan.
#[derive(Clone, Debug)]
pub struct RobotMotion {
    plan: RobotPlan,
    steps: Vec<TimedStep>,
}

impl RobotMotion {
    /// Lays the plan out in time; slips come from `stream`.
    pub fn new(plan: RobotPlan, stream: &mut RandomStream) -> Self {
        let mut motion = Self {
            steps: Vec::new(),
            plan,
        };
        let (mut time, mut heading, mut floor) = (0.0, 0.0, motion.plan.floor);
        for step in motion.plan.steps.clone() {
            let span = TimeSpan {
                start: time,
                end: time + motion.duration_of(&step),
            };
            let slips = motion.draw_slips(&step, &span, stream);
            let timed = TimedStep {
                span,
                step,
                heading,
                floor,
                slips,
            };
            heading = motion.turning_in(&timed, span.end).heading;
            if let RobotStep::Drive { floor: next, .. } = step {
                floor = next;
            }
            time = span.end;
            motion.steps.push(timed);
        }
        motion
    }

    fn duration_of(&self, step: &RobotStep) -> f64 {
        match *step {
            RobotStep::Rest { duration, .. } | RobotStep::Drive { duration, .. } => duration,
            RobotStep::Turn { angle, rate } => {
                let (rate, ramp) = self.reached(angle, rate);
                angle.abs() / rate + ramp
            }
        }
    }

    /// Rate that a turn gets up to, rad/s, and how long it takes to, s: half a cosine, at most `acceleration` steep.
    fn reached(&self, angle: f64, rate: f64) -> (f64, f64) {
        let rate = rate.min((angle.abs() * self.plan.acceleration / FRAC_PI_2).sqrt());
        (rate, FRAC_PI_2 * rate / self.plan.acceleration)
    }

    /// Slips while a turn is at its full rate, one in each of as many equal parts of that time; none where it has none.
    fn draw_slips(&self, step: &RobotStep, span: &TimeSpan, stream: &mut RandomStream) -> Vec<WheelSlip> {
        let RobotStep::Turn { angle, rate } = *step else {
            return Vec::new();
        };
        let (rate, ramp) = self.reached(angle, rate);
        let slowest = rate * (1.0 - self.plan.unevenness.0) * angle.signum();
        let count = (self.plan.slips * angle.abs() / TAU).round() as usize;
        let part = (span.end - span.start - 2.0 * ramp).max(0.0) / count.max(1) as f64;
        if part < SHORTEST_SLIP {
            return Vec::new();
        }
        let start = |index: usize| span.start + ramp + part * index as f64;
        (0..count)
            .map(|index| WheelSlip::draw(start(index), part, slowest, stream))
            .collect()
    }

    fn step_at(&self, t: f64) -> Option<&TimedStep> {
        let index = self.steps.partition_point(|timed| timed.span.end < t);
        self.steps.get(index).or(self.steps.last())
    }

    /// Heading at time `t`, s.
    pub fn turning(&self, t: f64) -> RobotHeading {
        self.step_at(t).map_or(
            RobotHeading {
                heading: 0.0,
                rate: 0.0,
                acceleration: 0.0,
            },
            |timed| self.turning_in(timed, t),
        )
    }

    fn turning_in(&self, timed: &TimedStep, t: f64) -> RobotHeading {
        let elapsed = (t - timed.span.start).clamp(0.0, timed.span.end - timed.span.start);
        let duration = timed.span.end - timed.span.start;
        let mut turning = match timed.step {
            RobotStep::Rest { slow_turn, .. } => RobotHeading {
                heading: slow_turn * elapsed,
                rate: slow_turn,
                acceleration: 0.0,
            },
            RobotStep::Turn { angle, rate } => {
                let (_, ramp) = self.reached(angle, rate);
                let (depth, frequency) = self.plan.unevenness;
                let waves = (frequency * (duration - ramp)).round().max(1.0);
                ramped(angle, duration, ramp, elapsed).uneven(depth, TAU * waves / angle)
            }
            RobotStep::Drive { bend, .. } => eased(bend, duration, elapsed),
        };
        for slip in &timed.slips {
            slip.subtract_from(&mut turning, t);
        }
        turning.heading += timed.heading;
        turning
    }

    /// When the robot stands still.
    pub fn rests(&self) -> Vec<TimeSpan> {
        let standing = |timed: &&TimedStep| matches!(timed.step, RobotStep::Rest { .. });
        self.steps
            .iter()
            .filter(standing)
            .map(|timed| timed.span)
            .collect()
    }

    /// When the robot turns on the spot, and by how much it truly turned, rad.
    pub fn turns(&self) -> Vec<(TimeSpan, f64)> {
        self.steps
            .iter()
            .filter(|timed| matches!(timed.step, RobotStep::Turn { .. }))
            .map(|timed| {
                let end = self.turning_in(timed, timed.span.end).heading;
                (timed.span, end - timed.heading)
            })
            .collect()
    }

    /// Tests whether the wheels turn at time `t`, s.
    pub fn wheels_turn(&self, t: f64) -> bool {
        self.step_at(t).is_some_and(|timed| match timed.step {
            RobotStep::Rest { slow_turn, .. } => slow_turn != 0.0,
            RobotStep::Turn { .. } | RobotStep::Drive { .. } => true,
        })
    }

    /// Tilt of the floor at time `t`, s.
    fn bending_floor(timed: &TimedStep, t: f64) -> BendingFloor {
        let level = timed.floor.lean();
        let RobotStep::Drive { floor, duration, .. } = &timed.step else {
            return BendingFloor::new(level, Vector3::zeros(), Vector3::zeros());
        };
        let change = floor.lean() - level;
        let bend = eased(1.0, *duration, t - timed.span.start);
        BendingFloor::new(
            level + change * bend.heading,
            change * bend.rate,
            change * bend.acceleration,
        )
    }

    /// Acceleration of the turning centre on a drive, floor frame; the robot turns at `rate`, rad/s.
    fn acceleration(timed: &TimedStep, rate: &Vector3<f64>, t: f64) -> Vector3<f64> {
        let RobotStep::Drive { duration, speed, .. } = timed.step else {
            return Vector3::zeros();
        };
        // Up to speed and down again: the rate of an eased way.
        let way = eased(speed * duration / 2.0, duration, t - timed.span.start);
        Vector3::x() * way.acceleration + rate.cross(&(Vector3::x() * way.rate))
    }

    fn vibration(&self, timed: &TimedStep, t: f64, elapsed: f64) -> Vector3<f64> {
        if self.plan.vibration == 0.0 || matches!(timed.step, RobotStep::Rest { .. }) {
            return Vector3::zeros();
        }
        let duration = timed.span.end - timed.span.start;
        let running = libm::sin(PI * (elapsed / duration).clamp(0.0, 1.0)).min(0.2) / 0.2;
        let [x, y, z] = VIBRATION.map(|(frequency, shift)| libm::sin(TAU * frequency * t + shift));
        Vector3::new(x + y, y - z, z + x) * (self.plan.vibration * running)
    }
}

impl Trajectory for RobotMotion {
    fn duration(&self) -> f64 {
        self.steps.last().map_or(0.0, |timed| timed.span.end)
    }

    fn truth(&self, t: f64) -> TrueMotion {
        let still = TrueMotion {
            specific_force: Vector3::zeros(),
            angular_rate: Vector3::zeros(),
            turn_rate: Vector3::zeros(),
            turn_acceleration: Vector3::zeros(),
        };
        let Some(timed) = self.step_at(t) else {
            return still;
        };
        let turning = self.turning_in(timed, t);
        let FloorMotion {
            up,
            earth,
            mut angular_motion,
        } = Self::bending_floor(timed, t).turned(&turning, self.plan.latitude);
        let mut force = up * self.plan.gravity
            + Self::acceleration(timed, &angular_motion.rate, t)
            + self.vibration(timed, t, t - timed.span.start);
        let mut robot = Rotation3::identity();
        for disturbance in &self.plan.disturbances {
            let bump = disturbance.at(t);
            force += up * bump.height_acceleration;
            let (tilted, turned) = angular_motion.turned(&Vector3::y_axis(), &bump.tilt);
            angular_motion = turned;
            robot = tilted.inverse() * robot;
        }
        let to_case = |v: Vector3<f64>| self.plan.case_from_floor * v;
        let turn_rate = to_case(angular_motion.rate);
        TrueMotion {
            specific_force: to_case(robot * force),
            angular_rate: turn_rate + to_case(robot * earth),
            turn_rate,
            turn_acceleration: to_case(angular_motion.acceleration),
        }
    }
}

/// Tilt of a disturbance, and how fast its height changes.
struct LiftAndTilt {
    tilt: Series<3>,
    height_acceleration: f64,
}

impl Disturbance {
    fn at(&self, t: f64) -> LiftAndTilt {
        let phase = PI * (t - self.start) / self.duration;
        if !(0.0..=PI).contains(&phase) {
            return LiftAndTilt {
                tilt: Series::constant(0.0),
                height_acceleration: 0.0,
            };
        }
        let speed = PI / self.duration;
        let (sine, cosine) = libm::sincos(2.0 * phase);
        let bend = 2.0 * speed * speed * cosine;
        LiftAndTilt {
            tilt: Series::of([(1.0 - cosine) / 2.0, speed * sine, bend]) * self.tilt,
            height_acceleration: self.lift * bend,
        }
    }
}

/// A bearing counter-clockwise from the robot's forward, as results state it: from the case's x laid onto the floor.
pub fn reported_bearing(case_from_floor: &Rotation3<f64>, bearing: f64) -> f64 {
    let up = case_from_floor * Vector3::z();
    let direction = case_from_floor * Vector3::new(libm::cos(bearing), libm::sin(bearing), 0.0);
    let reported = floor_frame(&up).tr_mul(&direction);
    libm::atan2(reported.y, reported.x)
}

#[cfg(test)]
#[path = "wheeled_robot_tests.rs"]
mod tests;
