//! The level-free estimator: physical quantities fitted to the harmonics of specific force over heading.
//!
//! Gravity turns with the heading and bias does not; the centripetal and the tangential pull of an IMU mounted off the
//! turning axis go with the squared rate and with its change. What the gyroscope showed of axis and bias comes in as
//! prior knowledge, with its covariance (docs/theory/spin.md, eq. 7 to 13).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::products::{cross, unit};
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
/// Of these the one along the axis, which heading drifts by; what lies across it no accelerometer feels.
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

/// What goes into the fit besides the harmonics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinPriors<T: Real> {
    /// Gravity, m/s^2.
    pub gravity: T,
    /// What was taken off the specific force before it was kept, m/s^2.
    pub origin: Vector3<T>,
    /// What the gyroscope showed.
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
    /// What the heading lacks, rad a second.
    pub by_time: T,
    /// Rows less the unknowns that they show.
    pub degrees_of_freedom: u32,
    /// Degrees of freedom that the variance of a turning row was found with; `None` where it was taken from the rest.
    pub turning_freedom: Option<u32>,
}

impl<T: Real> LevelFree<T> {
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
        let vertical = (self.gravity * self.gravity - uphill.norm_squared()).max(T::zero());
        self.up * vertical.square_root() + uphill * cosine // eq. 7
            - cross(&self.up, &uphill) * sine
            - arm * (rate * rate * q * q)
            + cross(&self.up, &arm) * (acceleration * q)
    }

    /// How much the sigmas are widened where the model does not fit the harmonics, one where it does.
    ///
    /// A chi-square beyond the limit chance makes once in a thousand spins, at one turn as at ten.
    pub(super) fn widening(&self) -> T {
        const UNLIKELY: f64 = 2.2;
        // Few rows say little of the noise that they are held against.
        let limit = self.turning_freedom.map_or(T::one(), |freedom| {
            count::<T>(freedom) / count(freedom.saturating_sub(4).max(1)) // eq. 15
        }) * real(UNLIKELY);
        let reduced = reduced(self.solution.chi_square, self.degrees_of_freedom);
        if reduced > limit {
            reduced.square_root()
        } else {
            T::one()
        }
    }

    /// What is to be added to a heading as it was counted, rad, `time` s after the origin.
    pub fn heading_correction(&self, heading: T, time: T) -> T {
        let q = T::one() / (T::one() + self.solution.x[SCALE]);
        heading * (q - T::one()) + time * self.by_time // eq. 8
    }
}

/// X of eq. 12: a line for each function of eq. 9, a column for each axis of the accelerometer.
type Coefficients<T> = SMatrix<T, FUNCTIONS, 3>;

/// The vectors that X is linear in.
#[derive(Clone, Copy)]
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

/// How heading as counted has to be stretched and sheared to be the true one, with `q = 1 / (1 + s)`.
#[derive(Clone, Copy)]
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

impl<T: Real> HarmonicVectors<T> {
    fn zero() -> Self {
        let zero = Vector3::zeros();
        Self {
            constant: zero,
            cosine: zero,
            sine: zero,
            arm: zero,
            arm_left: zero,
        }
    }

    /// X.
    fn coefficients(&self, distortion: &HeadingDistortion<T>) -> Coefficients<T> {
        Coefficients::from_rows(&[
            self.constant.transpose(),                          // eq. 12
            self.cosine.transpose(),                            // eq. 12: p
            self.sine.transpose(),                              // eq. 12: -n x p
            (self.cosine * -distortion.by_heading).transpose(), // eq. 12: -alpha p
            (self.sine * distortion.by_heading).transpose(),    // eq. 12: -alpha n x p
            (self.cosine * -distortion.by_time).transpose(),    // eq. 12: -eta p
            (self.sine * distortion.by_time).transpose(),       // eq. 12: -eta n x p
            (self.arm * -distortion.q_squared).transpose(),     // eq. 12: -q^2 r
            (self.arm_left * distortion.q).transpose(),         // eq. 12: q n x r
        ])
    }
}

/// The model about one point.
struct Linearization<T: Real> {
    /// `sqrt(g^2 - p^2)`, m/s^2.
    gravity: T,
    up: Vector3<T>,
    /// Forward and left, projected across `up`.
    plane: [Vector3<T>; 2],
    vectors: HarmonicVectors<T>,
    distortion: HeadingDistortion<T>,
    /// `epsilon`, rad/s.
    drift: T,
}

impl<T: Real> Linearization<T> {
    fn at(priors: &SpinPriors<T>, x: &SVector<T, UNKNOWNS>) -> Self {
        let floor = &priors.axis.floor;
        let (forward, left) = (floor.column(0), floor.column(1));
        let up = unit(&(floor.column(2) + forward * x[AXIS] + left * x[AXIS + 1]));
        let project_horizontal = |v: Vector3<T>| v - up * up.dot(&v);
        let plane = [
            project_horizontal(forward.into_owned()),
            project_horizontal(left.into_owned()),
        ];
        let uphill = plane[0] * x[UPHILL] + plane[1] * x[UPHILL + 1];
        let arm = plane[0] * x[LEVER_ARM] + plane[1] * x[LEVER_ARM + 1];
        let vertical = (priors.gravity * priors.gravity - uphill.norm_squared())
            .max(T::zero())
            .square_root();
        let q = T::one() / (T::one() + x[SCALE]); // eq. 8
        let drift = (priors.axis.bias - priors.counted_bias).dot(&up) + x[GYROSCOPE_UP]; // eq. 8: epsilon
        let bias = Vector3::new(x[ACCELEROMETER], x[ACCELEROMETER + 1], x[ACCELEROMETER + 2]);
        Self {
            gravity: vertical,
            up,
            plane,
            vectors: HarmonicVectors {
                constant: bias + (up * vertical - priors.origin), // eq. 12
                cosine: uphill,
                sine: -cross(&up, &uphill), // eq. 12
                arm,
                arm_left: cross(&up, &arm), // eq. 12
            },
            distortion: HeadingDistortion {
                by_heading: q - T::one(),     // eq. 12: alpha
                by_time: x[WALK] - drift * q, // eq. 12: eta
                q_squared: q * q,
                q,
            },
            drift,
        }
    }

    /// Derivative of X by unknown `i`; zero where X does not depend on it.
    #[inline(never)]
    fn derivative(&self, i: usize) -> Coefficients<T> {
        match i {
            ACCELEROMETER..GYROSCOPE => self.by_accelerometer_bias(i - ACCELEROMETER),
            GYROSCOPE_UP => self.by_drift(),
            AXIS..UPHILL => self.by_tilt(&self.plane[i - AXIS]),
            UPHILL..LEVER_ARM => self.by_uphill(&self.plane[i - UPHILL]),
            LEVER_ARM..SCALE => self.by_lever_arm(&self.plane[i - LEVER_ARM]),
            SCALE => self.by_scale(),
            WALK => self.by_walk(),
            _ => Coefficients::zeros(),
        }
    }

    fn by_accelerometer_bias(&self, axis: usize) -> Coefficients<T> {
        HarmonicVectors {
            constant: Vector3::from_fn(|k, _| if k == axis { T::one() } else { T::zero() }),
            ..HarmonicVectors::zero()
        }
        .coefficients(&HeadingDistortion::zero())
    }

    /// When the axis tilts towards `e`, `n` goes along `e`, and what lies along `e` goes down.
    fn by_tilt(&self, e: &Vector3<T>) -> Coefficients<T> {
        let lowered = |v: &Vector3<T>| self.up * -e.dot(v);
        HarmonicVectors {
            constant: e * self.gravity,
            cosine: lowered(&self.vectors.cosine),
            sine: -cross(e, &self.vectors.cosine),
            arm: lowered(&self.vectors.arm),
            arm_left: cross(e, &self.vectors.arm),
        }
        .coefficients(&self.distortion)
    }

    fn by_uphill(&self, e: &Vector3<T>) -> Coefficients<T> {
        HarmonicVectors {
            constant: self.up * -(self.vectors.cosine.dot(e) / self.gravity),
            cosine: *e,
            sine: -cross(&self.up, e),
            ..HarmonicVectors::zero()
        }
        .coefficients(&self.distortion)
    }

    fn by_lever_arm(&self, e: &Vector3<T>) -> Coefficients<T> {
        HarmonicVectors {
            arm: *e,
            arm_left: cross(&self.up, e),
            ..HarmonicVectors::zero()
        }
        .coefficients(&self.distortion)
    }

    fn by_drift(&self) -> Coefficients<T> {
        self.by_distortion(HeadingDistortion {
            by_time: -self.distortion.q,
            ..HeadingDistortion::zero()
        })
    }

    /// `dq/ds = -q^2`.
    fn by_scale(&self) -> Coefficients<T> {
        let q = self.distortion.q;
        self.by_distortion(HeadingDistortion {
            by_heading: -q * q,
            by_time: self.drift * q * q,
            q_squared: -q * q * q * real::<T>(2.0),
            q: -q * q,
        })
    }

    fn by_walk(&self) -> Coefficients<T> {
        self.by_distortion(HeadingDistortion {
            by_time: T::one(),
            ..HeadingDistortion::zero()
        })
    }

    /// The first three functions of eq. 9 do not know of the distortion.
    fn by_distortion(&self, change: HeadingDistortion<T>) -> Coefficients<T> {
        let turning = HarmonicVectors {
            constant: Vector3::zeros(),
            ..self.vectors
        };
        let mut coefficients = turning.coefficients(&change);
        coefficients.fixed_rows_mut::<3>(0).fill(T::zero());
        coefficients
    }
}

/// Rounds of linearisation: the heading's errors matter only once the floor's tilt is known, and that is the first
/// round's doing.
const ROUNDS: u32 = 5;

/// Fits all unknowns to what the accelerometer said at rest and while turning.
///
/// Lines of `resting` are weighted by the number of blocks, so that their variance is that of one.
///
/// # Errors
/// [`Unsolvable`] if something was not finite.
pub fn fit<T: Real>(
    resting: &Harmonics<T>,
    turning: &Harmonics<T>,
    priors: &SpinPriors<T>,
) -> Result<LevelFree<T>, Unsolvable> {
    let harmonics = [resting, turning];
    let mut x = nominal(priors);
    for _ in 1..ROUNDS {
        x = one_round(harmonics, priors, &x, LeastSquares::unknowns)?;
    }
    let solution = one_round(harmonics, priors, &x, LeastSquares::solve)?;
    let floor = priors.axis.floor;
    let x = &solution.x;
    let correction = Vector3::new(x[GYROSCOPE], x[GYROSCOPE + 1], x[GYROSCOPE_UP]);
    let point = Linearization::at(priors, x);
    Ok(LevelFree {
        up: point.up,
        gravity: priors.gravity,
        by_time: point.distortion.by_time,
        gyroscope_bias: priors.axis.bias + floor * correction,
        floor,
        degrees_of_freedom: degrees_of_freedom(solution.rows, shown(&solution)),
        turning_freedom: turning.freedom(),
        solution,
    })
}

/// How many unknowns the rows tell more of than was known before.
fn shown<T: Real>(solution: &Solution<T, UNKNOWNS>) -> usize {
    let half = real::<T>(0.5);
    solution.ignorance.iter().filter(|share| **share < half).count()
}

/// Unknowns before any data.
fn nominal<T: Real>(priors: &SpinPriors<T>) -> SVector<T, UNKNOWNS> {
    SVector::from_fn(|i, _| if i == SCALE { priors.scale.0 } else { T::zero() })
}

// Here and below: what is inlined into the fit keeps its stack while the fit goes on, 12 kB of it on a device.
#[inline(never)]
fn one_round<T: Real, S>(
    harmonics: [&Harmonics<T>; 2],
    priors: &SpinPriors<T>,
    x: &SVector<T, UNKNOWNS>,
    solve: impl Fn(&LeastSquares<T, UNKNOWNS>) -> Result<S, Unsolvable>,
) -> Result<S, Unsolvable> {
    let mut equations = prior(priors);
    accumulate(harmonics, priors, x, &mut equations);
    solve(&equations)
}

#[inline(never)]
fn prior<T: Real>(priors: &SpinPriors<T>) -> LeastSquares<T, UNKNOWNS> {
    let mut prior = Prior::<T, UNKNOWNS> {
        mean: nominal(priors),
        covariance: SMatrix::zeros(),
    };
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
        prior.covariance[(i, i)] = variance(i);
    }
    prior
        .covariance
        .fixed_view_mut::<5, 5>(GYROSCOPE, GYROSCOPE)
        .copy_from(&priors.axis.covariance);
    prior.covariance[(GYROSCOPE_UP, GYROSCOPE_UP)] = priors.bias_variance;
    LeastSquares::new(&prior)
}

/// The harmonics as equations, linearised about `x`.
#[inline(never)]
fn accumulate<T: Real>(
    [resting, turning]: [&Harmonics<T>; 2],
    priors: &SpinPriors<T>,
    x: &SVector<T, UNKNOWNS>,
    equations: &mut LeastSquares<T, UNKNOWNS>,
) {
    let point = Linearization::at(priors, x);
    let model = point.vectors.coefficients(&point.distortion);
    let derivatives: [Coefficients<T>; UNKNOWNS] = core::array::from_fn(|i| point.derivative(i));
    for (harmonics, variance) in [
        (resting, &priors.rest_variance),
        (turning, &priors.turning_variance),
    ] {
        for i in 0..FUNCTIONS {
            let (line, right) = harmonics.line(i);
            // Lines of functions that never were anything but zero say nothing.
            if line.iter().all(|value| *value == T::zero()) {
                continue;
            }
            let said = model.tr_mul(&line);
            let by_unknown = derivatives.each_ref().map(|d| d.tr_mul(&line));
            for axis in 0..3 {
                let a = SVector::<T, UNKNOWNS>::from_fn(|j, _| by_unknown[j][axis]);
                let y = right[axis] - said[axis] + a.dot(x);
                equations.push(&a, y, variance[axis]);
            }
        }
    }
}
