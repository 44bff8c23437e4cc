//! Shared parts of a quadrotor and a vehicle: the extent of their motion, and their state at any time.
//!
//! Frames: *level* (x east, y north, z up), *body* (forward, left, up; turns with the body).

use nalgebra::Vector3;
use serde::Deserialize;

use crate::simulate::attitude::EulerAngles;
use crate::simulate::floor::Floor;
use crate::simulate::series::Series;
use crate::simulate::time_span::TimeSpan;

/// Duration, repetition and extent of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarrierPlan {
    /// Flights, or drives, with a rest before each and after the last.
    pub flights: usize,
    /// Each of these rests, s.
    pub rest: f64,
    /// Manoeuvres of each flight, s; take-off and landing come on top.
    pub moving: f64,
    /// Stops of a vehicle on each drive.
    pub stops: usize,
    /// Each stop, s.
    pub stop: f64,
    /// From 0, just so much that it gets going, to 1.
    pub intensity: f64,
    /// Share, 0 to 1, of the usual motion forward, left and up.
    pub sway: [f64; 3],
    /// Share, 0 to 1, of the usual motion about the vertical.
    pub turning: f64,
    /// The ground at the start; heading zero is east.
    pub ground: Floor,
    /// m/s^2.
    pub gravity: f64,
}

/// Where a body is going, and how it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyMotion {
    /// Attitude.
    pub angles: EulerAngles,
    /// Level frame, m/s.
    pub velocity: Vector3<f64>,
    /// Level frame, m/s^2.
    pub acceleration: Vector3<f64>,
}

impl BodyMotion {
    /// A body that stands with its up along `up`, level frame, at a heading in rad.
    pub fn still(up: &Vector3<f64>, heading: f64) -> Self {
        let up = [up.x, up.y, up.z].map(Series::constant);
        Self {
            angles: EulerAngles::upright(&up, Series::constant(heading)),
            velocity: Vector3::zeros(),
            acceleration: Vector3::zeros(),
        }
    }
}

/// A way that something moves, from rest to rest.
pub trait CarrierMotion: Send + Sync {
    /// Attitude, velocity and acceleration at time `t`, s.
    fn body_motion(&self, t: f64) -> BodyMotion;

    /// Power of the motors' vibration, 0 to 1.
    fn running(&self, t: f64) -> Series<2>;

    /// When it stands still with its motors off, in order of time.
    fn rests(&self) -> &[TimeSpan];

    /// When it manoeuvres or drives.
    fn manoeuvres(&self) -> &[TimeSpan];

    /// End of the last rest, s.
    fn duration(&self) -> f64 {
        self.rests().last().map_or(0.0, |rest| rest.end)
    }
}

/// Normal of the ground, level frame, with a vertical part of 1: it leans away from uphill.
pub fn ground_normal(ground: &Floor) -> Vector3<f64> {
    let slope = libm::tan(ground.tilt);
    Vector3::new(
        -slope * libm::cos(ground.uphill),
        -slope * libm::sin(ground.uphill),
        1.0,
    )
}
