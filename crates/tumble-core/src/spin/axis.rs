//! The turning axis and the bias of the gyroscope: `y = b + w n`, a straight line in the space of angular rates.
//!
//! At rest the line shows its point `b`; while the robot turns, however unevenly, its direction `n`. The rate itself
//! need not be known beforehand (docs/theory/spin.md, eq. 4 to 6). The Earth's rotation across the axis is one more unknown
//! of known size, which turns past the robot with the heading (eq. 6a to 6d).

use nalgebra::{ArrayStorage, Matrix2, Matrix3, SMatrix, Vector2, Vector3};

use crate::products::{
    add, columns, congruent, matrix_product, of_columns, outer, product, transposed_matrix_product,
    transposed_product, unit, zeros,
};
use crate::real::{Real, count, real};

/// Cosine and sine of the heading, beside angular rates: means and centred second moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingMoments<T: Real> {
    /// Mean cosine and mean sine.
    mean: Vector2<T>,
    /// Sum of the squared distances of the two from their means.
    spread: T,
    /// Sums of the products of the cosine, and of the sine, with the rates, all from their means, rad/s.
    with_rate: [Vector3<T>; 2],
}

impl<T: Real> HeadingMoments<T> {
    /// Before the first point.
    pub fn none() -> Self {
        Self {
            mean: zeros(),
            spread: T::zero(),
            with_rate: [zeros(); 2],
        }
    }

    /// Takes in the mean over `points` of `[cosine, sine]`, given how many there are with these, and the rate there from the
    /// mean over all of them.
    pub fn push(&mut self, heading: &Vector2<T>, rate: &Vector3<T>, points: u32, of_all: u32) {
        let weight = count::<T>(points);
        let before = heading - self.mean;
        self.mean += before * (weight / count(of_all.max(1)));
        self.spread += before.dot(&(heading - self.mean)) * weight;
        self.with_rate[0] += rate * (before.x * weight);
        self.with_rate[1] += rate * (before.y * weight);
    }

    /// The same with the rates in another frame, of which the columns of the matrix are the axes.
    fn seen_from(&self, frame: &Matrix3<T>) -> Self {
        Self {
            with_rate: [
                transposed_product(frame, &self.with_rate[0]),
                transposed_product(frame, &self.with_rate[1]),
            ],
            ..*self
        }
    }

    /// Sums of the rates across the axis, turned back by the heading, where the rates are seen from the floor.
    fn turned_back(&self) -> Vector2<T> {
        let [with_cosine, with_sine] = &self.with_rate;
        Vector2::new(with_cosine.x - with_sine.y, with_sine.x + with_cosine.y) // eq. 6b
    }
}

/// Mean and centred second moments of three channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateMoments<T: Real> {
    points: u32,
    mean: Vector3<T>,
    spread: Matrix3<T>,
    headings: HeadingMoments<T>,
}

impl<T: Real> Default for RateMoments<T> {
    fn default() -> Self {
        Self {
            points: 0,
            mean: zeros(),
            spread: zeros(),
            headings: HeadingMoments::none(),
        }
    }
}

impl<T: Real> RateMoments<T> {
    /// Takes in one point (Welford 1962), and mean cosine and sine of the heading there.
    pub fn push(&mut self, point: &Vector3<T>, heading: &Vector2<T>) {
        self.points = self.points.saturating_add(1);
        let before = point - self.mean;
        self.mean += before / count::<T>(self.points);
        let after = point - self.mean;
        add(&mut self.spread, &outer(&before, &after));
        self.headings.push(heading, &after, 1, self.points);
    }

    /// The same points in another frame: `to_from` turns what was into what is.
    pub fn in_frame(&self, to_from: &Matrix3<T>) -> Self {
        Self {
            points: self.points,
            mean: product(to_from, &self.mean),
            spread: congruent(to_from, &self.spread),
            headings: self.headings.seen_from(&to_from.transpose()),
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
    /// Headings at which the robot stood, a point for each block, with the rates there, case frame.
    pub headings: HeadingMoments<T>,
    /// Variance of the mean over a block of a rest from that over all rests, of the axis where it is largest, (rad/s)^2.
    pub block_variance: T,
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
    /// Share of the Earth's rotation in the covariance of the bias forward and left, (rad/s)^2.
    pub by_earth: Matrix2<T>,
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
    /// Variance of the Earth's rotation along any direction across the axis, (rad/s)^2.
    pub earth_variance: T,
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

/// Smallest variance of the Earth's rotation across the axis that is divided by, (rad/s)^2: it ends up a pole.
const LEAST_EARTH: f64 = 1e-16;

/// Sums of the regression of what is seen across the axis on the rate along it.
struct LineSums<T: Real> {
    points: T,
    along: T,
    along_squared: T,
    /// Sums of cosine and sine of the heading.
    heading: Vector2<T>,
    /// The same, each times the rate along the axis.
    heading_along: Vector2<T>,
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
    let headings = rates.headings.seen_from(&local);
    let heading = headings.mean * points;
    let [with_cosine, with_sine] = &headings.with_rate;
    let sums = LineSums {
        points,
        along: mean.z * points,
        along_squared: about_rest(spread.m33, mean.z),
        heading,
        heading_along: Vector2::new(with_cosine.z, with_sine.z) + heading * mean.z,
    };
    let block_variance = floored(scatter(&spread, &sums), LEAST) + turning.rounding; // eq. 23
    let across = |mean: T, with_rate: T, rest_variance: T| {
        line(&sums, mean * points, with_rate, block_variance, rest_variance)
    };
    let mut lines = [
        across(mean.x, about_rest(spread.m13, mean.x), rest_variance.x),
        across(mean.y, about_rest(spread.m23, mean.y), rest_variance.y),
    ];
    let earth = EarthAcross::new(
        &sums,
        &lines,
        &rest.headings.seen_from(&floor),
        block_variance / floored(turning.earth_variance, LEAST_EARTH),
        block_variance / floored(rest.block_variance, LEAST),
    );
    earth.correct(&mut lines);
    let [forward, left] = &lines;
    let in_floor = |forward: T, left: T| product(&floor, &Vector3::new(forward, left, T::zero()));
    let bias = in_floor(forward.unknowns.x, left.unknowns.x) + rest.mean; // eq. 5: delta
    let tilted = up + in_floor(forward.unknowns.y, left.unknowns.y); // eq. 5: tau
    AxisFit {
        bias,
        floor: floor_frame(&unit(&tilted)),
        covariance: joint_covariance(&lines, &earth, block_variance, rest_variance.z),
        block_variance,
        by_earth: earth.of_bias() * block_variance,
    }
}

/// Covariance of `[bias forward, left, up; tilt forward, left]`: bias and tilt for each direction across the axis, and the
/// bias along it, which rest alone shows.
fn joint_covariance<T: Real>(
    lines: &[LineFit<T>; 2],
    earth: &EarthAcross<T>,
    variance: T,
    along: T,
) -> SMatrix<T, 5, 5> {
    let mut covariance = [[T::zero(); 5]; 5];
    for i in 0..2 {
        for j in 0..2 {
            let mut pair = earth.between(i, j);
            if i == j {
                pair += lines[i].inverse;
            }
            pair *= variance;
            covariance[j][i] = pair.m11;
            covariance[j + 3][i] = pair.m12;
            covariance[j][i + 3] = pair.m21;
            covariance[j + 3][i + 3] = pair.m22;
        }
    }
    covariance[2][2] = along;
    SMatrix::from_array_storage(ArrayStorage(covariance))
}

/// The Earth's rotation across the axis, at the heading of the first rest (docs/theory/spin.md, eq. 6a to 6d).
///
/// Rests at other headings show it. A turning robot does not: it sways on any floor by more, with the heading.
struct EarthAcross<T: Real> {
    /// Shift of offset and slope of each direction by it.
    shift: [Matrix2<T>; 2],
    /// Along each of both directions, rad/s.
    rate: Vector2<T>,
    /// Variance of each, over the variance of a block.
    variance: T,
}

impl<T: Real> EarthAcross<T> {
    #[inline(never)]
    fn new(
        sums: &LineSums<T>,
        lines: &[LineFit<T>; 2],
        rest: &HeadingMoments<T>,
        prior: T,
        ratio: T,
    ) -> Self {
        let seen = |heading: &Vector2<T>, direction: usize| match direction {
            0 => *heading,                            // eq. 6a: forward
            _ => Vector2::new(-heading.y, heading.x), // eq. 6a: left
        };
        let mut shift = [zeros::<T, 2, 2>(); 2];
        for (direction, line) in lines.iter().enumerate() {
            let offset = seen(&sums.heading, direction) + seen(&rest.mean, direction) * line.weight;
            let slope = seen(&sums.heading_along, direction);
            shift[direction] = line.inverse * Matrix2::new(offset.x, offset.y, slope.x, slope.y); // eq. 6c
        }
        let variance = T::one() / (rest.spread * ratio + prior); // eq. 6b
        Self {
            shift,
            rate: rest.turned_back() * (ratio * variance), // eq. 6b
            variance,
        }
    }

    fn correct(&self, lines: &mut [LineFit<T>; 2]) {
        for (line, shift) in lines.iter_mut().zip(&self.shift) {
            line.unknowns -= shift * self.rate; // eq. 6d
        }
    }

    /// Covariance of offset and slope of one direction with those of another from this, over the variance of a block.
    fn between(&self, one: usize, other: usize) -> Matrix2<T> {
        self.shift[one] * self.shift[other].transpose() * self.variance // eq. 6d
    }

    /// Covariance of both offsets from this, over the variance of a block.
    fn of_bias(&self) -> Matrix2<T> {
        Matrix2::from_fn(|i, j| self.between(i, j).m11)
    }
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

/// One direction across the axis.
struct LineFit<T: Real> {
    /// Offset of the bias from the rest's, rad/s, and slope over the rate.
    unknowns: Vector2<T>,
    /// Their covariance over the variance of a block.
    inverse: Matrix2<T>,
    /// Variance of a block over that of the rest.
    weight: T,
}

/// Offset and slope of one direction across the axis.
fn line<T: Real>(sums: &LineSums<T>, seen: T, with_rate: T, variance: T, rest_variance: T) -> LineFit<T> {
    // Scaled by the variance of a block, so that nothing overflows in single precision.
    let weight = variance / rest_variance; // eq. 6: v / v_0
    let (a, b, c) = (sums.points + weight, sums.along, sums.along_squared);
    let determinant = a * c - b * b;
    if determinant <= T::zero() {
        return LineFit {
            unknowns: zeros(),
            inverse: Matrix2::new(T::one() / weight, T::zero(), T::zero(), T::one() / variance),
            weight,
        };
    }
    let inverse = Matrix2::new(c, -b, -b, a) / determinant;
    LineFit {
        unknowns: inverse * Vector2::new(seen, with_rate), // eq. 5
        inverse,                                           // eq. 6
        weight,
    }
}
