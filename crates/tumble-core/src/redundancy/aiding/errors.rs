//! Errors of attitude, velocity and biases of one unit, and their covariance.

use nalgebra::{Matrix3, Vector3};

use crate::real::{Real, real};

/// Number of estimated errors.
const ERRORS: usize = 13;

/// Those that others move, attitude and velocity, which come first.
const MOVED: usize = 6;

/// Elements of the upper triangle of their covariance.
const KEPT: usize = ERRORS * (ERRORS + 1) / 2;

/// Errors of the state of a unit, or derivatives of a measurement by each of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Errors<T: Real> {
    /// Attitude error, a rotation vector in the level frame, rad.
    pub attitude: Vector3<T>,
    /// Velocity error, level frame, m/s.
    pub velocity: Vector3<T>,
    /// Error of the angular rate, axes of the primary, rad/s.
    pub rate: Vector3<T>,
    /// Error of the specific force, axes of the primary, m/s^2.
    pub force: Vector3<T>,
    /// Delay of the aiding measurement, s.
    pub delay: T,
}

impl<T: Real> Errors<T> {
    pub fn none() -> Self {
        Self {
            attitude: Vector3::zeros(),
            velocity: Vector3::zeros(),
            rate: Vector3::zeros(),
            force: Vector3::zeros(),
            delay: T::zero(),
        }
    }

    /// Adds `times` other errors.
    pub fn plus(&self, other: &Self, times: T) -> Self {
        Self {
            attitude: self.attitude + other.attitude * times,
            velocity: self.velocity + other.velocity * times,
            rate: self.rate + other.rate * times,
            force: self.force + other.force * times,
            delay: self.delay + other.delay * times,
        }
    }

    pub fn dot(&self, other: &Self) -> T {
        self.attitude.dot(&other.attitude)
            + self.velocity.dot(&other.velocity)
            + self.rate.dot(&other.rate)
            + self.force.dot(&other.force)
            + self.delay * other.delay
    }

    fn of(all: &[T; ERRORS]) -> Self {
        let [ax, ay, az, vx, vy, vz, wx, wy, wz, fx, fy, fz, delay] = *all;
        Self {
            attitude: Vector3::new(ax, ay, az),
            velocity: Vector3::new(vx, vy, vz),
            rate: Vector3::new(wx, wy, wz),
            force: Vector3::new(fx, fy, fz),
            delay,
        }
    }

    fn all(&self) -> [T; ERRORS] {
        let (a, v, w, f) = (&self.attitude, &self.velocity, &self.rate, &self.force);
        [
            a.x, a.y, a.z, v.x, v.y, v.z, w.x, w.y, w.z, f.x, f.y, f.z, self.delay,
        ]
    }
}

/// Transition of errors over a window (docs/theory/set.md, eq. 29).
pub(super) struct Moves<T: Real> {
    pub velocity_by_attitude: Matrix3<T>,
    /// Attitude by the angular rate, and velocity by the specific force.
    pub by_reading: Matrix3<T>,
}

impl<T: Real> Moves<T> {
    /// Propagates errors over the window.
    pub fn carry(&self, errors: &Errors<T>) -> Errors<T> {
        let turned = self.by_reading * errors.rate;
        let tilted = self.velocity_by_attitude * (errors.attitude + turned * real::<T>(0.5));
        Errors {
            attitude: errors.attitude + turned,
            velocity: errors.velocity + tilted + self.by_reading * errors.force,
            ..*errors
        }
    }
}

/// Covariance of errors: the upper triangle, row by row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Covariance<T: Real>([T; KEPT]);

impl<T: Real> Covariance<T> {
    /// Creates the covariance of independent errors from their variances.
    pub fn of_variances(variances: &Errors<T>) -> Self {
        let mut covariance = Self([T::zero(); KEPT]);
        covariance.widen(variances);
        covariance
    }

    /// Propagates the covariance and adds variances of noise.
    #[inline(never)]
    pub fn spread(&mut self, moves: &Moves<T>, noise: &Errors<T>) {
        let mut moved = [[T::zero(); MOVED]; ERRORS];
        for (line, columns) in moved.iter_mut().enumerate() {
            let row = moves.carry(&self.row(line)).all();
            columns.iter_mut().zip(row).for_each(|(to, from)| *to = from);
        }
        let mut row = [T::zero(); ERRORS];
        self.for_each(|line, column, element| {
            if line >= MOVED {
                return;
            }
            if column == line {
                // The matrix is symmetric, so the function for rows moves columns too.
                let of_line = |each: &[T; MOVED]| each.get(line).copied().unwrap_or(T::zero());
                row = moves.carry(&Errors::of(&moved.each_ref().map(of_line))).all();
            }
            *element = row.get(column).copied().unwrap_or(T::zero());
        });
        self.widen(noise); // set.md, eq. 29
    }

    /// Covariance of the errors with a measurement whose derivatives are `row`.
    pub fn across(&self, row: &Errors<T>) -> Errors<T> {
        Errors::of(&core::array::from_fn(|line| self.row(line).dot(row)))
    }

    /// Reduces the covariance by a measurement of a variance.
    pub fn narrow(&mut self, across: &Errors<T>, variance: T) {
        let all = across.all();
        self.for_each(|line, column, element| {
            let (Some(a), Some(b)) = (all.get(line), all.get(column)) else {
                return;
            };
            *element -= *a * *b / variance;
            if line == column {
                *element = element.max(real(LEAST));
            }
        });
    }

    /// Adds variances of independent errors.
    pub fn widen(&mut self, variances: &Errors<T>) {
        let variances = variances.all();
        self.for_each(|line, column, element| {
            if let Some(variance) = variances.get(line).filter(|_| line == column) {
                *element += *variance;
            }
        });
    }

    /// Replaces all marked errors: they get these variances and no correlation with the others.
    pub fn replace(&mut self, marked: &Errors<T>, variances: &Errors<T>) {
        let (marked, variances) = (marked.all(), variances.all());
        let is_marked = |place: usize| marked.get(place).is_some_and(|mark| *mark != T::zero());
        self.for_each(|line, column, element| {
            if is_marked(line) || is_marked(column) {
                let own = variances.get(line).filter(|_| line == column);
                *element = own.copied().unwrap_or(T::zero());
            }
        });
    }

    /// Calls a function with line, column and value of each kept element: those that are not below the diagonal.
    fn for_each(&mut self, mut change: impl FnMut(usize, usize, &mut T)) {
        let (mut line, mut column) = (0, 0);
        for element in &mut self.0 {
            change(line, column, element);
            column += 1;
            if column == ERRORS {
                line += 1;
                column = line;
            }
        }
    }

    fn row(&self, line: usize) -> Errors<T> {
        Errors::of(&core::array::from_fn(|column| self.at(line, column)))
    }

    /// Element of the symmetric matrix.
    fn at(&self, line: usize, column: usize) -> T {
        let (upper, lower) = (line.min(column), line.max(column));
        // `upper` lines stand above, of which each keeps one element less than the one before.
        let place = upper * (2 * ERRORS - 1 - upper) / 2 + lower;
        self.0.get(place).copied().unwrap_or(T::zero())
    }
}

/// Least variance, above the rounding of single precision.
const LEAST: f64 = 1e-14;
