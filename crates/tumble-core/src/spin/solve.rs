//! A spin solved from what was kept of it: the fit with the bias that its rest showed, or the one without it
//! (docs/theory/spin.md, eq. 13 to 19).

use nalgebra::Vector3;

use crate::real::{Real, real};
use crate::regression::reduced;
use crate::spin::axis::{self, AxisFit, TurningRates, floored};
use crate::spin::estimate::{ScalarEstimate, SpinEstimate, TrueAngle};
use crate::spin::estimator::{LEAST_TURN, SpinEstimator};
use crate::spin::failure::SpinFailure;
use crate::spin::level_free::{self, GYROSCOPE_UP, LevelFree, SpinPriors};
use crate::spin::outputs::from_fit;
use crate::spin::rests::Rests;
use crate::spin::scale::{Scales, common_scale, scales, widened_scale};

/// Sigma of the gyroscope bias along the axis where the rest does not count, rad/s.
const BIAS_UNKNOWN: f64 = 0.1;
/// Variance of a row over that of a block: the square of the trapezoid of eq. 10.
const ROW_OF_BLOCK: f64 = 5.0 / 12.0;
/// The random walk of the heading as a constant rate over the spin: its variance over that of the end point.
const WALK_SHARE: f64 = 1.2;

/// Solves for everything.
///
/// # Errors
/// [`SpinFailure::NoRest`], [`SpinFailure::NoTurn`], [`SpinFailure::FloorTooSteep`], [`SpinFailure::Unsolvable`].
pub fn solve<T: Real>(
    spin: &SpinEstimator<T>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<SpinEstimate<T>, SpinFailure<T>> {
    let (priors, scales) = prepare(spin, true_angle)?;
    let (fit, slow_turn, turned_while_still) = choose_fit(spin, &priors)?;
    let estimate = from_fit(spin, &priors, &fit, &scales, (slow_turn, turned_while_still));
    let (tilt, limit) = (&estimate.floor_tilt, spin.settings().largest_floor_tilt);
    if tilt.value - tilt.sigma * real(3.0) > limit {
        return Err(SpinFailure::FloorTooSteep {
            tilt: tilt.value,
            limit,
        });
    }
    Ok(estimate)
}

/// How heading should be counted from here on, rad a rad and rad a second.
///
/// Before a full turn was made the bias is that of the rest: harmonics of a part of a turn can be bent to many shapes.
///
/// # Errors
/// As of [`solve`].
pub fn heading_correction<T: Real>(spin: &SpinEstimator<T>) -> Result<(T, T), SpinFailure<T>> {
    let (priors, _) = prepare(spin, None)?;
    let fit = if spin.turned().span() < real(core::f64::consts::TAU) {
        fit(spin, &priors)?
    } else {
        choose_fit(spin, &priors)?.0
    };
    Ok((fit.heading_correction(T::one(), T::zero()), fit.by_time))
}

fn prepare<T: Real>(
    spin: &SpinEstimator<T>,
    true_angle: Option<&TrueAngle<T>>,
) -> Result<(SpinPriors<T>, Scales<T>), SpinFailure<T>> {
    let (rests, reference) = spin
        .rests()
        .zip(spin.heading_reference())
        .ok_or(SpinFailure::NoRest)?;
    let turned = spin.turned();
    if turned.angle() < real(LEAST_TURN) || spin.rate_moments().points() < 3 {
        return Err(SpinFailure::NoTurn {
            turned: turned.angle(),
        });
    }
    let rates = TurningRates {
        moments: *spin.rate_moments(),
        frame: *spin.frame(),
        counted_bias: reference.bias,
    };
    let instability = spin.settings().angular_rate_instability;
    let axis = axis::fit(&rates, &rests.rate(instability), &reference.up);
    let walk = spin.heading_walk(&axis);
    let scales = scales(&axis, &reference.bias, turned, true_angle, walk);
    let priors = priors(spin, rests, &axis, &reference.bias, walk, &scales);
    Ok((priors, scales))
}

fn fit<T: Real>(spin: &SpinEstimator<T>, priors: &SpinPriors<T>) -> Result<LevelFree<T>, SpinFailure<T>> {
    let rests = spin.rests().ok_or(SpinFailure::NoRest)?;
    level_free::fit(rests.harmonics(), spin.turning(), priors).map_err(|_| SpinFailure::Unsolvable)
}

/// The fit with the bias that the rest showed; the one without it where the harmonics contradict that bias.
fn choose_fit<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
) -> Result<(LevelFree<T>, ScalarEstimate<T>, bool), SpinFailure<T>> {
    let with_rest = fit(spin, priors)?;
    let without_rest = fit(
        spin,
        &SpinPriors {
            bias_variance: real(BIAS_UNKNOWN * BIAS_UNKNOWN),
            scale: widened_scale(priors, spin.settings().scale_sigma),
            ..*priors
        },
    )?;
    let (slow_turn, found) = slow_turn(&without_rest, priors);
    Ok((if found { without_rest } else { with_rest }, slow_turn, found))
}

fn priors<T: Real>(
    spin: &SpinEstimator<T>,
    rests: &Rests<T>,
    axis: &AxisFit<T>,
    counted_bias: &Vector3<T>,
    walk: T,
    scales: &Scales<T>,
) -> SpinPriors<T> {
    let as_at_rest = rests.block_variance(0) * real::<T>(ROW_OF_BLOCK);
    SpinPriors {
        gravity: spin.settings().gravity,
        origin: rests.first_force(),
        axis: *axis,
        counted_bias: *counted_bias,
        scale: common_scale(scales, spin.settings().scale_sigma),
        bias_variance: axis.covariance[(2, 2)],
        walk_variance: walk * real(WALK_SHARE) / spin.turned().duration(), // eq. 13
        rest_variance: rests
            .line_variance(spin.settings().specific_force_instability)
            .map(|v| floored(v, LEAST)),
        turning_variance: spin
            .turning()
            .variance()
            .unwrap_or(as_at_rest)
            .map(|v| floored(v, LEAST)),
    }
}

/// Smallest variance of a specific force that is divided by, (m/s^2)^2.
const LEAST: f64 = 1e-12;

/// The rate at rest that the harmonics ask for, and whether chance could not have made it. Harmonics that fit the model
/// neither way ask for nothing.
fn slow_turn<T: Real>(without_rest: &LevelFree<T>, priors: &SpinPriors<T>) -> (ScalarEstimate<T>, bool) {
    const SIGMAS: f64 = 5.0;
    const DRIFT: f64 = 3e-4;
    const FITS: f64 = 4.0;
    let i = GYROSCOPE_UP;
    if !without_rest.solution.observed(i) {
        return (ScalarEstimate::unknown(), false);
    }
    let variance = without_rest.solution.covariance[(i, i)];
    let value = -without_rest.solution.x[i];
    let chance = (variance + priors.bias_variance).square_root();
    let reduced = reduced(without_rest.solution.chi_square, without_rest.degrees_of_freedom);
    let found = value.abs() > chance * real(SIGMAS) + real(DRIFT) && reduced < real(FITS); // eq. 19
    (ScalarEstimate { value, sigma: chance }, found)
}
