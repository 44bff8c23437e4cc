//! Rows whose errors remember each other, made independent: from each is taken what the rows before predict of it.
//!
//! Flicker noise is remembered about as far as the session is long. The nearest few intervals tell almost all of it
//! (Vecchia 1988); but deviations from the mean bias of a session cancel over that session, so what remains is told by
//! the mean over all older intervals (docs/theory/turntable.md, eq. 19).

use nalgebra::{Matrix3, SMatrix, SVector};

use crate::real::{Real, real};
use crate::turntable::fit::{Knowledge, Observation, through};

/// Intervals just before that help to predict the error of one.
const NEAREST: usize = 5;

/// The nearest intervals, and the mean of the older ones.
const PREDICTORS: usize = NEAREST + 1;

/// The errors of one axis over all intervals.
pub(super) struct Errors<'a, T: Real, const P: usize, const Q: usize> {
    /// The intervals, in order of time.
    pub observations: &'a [Observation<T, P, Q>],
    /// Noise and session.
    pub knowledge: &'a Knowledge<T, Q>,
    /// M, through which errors of the truth pass.
    pub matrix: &'a Matrix3<T>,
    /// The axis.
    pub axis: usize,
}

impl<T: Real, const P: usize, const Q: usize> Errors<'_, T, P, Q> {
    /// Whether the errors of different intervals are independent as they are.
    fn independent(&self) -> bool {
        self.knowledge.noise[self.axis].flicker <= T::zero()
    }

    /// Covariance of the errors of two intervals.
    fn covariance(&self, i: usize, j: usize) -> T {
        let (Some(a), Some(b)) = (self.observations.get(i), self.observations.get(j)) else {
            return T::zero();
        };
        let noise = &self.knowledge.noise[self.axis];
        let own = noise.covariance(&a.interval, &b.interval, &self.knowledge.session);
        if i == j {
            own + through(self.matrix, &a.truth_covariance, self.axis)
        } else {
            own
        }
    }

    fn duration(&self, i: usize) -> T {
        self.observations
            .get(i)
            .map_or(T::zero(), |observation| observation.interval.duration())
    }

    /// Sum over the first `older` intervals of their lengths times their covariance with interval `i`.
    fn covariance_with_older(&self, older: usize, i: usize) -> T {
        (0..older).fold(T::zero(), |sum, j| sum + self.duration(j) * self.covariance(j, i))
    }
}

/// Takes rows in order of time and gives them back independent.
pub(super) struct Whitener<'a, T: Real, const P: usize, const Q: usize, const N: usize> {
    errors: &'a Errors<'a, T, P, Q>,
    next: usize,
    near: [(SVector<T, N>, T); NEAREST],
    older: Older<T, N>,
}

/// Sums over the older intervals, each weighted by its length.
struct Older<T: Real, const N: usize> {
    intervals: usize,
    length: T,
    row: SVector<T, N>,
    reading: T,
    squares: T,
}

impl<'a, T: Real, const P: usize, const Q: usize, const N: usize> Whitener<'a, T, P, Q, N> {
    /// Before the first row.
    pub fn new(errors: &'a Errors<'a, T, P, Q>) -> Self {
        Self {
            errors,
            next: 0,
            near: [(SVector::zeros(), T::zero()); NEAREST],
            older: Older {
                intervals: 0,
                length: T::zero(),
                row: SVector::zeros(),
                reading: T::zero(),
                squares: T::zero(),
            },
        }
    }

    /// Row, reading and variance of the next interval, without what those before predict.
    pub fn next(&mut self, row: &SVector<T, N>, reading: T) -> (SVector<T, N>, T, T) {
        let now = self.next;
        let (weights, variance) = self.predict(now);
        let (mut free_row, mut free_reading) = (*row, reading);
        for (weight, (row, reading)) in weights.iter().zip(&self.near) {
            free_row -= row * *weight;
            free_reading -= *reading * *weight;
        }
        if self.older.length > T::zero() {
            let share = weights[NEAREST] / self.older.length;
            free_row -= self.older.row * share;
            free_reading -= self.older.reading * share;
        }
        self.keep(row, reading);
        (free_row, free_reading, variance)
    }

    /// Index of the interval in a place of `near`, counted from the newest; `None` before there were so many.
    fn near_index(&self, place: usize) -> Option<usize> {
        self.next.checked_sub(place + 1)
    }

    /// Weights of the near intervals and of the mean of the older ones, and the variance that remains.
    fn predict(&self, now: usize) -> (SVector<T, PREDICTORS>, T) {
        let errors = self.errors;
        let alone = errors.covariance(now, now);
        if errors.independent() {
            return (SVector::zeros(), alone);
        }
        let mut among = SMatrix::<T, PREDICTORS, PREDICTORS>::identity();
        let mut with = SVector::<T, PREDICTORS>::zeros();
        for (a, i) in (0..NEAREST).filter_map(|place| Some((place, self.near_index(place)?))) {
            with[a] = errors.covariance(i, now);
            for (b, j) in (0..NEAREST).filter_map(|place| Some((place, self.near_index(place)?))) {
                among[(a, b)] = errors.covariance(i, j);
            }
            let with_older = self.older.mean_covariance(errors, i);
            among[(a, NEAREST)] = with_older;
            among[(NEAREST, a)] = with_older;
        }
        if self.older.intervals > 0 {
            among[(NEAREST, NEAREST)] = self.older.squares / (self.older.length * self.older.length);
            with[NEAREST] = self.older.mean_covariance(errors, now);
        }
        among.cholesky().map_or((SVector::zeros(), alone), |root| {
            let weights = root.solve(&with);
            (weights, alone - weights.dot(&with))
        })
    }

    /// Moves the oldest of the near rows to the older ones, and the new row to the near ones.
    fn keep(&mut self, row: &SVector<T, N>, reading: T) {
        if !self.errors.independent() && self.near_index(NEAREST - 1).is_some() {
            let (row, reading) = self.near[NEAREST - 1];
            self.older.take(self.errors, &row, reading);
        }
        self.near.rotate_right(1);
        self.near[0] = (*row, reading);
        self.next += 1;
    }
}

impl<T: Real, const N: usize> Older<T, N> {
    /// Takes in the next interval.
    fn take<const P: usize, const Q: usize>(
        &mut self,
        errors: &Errors<'_, T, P, Q>,
        row: &SVector<T, N>,
        reading: T,
    ) {
        let (one, length) = (self.intervals, errors.duration(self.intervals));
        let with_others = errors.covariance_with_older(self.intervals, one);
        self.squares += length * (length * errors.covariance(one, one) + with_others * real::<T>(2.0));
        self.length += length;
        self.row += row * length;
        self.reading += reading * length;
        self.intervals += 1;
    }

    /// Covariance of the mean of the older intervals with interval `i`; zero where there are none.
    fn mean_covariance<const P: usize, const Q: usize>(&self, errors: &Errors<'_, T, P, Q>, i: usize) -> T {
        if self.intervals == 0 {
            return T::zero();
        }
        errors.covariance_with_older(self.intervals, i) / self.length
    }
}
