//! The level-free estimator: physical quantities fitted to the harmonics of specific force over heading.
//!
//! Gravity turns with the heading and bias does not; the centripetal and the tangential pull of an IMU mounted off the
//! turning axis go with the squared rate and with its change. What the gyroscope showed of axis and bias comes in as
//! prior knowledge, with its covariance (docs/theory/spin.md, eq. 7 to 12).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::real::{Real, real};
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
    /// Rows less unknowns.
    pub degrees_of_freedom: u32,
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
        let (sine, cosine) = heading.sin_cos();
        let single = T::one() / (T::one() + x[SCALE]);
        let vertical = (self.gravity * self.gravity - uphill.norm_squared()).max(T::zero());
        self.up * vertical.sqrt() + uphill * cosine
            - self.up.cross(&uphill) * sine
            - arm * (rate * rate * single * single)
            + self.up.cross(&arm) * (acceleration * single)
    }

    /// How much the variances are widened where the model does not fit the harmonics.
    pub(super) fn widening(&self) -> T {
        const UNLIKELY: f64 = 2.0;
        let reduced = reduced(self.solution.chi_square, self.degrees_of_freedom);
        if reduced > real(UNLIKELY) {
            reduced
        } else {
            T::one()
        }
    }

    /// What is to be added to a heading as it was counted, rad, `time` s after the origin.
    pub fn heading_correction(&self, heading: T, time: T) -> T {
        let single = T::one() / (T::one() + self.solution.x[SCALE]);
        heading * (single - T::one()) + time * self.by_time
    }
}

type Coefficients<T> = SMatrix<T, FUNCTIONS, 3>;

/// The vectors the coefficients are linear in.
#[derive(Clone, Copy)]
struct Vectors<T: Real> {
    constant: Vector3<T>,
    cosine: Vector3<T>,
    sine: Vector3<T>,
    arm: Vector3<T>,
    arm_left: Vector3<T>,
}

/// How heading as counted has to be stretched and sheared to be the true one.
#[derive(Clone, Copy)]
struct HeadingDistortion<T: Real> {
    by_heading: T,
    by_time: T,
    squared: T,
    single: T,
}

impl<T: Real> Vectors<T> {
    /// Eq. 11.
    fn coefficients(&self, distortion: &HeadingDistortion<T>) -> Coefficients<T> {
        Coefficients::from_rows(&[
            self.constant.transpose(),
            self.cosine.transpose(),
            self.sine.transpose(),
            (self.cosine * -distortion.by_heading).transpose(),
            (self.sine * distortion.by_heading).transpose(),
            (self.cosine * -distortion.by_time).transpose(),
            (self.sine * distortion.by_time).transpose(),
            (self.arm * -distortion.squared).transpose(),
            (self.arm_left * distortion.single).transpose(),
        ])
    }
}

/// The model about one point.
struct Point<T: Real> {
    gravity: T,
    up: Vector3<T>,
    plane: [Vector3<T>; 2],
    vectors: Vectors<T>,
    distortion: HeadingDistortion<T>,
    drift: T,
}

impl<T: Real> Point<T> {
    fn new(priors: &SpinPriors<T>, x: &SVector<T, UNKNOWNS>) -> Self {
        let floor = &priors.axis.floor;
        let (forward, left) = (floor.column(0), floor.column(1));
        let up = (floor.column(2) + forward * x[AXIS] + left * x[AXIS + 1]).normalize();
        let project_horizontal = |v: Vector3<T>| v - up * up.dot(&v);
        let plane = [
            project_horizontal(forward.into_owned()),
            project_horizontal(left.into_owned()),
        ];
        let uphill = plane[0] * x[UPHILL] + plane[1] * x[UPHILL + 1];
        let arm = plane[0] * x[LEVER_ARM] + plane[1] * x[LEVER_ARM + 1];
        let vertical = (priors.gravity * priors.gravity - uphill.norm_squared())
            .max(T::zero())
            .sqrt();
        let single = T::one() / (T::one() + x[SCALE]);
        let drift = (priors.axis.bias - priors.counted_bias).dot(&up) + x[GYROSCOPE + 2];
        Self {
            gravity: vertical,
            up,
            plane,
            vectors: Vectors {
                constant: Vector3::new(x[0], x[1], x[2]) + (up * vertical - priors.origin),
                cosine: uphill,
                sine: -up.cross(&uphill),
                arm,
                arm_left: up.cross(&arm),
            },
            distortion: HeadingDistortion {
                by_heading: single - T::one(),
                by_time: x[WALK] - drift * single,
                squared: single * single,
                single,
            },
            drift,
        }
    }

    /// Derivative of the coefficients by unknown `i`; zero where they do not depend on it.
    #[inline(never)]
    fn derivative(&self, i: usize) -> Coefficients<T> {
        let zero = Vector3::zeros();
        let none = Vectors {
            constant: zero,
            cosine: zero,
            sine: zero,
            arm: zero,
            arm_left: zero,
        };
        let single = self.distortion.single;
        let still = HeadingDistortion {
            by_heading: T::zero(),
            by_time: T::zero(),
            squared: T::zero(),
            single: T::zero(),
        };
        let turning = Vectors {
            constant: zero,
            ..self.vectors
        };
        let distorted = |distortion: HeadingDistortion<T>| {
            let mut coefficients = turning.coefficients(&distortion);
            coefficients.fixed_rows_mut::<3>(0).fill(T::zero());
            coefficients
        };
        match i {
            0..3 => Vectors {
                constant: Vector3::from_fn(|k, _| if k == i { T::one() } else { T::zero() }),
                ..none
            }
            .coefficients(&still),
            5 => distorted(HeadingDistortion {
                by_time: -single,
                ..still
            }),
            6 | 7 => self.by_tilt(&self.plane[i - 6]).coefficients(&self.distortion),
            8 | 9 => {
                let e = self.plane[i - 8];
                Vectors {
                    constant: self.up * -(self.vectors.cosine.dot(&e) / self.gravity),
                    cosine: e,
                    sine: -self.up.cross(&e),
                    ..none
                }
                .coefficients(&self.distortion)
            }
            10 | 11 => {
                let e = self.plane[i - 10];
                Vectors {
                    arm: e,
                    arm_left: self.up.cross(&e),
                    ..none
                }
                .coefficients(&self.distortion)
            }
            SCALE => distorted(HeadingDistortion {
                by_heading: -single * single,
                by_time: self.drift * single * single,
                squared: -single * single * single * real::<T>(2.0),
                single: -single * single,
            }),
            WALK => distorted(HeadingDistortion {
                by_time: T::one(),
                ..still
            }),
            _ => Coefficients::zeros(),
        }
    }

    /// How everything moves when the axis tilts towards `e`.
    fn by_tilt(&self, e: &Vector3<T>) -> Vectors<T> {
        let moved_up = |v: &Vector3<T>| self.up * -e.dot(v);
        Vectors {
            constant: e * self.gravity,
            cosine: moved_up(&self.vectors.cosine),
            sine: -e.cross(&self.vectors.cosine),
            arm: moved_up(&self.vectors.arm),
            arm_left: e.cross(&self.vectors.arm),
        }
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
    let mut solution = one_round(harmonics, priors, &nominal(priors))?;
    for _ in 1..ROUNDS {
        solution = one_round(harmonics, priors, &solution.x)?;
    }
    let floor = priors.axis.floor;
    let x = &solution.x;
    let correction = Vector3::new(x[GYROSCOPE], x[GYROSCOPE + 1], x[GYROSCOPE + 2]);
    let point = Point::new(priors, x);
    Ok(LevelFree {
        up: point.up,
        gravity: priors.gravity,
        by_time: point.distortion.by_time,
        gyroscope_bias: priors.axis.bias + floor * correction,
        floor,
        degrees_of_freedom: degrees_of_freedom(solution.rows, FREE),
        solution,
    })
}

/// Unknowns without prior knowledge: accelerometer bias, uphill pull, lever arm.
const FREE: usize = 7;

/// Unknowns before any data.
fn nominal<T: Real>(priors: &SpinPriors<T>) -> SVector<T, UNKNOWNS> {
    SVector::from_fn(|i, _| if i == SCALE { priors.scale.0 } else { T::zero() })
}

// Here and below: what is inlined into the fit keeps its stack while the fit goes on, 12 kB of it on a device.
#[inline(never)]
fn one_round<T: Real>(
    harmonics: [&Harmonics<T>; 2],
    priors: &SpinPriors<T>,
    x: &SVector<T, UNKNOWNS>,
) -> Result<Solution<T, UNKNOWNS>, Unsolvable> {
    let mut equations = prior(priors);
    accumulate(harmonics, priors, x, &mut equations);
    equations.solve()
}

#[inline(never)]
fn prior<T: Real>(priors: &SpinPriors<T>) -> LeastSquares<T, UNKNOWNS> {
    let mut prior = Prior::<T, UNKNOWNS> {
        mean: nominal(priors),
        covariance: SMatrix::zeros(),
    };
    let variance = |i: usize| -> T {
        let largest: T = match i {
            0..3 => real(LARGEST.0),
            8 | 9 => real(LARGEST.1),
            10 | 11 => real(LARGEST.2),
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
    prior.covariance[(GYROSCOPE + 2, GYROSCOPE + 2)] = priors.bias_variance;
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
    let point = Point::new(priors, x);
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
