//! Search for the course of a level frame: the angle about the vertical from it to the frame of aided velocities.
//!
//! Filters of all courses share one covariance, and their states are linear in the cosine and the sine of the course. So three
//! changes of the state and a quadratic form hold the likelihood of every course (docs/theory/set.md, eq. 32).

use nalgebra::{Vector2, Vector3};

use crate::real::{Real, count, real};
use crate::redundancy::aiding::errors::{Errors, Moves};

/// Sigma of the course below which it is known, rad; time in motion after which the likeliest one is taken, s, and its sigma then at
/// most, rad: where nothing moves level, any one serves; and time after which the search begins anew, s, for errors grow beyond what
/// is linear.
const KNOWN: f64 = 0.1;
const SOUGHT: f64 = 4.0;
const UNSURE: f64 = 0.25;
const ANEW: f64 = 10.0;

/// Courses that are tried, the angle between them, rad, and steps of Newton's method from the best of them.
const TRIED: u32 = 24;
const APART: f64 = core::f64::consts::TAU / 24.0;
const REFINED: u8 = 4;

/// Likelihood of courses: minus twice its logarithm, a quadratic form of (1, cosine, sine).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CourseLikelihood<T: Real> {
    /// Coefficients of 1, cosine^2, cosine sine, sine^2, cosine and sine.
    terms: [T; 6],
    /// Number of innovations.
    innovations: u16,
}

impl<T: Real> CourseLikelihood<T> {
    pub fn none() -> Self {
        Self {
            terms: [T::zero(); 6],
            innovations: 0,
        }
    }

    /// Adds the likelihood of independent measurements.
    pub fn add(&mut self, other: &Self) {
        for (term, other) in self.terms.iter_mut().zip(&other.terms) {
            *term += *other;
        }
        self.innovations = self.innovations.saturating_add(other.innovations);
    }

    /// Adds an innovation, linear in cosine and sine, of a variance.
    fn take(&mut self, [plain, by_cosine, by_sine]: [T; 3], variance: T) {
        let two = real::<T>(2.0);
        let more = [
            plain * plain,
            by_cosine * by_cosine,
            by_cosine * by_sine * two,
            by_sine * by_sine,
            plain * by_cosine * two,
            plain * by_sine * two,
        ];
        for (term, more) in self.terms.iter_mut().zip(more) {
            *term += more / variance; // set.md, eq. 32
        }
        self.innovations = self.innovations.saturating_add(1);
    }

    /// Sum of squares at a course, and its first two derivatives by the angle.
    fn at(&self, [sine, cosine]: [T; 2]) -> [T; 3] {
        let [one, cc, cs, ss, c, s] = self.terms;
        let two = real::<T>(2.0);
        let (double_sine, double_cosine) = (two * sine * cosine, cosine * cosine - sine * sine);
        [
            one + cc * cosine * cosine + cs * cosine * sine + ss * sine * sine + c * cosine + s * sine,
            (ss - cc) * double_sine + cs * double_cosine - c * sine + s * cosine,
            (ss - cc) * two * double_cosine - cs * two * double_sine - c * cosine - s * sine,
        ]
    }

    /// Sum of squares at a course.
    #[cfg(test)]
    pub fn squares(&self, course: [T; 2]) -> T {
        let [square, ..] = self.at(course);
        square
    }

    /// The likeliest course, as sine and cosine, and its variance, rad^2: infinite where nothing shows it.
    pub fn best(&self) -> ([T; 2], T) {
        let mut best = (T::zero(), [T::zero(), T::one()]);
        let mut least = None;
        for number in 0..TRIED {
            let angle = real::<T>(APART) * count(number);
            let (sine, cosine) = angle.sine_cosine();
            let [square, ..] = self.at([sine, cosine]);
            if least.is_none_or(|least| square < least) {
                (least, best) = (Some(square), (angle, [sine, cosine]));
            }
        }
        let (mut angle, mut course) = best;
        for _ in 0..REFINED {
            let [_, slope, bend] = self.at(course);
            if bend > T::zero() {
                angle -= slope / bend;
                let (sine, cosine) = angle.sine_cosine();
                course = [sine, cosine];
            }
        }
        let [squares, _, bend] = self.at(course);
        if bend <= T::zero() {
            return (course, real(f64::INFINITY));
        }
        // The scatter that the best course leaves is no less than its variance shows.
        let scatter = squares / count(u32::from(self.innovations).max(2) - 1);
        (course, real::<T>(2.0) / bend * scatter.max(T::one()))
    }

    /// The likeliest course, as sine and cosine, and its variance, rad^2, once it is known or was sought in motion for so many s.
    pub fn found(&self, moving: T) -> Option<([T; 2], T)> {
        let (course, variance) = self.best();
        let is_known = variance < real(KNOWN * KNOWN);
        (is_known || moving > real(SOUGHT)).then(|| (course, variance.min(real(UNSURE * UNSURE))))
    }
}

/// State of the search of one filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CourseSearch<T: Real> {
    /// Changes of the state that began: of all courses, by the cosine, and by the sine.
    changes: [Errors<T>; 3],
    likelihood: CourseLikelihood<T>,
    since: T,
    moving: T,
}

impl<T: Real> CourseSearch<T> {
    /// Begins at an aided velocity, m/s.
    pub fn new(aided: &Vector2<T>) -> Self {
        let velocity = |x, y| Errors {
            velocity: Vector3::new(x, y, T::zero()),
            ..Errors::none()
        };
        Self {
            changes: [
                Errors::none(),
                velocity(aided.x, aided.y),
                velocity(aided.y, -aided.x),
            ],
            likelihood: CourseLikelihood::none(),
            since: T::zero(),
            moving: T::zero(),
        }
    }

    /// With a change of the state, of all courses.
    #[cfg(test)]
    pub fn with(change: Errors<T>) -> Self {
        let mut search = Self::new(&Vector2::zeros());
        let [of_all, ..] = &mut search.changes;
        *of_all = change;
        search
    }

    /// Time in motion since it began, s.
    pub fn moving(&self) -> T {
        self.moving
    }

    /// Returns whether errors have grown beyond what is linear.
    pub fn is_over(&self) -> bool {
        self.since > real(ANEW)
    }

    pub fn likelihood(&self) -> &CourseLikelihood<T> {
        &self.likelihood
    }

    /// Propagates over a window of so many s.
    pub fn carry(&mut self, moves: &Moves<T>, length: T, rests: bool) {
        self.since += length;
        self.moving += if rests { T::zero() } else { length };
        self.changes = self.changes.each_ref().map(|change| moves.carry(change));
    }

    /// Takes a measurement: its difference from the state that began, of all courses, by the cosine and by the sine; its
    /// derivatives, their covariance with the state, and the variance.
    pub fn take(&mut self, measured: [T; 3], row: &Errors<T>, across: &Errors<T>, variance: T) {
        let mut innovation = measured;
        for (left, change) in innovation.iter_mut().zip(&mut self.changes) {
            *left -= row.dot(change);
            *change = change.plus(across, *left / variance);
        }
        self.likelihood.take(innovation, variance);
    }

    /// Change of the state of all courses.
    pub fn of_all(&self) -> Errors<T> {
        let [of_all, ..] = &self.changes;
        *of_all
    }

    /// Change of the state at a course.
    pub fn errors_at(&self, [sine, cosine]: &[T; 2]) -> Errors<T> {
        let [of_all, by_cosine, by_sine] = &self.changes;
        of_all.plus(by_cosine, *cosine).plus(by_sine, *sine)
    }
}

/// The parts of a horizontal velocity along an axis, x or y, that is turned back by the course: by cosine and by sine.
pub(super) fn turned_back<T: Real>(axis: usize, aided: &Vector2<T>) -> [T; 2] {
    if axis == 0 {
        [aided.x, aided.y]
    } else {
        [aided.y, -aided.x]
    }
}
