//! The turning axis and the bias of the gyroscope: `y = b + w n`, a straight line in the space of angular rates.
//!
//! At rest the line shows its point `b`; while the robot turns, however unevenly, its direction `n`. The rate itself
//! need not be known beforehand (docs/theory/spin.md, eq. 4 to 6).

use nalgebra::{ArrayStorage, Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use crate::products::{
    add, columns, congruent, matrix_product, of_columns, outer, product, transposed_matrix_product,
    transposed_product, unit, zeros,
};
use crate::real::{Real, count, real};

/// Mean and centred second moments of three channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateMoments<T: Real> {
    points: u32,
    mean: Vector3<T>,
    spread: Matrix3<T>,
}

impl<T: Real> Default for RateMoments<T> {
    fn default() -> Self {
        Self {
            points: 0,
            mean: zeros(),
            spread: zeros(),
        }
    }
}

impl<T: Real> RateMoments<T> {
    /// Takes in one point (Welford 1962).
    pub fn push(&mut self, point: &Vector3<T>) {
        self.points = self.points.saturating_add(1);
        let before = point - self.mean;
        self.mean += before / count::<T>(self.points);
        add(&mut self.spread, &outer(&before, &(point - self.mean)));
    }

    /// The same points in another frame: `to_from` turns what was into what is.
    pub fn in_frame(&self, to_from: &Matrix3<T>) -> Self {
        Self {
            points: self.points,
            mean: product(to_from, &self.mean),
            spread: congruent(to_from, &self.spread),
        }
    }

    /// Points taken in.
    pub fn points(&self) -> u32 {
        self.points
    }
}

/// Frame of the floor: forward, left, up, as columns in the case frame. Forward is the case's x, projected onto the floor.
#[inline(never)]
pub fn floor_frame<T: Real>(up: &Vector3<T>) -> Matrix3<T> {
    let level = up.y.hypotenuse(up.z);
    // Where x points up or down there is no forward, and roll counts as zero.
    let (sine, cosine) = if level > T::zero() {
        (up.y / level, up.z / level)
    } else {
        (T::zero(), T::one())
    };
    let forward = Vector3::new(level, -up.x * sine, -up.x * cosine);
    let left = Vector3::new(T::zero(), cosine, -sine);
    of_columns([forward, left, *up])
}

/// Roll and pitch, rad, of a case in which `up` points up: `floor_from_case = R_y(pitch) R_x(roll)`.
pub fn tilt<T: Real>(up: &Vector3<T>) -> (T, T) {
    (up.y.atan2(up.z), (-up.x).atan2(up.y.hypotenuse(up.z)))
}

/// The rest that the line starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestingRate<T: Real> {
    /// Mean angular rate, rad/s.
    pub mean: Vector3<T>,
    /// Variance of the mean, each axis, (rad/s)^2.
    pub variance: Vector3<T>,
}

/// Bias and axis with their uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisFit<T: Real> {
    /// Angular-rate bias, rad/s, case frame.
    pub bias: Vector3<T>,
    /// Floor frame: forward, left, up as columns in the case frame; up is the turning axis.
    pub floor: Matrix3<T>,
    /// Covariance of `[bias forward, left, up; tilt of the axis forward, left]`, (rad/s)^2 and rad^2.
    pub covariance: SMatrix<T, 5, 5>,
    /// Variance of the mean over a block across the axis, while turning, (rad/s)^2.
    pub block_variance: T,
}

/// Rounds in which the axis settles; the second is exact to the square of the first correction.
const ROUNDS: u32 = 4;

/// Means over blocks while the robot turned, and what they are stated in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurningRates<T: Real> {
    /// Rates less `counted_bias`, rad/s, in `frame`.
    pub moments: RateMoments<T>,
    /// Columns in the case frame; the third is close to the turning axis, so that rounding of the rate about it does
    /// not disturb the components across.
    pub frame: Matrix3<T>,
    /// rad/s, case frame.
    pub counted_bias: Vector3<T>,
    /// Variance that rounding adds to the mean over a block, as if it were white, (rad/s)^2.
    pub rounding: T,
}

/// Fits the line, beginning with a guess of the axis that points upwards.
#[inline(never)]
pub fn fit<T: Real>(turning: &TurningRates<T>, rest: &RestingRate<T>, guess: &Vector3<T>) -> AxisFit<T> {
    let mut fit = one_round(turning, rest, guess);
    for _ in 1..ROUNDS {
        fit = one_round(turning, rest, &columns(&fit.floor)[2]);
    }
    fit
}

/// Smallest variance of an angular rate that is divided by, (rad/s)^2.
const LEAST: f64 = 1e-14;

/// Sensors without any noise exist only in tests; a variance of zero would divide by it.
pub(super) fn floored<T: Real>(variance: T, least: f64) -> T {
    variance.max(real(least))
}

/// Sums of the regression of what is seen across the axis on the rate along it.
struct LineSums<T> {
    points: T,
    along: T,
    along_squared: T,
}

fn one_round<T: Real>(turning: &TurningRates<T>, rest: &RestingRate<T>, up: &Vector3<T>) -> AxisFit<T> {
    let floor = floor_frame(up);
    let rates = &turning.moments;
    let points = count::<T>(rates.points.max(1));
    let local = transposed_matrix_product(&turning.frame, &floor);
    // The rest is the origin: means and moments about it.
    let offset = rates.mean - transposed_product(&turning.frame, &(rest.mean - turning.counted_bias));
    let spread = transposed_matrix_product(&local, &matrix_product(&rates.spread, &local));
    let mean = transposed_product(&local, &offset);
    let about_rest = |with: T, i: T| with + i * mean.z * points;
    let rest_variance = transposed_product(&floor.map(|e| e * e), &rest.variance).map(|v| floored(v, LEAST));
    let sums = LineSums {
        points,
        along: mean.z * points,
        along_squared: about_rest(spread.m33, mean.z),
    };
    let block_variance = floored(scatter(&spread, &sums), LEAST) + turning.rounding; // eq. 23
    let across = |mean: T, with_rate: T, rest_variance: T| {
        line(&sums, mean * points, with_rate, block_variance, rest_variance)
    };
    let forward = across(mean.x, about_rest(spread.m13, mean.x), rest_variance.x);
    let left = across(mean.y, about_rest(spread.m23, mean.y), rest_variance.y);
    let in_floor = |forward: T, left: T| product(&floor, &Vector3::new(forward, left, T::zero()));
    let bias = in_floor(forward.0.x, left.0.x) + rest.mean; // eq. 5: delta
    let tilted = up + in_floor(forward.0.y, left.0.y); // eq. 5: tau
    AxisFit {
        bias,
        floor: floor_frame(&unit(&tilted)),
        covariance: joint_covariance([&forward.1, &left.1], rest_variance.z),
        block_variance,
    }
}

/// Covariance of `[bias forward, left, up; tilt forward, left]`: a pair of bias and tilt for each direction across the
/// axis, and the bias along it, which rest alone shows.
fn joint_covariance<T: Real>(across: [&Matrix2<T>; 2], along: T) -> SMatrix<T, 5, 5> {
    let mut covariance = [[T::zero(); 5]; 5];
    for i in 0..2 {
        let pair = across[i];
        covariance[i][i] = pair.m11;
        covariance[i + 3][i] = pair.m12;
        covariance[i][i + 3] = pair.m12;
        covariance[i + 3][i + 3] = pair.m22;
    }
    covariance[2][2] = along;
    SMatrix::from_array_storage(ArrayStorage(covariance))
}

/// Variance across the axis about the line through the turning blocks alone; that of a block.
fn scatter<T: Real>(spread: &Matrix3<T>, sums: &LineSums<T>) -> T {
    let along = spread.m33;
    let left_over = |square: T, with_rate: T| {
        let explained = if along > T::zero() {
            with_rate * with_rate / along
        } else {
            T::zero()
        };
        (square - explained).max(T::zero())
    };
    (left_over(spread.m11, spread.m13) + left_over(spread.m22, spread.m23))
        / ((sums.points - real(2.0)).max(T::one()) * real(2.0))
}

/// One direction across the axis: offset of the bias from the rest's, and slope over the rate, with their covariance.
fn line<T: Real>(
    sums: &LineSums<T>,
    seen: T,
    with_rate: T,
    variance: T,
    rest_variance: T,
) -> (Vector2<T>, Matrix2<T>) {
    // Scaled by the variance of a block, so that nothing overflows in single precision.
    let weight = variance / rest_variance; // eq. 6: v / v_0
    let (a, b, c) = (sums.points + weight, sums.along, sums.along_squared);
    let determinant = a * c - b * b;
    if determinant <= T::zero() {
        let unknown = Matrix2::new(rest_variance, T::zero(), T::zero(), T::one());
        return (zeros(), unknown);
    }
    let inverse = Matrix2::new(c, -b, -b, a) / determinant;
    (inverse * Vector2::new(seen, with_rate), inverse * variance) // eq. 5, 6
}
