//! A wheeled robot: it stands, turns on the spot, drives to another, and is treated badly, as truth at any time.
//!
//! Frames: *floor* (forward, left, up; turns with the robot), *case* (the IMU's, fixed to the robot by
//! `case_from_floor`). Heading, its rate and its change are functions of time that are each other's exact derivatives.

use core::f64::consts::{PI, TAU};

use nalgebra::{Rotation3, Unit, Vector3};
use rand::RngExt;
use tumble_core::gravity::EARTH_RATE;
use tumble_core::spin::axis::floor_frame;

use crate::simulate::motion::{Course, Truth};
use crate::simulate::stream::Stream;

/// What the robot does next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
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

/// The floor at one spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// rad.
    pub tilt: f64,
    /// Uphill, rad counter-clockwise from forward at heading zero.
    pub uphill: f64,
}

/// Something that lifts and tilts the robot for a while, and sets it down as it was: `sin^2` over its duration.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Steps in order of time.
    pub steps: Vec<Step>,
    /// Floor at the first spot.
    pub floor: Floor,
    /// Angular acceleration, rad/s^2, at which a turn begins and ends.
    pub acceleration: f64,
    /// Share by which the rate goes up and down, and how often, Hz.
    pub unevenness: (f64, f64),
    /// Slips of the wheels a turn.
    pub slips: f64,
    /// Vibration while the motors run, m/s^2.
    pub vibration: f64,
    /// What disturbs the robot.
    pub disturbances: Vec<Disturbance>,
    /// Rotation of the IMU in the robot.
    pub case_from_floor: Rotation3<f64>,
    /// m/s^2.
    pub gravity: f64,
    /// rad; `None` for an Earth that does not turn.
    pub latitude: Option<f64>,
}

/// A stretch of time between two others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
}

#[derive(Clone, Debug)]
struct Phase {
    span: Span,
    step: Step,
    heading: f64,
    floor: Floor,
    slips: Vec<Slip>,
}

/// A dip of the rate: `-depth sin^2` over its width.
#[derive(Clone, Copy, Debug)]
struct Slip {
    start: f64,
    width: f64,
    depth: f64,
}

/// Heading and its two derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    /// rad.
    pub heading: f64,
    /// rad/s.
    pub rate: f64,
    /// rad/s^2.
    pub acceleration: f64,
}

/// Frequencies of the vibration, Hz, and its phases.
const VIBRATION: [(f64, f64); 3] = [(23.0, 0.4), (37.0, 2.1), (58.0, 4.4)];

/// The motion of the whole plan.
#[derive(Clone, Debug)]
pub struct SpotMotion {
    plan: Plan,
    phases: Vec<Phase>,
}

impl SpotMotion {
    /// Lays the plan out in time; slips come from `stream`.
    pub fn new(plan: Plan, stream: &mut Stream) -> Self {
        let mut motion = Self {
            phases: Vec::new(),
            plan,
        };
        let (mut time, mut heading, mut floor) = (0.0, 0.0, motion.plan.floor);
        for step in motion.plan.steps.clone() {
            let span = Span {
                start: time,
                end: time + motion.duration_of(&step),
            };
            let slips = motion.draw_slips(&step, &span, stream);
            let phase = Phase {
                span,
                step,
                heading,
                floor,
                slips,
            };
            heading = motion.turning_in(&phase, span.end).heading;
            if let Step::Drive { floor: next, .. } = step {
                floor = next;
            }
            time = span.end;
            motion.phases.push(phase);
        }
        motion
    }

    fn duration_of(&self, step: &Step) -> f64 {
        match *step {
            Step::Rest { duration, .. } | Step::Drive { duration, .. } => duration,
            Step::Turn { angle, rate } => {
                let rate = rate.min((angle.abs() * self.plan.acceleration).sqrt());
                angle.abs() / rate + rate / self.plan.acceleration
            }
        }
    }

    /// Slips short and deep, evenly likely over the middle of a turn.
    fn draw_slips(&self, step: &Step, span: &Span, stream: &mut Stream) -> Vec<Slip> {
        let Step::Turn { angle, rate } = *step else {
            return Vec::new();
        };
        let count = (self.plan.slips * angle.abs() / TAU).round() as usize;
        let (from, length) = (span.start + 1.0, (span.end - span.start - 2.5).max(0.0));
        (0..count)
            .map(|_| Slip {
                start: from + length * stream.random::<f64>(),
                width: 0.3 + 0.4 * stream.random::<f64>(),
                depth: rate * angle.signum() * (0.1 + 0.3 * stream.random::<f64>()),
            })
            .collect()
    }

    fn phase(&self, t: f64) -> Option<&Phase> {
        let index = self.phases.partition_point(|phase| phase.span.end < t);
        self.phases.get(index).or(self.phases.last())
    }

    /// Heading at time `t`, s.
    pub fn turning(&self, t: f64) -> Turning {
        self.phase(t).map_or(
            Turning {
                heading: 0.0,
                rate: 0.0,
                acceleration: 0.0,
            },
            |phase| self.turning_in(phase, t),
        )
    }

    fn turning_in(&self, phase: &Phase, t: f64) -> Turning {
        let elapsed = (t - phase.span.start).clamp(0.0, phase.span.end - phase.span.start);
        let duration = phase.span.end - phase.span.start;
        let mut turning = match phase.step {
            Step::Rest { slow_turn, .. } => Turning {
                heading: slow_turn * elapsed,
                rate: slow_turn,
                acceleration: 0.0,
            },
            Step::Turn { angle, rate } => {
                let rate = rate.min((angle.abs() * self.plan.acceleration).sqrt());
                let ramp = rate / self.plan.acceleration;
                uneven(angle, duration, ramp, elapsed, self.plan.unevenness)
            }
            Step::Drive { bend, .. } => eased(bend, duration, elapsed),
        };
        for slip in &phase.slips {
            slip.take_off(&mut turning, t);
        }
        turning.heading += phase.heading;
        turning
    }

    /// When the robot stands still.
    pub fn rests(&self) -> Vec<Span> {
        let standing = |phase: &&Phase| matches!(phase.step, Step::Rest { .. });
        self.phases
            .iter()
            .filter(standing)
            .map(|phase| phase.span)
            .collect()
    }

    /// When the robot turns on the spot, and by how much it truly turned, rad.
    pub fn turns(&self) -> Vec<(Span, f64)> {
        self.phases
            .iter()
            .filter(|phase| matches!(phase.step, Step::Turn { .. }))
            .map(|phase| {
                let end = self.turning_in(phase, phase.span.end).heading;
                (phase.span, end - phase.heading)
            })
            .collect()
    }

    /// Whether the wheels turn at time `t`, s.
    pub fn wheels_turn(&self, t: f64) -> bool {
        self.phase(t).is_some_and(|phase| match phase.step {
            Step::Rest { slow_turn, .. } => slow_turn != 0.0,
            Step::Turn { .. } | Step::Drive { .. } => true,
        })
    }

    /// Direction of up in the floor frame at heading `heading`: up leans uphill.
    fn up_in_floor(&self, phase: &Phase, heading: f64, progress: f64) -> Vector3<f64> {
        let lean = |floor: &Floor| {
            let sine = libm::sin(floor.tilt);
            Vector3::new(
                sine * libm::cos(floor.uphill),
                sine * libm::sin(floor.uphill),
                0.0,
            )
        };
        let mut level = lean(&phase.floor);
        if let Step::Drive { floor, .. } = &phase.step {
            level += (lean(floor) - level) * progress;
        }
        let up = level + Vector3::z() * (1.0 - level.norm_squared()).max(0.0).sqrt();
        Rotation3::from_axis_angle(&Vector3::z_axis(), -heading) * up
    }

    /// Acceleration of the turning centre on a drive, floor frame.
    fn acceleration(phase: &Phase, turning: &Turning, elapsed: f64) -> Vector3<f64> {
        let Step::Drive { duration, speed, .. } = phase.step else {
            return Vector3::zeros();
        };
        // Up to speed and down again, as half a wave of a raised cosine.
        let angle = TAU * elapsed / duration;
        let forward = speed / 2.0 * (1.0 - libm::cos(angle));
        let pull = speed / 2.0 * TAU / duration * libm::sin(angle);
        Vector3::new(pull, forward * turning.rate, 0.0)
    }

    fn vibration(&self, phase: &Phase, t: f64, elapsed: f64) -> Vector3<f64> {
        if self.plan.vibration == 0.0 || matches!(phase.step, Step::Rest { .. }) {
            return Vector3::zeros();
        }
        let duration = phase.span.end - phase.span.start;
        let running = libm::sin(PI * (elapsed / duration).clamp(0.0, 1.0)).min(0.2) / 0.2;
        let [x, y, z] = VIBRATION.map(|(frequency, shift)| libm::sin(TAU * frequency * t + shift));
        Vector3::new(x + y, y - z, z + x) * (self.plan.vibration * running)
    }
}

impl Course for SpotMotion {
    fn duration(&self) -> f64 {
        self.phases.last().map_or(0.0, |phase| phase.span.end)
    }

    fn truth(&self, t: f64) -> Truth {
        let still = Truth {
            specific_force: Vector3::zeros(),
            angular_rate: Vector3::zeros(),
            turn_rate: Vector3::zeros(),
            turn_acceleration: Vector3::zeros(),
        };
        let Some(phase) = self.phase(t) else { return still };
        let turning = self.turning_in(phase, t);
        let elapsed = t - phase.span.start;
        let progress = eased(1.0, phase.span.end - phase.span.start, elapsed).heading;
        let up = self.up_in_floor(phase, turning.heading, progress);
        let mut force = up * self.plan.gravity
            + Self::acceleration(phase, &turning, elapsed)
            + self.vibration(phase, t, elapsed);
        let mut rate = Vector3::z() * turning.rate;
        let mut acceleration = Vector3::z() * turning.acceleration;
        let mut robot = Rotation3::identity();
        for disturbance in &self.plan.disturbances {
            let bump = disturbance.at(t);
            force += up * bump.height_acceleration;
            let tilted = Rotation3::from_axis_angle(&Vector3::y_axis(), -bump.tilt);
            let spin = tilted * rate;
            rate = spin + Vector3::y() * bump.tilt_rate;
            acceleration = tilted * acceleration + Vector3::y() * bump.tilt_acceleration
                - Vector3::y().cross(&spin) * bump.tilt_rate;
            robot = tilted * robot;
        }
        let to_case = |v: Vector3<f64>| self.plan.case_from_floor * v;
        let earth = self
            .plan
            .latitude
            .map_or(0.0, |latitude| EARTH_RATE * libm::sin(latitude));
        let turn_rate = to_case(rate);
        Truth {
            specific_force: to_case(robot * force),
            angular_rate: turn_rate + to_case(robot * up) * earth,
            turn_rate,
            turn_acceleration: to_case(acceleration),
        }
    }
}

/// Height and tilt of a disturbance, and their derivatives.
struct Bump {
    tilt: f64,
    tilt_rate: f64,
    tilt_acceleration: f64,
    height_acceleration: f64,
}

impl Disturbance {
    fn at(&self, t: f64) -> Bump {
        let phase = PI * (t - self.start) / self.duration;
        if !(0.0..=PI).contains(&phase) {
            return Bump {
                tilt: 0.0,
                tilt_rate: 0.0,
                tilt_acceleration: 0.0,
                height_acceleration: 0.0,
            };
        }
        let speed = PI / self.duration;
        let (sine, cosine) = libm::sincos(2.0 * phase);
        let bend = 2.0 * speed * speed * cosine;
        Bump {
            tilt: self.tilt * (1.0 - cosine) / 2.0,
            tilt_rate: self.tilt * speed * sine,
            tilt_acceleration: self.tilt * bend,
            height_acceleration: self.lift * bend,
        }
    }
}

impl Slip {
    fn take_off(&self, turning: &mut Turning, t: f64) {
        let elapsed = (t - self.start).clamp(0.0, self.width);
        let speed = TAU / self.width;
        let (sine, cosine) = libm::sincos(speed * elapsed);
        turning.heading -= self.depth / 2.0 * (elapsed - sine / speed);
        if (self.start..=self.start + self.width).contains(&t) {
            turning.rate -= self.depth / 2.0 * (1.0 - cosine);
            turning.acceleration -= self.depth / 2.0 * speed * sine;
        }
    }
}

/// From rest to rest by `angle` in `duration`, as a raised cosine.
fn eased(angle: f64, duration: f64, elapsed: f64) -> Turning {
    let speed = TAU / duration;
    let (sine, cosine) = libm::sincos(speed * elapsed.clamp(0.0, duration));
    let mean = angle / duration;
    Turning {
        heading: mean * (elapsed.clamp(0.0, duration) - sine / speed),
        rate: mean * (1.0 - cosine),
        acceleration: mean * speed * sine,
    }
}

/// From rest to rest by `angle` in `duration`, up to speed and down again over `ramp` as half a cosine, with a ripple
/// of whole periods on top, which leaves the angle as it is.
fn uneven(angle: f64, duration: f64, ramp: f64, elapsed: f64, (depth, frequency): (f64, f64)) -> Turning {
    let top = angle / (duration - ramp);
    let rising = |t: f64| {
        if t >= ramp {
            return (t - ramp / 2.0, 1.0, 0.0);
        }
        let (sine, cosine) = libm::sincos(PI * t / ramp);
        (
            (t - sine * ramp / PI) / 2.0,
            (1.0 - cosine) / 2.0,
            PI / ramp * sine / 2.0,
        )
    };
    let (gained, rate, change) = if elapsed <= duration - ramp {
        rising(elapsed)
    } else {
        let (gained, rate, change) = rising(duration - elapsed);
        (duration - ramp - gained, rate, -change)
    };
    let periods = (frequency * duration).round().max(1.0);
    let speed = TAU * periods / duration;
    let (sine, cosine) = libm::sincos(speed * elapsed);
    Turning {
        heading: top * (gained + depth * (1.0 - cosine) / speed),
        rate: top * (rate + depth * sine),
        acceleration: top * (change + depth * speed * cosine),
    }
}

/// `case_from_floor` of an IMU mounted with roll, pitch and yaw, rad: `floor_from_case = R_z(yaw) R_y(pitch) R_x(roll)`.
pub fn mounted(roll: f64, pitch: f64, yaw: f64) -> Rotation3<f64> {
    let about = |axis: Unit<Vector3<f64>>, angle| Rotation3::from_axis_angle(&axis, angle);
    let floor_from_case =
        about(Vector3::z_axis(), yaw) * about(Vector3::y_axis(), pitch) * about(Vector3::x_axis(), roll);
    floor_from_case.inverse()
}

/// A bearing counter-clockwise from the robot's forward, as results state it: from the case's x laid onto the floor.
pub fn reported_bearing(case_from_floor: &Rotation3<f64>, bearing: f64) -> f64 {
    let up = case_from_floor * Vector3::z();
    let direction = case_from_floor * Vector3::new(libm::cos(bearing), libm::sin(bearing), 0.0);
    let reported = floor_frame(&up).tr_mul(&direction);
    libm::atan2(reported.y, reported.x)
}
