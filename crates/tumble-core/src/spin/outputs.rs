//! From the unknowns of the fit to the quantities people ask for, with their sigmas.

use nalgebra::{ArrayStorage, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use crate::products::{Length, columns, congruent, diagonal, matrix_product, zeros};
use crate::real::{Real, real};
use crate::spin::axis;
use crate::spin::estimate::{ScalarEstimate, SpinEstimate, VectorEstimate};
use crate::spin::estimator::SpinEstimator;
use crate::spin::level_floor::{self, LevelFloorInputs};
use crate::spin::level_free::{
    ACCELEROMETER, AXIS, GYROSCOPE, LEVER_ARM, LevelFree, SCALE, SpinPriors, UNKNOWNS, UPHILL,
};
use crate::spin::rests::SpinRests;
use crate::spin::scale::Scales;

/// Sigma of an accelerometer bias beyond which it counts as not shown, m/s^2: a floor tilt of 3 deg.
const LARGEST_USEFUL_SIGMA: f64 = 0.5;
/// Sigma below which the level-free bias of a part of a turn is the result, m/s^2: a floor taken for level is seldom known
/// to be level to 0.1 deg.
const TRUSTED_SIGMA: f64 = 0.02;

/// Converts a fit into the quantities that users ask for (docs/theory/spin.md, eq. 18).
pub(super) fn from_fit<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
    fit: &LevelFree<T>,
    scales: &Scales<T>,
    (slow_turn, turned_while_still): (ScalarEstimate<T>, bool),
) -> SpinEstimate<T> {
    let spread = Spread::of_fit(fit);
    let sine = pull(&fit.solution.x).size / fit.gravity;
    let along = spin.settings().earth_variance().along_normal(sine);
    let joint = biases(&fit.floor, &spread, along);
    let accelerometer = accelerometer_bias(spin, priors, fit, &joint);
    let attitude = floor_attitude(fit, &spread);
    SpinEstimate {
        turned: *spin.turned(),
        resting_time: spin.rests().map_or(T::zero(), SpinRests::time),
        samples: spin.samples(),
        noise: noise(spin),
        gyroscope_bias: gyroscope_bias(spin, fit, &joint),
        level_free: accelerometer.level_free,
        level_floor: accelerometer.level_floor,
        level_free_is_default: accelerometer.level_free_is_default,
        covariance: accelerometer.covariance,
        by_earth: by_earth(priors, fit, along),
        up: fit.up,
        roll: attitude.roll,
        pitch: attitude.pitch,
        floor_tilt: floor_tilt(priors, fit),
        uphill_bearing: uphill_bearing(fit, attitude.forward_sigma),
        lever_arm: lever_arm(fit, &spread),
        scale: scale(spin, fit, priors, &spread),
        scale_clockwise: scales.clockwise,
        scale_counter_clockwise: scales.counter_clockwise,
        slow_turn,
        turned_while_still,
        chi_square: fit.solution.chi_square,
        degrees_of_freedom: fit.degrees_of_freedom,
        widening: fit.widened,
    }
}

/// Covariance of the unknowns.
struct Spread<'a, T: Real> {
    covariance: &'a SMatrix<T, UNKNOWNS, UNKNOWNS>,
}

impl<'a, T: Real> Spread<'a, T> {
    fn of_fit(fit: &'a LevelFree<T>) -> Self {
        Self {
            covariance: &fit.solution.covariance,
        }
    }

    fn of(&self, i: usize, j: usize) -> T {
        self.covariance.get((i, j)).map_or(T::zero(), |value| *value)
    }

    fn sigma(&self, i: usize) -> T {
        self.of(i, i).square_root()
    }

    /// Covariance of two neighbours from `first` with two from `second`.
    fn pair(&self, first: usize, second: usize) -> Matrix2<T> {
        Matrix2::from_fn(|i, j| self.of(first + i, second + j))
    }

    /// 1-sigma of `a . (x_first, x_first+1)`.
    fn along(&self, first: usize, a: &Vector2<T>) -> T {
        let covariance = self.pair(first, first);
        a.dot(&(covariance * a)).max(T::zero()).square_root()
    }
}

/// Both estimates of the accelerometer bias, and which of them is the result.
struct AccelerometerBias<T: Real> {
    level_free: VectorEstimate<T>,
    level_floor: VectorEstimate<T>,
    level_free_is_default: bool,
    /// Covariance of the result and the gyroscope bias.
    covariance: SMatrix<T, 6, 6>,
}

fn accelerometer_bias<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
    fit: &LevelFree<T>,
    joint: &SMatrix<T, 6, 6>,
) -> AccelerometerBias<T> {
    let level_free = bias(fit.accelerometer_bias(), sigma(joint, ACCELEROMETER));
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
    let tilt = pull(&fit.solution.x).size / fit.gravity;
    let vertical = (T::one() - tilt * tilt).max(T::zero()).square_root();
    let earth = fit.up * (spin.settings().earth_rate_up * vertical); // eq. 6e
    VectorEstimate {
        value: fit.gyroscope_bias - earth,
        sigma: sigma(joint, GYROSCOPE),
        observed: true,
    }
}

/// Attitude of the IMU on the floor.
struct FloorAttitude<T: Real> {
    roll: ScalarEstimate<T>,
    pitch: ScalarEstimate<T>,
    /// 1-sigma of the direction that counts as forward, rad.
    forward_sigma: T,
}

fn floor_attitude<T: Real>(fit: &LevelFree<T>, spread: &Spread<'_, T>) -> FloorAttitude<T> {
    let (roll, pitch) = axis::tilt(&fit.up); // eq. 18
    let tilt_sigma = |i: usize| spread.sigma(AXIS + i);
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
            .map_or(zeros(), |rests| rests.sample_variance(first))
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

/// Share of the Earth's rotation in the covariance of the gyroscope bias, case frame, given its variance along the axis.
fn by_earth<T: Real>(priors: &SpinPriors<T>, fit: &LevelFree<T>, along: T) -> Matrix3<T> {
    let across = &priors.axis.by_earth;
    let mut local = diagonal(across.m11, across.m22, along);
    (local.m12, local.m21) = (across.m12, across.m21);
    congruent(&fit.floor, &local)
}

/// Covariance of both biases in the case frame, given the variance of the Earth's rotation along the turning axis: heading is
/// counted from the rate at rest, so that it knows nothing of it.
fn biases<T: Real>(floor: &Matrix3<T>, spread: &Spread<'_, T>, along: T) -> SMatrix<T, 6, 6> {
    let block = |i: usize, j: usize| Matrix3::from_fn(|k, l| spread.of(i + k, j + l));
    let apart = matrix_product(&block(ACCELEROMETER, GYROSCOPE), &floor.transpose());
    joint(
        &block(ACCELEROMETER, ACCELEROMETER),
        &apart,
        &congruent(
            floor,
            &(block(GYROSCOPE, GYROSCOPE) + diagonal(T::zero(), T::zero(), along)), // eq. 6e
        ),
    )
}

/// 1-sigma of a triad of both, which begins at `first`.
#[inline(never)]
fn sigma<T: Real>(joint: &SMatrix<T, 6, 6>, first: usize) -> Vector3<T> {
    let variance = |i: usize| joint.get((first + i, first + i)).copied().unwrap_or(T::zero());
    Vector3::new(variance(0), variance(1), variance(2)).map(Real::square_root)
}

/// Joins the covariances of two triads and that between them.
fn joint<T: Real>(first: &Matrix3<T>, between: &Matrix3<T>, second: &Matrix3<T>) -> SMatrix<T, 6, 6> {
    let (first, between, second) = (&first.data.0, &between.data.0, &second.data.0);
    let mut joint = [[T::zero(); 6]; 6];
    for i in 0..3 {
        for j in 0..3 {
            joint[j][i] = first[j][i];
            joint[j + 3][i] = between[j][i];
            joint[j][i + 3] = between[i][j];
            joint[j + 3][i + 3] = second[j][i];
        }
    }
    SMatrix::from_array_storage(ArrayStorage(joint))
}

fn bias<T: Real>(value: Vector3<T>, sigma: Vector3<T>) -> VectorEstimate<T> {
    VectorEstimate {
        value,
        sigma,
        observed: sigma.max() < real(LARGEST_USEFUL_SIGMA),
    }
}

/// Estimate for level floors, and its covariance with the gyroscope bias; unknown if the robot did not turn.
fn level_floor<T: Real>(
    spin: &SpinEstimator<T>,
    priors: &SpinPriors<T>,
    of_both: &SMatrix<T, 6, 6>,
) -> (VectorEstimate<T>, SMatrix<T, 6, 6>) {
    let inputs = spin.rests().map(|rests| level_floor_inputs(spin, rests, priors));
    let Some(found) = inputs.and_then(|inputs| level_floor::estimate(&inputs)) else {
        let largest = T::max_value().unwrap_or(T::zero());
        let unknown = Vector3::new(largest, largest, largest);
        return (bias(zeros(), unknown), *of_both);
    };
    let of_gyroscope = of_both.fixed_view::<3, 3>(GYROSCOPE, GYROSCOPE).into_owned();
    let both = joint(&found.covariance, &zeros(), &of_gyroscope);
    let sigma = found.covariance.diagonal().map(|v| v.square_root());
    (bias(found.bias, sigma), both)
}

fn level_floor_inputs<T: Real>(
    spin: &SpinEstimator<T>,
    rests: &SpinRests<T>,
    priors: &SpinPriors<T>,
) -> LevelFloorInputs<T> {
    let turned = spin.turned();
    let settings = spin.settings();
    let (of_force, of_rate) = (
        settings.specific_force_instability,
        settings.angular_rate_instability,
    );
    // The part towards north, less that of the rest from which the turn is counted.
    let swept = turned.swept
        - Vector2::new(
            turned.counter_clockwise.duration - turned.clockwise.duration,
            T::zero(),
        );
    let by_earth = settings.earth_variance().across * swept.dot(&swept);
    LevelFloorInputs {
        rest: rests.rate(of_rate, &spin.rounding(rests)),
        specific_force: rests.first_force(),
        specific_force_variance: rests.first_force_variance(of_force, &spin.force_rounding(rests)),
        turned: turned.vector,
        net_duration: turned.counter_clockwise.duration - turned.clockwise.duration,
        turned_variance: spin.heading_walk(&priors.axis) * turned.duration() + by_earth,
        gravity: priors.gravity,
    }
}

/// Component of gravity along the floor, m/s^2, forward and left, with its size and its direction.
struct Pull<T: Real> {
    vector: Vector2<T>,
    size: T,
    unit: Vector2<T>,
}

fn pull<T: Real>(x: &SVector<T, UNKNOWNS>) -> Pull<T> {
    let vector = Vector2::new(x[UPHILL], x[UPHILL + 1]);
    let size = vector.length();
    Pull {
        vector,
        size,
        unit: if size > T::zero() {
            vector / size
        } else {
            Vector2::x()
        },
    }
}

/// Tilt of the floor, rad.
pub(super) fn floor_tilt<T: Real>(priors: &SpinPriors<T>, fit: &LevelFree<T>) -> ScalarEstimate<T> {
    let pull = pull(&fit.solution.x);
    let sine = (pull.size / priors.gravity).min(T::one());
    let cosine = (T::one() - sine * sine).square_root().max(real(1e-6));
    ScalarEstimate {
        value: sine.arc_sine(), // eq. 18
        sigma: Spread::of_fit(fit).along(UPHILL, &pull.unit) / (priors.gravity * cosine),
    }
}

/// Bearing of uphill, rad; unknown where the floor is level as far as the spin shows.
fn uphill_bearing<T: Real>(fit: &LevelFree<T>, forward_sigma: T) -> ScalarEstimate<T> {
    const SHOWN: f64 = 3.0;
    let Pull { vector, size, unit } = pull(&fit.solution.x);
    let crosswise = Spread::of_fit(fit).along(UPHILL, &Vector2::new(-unit.y, unit.x));
    if size > crosswise * real(SHOWN) && forward_sigma < T::one() {
        ScalarEstimate {
            value: vector.y.atan2(vector.x),
            sigma: (crosswise / size).hypotenuse(forward_sigma),
        }
    } else {
        ScalarEstimate::unknown()
    }
}

fn lever_arm<T: Real>(fit: &LevelFree<T>, spread: &Spread<'_, T>) -> VectorEstimate<T> {
    let x = &fit.solution.x;
    let [forward, left, up] = columns(&fit.floor);
    let in_plane = Vector2::new(x[LEVER_ARM], x[LEVER_ARM + 1]);
    let (by_arm, by_tilt) = (spread.pair(LEVER_ARM, LEVER_ARM), spread.pair(AXIS, AXIS));
    let by_both = spread.pair(LEVER_ARM, AXIS);
    // The arm lies across the axis, and tilts with it.
    let sigma = |axis: usize| {
        let plane = Vector2::new(forward[axis], left[axis]); // eq. 24
        let tilt = in_plane * -up[axis]; // eq. 24
        let variance = plane.dot(&(by_arm * plane))
            + tilt.dot(&(by_tilt * tilt))
            + plane.dot(&(by_both * tilt)) * real(2.0);
        variance.max(T::zero()).square_root()
    };
    let tilted = in_plane.dot(&Vector2::new(x[AXIS], x[AXIS + 1]));
    VectorEstimate {
        value: forward * in_plane.x + left * in_plane.y - up * tilted, // eq. 24
        sigma: Vector3::new(sigma(0), sigma(1), sigma(2)),
        observed: fit.solution.observed(LEVER_ARM) && fit.solution.observed(LEVER_ARM + 1),
    }
}

/// Scale error about the axis, if harmonics or a true angle took most of the ignorance away.
fn scale<T: Real>(
    spin: &SpinEstimator<T>,
    fit: &LevelFree<T>,
    priors: &SpinPriors<T>,
    spread: &Spread<'_, T>,
) -> ScalarEstimate<T> {
    let given = priors.scale.0 != T::zero();
    if !given && !fit.solution.observed(SCALE) {
        return ScalarEstimate::unknown();
    }
    ScalarEstimate {
        value: fit.solution.x[SCALE],
        // Heading shows the scale error together with rounding, of which a true angle has its share already.
        sigma: if given {
            spread.sigma(SCALE)
        } else {
            spread
                .sigma(SCALE)
                .hypotenuse(spin.rounding_as_scale().square_root())
        },
    }
}
