//! Scale error of the gyroscope about the turning axis, from angles truly turned (docs/theory/spin.md, eq. 20).

use nalgebra::Vector3;

use crate::products::columns;
use crate::real::{Real, real};
use crate::spin::axis::AxisFit;
use crate::spin::estimate::{ScalarEstimate, TrueAngle};
use crate::spin::estimator::{Direction, LEAST_TURN, TurnTotals};
use crate::spin::level_free::SpinPriors;

/// Scale error of each direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scales<T: Real> {
    pub clockwise: ScalarEstimate<T>,
    pub counter_clockwise: ScalarEstimate<T>,
}

/// Scale error of each direction: `(angle seen - bias left over) / true angle - 1`.
pub(super) fn scales<T: Real>(
    axis: &AxisFit<T>,
    counted: &Vector3<T>,
    turned: &TurnTotals<T>,
    truth: Option<&TrueAngle<T>>,
    walk: T,
) -> Scales<T> {
    let drift = (axis.bias - counted).dot(&columns(&axis.floor)[2]); // eq. 8: epsilon
    let one = |direction: &Direction<T>, sign: T, angle: Option<T>| {
        let Some((truth, angle)) = truth.zip(angle).filter(|(_, angle)| *angle > real(LEAST_TURN)) else {
            return ScalarEstimate::unknown();
        };
        let time = direction.duration;
        let seen = direction.angle - sign * drift * time; // eq. 20: h - epsilon t
        let variance = truth.sigma * truth.sigma + axis.covariance[(2, 2)] * time * time + walk * time; // eq. 20
        ScalarEstimate {
            value: seen / angle - T::one(),        // eq. 20
            sigma: variance.square_root() / angle, // eq. 20
        }
    };
    Scales {
        clockwise: one(&turned.clockwise, -T::one(), truth.and_then(|t| t.clockwise)),
        counter_clockwise: one(
            &turned.counter_clockwise,
            T::one(),
            truth.and_then(|t| t.counter_clockwise),
        ),
    }
}

/// One scale for both directions: the weighted mean with what any gyroscope may have.
pub(super) fn common_scale<T: Real>(scales: &Scales<T>, sigma: T) -> (T, T) {
    let (mut weight, mut sum) = (T::one() / (sigma * sigma), T::zero());
    for scale in [&scales.clockwise, &scales.counter_clockwise] {
        if scale.is_known() {
            let each = T::one() / (scale.sigma * scale.sigma);
            weight += each;
            sum += each * scale.value;
        }
    }
    (sum / weight, T::one() / weight.square_root())
}

/// Over turns in one direction a scale error looks like a slow turn at rest: one is not to be found for want of the
/// other. A scale that a true angle has shown stands.
pub(super) fn widened_scale<T: Real>(priors: &SpinPriors<T>, prior_sigma: T) -> (T, T) {
    const WIDENED: f64 = 5.0;
    let (scale, sigma) = priors.scale;
    let known = sigma < prior_sigma * real(0.5);
    (scale, if known { sigma } else { sigma * real(WIDENED) })
}
