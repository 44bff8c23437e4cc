//! From the unknowns of the fit to the quantities people ask for, with their sigmas.

use nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3};

use crate::products::Length;
use crate::real::{Real, real};
use crate::spin::axis;
use crate::spin::estimate::{ScalarEstimate, SpinEstimate, VectorEstimate};
use crate::spin::estimator::SpinEstimator;
use crate::spin::level_floor::{self, LevelFloorInputs};
use crate::spin::level_free::{AXIS, LEVER_ARM, LevelFree, SCALE, SpinPriors, UNKNOWNS, UPHILL};
use crate::spin::rests::Rests;
use crate::spin::scale::Scales;

/// Sigma of an accelerometer bias beyond which it counts as not shown, m/s^2: a floor tilt of 3 deg.
const LARGEST_USEFUL_SIGMA: f64 = 0.5;
/// Sigma below which the level-free bias of a part of a turn is the result, m/s^2: a floor taken for level is seldom known
/// to be level to 0.1 deg.
const TRUSTED_SIGMA: f64 = 0.02;

/// Everything a fit says, in the quantities people ask for (docs/theory/spin.md, eq. 18).
pub(super) fn from_fit<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
    fit: &LevelFree<T>,
    scales: &Scales<T>,
    (slow_turn, turned_while_still): (ScalarEstimate<T>, bool),
) -> SpinEstimate<T> {
    let widening = fit.widening();
    let covariance = fit.solution.covariance * (widening * widening);
    let joint = biases(&fit.floor, &covariance);
    let accelerometer = accelerometer_bias(spin, priors, fit, &joint);
    let attitude = floor_attitude(fit, &covariance);
    let (floor_tilt, uphill_bearing) = uphill(priors, &fit.solution.x, &covariance, attitude.forward_sigma);
    SpinEstimate {
        turned: *spin.turned(),
        resting_time: spin.rests().map_or(T::zero(), Rests::time),
        samples: spin.samples(),
        noise: noise(spin),
        gyroscope_bias: gyroscope_bias(spin, fit, &joint),
        level_free: accelerometer.level_free,
        level_floor: accelerometer.level_floor,
        level_free_is_default: accelerometer.level_free_is_default,
        covariance: accelerometer.covariance,
        up: fit.up,
        roll: attitude.roll,
        pitch: attitude.pitch,
        floor_tilt,
        uphill_bearing,
        lever_arm: lever_arm(fit, &covariance),
        scale: scale(fit, priors, &covariance),
        scale_clockwise: scales.clockwise,
        scale_counter_clockwise: scales.counter_clockwise,
        slow_turn,
        turned_while_still,
        chi_square: fit.solution.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        widening,
        fit: *fit,
    }
}

/// Both estimates of the accelerometer bias, and which of them is the result.
struct AccelerometerBias<T: Real> {
    level_free: VectorEstimate<T>,
    level_floor: VectorEstimate<T>,
    level_free_is_default: bool,
    /// Of the result and the gyroscope bias.
    covariance: SMatrix<T, 6, 6>,
}

fn accelerometer_bias<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
    fit: &LevelFree<T>,
    joint: &SMatrix<T, 6, 6>,
) -> AccelerometerBias<T> {
    let level_free = bias(
        fit.accelerometer_bias(),
        Vector3::from_fn(|i, _| joint[(i, i)].square_root()),
    );
    let (level_floor, level_floor_covariance) = level_floor(spin, priors, joint);
    let full_turn = spin.turned().span() >= real(core::f64::consts::TAU);
    let trusted = full_turn || level_free.sigma.max() < real(TRUSTED_SIGMA);
    let level_free_is_default = trusted && !spin.settings().level_floor;
    AccelerometerBias {
        level_free,
        level_floor,
        level_free_is_default,
        covariance: if level_free_is_default {
            *joint
        } else {
            level_floor_covariance
        },
    }
}

fn gyroscope_bias<T: Real>(
    spin: &SpinEstimator<T>,
    fit: &LevelFree<T>,
    joint: &SMatrix<T, 6, 6>,
) -> VectorEstimate<T> {
    let earth = fit.up * spin.settings().earth_rate_up;
    VectorEstimate {
        value: fit.gyroscope_bias - earth,
        sigma: Vector3::from_fn(|i, _| joint[(3 + i, 3 + i)].square_root()),
        observed: true,
    }
}

/// How the IMU sits on the floor.
struct FloorAttitude<T: Real> {
    roll: ScalarEstimate<T>,
    pitch: ScalarEstimate<T>,
    /// 1-sigma of the direction that counts as forward, rad.
    forward_sigma: T,
}

fn floor_attitude<T: Real>(
    fit: &LevelFree<T>,
    covariance: &SMatrix<T, UNKNOWNS, UNKNOWNS>,
) -> FloorAttitude<T> {
    let (roll, pitch) = axis::tilt(&fit.up); // eq. 18
    let tilt_sigma = |i: usize| covariance[(AXIS + i, AXIS + i)].square_root();
    let (sine, cosine) = pitch.sine_cosine();
    FloorAttitude {
        roll: ScalarEstimate {
            value: roll,
            sigma: tilt_sigma(1) / cosine.abs().max(real(1e-6)),
        },
        pitch: ScalarEstimate {
            value: pitch,
            sigma: tilt_sigma(0),
        },
        // Forward turns with the roll where x points up or down.
        forward_sigma: tilt_sigma(1) * (sine / cosine.max(real(1e-6))).abs(),
    }
}

/// Scatter of one sample, accelerometer and gyroscope, at rest and turning.
fn noise<T: Real>(spin: &SpinEstimator<T>) -> [Vector3<T>; 4] {
    let at_rest = |first: usize| {
        spin.rests()
            .map_or(Vector3::zeros(), |rests| rests.sample_variance(first))
            .map(|v| v.square_root())
    };
    let [fx, fy, fz, wx, wy, wz] = spin.turning_noise().map(|v| v.square_root());
    [
        at_rest(0),
        Vector3::new(fx, fy, fz),
        at_rest(3),
        Vector3::new(wx, wy, wz),
    ]
}

/// Covariance of both biases in the case frame.
fn biases<T: Real>(floor: &Matrix3<T>, covariance: &SMatrix<T, UNKNOWNS, UNKNOWNS>) -> SMatrix<T, 6, 6> {
    let mut turn = SMatrix::<T, 6, 6>::identity();
    turn.fixed_view_mut::<3, 3>(3, 3).copy_from(floor);
    turn * covariance.fixed_view::<6, 6>(0, 0) * turn.transpose()
}

fn bias<T: Real>(value: Vector3<T>, sigma: Vector3<T>) -> VectorEstimate<T> {
    VectorEstimate {
        value,
        sigma,
        observed: sigma.max() < real(LARGEST_USEFUL_SIGMA),
    }
}

/// What the estimator for level floors says, and its covariance with the gyroscope bias; unknown if the robot did not turn.
fn level_floor<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
    joint: &SMatrix<T, 6, 6>,
) -> (VectorEstimate<T>, SMatrix<T, 6, 6>) {
    let inputs = spin.rests().map(|rests| level_floor_inputs(spin, rests, priors));
    let Some(found) = inputs.and_then(|inputs| level_floor::estimate(&inputs)) else {
        let unknown = Vector3::repeat(T::max_value().unwrap_or(T::zero()));
        return (bias(Vector3::zeros(), unknown), *joint);
    };
    let mut both = *joint;
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&found.covariance);
    both.fixed_view_mut::<3, 3>(0, 3).fill(T::zero());
    both.fixed_view_mut::<3, 3>(3, 0).fill(T::zero());
    let sigma = found.covariance.diagonal().map(|v| v.square_root());
    (bias(found.bias, sigma), both)
}

fn level_floor_inputs<T: Real>(
    spin: &SpinEstimator<T>,
    rests: &Rests<T>,
    priors: &SpinPriors<T>,
) -> LevelFloorInputs<T> {
    let turned = spin.turned();
    let settings = spin.settings();
    let (of_force, of_rate) = (
        settings.specific_force_instability,
        settings.angular_rate_instability,
    );
    LevelFloorInputs {
        rest: rests.rate(of_rate),
        specific_force: rests.first_force(),
        specific_force_variance: rests.first_force_variance(of_force),
        turned: turned.vector,
        net_duration: turned.counter_clockwise.duration - turned.clockwise.duration,
        turned_variance: spin.heading_walk(&priors.axis) * turned.duration(),
        gravity: priors.gravity,
    }
}

/// Tilt of the floor and bearing of uphill.
fn uphill<T: Real>(
    priors: &SpinPriors<T>,
    x: &SVector<T, UNKNOWNS>,
    covariance: &SMatrix<T, UNKNOWNS, UNKNOWNS>,
    forward_sigma: T,
) -> (ScalarEstimate<T>, ScalarEstimate<T>) {
    const SHOWN: f64 = 3.0;
    let pull = x.fixed_rows::<2>(UPHILL).into_owned();
    let spread = covariance.fixed_view::<2, 2>(UPHILL, UPHILL).into_owned();
    let size = pull.length();
    let along = |direction: Vector2<T>| direction.dot(&(spread * direction)).square_root();
    let unit = if size > T::zero() {
        pull / size
    } else {
        Vector2::x()
    };
    let (lengthwise, crosswise) = (along(unit), along(Vector2::new(-unit.y, unit.x)));
    let sine = (size / priors.gravity).min(T::one());
    let cosine = (T::one() - sine * sine).square_root().max(real(1e-6));
    let tilt = ScalarEstimate {
        value: sine.arc_sine(), // eq. 18
        sigma: lengthwise / (priors.gravity * cosine),
    };
    let bearing = if size > crosswise * real(SHOWN) && forward_sigma < T::one() {
        ScalarEstimate {
            value: pull.y.atan2(pull.x),
            sigma: (crosswise / size).hypotenuse(forward_sigma),
        }
    } else {
        ScalarEstimate::unknown()
    };
    (tilt, bearing)
}

fn lever_arm<T: Real>(fit: &LevelFree<T>, covariance: &SMatrix<T, UNKNOWNS, UNKNOWNS>) -> VectorEstimate<T> {
    let plane = fit.floor.fixed_columns::<2>(0);
    let spread = plane * covariance.fixed_view::<2, 2>(LEVER_ARM, LEVER_ARM) * plane.transpose();
    VectorEstimate {
        value: plane * fit.solution.x.fixed_rows::<2>(LEVER_ARM),
        sigma: spread.diagonal().map(|v| v.max(T::zero()).square_root()),
        observed: fit.solution.observed(LEVER_ARM) && fit.solution.observed(LEVER_ARM + 1),
    }
}

/// Scale error about the axis, if harmonics or a true angle took most of the ignorance away.
fn scale<T: Real>(
    fit: &LevelFree<T>,
    priors: &SpinPriors<T>,
    covariance: &SMatrix<T, UNKNOWNS, UNKNOWNS>,
) -> ScalarEstimate<T> {
    let given = priors.scale.0 != T::zero();
    if !given && !fit.solution.observed(SCALE) {
        return ScalarEstimate::unknown();
    }
    ScalarEstimate {
        value: fit.solution.x[SCALE],
        sigma: covariance[(SCALE, SCALE)].square_root(),
    }
}
