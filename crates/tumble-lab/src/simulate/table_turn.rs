//! One turn of the table: a rotation about a fixed axis within limits of rate and acceleration.

use nalgebra::Vector3;
use serde::Deserialize;

/// Shape of the angular rate over a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TurnProfile {
    /// Raised cosine: rate and acceleration are continuous.
    Smooth,
    /// Constant acceleration, constant rate, constant deceleration.
    Trapezoid,
}

/// Limits of the speed of a table's turns.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnLimits {
    /// Largest angular rate, rad/s.
    pub rate: f64,
    /// Largest angular acceleration, rad/s^2.
    pub acceleration: f64,
}

/// Progress of a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnProgress {
    /// Angle turned, rad.
    pub angle: f64,
    /// Its rate, rad/s.
    pub rate: f64,
    /// Its acceleration, rad/s^2.
    pub acceleration: f64,
}

/// A turn that starts and ends at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableTurn {
    /// Unit vector.
    pub axis: Vector3<f64>,
    /// Whole angle, rad, not negative.
    pub angle: f64,
    /// Time it takes, s.
    pub duration: f64,
    shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Smooth,
    Trapezoid { ramp: f64, acceleration: f64 },
}

impl TableTurn {
    /// The quickest turn of that profile within the limits; `rotation` is its rotation vector, rad, not zero.
    pub fn new(rotation: Vector3<f64>, profile: TurnProfile, limits: &TurnLimits) -> Self {
        let angle = rotation.norm();
        let (duration, shape) = match profile {
            TurnProfile::Smooth => (smooth_duration(angle, limits), Shape::Smooth),
            TurnProfile::Trapezoid => trapezoid(angle, limits),
        };
        Self {
            axis: rotation / angle,
            angle,
            duration,
            shape,
        }
    }

    /// Progress `elapsed` seconds after the start.
    pub fn progress(&self, elapsed: f64) -> TurnProgress {
        let elapsed = elapsed.clamp(0.0, self.duration);
        match self.shape {
            Shape::Smooth => self.smooth(elapsed / self.duration),
            Shape::Trapezoid { ramp, acceleration } => self.trapezoidal(elapsed, ramp, acceleration),
        }
    }

    fn smooth(&self, part: f64) -> TurnProgress {
        let mean_rate = self.angle / self.duration;
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * part);
        TurnProgress {
            angle: self.angle * (part - sin / core::f64::consts::TAU),
            rate: mean_rate * (1.0 - cos),
            acceleration: mean_rate / self.duration * core::f64::consts::TAU * sin,
        }
    }

    fn trapezoidal(&self, elapsed: f64, ramp: f64, acceleration: f64) -> TurnProgress {
        let left = self.duration - elapsed;
        if elapsed < ramp {
            let rate = acceleration * elapsed;
            TurnProgress {
                angle: rate * elapsed / 2.0,
                rate,
                acceleration,
            }
        } else if left < ramp {
            let rate = acceleration * left;
            TurnProgress {
                angle: self.angle - rate * left / 2.0,
                rate,
                acceleration: -acceleration,
            }
        } else {
            let rate = acceleration * ramp;
            TurnProgress {
                angle: rate * (elapsed - ramp / 2.0),
                rate,
                acceleration: 0.0,
            }
        }
    }
}

/// Rate peaks at twice the mean rate, acceleration at 2 pi times the mean rate over the duration.
fn smooth_duration(angle: f64, limits: &TurnLimits) -> f64 {
    let by_rate = 2.0 * angle / limits.rate;
    let by_acceleration = (core::f64::consts::TAU * angle / limits.acceleration).sqrt();
    by_rate.max(by_acceleration)
}

fn trapezoid(angle: f64, limits: &TurnLimits) -> (f64, Shape) {
    let ramp = (limits.rate / limits.acceleration).min((angle / limits.acceleration).sqrt());
    let cruise = angle / (limits.acceleration * ramp) - ramp;
    (
        2.0 * ramp + cruise,
        Shape::Trapezoid {
            ramp,
            acceleration: limits.acceleration,
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn profile() -> impl Strategy<Value = TurnProfile> {
        prop_oneof![Just(TurnProfile::Smooth), Just(TurnProfile::Trapezoid)]
    }

    proptest! {
        #[test]
        fn a_turn_starts_and_ends_at_rest_having_turned_its_angle(
            angle in 1e-6..7.0f64, rate in 0.1..5.0f64, acceleration in 0.1..20.0f64, profile in profile(),
        ) {
            let turn = TableTurn::new(Vector3::x() * angle, profile, &TurnLimits { rate, acceleration });
            let (start, end) = (turn.progress(0.0), turn.progress(turn.duration));
            prop_assert!(start.angle.abs() < 1e-12 && start.rate.abs() < 1e-9);
            prop_assert!((end.angle - angle).abs() < 1e-12 && end.rate.abs() < 1e-9);
        }

        #[test]
        fn a_turn_keeps_within_its_limits_and_reaches_one_of_them(
            angle in 1e-3..7.0f64, rate in 0.1..5.0f64, acceleration in 0.1..20.0f64, profile in profile(),
        ) {
            let turn = TableTurn::new(Vector3::y() * angle, profile, &TurnLimits { rate, acceleration });
            let along: Vec<_> = (0..=1000).map(|i| turn.progress(turn.duration * f64::from(i) / 1000.0)).collect();
            let peak_rate = along.iter().map(|p| p.rate).fold(0.0, f64::max);
            let peak_acceleration = along.iter().map(|p| p.acceleration.abs()).fold(0.0, f64::max);
            prop_assert!(peak_rate < rate * (1.0 + 1e-9));
            prop_assert!(peak_acceleration < acceleration * (1.0 + 1e-9));
            prop_assert!(peak_rate > 0.99 * rate || peak_acceleration > 0.99 * acceleration);
        }

        #[test]
        fn rate_and_acceleration_are_derivatives_of_the_angle(
            angle in 0.1..7.0f64, part in 0.02..0.98f64, profile in profile(),
        ) {
            let turn = TableTurn::new(Vector3::z() * angle, profile, &TurnLimits { rate: 1.0, acceleration: 2.0 });
            let (t, h) = (part * turn.duration, 1e-5);
            // The corners of the trapezoid have no derivative of the rate.
            prop_assume!([0.5, turn.duration - 0.5].iter().all(|corner| (t - corner).abs() > 2.0 * h));
            let (before, now, after) = (turn.progress(t - h), turn.progress(t), turn.progress(t + h));
            prop_assert!((now.rate - (after.angle - before.angle) / (2.0 * h)).abs() < 1e-6);
            prop_assert!((now.acceleration - (after.rate - before.rate) / (2.0 * h)).abs() < 1e-6);
        }
    }
}
