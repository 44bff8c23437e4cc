//! The published estimator: the floor is level, so the turning axis is the direction of gravity.
//!
//! `n = (mean(y_2) - b_g) / |...|`, its sign such that `n . mean(a_1) > 0`; `b_a = mean(a_1) - g n`
//! (docs/theory/spin.md, eq. 1 to 3). Turns in both directions are brought to one by the sign of each.

use nalgebra::{Matrix3, Vector3};

use crate::products::{Length, combined, congruent, diagonal, identity, outer};
use crate::real::{Real, real};
use crate::spin::axis::RestingRate;

/// First data, second data, and gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFloorInputs<T: Real> {
    /// Mean angular rate at rest.
    pub rest: RestingRate<T>,
    /// Mean specific force at rest, m/s^2.
    pub specific_force: Vector3<T>,
    /// Variance of that mean, each axis, (m/s^2)^2.
    pub specific_force_variance: Vector3<T>,
    /// Angle turned less bias, counter-clockwise added to clockwise with its sign turned, rad.
    pub turned: Vector3<T>,
    /// Duration of counter-clockwise less that of clockwise turning, s.
    pub net_duration: T,
    /// Variance of the angle from noise while turning, each direction across the axis, rad^2.
    pub turned_variance: T,
    /// Gravity, m/s^2.
    pub gravity: T,
}

/// Biases on level ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFloor<T: Real> {
    /// Turning axis, upwards, unit length, case frame.
    pub up: Vector3<T>,
    /// Accelerometer bias, m/s^2.
    pub bias: Vector3<T>,
    /// Covariance of that bias if the floor is level, (m/s^2)^2.
    pub covariance: Matrix3<T>,
}

/// The estimate; `None` if the robot did not turn.
pub fn estimate<T: Real>(readings: &LevelFloorInputs<T>) -> Option<LevelFloor<T>> {
    let angle = readings.turned.length();
    if angle < real(1e-3) {
        return None;
    }
    let upwards = if readings.turned.dot(&readings.specific_force) < T::zero() {
        -T::one()
    } else {
        T::one()
    };
    let up = readings.turned * (upwards / angle); // eq. 2
    let across = identity() - outer(&up, &up);
    let squared_duration = readings.net_duration * readings.net_duration;
    let of_turn = |at_rest: T| at_rest * squared_duration + readings.turned_variance;
    let at_rest = &readings.rest.variance;
    let of_turn = diagonal(of_turn(at_rest.x), of_turn(at_rest.y), of_turn(at_rest.z));
    let lever = readings.gravity / angle;
    let mut covariance = congruent(&across, &of_turn) * (lever * lever);
    covariance.m11 += readings.specific_force_variance.x;
    covariance.m22 += readings.specific_force_variance.y;
    covariance.m33 += readings.specific_force_variance.z;
    Some(LevelFloor {
        up,
        bias: combined(&[(&readings.specific_force, T::one()), (&up, -readings.gravity)]), // eq. 3
        covariance,
    })
}
