//! The floor under a robot: how it tilts, and how it bends from one tilt to the next.
//!
//! Frame: *floor* (forward, left, up across the floor), which turns with the robot.

use nalgebra::Vector3;
use serde::Deserialize;
use tumble_core::gravity::EARTH_RATE;

use crate::simulate::attitude::AngularMotion;
use crate::simulate::heading::RobotHeading;
use crate::simulate::series::Series;

/// The floor at one spot.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// rad.
    pub tilt: f64,
    /// Uphill, rad counter-clockwise from forward at heading zero.
    pub uphill: f64,
}

impl Floor {
    /// Level part of up in the floor frame at heading zero: up leans uphill.
    pub fn lean(&self) -> Vector3<f64> {
        let sine = libm::sin(self.tilt);
        Vector3::new(sine * libm::cos(self.uphill), sine * libm::sin(self.uphill), 0.0)
    }
}

/// Tilt of the floor: up, and the rate at which the floor bends under the robot, at heading zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingFloor {
    up: Vector3<f64>,
    bend: AngularMotion,
}

/// Motion of a robot on it, floor frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorMotion {
    /// Up, unit length.
    pub up: Vector3<f64>,
    /// Earth's rate, rad/s.
    pub earth: Vector3<f64>,
    /// Rotation of the robot against the Earth.
    pub angular_motion: AngularMotion,
}

impl BendingFloor {
    /// `level` is the level part of up, with its first and second derivative.
    ///
    /// Up is fixed in the world: `d(up)/dt = -e x up`. The rate `e` that does this without a part about the floor's
    /// normal is `(u_y', -u_x', 0) / u_z`.
    pub fn new(level: Vector3<f64>, rate: Vector3<f64>, acceleration: Vector3<f64>) -> Self {
        let height = (1.0 - level.norm_squared()).sqrt();
        let height_rate = -level.dot(&rate) / height;
        let across = |v: Vector3<f64>| Vector3::new(v.y, -v.x, 0.0);
        let bend_rate = across(rate) / height;
        Self {
            up: level + Vector3::z() * height,
            bend: AngularMotion {
                rate: bend_rate,
                acceleration: (across(acceleration) - bend_rate * height_rate) / height,
            },
        }
    }

    /// For a robot that turns on the floor; latitude in rad, `None` for an Earth that does not turn.
    pub fn turned(&self, turning: &RobotHeading, latitude: Option<f64>) -> FloorMotion {
        let heading = Series::of([turning.heading, turning.rate, turning.acceleration]);
        let (turn, angular_motion) = self.bend.turned(&Vector3::z_axis(), &heading);
        let earth = latitude.map_or(Vector3::zeros(), |latitude| self.earth_rate(latitude));
        FloorMotion {
            up: turn.inverse_transform_vector(&self.up),
            earth: turn.inverse_transform_vector(&earth),
            angular_motion,
        }
    }

    /// The Earth's rate: north is where x points, laid level.
    fn earth_rate(&self, latitude: f64) -> Vector3<f64> {
        let north = (Vector3::x() - self.up * self.up.x).normalize();
        (north * libm::cos(latitude) + self.up * libm::sin(latitude)) * EARTH_RATE
    }
}
