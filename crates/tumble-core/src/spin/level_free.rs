//! The level-free estimator: physical quantities fitted to the harmonics of specific force over heading.
//!
//! Gravity turns with the heading and bias does not; the centripetal and the tangential pull of an IMU mounted off the
//! turning axis go with the squared rate and with its change. Axis and bias from the gyroscope come in as prior
//! knowledge, with their covariance (docs/theory/spin.md, eq. 7 to 13).

use nalgebra::{Matrix3, SVector, Vector3};

use crate::products::{across, columns, combined, cross, identity, product, squared, unit, zeros};
use crate::real::{Real, count, real};
use crate::regression::{LeastSquares, Prior, Solution, Unsolvable, degrees_of_freedom, reduced};
use crate::spin::axis::AxisFit;
use crate::spin::harmonics::{FUNCTIONS, Harmonics};

/// Unknowns: accelerometer bias (3, case frame), correction of the gyroscope bias (3, floor frame), tilt of the axis
/// (forward, left), uphill pull of gravity (forward, left), lever arm (forward, left), gyroscope scale about the axis,
/// random walk of the heading.
pub const UNKNOWNS: usize = 14;

/// First of the accelerometer bias.
pub const ACCELEROMETER: usize = 0;
/// First of the correction of the gyroscope bias.
pub const GYROSCOPE: usize = 3;
/// Component along the axis, which makes heading drift; an accelerometer does not show those across.
pub const GYROSCOPE_UP: usize = 5;
/// First of the tilt of the axis.
pub const AXIS: usize = 6;
/// First of the uphill pull of gravity.
pub const UPHILL: usize = 8;
/// First of the lever arm.
pub const LEVER_ARM: usize = 10;
/// The gyroscope's scale error about the axis.
pub const SCALE: usize = 12;
const WALK: usize = 13;

/// Largest plausible accelerometer bias and horizontal part of gravity, m/s^2, and lever arm, m.
const LARGEST: (f64, f64, f64) = (5.0, 5.0, 1.0);

/// Inputs of the fit besides the harmonics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinPriors<T: Real> {
    /// Gravity, m/s^2.
    pub gravity: T,
    /// Origin that was subtracted from the specific force before it was stored, m/s^2.
    pub origin: Vector3<T>,
    /// Axis and bias from the gyroscope.
    pub axis: AxisFit<T>,
    /// The angular rate that was taken for the bias while heading was counted, rad/s.
    pub counted_bias: Vector3<T>,
    /// Scale error of the gyroscope about the axis, and its 1-sigma.
    pub scale: (T, T),
    /// Variance of the bias along the axis, (rad/s)^2: that of the rest, if the rest was one.
    pub bias_variance: T,
    /// Variance of the mean rate of the heading's random walk, (rad/s)^2.
    pub walk_variance: T,
    /// Variance of the mean over a block of the accelerometer at rest, (m/s^2)^2.
    pub rest_variance: Vector3<T>,
    /// The same of a row of the turning robot.
    pub turning_variance: Vector3<T>,
}

/// The fit and the frame its unknowns are stated in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFree<T: Real> {
    /// Unknowns in the order of the constants above.
    pub solution: Solution<T, UNKNOWNS>,
    /// Floor frame: forward, left, up as columns in the case frame.
    pub floor: Matrix3<T>,
    /// Turning axis as the fit has it, unit length, case frame.
    pub up: Vector3<T>,
    /// Gyroscope bias, rad/s, case frame.
    pub gyroscope_bias: Vector3<T>,
    /// Gravity, m/s^2.
    pub gravity: T,
    /// Error of the heading that grows with time, rad a second.
    pub by_time: T,
    /// Rows less the unknowns that they show.
    pub degrees_of_freedom: u32,
    /// Degrees of freedom that the variance of a turning row was found with; `None` where it was taken from the rest.
    pub turning_freedom: Option<u32>,
    /// Factor on the sigmas of the specific force under which it was fitted, because the harmonics ask for it.
    pub widened: T,
}

impl<T: Real> SpinPriors<T> {
    /// The same where the specific force is uncertain by this factor more. The gyroscope's part stays as it is: its noise
    /// is that of its own residuals.
    pub(super) fn widened(&self, factor: T) -> Self {
        let by = factor * factor;
        Self {
            rest_variance: self.rest_variance * by,
            turning_variance: self.turning_variance * by,
            ..*self
        }
    }
}

impl<T: Real> LevelFree<T> {
    /// Fit of nothing.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            solution: Solution::none(),
            floor: identity(),
            up: Vector3::z(),
            gyroscope_bias: zeros(),
            gravity: T::zero(),
            by_time: T::zero(),
            degrees_of_freedom: 0,
            turning_freedom: None,
            widened: T::one(),
        }
    }

    /// Accelerometer bias, m/s^2, case frame.
    pub fn accelerometer_bias(&self) -> Vector3<T> {
        self.solution.x.fixed_rows::<3>(ACCELEROMETER).into_owned()
    }

    /// Specific force without bias, m/s^2, case frame, at a true heading in rad, rate in rad/s as the gyroscope has it
    /// and angular acceleration in rad/s^2.
    pub fn specific_force(&self, heading: T, rate: T, acceleration: T) -> Vector3<T> {
        let x = &self.solution.x;
        let project_horizontal = |i: usize| {
            let v = self.floor * Vector3::new(x[i], x[i + 1], T::zero());
            v - self.up * self.up.dot(&v)
        };
        let (uphill, arm) = (project_horizontal(UPHILL), project_horizontal(LEVER_ARM));
        let (sine, cosine) = heading.sine_cosine();
        let q = T::one() / (T::one() + x[SCALE]);
        let vertical = (self.gravity * self.gravity - squared(&uphill)).max(T::zero());
        combined(&[
            (&self.up, vertical.square_root()), // eq. 7
            (&uphill, cosine),
            (&cross(&self.up, &uphill), -sine),
            (&arm, -(rate * rate * q * q)),
            (&cross(&self.up, &arm), acceleration * q),
        ])
    }

    /// Factor by which the sigmas of the specific force are widened where the model does not fit the harmonics, one where it
    /// does.
    ///
    /// Chance makes a chi-square beyond the upper limit once in a thousand spins, at one turn as at ten, and beyond the lower
    /// once in a hundred: between the two the widening sets in. All that is too much of it may lie in one direction of the
    /// unknowns: a wheel that slips as the robot starts is seen in few rows.
    fn widening(&self) -> T {
        const UNUSUAL: f64 = 1.8;
        const UNLIKELY: f64 = 2.2;
        // Few rows are a poor measure of the noise in the test.
        let usual = self.turning_freedom.map_or(T::one(), |freedom| {
            count::<T>(freedom) / count(freedom.saturating_sub(4).max(1)) // eq. 15
        });
        let (chi_square, freedom) = (self.solution.chi_square, self.degrees_of_freedom);
        let beyond = reduced(chi_square, freedom) / usual - real(UNUSUAL);
        if beyond > T::zero() {
            let share = (beyond / real(UNLIKELY - UNUSUAL)).min(T::one());
            let all = (chi_square - count(freedom.saturating_sub(1))).square_root(); // eq. 15
            T::one() + (all - T::one()) * share
        } else {
            T::one()
        }
    }

    /// Correction of a heading as it was counted, rad, `time` s after the origin.
    pub fn heading_correction(&self, heading: T, time: T) -> T {
        let q = T::one() / (T::one() + self.solution.x[SCALE]);
        heading * (q - T::one()) + time * self.by_time // eq. 8
    }
}

/// The vectors that the specific force is linear in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HarmonicVectors<T: Real> {
    /// `b_a + sqrt(g^2 - p^2) n`, less what was taken off the specific force, m/s^2.
    constant: Vector3<T>,
    /// `p`, m/s^2.
    cosine: Vector3<T>,
    /// `-n x p`, m/s^2.
    sine: Vector3<T>,
    /// `r`, m.
    arm: Vector3<T>,
    /// `n x r`, m.
    arm_left: Vector3<T>,
}

/// Distortion of the counted heading against the true one, by stretch and shear, with `q = 1 / (1 + s)`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadingDistortion<T: Real> {
    /// `alpha = q - 1`.
    by_heading: T,
    /// `eta = xi - epsilon q`, rad/s.
    by_time: T,
    /// `q^2`.
    q_squared: T,
    /// `q`.
    q: T,
}

impl<T: Real> HeadingDistortion<T> {
    fn zero() -> Self {
        Self {
            by_heading: T::zero(),
            by_time: T::zero(),
            q_squared: T::zero(),
            q: T::zero(),
        }
    }
}

/// A line of the harmonics: coefficients of the functions of eq. 9.
type Line<T> = [T; FUNCTIONS];

/// Weights of a line of the harmonics for each of the vectors: the line times X of eq. 12.
#[derive(Clone, Copy)]
struct VectorWeights<T: Real> {
    constant: T,
    cosine: T,
    sine: T,
    arm: T,
    arm_left: T,
}

impl<T: Real> VectorWeights<T> {
    fn new(line: &Line<T>, distortion: &HeadingDistortion<T>) -> Self {
        let distorted = Self::distorted(line, distortion);
        Self {
            constant: line[0],                  // eq. 12
            cosine: line[1] + distorted.cosine, // eq. 12: p
            sine: line[2] + distorted.sine,     // eq. 12: -n x p
            ..distorted
        }
    }

    /// Weights of the functions that the distortion of heading makes; it may be a derivative.
    #[inline(never)]
    fn distorted(line: &Line<T>, distortion: &HeadingDistortion<T>) -> Self {
        let HeadingDistortion {
            by_heading: alpha,
            by_time: eta,
            q_squared,
            q,
        } = *distortion;
        Self {
            constant: T::zero(),
            cosine: -(alpha * line[3] + eta * line[5]), // eq. 12: -alpha p, -eta p
            sine: alpha * line[4] + eta * line[6],      // eq. 12: -alpha n x p, -eta n x p
            arm: -q_squared * line[7],                  // eq. 12: -q^2 r
            arm_left: q * line[8],                      // eq. 12: q n x r
        }
    }
}

impl<T: Real> HarmonicVectors<T> {
    fn zero() -> Self {
        let zero = zeros();
        Self {
            constant: zero,
            cosine: zero,
            sine: zero,
            arm: zero,
            arm_left: zero,
        }
    }

    /// The specific force of a line of the harmonics.
    #[inline(never)]
    fn weighted(&self, weights: &VectorWeights<T>) -> Vector3<T> {
        combined(&[
            (&self.constant, weights.constant),
            (&self.cosine, weights.cosine),
            (&self.sine, weights.sine),
            (&self.arm, weights.arm),
            (&self.arm_left, weights.arm_left),
        ]) // eq. 12
    }
}

/// Unknowns that the vectors depend on, but for the accelerometer bias: tilt of the axis, uphill pull, lever arm.
const VECTOR_UNKNOWNS: usize = SCALE - AXIS;

/// Turning axis, unit length, and distortion of the heading, where the unknowns are `x`.
fn axis_and_distortion<T: Real>(
    priors: &SpinPriors<T>,
    x: &SVector<T, UNKNOWNS>,
) -> (Vector3<T>, HeadingDistortion<T>) {
    let [forward, left, floor_up] = columns(&priors.axis.floor);
    let up = unit(&combined(&[
        (&floor_up, T::one()),
        (&forward, x[AXIS]),
        (&left, x[AXIS + 1]),
    ]));
    let q = T::one() / (T::one() + x[SCALE]); // eq. 8
    let drift = (priors.axis.bias - priors.counted_bias).dot(&up) + x[GYROSCOPE_UP]; // eq. 8: epsilon
    let distortion = HeadingDistortion {
        by_heading: q - T::one(),     // eq. 12: alpha
        by_time: x[WALK] - drift * q, // eq. 12: eta
        q_squared: q * q,
        q,
    };
    (up, distortion)
}

/// The model about one point.
struct Linearization<T: Real> {
    vectors: HarmonicVectors<T>,
    distortion: HeadingDistortion<T>,
    /// Derivatives of the vectors by the unknowns from the tilt of the axis on.
    by_vectors: [HarmonicVectors<T>; VECTOR_UNKNOWNS],
    /// Derivatives of the distortion by the bias along the axis, the scale and the random walk.
    by_drift: HeadingDistortion<T>,
    by_scale: HeadingDistortion<T>,
    by_walk: HeadingDistortion<T>,
}

impl<T: Real> Linearization<T> {
    #[inline(never)]
    fn at(priors: &SpinPriors<T>, x: &SVector<T, UNKNOWNS>) -> Self {
        let (up, distortion) = axis_and_distortion(priors, x);
        let [forward, left, _] = columns(&priors.axis.floor);
        let plane = [across(&forward, &up), across(&left, &up)];
        let across = [cross(&up, &plane[0]), cross(&up, &plane[1])];
        let in_plane = |first: usize| combined(&[(&plane[0], x[first]), (&plane[1], x[first + 1])]);
        let (uphill, arm) = (in_plane(UPHILL), in_plane(LEVER_ARM));
        let gravity = (priors.gravity * priors.gravity - squared(&uphill))
            .max(T::zero())
            .square_root(); // eq. 7: sqrt(g^2 - p^2)
        let bias = Vector3::new(x[ACCELEROMETER], x[ACCELEROMETER + 1], x[ACCELEROMETER + 2]);
        let vectors = HarmonicVectors {
            constant: bias + combined(&[(&up, gravity), (&priors.origin, -T::one())]), // eq. 12
            cosine: uphill,
            sine: -cross(&up, &uphill), // eq. 12
            arm,
            arm_left: cross(&up, &arm), // eq. 12
        };
        let q = distortion.q;
        let by_tilt = |i: usize| vectors.by_tilt(&up, &plane[i], gravity);
        let by_uphill = |i: usize| HarmonicVectors {
            constant: combined(&[(&up, -(uphill.dot(&plane[i]) / gravity))]),
            cosine: plane[i],
            sine: -across[i],
            ..HarmonicVectors::zero()
        };
        let by_arm = |i: usize| HarmonicVectors {
            arm: plane[i],
            arm_left: across[i],
            ..HarmonicVectors::zero()
        };
        Self {
            vectors,
            distortion,
            by_vectors: [
                by_tilt(0),
                by_tilt(1),
                by_uphill(0),
                by_uphill(1),
                by_arm(0),
                by_arm(1),
            ],
            by_drift: HeadingDistortion {
                by_time: -q,
                ..HeadingDistortion::zero()
            },
            // dq/ds = -q^2
            by_scale: HeadingDistortion {
                by_heading: -q * q,
                by_time: (x[WALK] - distortion.by_time) * q,
                q_squared: -q * q * q * real::<T>(2.0),
                q: -q * q,
            },
            by_walk: HeadingDistortion {
                by_time: T::one(),
                ..HeadingDistortion::zero()
            },
        }
    }

    /// Derivatives by all unknowns of the specific force of a line whose weights are `weights`.
    fn derivatives(&self, line: &Line<T>, weights: &VectorWeights<T>) -> [[T; 3]; UNKNOWNS] {
        let by = |change| {
            self.vectors
                .weighted(&VectorWeights::distorted(line, change))
                .into()
        };
        let mut derivatives = [[T::zero(); 3]; UNKNOWNS];
        for axis in 0..3 {
            derivatives[ACCELEROMETER + axis][axis] = weights.constant;
        }
        derivatives[GYROSCOPE_UP] = by(&self.by_drift);
        for (i, vectors) in self.by_vectors.iter().enumerate() {
            derivatives[AXIS + i] = vectors.weighted(weights).into();
        }
        derivatives[SCALE] = by(&self.by_scale);
        derivatives[WALK] = by(&self.by_walk);
        derivatives
    }
}

impl<T: Real> HarmonicVectors<T> {
    /// Their derivative where the axis `up` tilts towards `e`: it goes along `e`, and what lies along `e` goes down.
    fn by_tilt(&self, up: &Vector3<T>, e: &Vector3<T>, gravity: T) -> Self {
        let lowered = |v: &Vector3<T>| combined(&[(up, -e.dot(v))]);
        Self {
            constant: combined(&[(e, gravity)]),
            cosine: lowered(&self.cosine),
            sine: -cross(e, &self.cosine),
            arm: lowered(&self.arm),
            arm_left: cross(e, &self.arm),
        }
    }
}

/// Most rounds of linearisation: the heading's errors matter only once the floor's tilt is known, and that is the first
/// round's doing.
const MOST_ROUNDS: u32 = 5;

/// Square of the distance, in sigmas, that a round may move the unknowns for there to be no other: what the next would move
/// them is far less.
const SETTLED: f64 = 1e-4;

/// All unknowns fitted to the accelerometer at rest and while turning, round by round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelFreeFit<T: Real> {
    equations: LeastSquares<T, UNKNOWNS>,
    x: SVector<T, UNKNOWNS>,
    rounds: u32,
}

impl<T: Real> LevelFreeFit<T> {
    /// Fit of nothing.
    #[inline(always)]
    pub fn none() -> Self {
        Self {
            equations: LeastSquares::none(),
            x: zeros(),
            rounds: 0,
        }
    }

    /// Before the first round, with nominal unknowns or with those that another fit ended with.
    pub fn begin(&mut self, priors: &SpinPriors<T>, x: Option<&SVector<T, UNKNOWNS>>) {
        self.equations.begin(&prior(priors));
        self.x = x.map_or_else(|| nominal(priors), |x| *x);
        self.rounds = 0;
    }

    /// The unknowns so far.
    pub fn unknowns(&self) -> &SVector<T, UNKNOWNS> {
        &self.x
    }

    /// One round, linearised about the one before; whether it was the last. Lines of `resting` are weighted by the number of
    /// blocks, so that their variance is that of one.
    ///
    /// # Errors
    /// [`Unsolvable`] if something was not finite.
    pub fn round(
        &mut self,
        [resting, turning]: [&Harmonics<T>; 2],
        priors: &SpinPriors<T>,
    ) -> Result<bool, Unsolvable> {
        self.equations.restart();
        self.accumulate(
            [
                (resting, &priors.rest_variance),
                (turning, &priors.turning_variance),
            ],
            &Linearization::at(priors, &self.x),
        );
        let before = self.x;
        self.x = self.equations.unknowns()?;
        self.rounds += 1;
        Ok(self.rounds >= MOST_ROUNDS || self.equations.excess(&before) < real(SETTLED))
    }

    /// The harmonics as equations, with the variance of each axis, linearised about the unknowns so far.
    #[inline(never)]
    fn accumulate(&mut self, harmonics: [(&Harmonics<T>, &Vector3<T>); 2], point: &Linearization<T>) {
        for (harmonics, variance) in harmonics {
            for (line, right) in harmonics.lines() {
                // Lines of functions that never were anything but zero carry no information.
                if line.iter().all(|value| *value == T::zero()) {
                    continue;
                }
                let weights = VectorWeights::new(line, &point.distortion);
                let [left] = (Vector3::from(*right) - point.vectors.weighted(&weights)).data.0;
                let derivatives = point.derivatives(line, &weights);
                for axis in 0..3 {
                    let mut a: SVector<T, UNKNOWNS> = zeros();
                    for (element, by) in a.iter_mut().zip(&derivatives) {
                        *element = by[axis];
                    }
                    let [variance] = &variance.data.0;
                    self.equations
                        .push(&a, left[axis] + a.dot(&self.x), variance[axis]);
                }
            }
        }
    }

    /// Computes the result of the last round, given the degrees of freedom of [`Harmonics::freedom`].
    ///
    /// # Errors
    /// [`Unsolvable`] if something was not finite; nothing of `found` is of use then.
    pub fn conclude(
        &self,
        priors: &SpinPriors<T>,
        turning_freedom: Option<u32>,
        found: &mut LevelFree<T>,
    ) -> Result<(), Unsolvable> {
        self.equations.solve_into(&mut found.solution)?;
        let x = &found.solution.x;
        let correction = Vector3::new(x[GYROSCOPE], x[GYROSCOPE + 1], x[GYROSCOPE_UP]);
        let axis = &priors.axis;
        let (up, distortion) = axis_and_distortion(priors, x);
        found.up = up;
        found.gravity = priors.gravity;
        found.by_time = distortion.by_time;
        found.gyroscope_bias = axis.bias + product(&axis.floor, &correction);
        found.floor = axis.floor;
        found.degrees_of_freedom = degrees_of_freedom(found.solution.rows, shown(&found.solution));
        found.turning_freedom = turning_freedom;
        found.widened = found.widening();
        Ok(())
    }

    /// Computes the result of the last round under widened variances: chi-square is that under those before.
    ///
    /// # Errors
    /// Those of [`Self::conclude`].
    pub fn conclude_widened(
        &self,
        priors: &SpinPriors<T>,
        found: &mut LevelFree<T>,
    ) -> Result<(), Unsolvable> {
        let (chi_square, freedom, widened) =
            (found.solution.chi_square, found.degrees_of_freedom, found.widened);
        self.conclude(priors, found.turning_freedom, found)?;
        found.solution.chi_square = chi_square;
        found.degrees_of_freedom = freedom;
        found.widened = widened;
        Ok(())
    }
}

/// Correction of a heading counted from here on, rad a rad and rad a second, where the unknowns are `x`.
pub fn heading_correction<T: Real>(priors: &SpinPriors<T>, x: &SVector<T, UNKNOWNS>) -> (T, T) {
    let (_, distortion) = axis_and_distortion(priors, x);
    (distortion.by_heading, distortion.by_time) // eq. 8
}

/// Number of unknowns on which the rows are more informative than the prior.
fn shown<T: Real>(solution: &Solution<T, UNKNOWNS>) -> usize {
    let half = real::<T>(0.5);
    solution.ignorance.iter().filter(|share| **share < half).count()
}

/// Unknowns before any data.
fn nominal<T: Real>(priors: &SpinPriors<T>) -> SVector<T, UNKNOWNS> {
    SVector::from_fn(|i, _| if i == SCALE { priors.scale.0 } else { T::zero() })
}

fn prior<T: Real>(priors: &SpinPriors<T>) -> Prior<T, UNKNOWNS> {
    let mut prior = Prior::<T, UNKNOWNS> {
        mean: nominal(priors),
        covariance: zeros(),
    };
    let covariance = &mut prior.covariance.data.0;
    let variance = |i: usize| -> T {
        let largest: T = match i {
            ACCELEROMETER..GYROSCOPE => real(LARGEST.0),
            UPHILL..LEVER_ARM => real(LARGEST.1),
            LEVER_ARM..SCALE => real(LARGEST.2),
            SCALE => priors.scale.1,
            _ => return priors.walk_variance.max(real(1e-20)),
        };
        largest * largest
    };
    for i in (0..GYROSCOPE).chain(UPHILL..UNKNOWNS) {
        covariance[i][i] = variance(i);
    }
    let of_axis = &priors.axis.covariance.data.0;
    for (column, of_axis) in covariance[GYROSCOPE..UPHILL].iter_mut().zip(of_axis) {
        column[GYROSCOPE..UPHILL].copy_from_slice(of_axis);
    }
    covariance[GYROSCOPE_UP][GYROSCOPE_UP] = priors.bias_variance;
    prior
}
