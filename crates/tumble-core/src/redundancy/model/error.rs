//! Knowledge of the errors of a secondary: one Gaussian a sensor, to which motion adds information.
//!
//! `y = M (f + W r) + b` of an accelerometer, `y = M w + b` of a gyroscope, relative to the primary
//! (docs/theory/set.md, eq. 5 and 6).

use super::motion::{Lever, MotionOfSet};
use super::table::{ErrorSigmas, SIGMAS, UNCALIBRATED, WALK};
use super::triangle::InformationTriangle;
use crate::real::{Real, real};

/// Parameters of a row of a gyroscope: a row of `M - 1`, then the bias.
const RATE: usize = 4;
/// Parameters of an accelerometer: for each axis a row of `M - 1` and the bias, then the lever arm.
const FORCE: usize = 15;

/// Information of angular rates.
pub type RateTriangle<T> = InformationTriangle<T, 4, 3, 22>;
/// Information of specific forces.
pub type ForceTriangle<T> = InformationTriangle<T, 15, 1, 135>;

/// Prior mean and standard deviations of an accelerometer or gyroscope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters<T: Real> {
    /// Rows of `M - 1` and the bias, of the accelerometer and the gyroscope.
    pub rows: [[[T; RATE]; 3]; 2],
    /// m.
    pub arm: [T; 3],
}

/// Mean and information of all parameters of one secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondaryErrors<T: Real> {
    rate: RateTriangle<T>,
    force: ForceTriangle<T>,
    mean: Parameters<T>,
}

/// Information that a block adds of angular rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateBlock<T: Real>(RateTriangle<T>);

impl<T: Real> RateBlock<T> {
    /// No information.
    pub fn none() -> Self {
        Self(InformationTriangle::none())
    }

    /// Adds a window: the rate of the set, and secondary minus primary, rad/s.
    pub fn add(&mut self, rate: &[T; 3], difference: &[T; 3]) {
        let [_, sigma] = SIGMAS;
        let weight = real::<T>(1.0 / sigma);
        let [x, y, z] = *rate;
        let [a, b, c] = *difference;
        let mut row = [x, y, z, T::one(), a, b, c].map(|value| value * weight);
        self.0.add(&mut row);
    }
}

impl<T: Real> SecondaryErrors<T> {
    /// Errors of a unit of which nothing is known.
    pub fn uncalibrated() -> Self {
        Self::new(&Parameters::zero(), &Parameters::of_grade(&UNCALIBRATED))
    }

    /// Errors with a mean and independent standard deviations.
    pub fn new(mean: &Parameters<T>, sigmas: &Parameters<T>) -> Self {
        let [force, rate] = mean.rows;
        let [_, [rate_sigmas, ..]] = sigmas.rows;
        let mut rate_means = [[T::zero(); 3]; RATE];
        for (axis, row) in rate.iter().enumerate() {
            for (means, value) in rate_means.iter_mut().zip(row) {
                if let Some(place) = means.get_mut(axis) {
                    *place = *value;
                }
            }
        }
        let joined = joined(&force, &mean.arm).map(|value| [value]);
        let [force_sigmas, _] = sigmas.rows;
        Self {
            rate: InformationTriangle::independent(&rate_means, &rate_sigmas),
            force: InformationTriangle::independent(&joined, &self::joined(&force_sigmas, &sigmas.arm)),
            mean: *mean,
        }
    }

    /// Errors of which all that was learnt before is stored: information as [`Self::information`] gives it.
    pub fn stored(rate: &[T; 22], force: &[T; 135]) -> Self {
        let mut errors = Self {
            rate: InformationTriangle::of_rows(rate),
            force: InformationTriangle::of_rows(force),
            mean: Parameters::zero(),
        };
        errors.update_mean();
        errors
    }

    /// Rows of both triangles: all that is known.
    pub fn information(&self) -> (&[T; 22], &[T; 135]) {
        (self.rate.rows(), self.force.rows())
    }

    /// The mean.
    pub fn mean(&self) -> &Parameters<T> {
        &self.mean
    }

    /// Lets biases walk for a time, s (eq. 9).
    pub fn walk(&mut self, root_seconds: T) {
        let [force, rate] = WALK.map(real::<T>);
        self.rate
            .walk(RATE - 1, rate * root_seconds, &mut [T::zero(); RATE + 3]);
        for axis in 0..3 {
            let bias = RATE * axis + RATE - 1;
            self.force
                .walk(bias, force * root_seconds, &mut [T::zero(); FORCE + 1]);
        }
    }

    /// Adds a block of angular rates.
    pub fn add_rates(&mut self, block: &RateBlock<T>) {
        self.rate.add_all(&block.0, &mut [T::zero(); RATE + 3]);
    }

    /// Adds a mean: the specific force of the set, its lever, and secondary minus primary, m/s^2.
    pub fn add_force(&mut self, force: &[T; 3], lever: &Lever<T>, difference: &[T; 3]) {
        let [sigma, _] = SIGMAS;
        let weight = real::<T>(1.0 / sigma);
        for (axis, (arm, value)) in lever.0.iter().zip(difference).enumerate() {
            let mut row = [T::zero(); FORCE + 1];
            design(&mut row, axis, force, arm);
            if let Some(last) = row.last_mut() {
                *last = *value;
            }
            let mut row = row.map(|value| value * weight);
            self.force.add(&mut row);
        }
    }

    /// Solves for the mean (eq. 10).
    pub fn update_mean(&mut self) {
        let rate = self.rate.solve();
        let force = self.force.solve();
        let [force_rows, rate_rows] = &mut self.mean.rows;
        for (axis, row) in rate_rows.iter_mut().enumerate() {
            for (place, values) in row.iter_mut().zip(&rate) {
                *place = values.get(axis).copied().unwrap_or(T::zero());
            }
        }
        let places = force_rows.as_flattened_mut().iter_mut().chain(&mut self.mean.arm);
        for (place, [value]) in places.zip(force) {
            *place = value;
        }
    }

    /// Error of both sensors along a motion, m/s^2 and rad/s.
    pub fn error(&self, motion: &MotionOfSet<T>, lever: &Lever<T>) -> [[T; 3]; 2] {
        self.mean.error(motion, lever)
    }

    /// `(M - 1) W r`, m/s^2: no linear part of the parameters.
    pub fn bilinear(&self, lever: &Lever<T>) -> [T; 3] {
        let [force, _] = &self.mean.rows;
        let [x, y, z] = lever.carried(&self.mean.arm);
        force.map(|[a, b, c, _]| a * x + b * y + c * z)
    }

    /// Variance of the errors of both sensors along a motion, by axis: `phi' C phi` (eq. 11).
    pub fn variance(&self, motion: &MotionOfSet<T>, lever: &Lever<T>) -> [[T; 3]; 2] {
        let [x, y, z] = *motion.rate();
        let rate = self.rate.variance(&mut [x, y, z, T::one()]);
        let mut force = [T::zero(); 3];
        for (axis, (place, arm)) in force.iter_mut().zip(&lever.0).enumerate() {
            let mut phi = [T::zero(); FORCE];
            design(&mut phi, axis, motion.force(), arm);
            *place = self.force.variance(&mut phi);
        }
        [force, [rate; 3]]
    }
}

impl<T: Real> Parameters<T> {
    /// Parameters of a perfect unit at the place of the primary.
    pub fn zero() -> Self {
        Self {
            rows: [[[T::zero(); RATE]; 3]; 2],
            arm: [T::zero(); 3],
        }
    }

    /// Error of both sensors along a motion, m/s^2 and rad/s (eq. 5 and 6).
    pub fn error(&self, motion: &MotionOfSet<T>, lever: &Lever<T>) -> [[T; 3]; 2] {
        let [force, rate] = &self.rows;
        let carried = lever.carried(&self.arm);
        let felt = added(motion.force(), &carried);
        [
            added(&linear(force, &felt), &carried),
            linear(rate, motion.rate()),
        ]
    }

    /// Standard deviations of a grade.
    pub fn of_grade(grade: &ErrorSigmas) -> Self {
        let m = real(grade.matrix);
        Self {
            rows: grade.bias.map(|bias| [[m, m, m, real(bias)]; 3]),
            arm: [real(grade.arm); 3],
        }
    }
}

/// Derivative of the error along an axis by the parameters of an accelerometer.
fn design<T: Real>(row: &mut [T], axis: usize, force: &[T; 3], lever: &[T; 3]) {
    let of_axis = row.iter_mut().skip(RATE * axis);
    for (place, value) in of_axis.zip(force.iter().chain(&[T::one()])) {
        *place = *value;
    }
    for (place, value) in row.iter_mut().skip(RATE * 3).zip(lever) {
        *place = *value;
    }
}

/// Rows of an accelerometer and its lever arm, one after the other.
fn joined<T: Real>(rows: &[[T; RATE]; 3], arm: &[T; 3]) -> [T; FORCE] {
    let mut all = [T::zero(); FORCE];
    for (place, value) in all.iter_mut().zip(rows.as_flattened().iter().chain(arm)) {
        *place = *value;
    }
    all
}

/// `A x + b` of rows `[A | b]`.
fn linear<T: Real>(rows: &[[T; RATE]; 3], [x, y, z]: &[T; 3]) -> [T; 3] {
    rows.map(|[a, b, c, bias]| a * *x + b * *y + c * *z + bias)
}

fn added<T: Real>([a, b, c]: &[T; 3], [x, y, z]: &[T; 3]) -> [T; 3] {
    [*a + *x, *b + *y, *c + *z]
}
