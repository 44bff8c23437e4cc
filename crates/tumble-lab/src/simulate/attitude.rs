//! Attitude of a body by heading, pitch and roll, with its angular rate and angular acceleration.
//!
//! Frames: *level* (x east, y north, z up), *body* (forward, left, up; turns with the body). The attitude is
//! `level_from_body = R_z(heading) R_y(pitch) R_x(roll)`.

use nalgebra::{Rotation3, Unit, Vector3};
use serde::{Deserialize, Deserializer};

use crate::simulate::series::Series;

/// Rotation of a frame against the level one, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngularMotion {
    /// rad/s.
    pub rate: Vector3<f64>,
    /// Its derivative, rad/s^2.
    pub acceleration: Vector3<f64>,
}

impl AngularMotion {
    /// Motion of the level frame itself.
    pub const NONE: Self = Self {
        rate: Vector3::new(0.0, 0.0, 0.0),
        acceleration: Vector3::new(0.0, 0.0, 0.0),
    };

    /// Motion of a frame that is turned against this one about an axis of both; returns its rotation too.
    ///
    /// With `e` the axis, `s` the angle and `w` this rate seen from the turned frame: the rate is `w + s' e`, the
    /// acceleration `dw + s'' e + w x s' e`.
    pub fn turned(&self, axis: &Unit<Vector3<f64>>, angle: &Series<3>) -> (Rotation3<f64>, Self) {
        let turn = Rotation3::from_axis_angle(axis, angle.value());
        let about = **axis * angle.derivative(1);
        let rate = turn.inverse_transform_vector(&self.rate);
        let acceleration = turn.inverse_transform_vector(&self.acceleration)
            + **axis * angle.derivative(2)
            + rate.cross(&about);
        let angular_motion = Self {
            rate: rate + about,
            acceleration,
        };
        (turn, angular_motion)
    }
}

/// Attitude as functions of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EulerAngles {
    /// Counter-clockwise from east, rad.
    pub heading: Series<3>,
    /// Front down, rad.
    pub pitch: Series<3>,
    /// Left side up, rad.
    pub roll: Series<3>,
}

impl EulerAngles {
    /// The attitude at which the body's up points along `up`, level frame, at that heading.
    pub fn upright(up: &[Series<3>; 3], heading: Series<3>) -> Self {
        let (sine, cosine) = heading.sincos();
        let forward = cosine * up[0] + sine * up[1];
        let left = cosine * up[1] - sine * up[0];
        Self {
            heading,
            pitch: forward.atan2(&up[2]),
            roll: (-left).atan2(&(forward * forward + up[2] * up[2]).sqrt()),
        }
    }

    /// `level_from_body`, and how the body turns.
    pub fn attitude(&self) -> (Rotation3<f64>, AngularMotion) {
        let (heading, angular_motion) = AngularMotion::NONE.turned(&Vector3::z_axis(), &self.heading);
        let (pitch, angular_motion) = angular_motion.turned(&Vector3::y_axis(), &self.pitch);
        let (roll, angular_motion) = angular_motion.turned(&Vector3::x_axis(), &self.roll);
        (heading * pitch * roll, angular_motion)
    }
}

/// `case_from_body` of an IMU mounted with roll, pitch and yaw, rad: `body_from_case = R_z(yaw) R_y(pitch) R_x(roll)`.
pub fn mounted(roll: f64, pitch: f64, yaw: f64) -> Rotation3<f64> {
    let about = |axis: Unit<Vector3<f64>>, angle| Rotation3::from_axis_angle(&axis, angle);
    let body_from_case =
        about(Vector3::z_axis(), yaw) * about(Vector3::y_axis(), pitch) * about(Vector3::x_axis(), roll);
    body_from_case.inverse()
}

/// Reads [`mounted`] from roll, pitch and yaw, rad.
///
/// # Errors
/// Where these are not three numbers.
pub fn roll_pitch_yaw<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Rotation3<f64>, D::Error> {
    let [roll, pitch, yaw] = Deserialize::deserialize(deserializer)?;
    Ok(mounted(roll, pitch, yaw))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn wave(t: f64, pace: f64) -> Series<3> {
        (Series::time(t) * pace).sincos().0
    }

    fn angles(t: f64) -> EulerAngles {
        EulerAngles {
            heading: wave(t, 0.8) * 2.0,
            pitch: wave(t, 1.1) * 0.6,
            roll: wave(t, 1.7) * 0.9,
        }
    }

    proptest! {
        #[test]
        fn rate_and_acceleration_are_derivatives_of_the_attitude(t in 0.0..20.0f64) {
            let h = 1e-4;
            let (before, last) = angles(t - h).attitude();
            let (now, angular_motion) = angles(t).attitude();
            let (after, next) = angles(t + h).attitude();
            let turned = (before.inverse() * after).scaled_axis() / (2.0 * h);
            prop_assert!((turned - angular_motion.rate).amax() < 1e-5, "{turned} {}", angular_motion.rate);
            let slope = (next.rate - last.rate) / (2.0 * h);
            prop_assert!((slope - angular_motion.acceleration).amax() < 1e-5);
            prop_assert!((now.matrix().determinant() - 1.0).abs() < 1e-12);
        }

        #[test]
        fn the_body_stands_upright_along_what_it_is_told(
            x in -8.0..8.0f64, y in -8.0..8.0f64, z in 0.5..20.0f64, heading in -3.0..3.0f64,
        ) {
            let up = [x, y, z].map(Series::constant);
            let (level_from_body, _) = EulerAngles::upright(&up, Series::constant(heading)).attitude();
            let expected = Vector3::new(x, y, z).normalize();
            prop_assert!((level_from_body * Vector3::z() - expected).amax() < 1e-12);
            prop_assert!((level_from_body * Vector3::x()).dot(&Vector3::new(-heading.sin(), heading.cos(), 0.0)).abs() < 1e-12);
        }
    }
}
