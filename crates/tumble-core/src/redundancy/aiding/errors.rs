//! Errors of attitude and velocity, and their covariance.

use nalgebra::{Matrix3, Vector3};

use crate::real::{Real, real};

/// Number of estimated errors.
const ERRORS: usize = 10;

/// Elements of the upper triangle of their covariance.
const KEPT: usize = ERRORS * (ERRORS + 1) / 2;

/// Errors of the state of the set, or derivatives of a measurement by each of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors<T: Real> {
    /// Attitude error, a rotation vector in the level frame, rad.
    pub attitude: Vector3<T>,
    /// Velocity error, level frame, m/s.
    pub velocity: Vector3<T>,
    /// Error of the angular rate, axes of the primary, rad/s.
    pub rate: Vector3<T>,
    /// Error of the specific force along the vertical, m/s^2, which includes that of the nominal gravity.
    pub vertical: T,
}

impl<T: Real> Errors<T> {
    pub fn none() -> Self {
        Self {
            attitude: Vector3::zeros(),
            velocity: Vector3::zeros(),
            rate: Vector3::zeros(),
            vertical: T::zero(),
        }
    }

    /// Adds `times` other errors.
    pub fn plus(&self, other: &Self, times: T) -> Self {
        Self {
            attitude: self.attitude + other.attitude * times,
            velocity: self.velocity + other.velocity * times,
            rate: self.rate + other.rate * times,
            vertical: self.vertical + other.vertical * times,
        }
    }

    pub fn dot(&self, other: &Self) -> T {
        self.attitude.dot(&other.attitude)
            + self.velocity.dot(&other.velocity)
            + self.rate.dot(&other.rate)
            + self.vertical * other.vertical
    }

    fn of(all: &[T; ERRORS]) -> Self {
        let [ax, ay, az, vx, vy, vz, wx, wy, wz, vertical] = *all;
        Self {
            attitude: Vector3::new(ax, ay, az),
            velocity: Vector3::new(vx, vy, vz),
            rate: Vector3::new(wx, wy, wz),
            vertical,
        }
    }

    fn all(&self) -> [T; ERRORS] {
        let (a, v, w) = (&self.attitude, &self.velocity, &self.rate);
        [a.x, a.y, a.z, v.x, v.y, v.z, w.x, w.y, w.z, self.vertical]
    }
}

/// Transition of errors over a window (docs/theory/isolation.md, eq. 17).
pub(super) struct Moves<T: Real> {
    pub velocity_by_attitude: Matrix3<T>,
    pub attitude_by_rate: Matrix3<T>,
    pub velocity_by_vertical: T,
}

impl<T: Real> Moves<T> {
    /// Propagates errors over the window.
    pub fn carry(&self, errors: &Errors<T>) -> Errors<T> {
        let turned = self.attitude_by_rate * errors.rate;
        let mut moved = self.velocity_by_attitude * (errors.attitude + turned * real::<T>(0.5));
        moved.z += self.velocity_by_vertical * errors.vertical;
        Errors {
            attitude: errors.attitude + turned,
            velocity: errors.velocity + moved,
            ..*errors
        }
    }
}

/// Covariance of errors: the upper triangle, row by row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Covariance<T: Real>([T; KEPT]);

type Square<T> = [[T; ERRORS]; ERRORS];

impl<T: Real> Covariance<T> {
    /// Creates the covariance of independent errors from their variances.
    pub fn of_variances(variances: &Errors<T>) -> Self {
        let mut square = [[T::zero(); ERRORS]; ERRORS];
        add_to_diagonal(&mut square, variances);
        Self::packed(&square)
    }

    /// Propagates the covariance and adds variances of noise.
    pub fn spread(&mut self, moves: &Moves<T>, noise: &Errors<T>) {
        let carried = |square: &Square<T>| square.map(|row| moves.carry(&Errors::of(&row)).all());
        // The matrix is symmetric, so the function for rows moves columns once they are transposed.
        let mut square = carried(&transposed(&carried(&self.square())));
        add_to_diagonal(&mut square, noise); // isolation.md, eq. 17
        *self = Self::packed(&square);
    }

    /// Covariance of the errors with a measurement whose derivatives are `row`.
    pub fn across(&self, row: &Errors<T>) -> Errors<T> {
        Errors::of(&self.square().map(|each| Errors::of(&each).dot(row)))
    }

    /// Reduces the covariance by a measurement of a variance.
    pub fn narrow(&mut self, across: &Errors<T>, variance: T) {
        let all = across.all();
        let mut square = self.square();
        for (line, (row, a)) in square.iter_mut().zip(all).enumerate() {
            for (column, (element, b)) in row.iter_mut().zip(all).enumerate() {
                *element -= a * b / variance;
                if line == column {
                    *element = element.max(real(LEAST));
                }
            }
        }
        *self = Self::packed(&square);
    }

    /// Adds variances of independent errors.
    pub fn widen(&mut self, variances: &Errors<T>) {
        let mut square = self.square();
        add_to_diagonal(&mut square, variances);
        *self = Self::packed(&square);
    }

    /// Variances of the errors.
    pub fn variances(&self) -> Errors<T> {
        let square = self.square();
        let mut all = [T::zero(); ERRORS];
        for (place, (variance, row)) in all.iter_mut().zip(&square).enumerate() {
            *variance = row.get(place).copied().unwrap_or(T::zero());
        }
        Errors::of(&all)
    }

    /// Replaces all marked errors: they get these variances and no correlation with the others.
    pub fn replace(&mut self, marked: &Errors<T>, variances: &Errors<T>) {
        let (marked, variances) = (marked.all(), variances.all());
        let mut square = self.square();
        for (line, (row, of_row)) in square.iter_mut().zip(marked).enumerate() {
            for (column, (element, of_column)) in row.iter_mut().zip(marked).enumerate() {
                if of_row == T::zero() && of_column == T::zero() {
                    continue;
                }
                let own = variances.get(line).filter(|_| line == column);
                *element = own.copied().unwrap_or(T::zero());
            }
        }
        *self = Self::packed(&square);
    }

    fn packed(square: &Square<T>) -> Self {
        let mut packed = [T::zero(); KEPT];
        let upper = square
            .iter()
            .enumerate()
            .flat_map(|(line, row)| row.iter().skip(line));
        for (kept, element) in packed.iter_mut().zip(upper) {
            *kept = *element;
        }
        Self(packed)
    }

    fn square(&self) -> Square<T> {
        let mut upper = [[T::zero(); ERRORS]; ERRORS];
        let places = upper
            .iter_mut()
            .enumerate()
            .flat_map(|(line, row)| row.iter_mut().skip(line));
        for (element, kept) in places.zip(&self.0) {
            *element = *kept;
        }
        let mut square = upper;
        for (line, (row, turned)) in square.iter_mut().zip(&transposed(&upper)).enumerate() {
            for (element, other) in row.iter_mut().zip(turned).take(line) {
                *element = *other;
            }
        }
        square
    }
}

/// Least variance, above the rounding of single precision.
const LEAST: f64 = 1e-14;

fn transposed<T: Real>(square: &Square<T>) -> Square<T> {
    core::array::from_fn(|line| square.map(|row| row.get(line).copied().unwrap_or(T::zero())))
}

fn add_to_diagonal<T: Real>(square: &mut Square<T>, variances: &Errors<T>) {
    for (place, (row, variance)) in square.iter_mut().zip(variances.all()).enumerate() {
        if let Some(element) = row.get_mut(place) {
            *element += variance;
        }
    }
}
