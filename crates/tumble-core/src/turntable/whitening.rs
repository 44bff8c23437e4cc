//! Rows whose errors remember each other, made independent: from each is taken what the rows before predict of it.
//!
//! Flicker noise is remembered about as far as the session is long. The nearest few intervals predict almost all of it
//! (Vecchia 1988); but deviations from the mean bias of a session cancel over that session, so what remains is
//! predicted by the mean over all older intervals (docs/theory/turntable.md, eq. 19).
//!
//! The correlation of intervals by flicker is the same for the three axes, up to B^2, so they are whitened side by
//! side. Sums over the older intervals go along with each near one: only those of the newest are made anew.

use nalgebra::{SMatrix, SVector, Vector3};

use crate::noise::{Flicker, Interval, Placed, Pool};
use crate::real::{Real, real};
use crate::turntable::observation::{FitInputs, Observation};

/// Intervals just before that help to predict the error of one.
const NEAREST: usize = 5;

/// The nearest intervals, and the mean of the older ones.
const PREDICTORS: usize = NEAREST + 1;

/// The rows of one interval as they are, one an axis.
pub(super) struct IntervalRows<T: Real, const N: usize> {
    /// When.
    pub interval: Interval<T>,
    /// Coefficients of the unknowns.
    pub rows: [SVector<T, N>; 3],
    /// Right side of the rows: readings.
    pub reading: Vector3<T>,
    /// Variance that errors of the truth leave on the reading, and what else is not the noise of its sensor.
    pub besides_noise: Vector3<T>,
}

/// A row without what those before predict of it.
pub(super) struct WhitenedRow<T: Real, const N: usize> {
    /// Coefficients of the unknowns.
    pub row: SVector<T, N>,
    /// Right side of the row: reading.
    pub reading: T,
    /// Variance that remains.
    pub variance: T,
}

/// An interval that is remembered.
#[derive(Clone, Copy)]
struct PlacedRows<T: Real, const N: usize> {
    placed: Placed<T>,
    rows: [SVector<T, N>; 3],
    reading: Vector3<T>,
    /// Variance of each axis besides flicker.
    own: Vector3<T>,
    /// Sum over the older intervals of their lengths times their covariance with this one at B = 1.
    with_older: T,
}

/// Sums over the older intervals, each weighted by its length.
struct OlderIntervals<T: Real, const N: usize> {
    intervals: usize,
    pool: Pool<T>,
    rows: [SVector<T, N>; 3],
    reading: Vector3<T>,
    /// Variance of each axis besides flicker.
    own: Vector3<T>,
    /// Variance at B = 1.
    flicker: T,
}

/// Covariances at B = 1: of the predictors with each other, and with the interval they predict.
struct FlickerCovariances<T: Real> {
    among: SMatrix<T, PREDICTORS, PREDICTORS>,
    with: SVector<T, PREDICTORS>,
    alone: T,
}

/// Takes the rows of interval by interval, in order of time, and gives them back independent.
pub(super) struct Whitener<'a, T: Real, const P: usize, const Q: usize, const N: usize> {
    observations: &'a [Observation<T, P, Q>],
    inputs: &'a FitInputs<T, Q>,
    flicker: Flicker<T>,
    /// The newest first.
    near: [Option<PlacedRows<T, N>>; NEAREST],
    older: OlderIntervals<T, N>,
}

impl<'a, T: Real, const P: usize, const Q: usize, const N: usize> Whitener<'a, T, P, Q, N> {
    /// Before the first interval.
    pub fn new(observations: &'a [Observation<T, P, Q>], inputs: &'a FitInputs<T, Q>) -> Self {
        Self {
            observations,
            inputs,
            flicker: Flicker::over(&inputs.session),
            near: [None; NEAREST],
            older: OlderIntervals {
                intervals: 0,
                pool: Pool::empty(),
                rows: [SVector::zeros(); 3],
                reading: Vector3::zeros(),
                own: Vector3::zeros(),
                flicker: T::zero(),
            },
        }
    }

    /// The rows of the next interval, without what those before predict.
    pub fn next(&mut self, fresh: IntervalRows<T, N>) -> [WhitenedRow<T, N>; 3] {
        let now = self.placed(fresh);
        if self.inputs.noise.iter().all(|noise| noise.flicker <= T::zero()) {
            return core::array::from_fn(|axis| now.alone(axis));
        }
        let remembered = self.remembered(&now);
        let white = core::array::from_fn(|axis| self.whiten(&now, &remembered, axis));
        self.keep(now);
        white
    }

    fn placed(&self, fresh: IntervalRows<T, N>) -> PlacedRows<T, N> {
        let placed = self.flicker.placed(&fresh.interval);
        let duration = fresh.interval.duration();
        let before = self.observations.iter().take(self.older.intervals);
        let before = before.map(|observation| &observation.interval);
        PlacedRows {
            placed,
            own: fresh.besides_noise + Vector3::from_fn(|axis, _| self.inputs.noise[axis].white / duration),
            rows: fresh.rows,
            reading: fresh.reading,
            with_older: self
                .flicker
                .covariance_with_pool(&self.older.pool, before, &placed),
        }
    }

    /// The near intervals with their places.
    fn near(&self) -> impl Iterator<Item = (usize, &PlacedRows<T, N>)> {
        let places = self.near.iter().enumerate();
        places.filter_map(|(place, kept)| Some((place, kept.as_ref()?)))
    }

    fn remembered(&self, now: &PlacedRows<T, N>) -> FlickerCovariances<T> {
        let covariance =
            |a: &PlacedRows<T, N>, b: &PlacedRows<T, N>| self.flicker.covariance(&a.placed, &b.placed);
        let mut among = SMatrix::zeros();
        let mut with = SVector::zeros();
        for (a, one) in self.near() {
            with[a] = covariance(one, now);
            for (b, other) in self.near().take(a + 1) {
                among[(a, b)] = covariance(one, other);
                among[(b, a)] = among[(a, b)];
            }
            among[(a, NEAREST)] = self.older.mean(one.with_older);
            among[(NEAREST, a)] = among[(a, NEAREST)];
        }
        among[(NEAREST, NEAREST)] = self.older.mean(self.older.mean(self.older.flicker));
        with[NEAREST] = self.older.mean(now.with_older);
        FlickerCovariances {
            among,
            with,
            alone: covariance(now, now),
        }
    }

    fn whiten(
        &self,
        now: &PlacedRows<T, N>,
        remembered: &FlickerCovariances<T>,
        axis: usize,
    ) -> WhitenedRow<T, N> {
        let (weights, variance) = self.predict(now, remembered, axis);
        let mut white = WhitenedRow {
            variance,
            ..now.alone(axis)
        };
        for (place, kept) in self.near() {
            white.row -= kept.rows[axis] * weights[place]; // eq. 19
            white.reading -= kept.reading[axis] * weights[place]; // eq. 19
        }
        let share = self.older.mean(weights[NEAREST]);
        white.row -= self.older.rows[axis] * share; // eq. 19
        white.reading -= self.older.reading[axis] * share; // eq. 19
        white
    }

    /// Weights of the near intervals and of the mean of the older ones, and the variance that remains.
    fn predict(
        &self,
        now: &PlacedRows<T, N>,
        remembered: &FlickerCovariances<T>,
        axis: usize,
    ) -> (SVector<T, PREDICTORS>, T) {
        let flicker = self.inputs.noise[axis].flicker;
        let alone = remembered.alone * flicker + now.own[axis];
        if flicker <= T::zero() {
            return (SVector::zeros(), alone);
        }
        let mut among = remembered.among * flicker;
        for place in 0..NEAREST {
            // Missing intervals predict nothing; they must only not make the matrix singular.
            among[(place, place)] += self.near[place].map_or(T::one(), |kept| kept.own[axis]);
        }
        among[(NEAREST, NEAREST)] += if self.older.intervals > 0 {
            self.older.mean(self.older.mean(self.older.own[axis]))
        } else {
            T::one()
        };
        let with = remembered.with * flicker;
        among.cholesky().map_or((SVector::zeros(), alone), |root| {
            let weights = root.solve(&with); // eq. 19: w = C^-1 c
            (weights, alone - weights.dot(&with)) // eq. 19
        })
    }

    /// Moves the oldest of the near intervals to the older ones, and the new one to the near ones.
    fn keep(&mut self, mut now: PlacedRows<T, N>) {
        self.near.rotate_right(1);
        if let Some(oldest) = self.near[0].take() {
            let length = oldest.placed.interval.duration();
            for kept in self.near.iter_mut().flatten().chain([&mut now]) {
                kept.with_older += length * self.flicker.covariance(&oldest.placed, &kept.placed);
            }
            self.older
                .take(&oldest, self.flicker.covariance(&oldest.placed, &oldest.placed));
        }
        self.near[0] = Some(now);
    }
}

impl<T: Real, const N: usize> PlacedRows<T, N> {
    /// The row of an axis where nothing is remembered.
    fn alone(&self, axis: usize) -> WhitenedRow<T, N> {
        WhitenedRow {
            row: self.rows[axis],
            reading: self.reading[axis],
            variance: self.own[axis],
        }
    }
}

impl<T: Real, const N: usize> OlderIntervals<T, N> {
    /// Takes in the next interval, whose variance at B = 1 is `flicker`.
    fn take(&mut self, kept: &PlacedRows<T, N>, flicker: T) {
        let length = kept.placed.interval.duration();
        self.flicker += length * (length * flicker + kept.with_older * real::<T>(2.0));
        self.own += kept.own * (length * length);
        for (sum, row) in self.rows.iter_mut().zip(&kept.rows) {
            *sum += row * length;
        }
        self.reading += kept.reading * length;
        self.pool.add(&kept.placed);
        self.intervals += 1;
    }

    /// A sum over the older intervals as their mean; zero where there are none.
    fn mean(&self, sum: T) -> T {
        if self.intervals == 0 {
            return T::zero();
        }
        sum / self.pool.length
    }
}
