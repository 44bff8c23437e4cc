//! Threshold of the difference of two units: tolerated drift, explained motion, and the share of it shown in
//! health.

use nalgebra::Vector3;

use crate::products::squared;
use crate::real::{Real, real, tabulated};
use crate::redundancy::components::{difference, larger, smaller};
use crate::redundancy::isolation::motion::{Strain, Tolerance};
use crate::redundancy::isolation::scales::{SCALES, SECONDS};
use crate::redundancy::isolation::shaking::LeftByVibration;
use crate::redundancy::sensor::{SENSORS, Sensor};
use crate::redundancy::unit_count::{UnitCount, Units};

/// Constants of one scale (docs/theory/isolation.md, table 1).
struct ScaleConstants {
    /// Noise of samples that remains in the mean, of accelerometers, m/s^2, and of gyroscopes, rad/s.
    noise: [f32; 2],
    /// Factor on drift within specification that is tolerated.
    tolerated: f32,
    /// Standard deviations of explained motion within which a healthy pair stays: the tail is heavier than a
    /// normal one.
    tail: f32,
    /// Share of the predicted strain of motion that a pair is assumed to show before it has shown any.
    shown_at_first: f32,
    /// Least and largest share that is learnt. The largest prevents a fault from being learnt.
    shown: [f32; 2],
    /// Share of the variance of vibration in a window that is left in the mean.
    shaken: f32,
    /// Number of independent pairs that average the residual of a calibration: beyond one second it depends on
    /// the attitude.
    averaged: f32,
}

const CONSTANTS: [ScaleConstants; SCALES] = [
    ScaleConstants {
        noise: [0.02, 0.0015],
        tolerated: 1.6,
        tail: 5.0,
        shown_at_first: 1.0,
        shown: [0.05, 9.0],
        shaken: 0.75,
        averaged: 2.0,
    },
    ScaleConstants {
        noise: [0.008, 0.0006],
        tolerated: 1.0,
        tail: 5.0,
        shown_at_first: 0.5,
        shown: [0.03, 2.0],
        shaken: 0.075,
        averaged: 10.0,
    },
    ScaleConstants {
        noise: [0.003, 0.0002],
        tolerated: 1.0,
        tail: 4.5,
        shown_at_first: 0.1,
        shown: [0.005, 0.15],
        shaken: 0.0075,
        averaged: 22.5,
    },
    ScaleConstants {
        noise: [0.001, 0.0001],
        tolerated: 1.0,
        tail: 4.0,
        shown_at_first: 0.03,
        shown: [0.002, 0.05],
        shaken: 0.00125,
        averaged: 22.5,
    },
];

impl ScaleConstants {
    fn noise_variance<T: Real>(&self, sensor: Sensor) -> T {
        let noise = tabulated::<T>(*sensor.of(&self.noise));
        noise * noise
    }
}

/// Number of residuals of a channel within which three channels together stay.
const RESIDUALS: f64 = 3.0;

/// Factor on the error of straight lines between samples that is tolerated: slow units resolve quick motion
/// poorly.
const STRAIGHT: f64 = 2.0;

/// Shortest time constant of learning, s, unless two of the scale are longer.
const LEARNT_OVER: f64 = 30.0;

/// Assumed age before the first window, s: the first windows shall not dominate.
const HEAD_START: f64 = 5.0;

/// Share of the strain of motion that a pair of sensors has shown over one scale: a ratio of sums.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ShownOverScale<T: Real> {
    square: T,
    strain: T,
}

impl<T: Real> ShownOverScale<T> {
    /// Share of the strain that the pair shows.
    fn share(&self, of: &ScaleConstants) -> T {
        let share = if self.strain > T::zero() {
            self.square / self.strain
        } else {
            tabulated(of.shown_at_first)
        };
        let [least, most] = of.shown;
        smaller(tabulated(most), larger(tabulated(least), share))
    }

    fn learn(&mut self, noise: T, squares: &Squares<T>, gain: T) {
        let strain = squares.strain;
        if strain <= noise {
            return;
        }
        let share = squares.share;
        let most = share * strain * real(2.0) + noise;
        let square = smaller(most, larger(T::zero(), squares.apart - noise - squares.shaken));
        if self.strain == T::zero() {
            (self.square, self.strain) = (share * strain, strain);
        }
        self.square += (square - self.square) * gain; // eq. 6
        self.strain += (strain - self.strain) * gain; // eq. 6
    }
}

/// Shares of the strain that a pair of sensors has shown, over each scale (docs/theory/isolation.md, eq. 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown<T: Real>([ShownOverScale<T>; SCALES]);

/// Gains with which the shown shares follow a window, over each scale.
pub struct Gains<T: Real>([T; SCALES]);

impl<T: Real> Gains<T> {
    /// Gains after a time of learning, s; `window` is the length of a window, s.
    pub fn after(age: T, window: T) -> Self {
        Self(SECONDS.map(|seconds| {
            let longest = larger(real(LEARNT_OVER), tabulated::<T>(seconds) * real(2.0));
            window / smaller(longest, age + real(HEAD_START))
        }))
    }
}

impl<T: Real> Shown<T> {
    /// Creates shares of pairs that have shown nothing.
    pub fn new() -> Self {
        let nothing = ShownOverScale {
            square: T::zero(),
            strain: T::zero(),
        };
        Self([nothing; SCALES])
    }

    /// Learns from a window in health.
    pub fn learn(&mut self, sensor: Sensor, comparison: &Comparison<T>, gains: &Gains<T>) {
        let scales = self.0.iter_mut().zip(&CONSTANTS).zip(&gains.0);
        for (((shown, of), gain), squares) in scales.zip(comparison.filled()) {
            shown.learn(of.noise_variance(sensor), squares, *gain);
        }
    }
}

/// Shares that all pairs of a set have shown: pair `(i, j)`, `i < j`, has accelerometers at row `i` and column `j`,
/// gyroscopes at row `j - 1` and column `i`, which fills all places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownByPairs<T: Real, const UNITS: usize>(
    <Units<UNITS> as UnitCount>::OfSecondaries<[Shown<T>; UNITS]>,
)
where
    Units<UNITS>: UnitCount;

impl<T: Real, const UNITS: usize> ShownByPairs<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    /// Creates shares of pairs that have shown nothing.
    pub fn new() -> Self {
        Self(Units::filled([Shown::new(); UNITS]))
    }

    /// Shares of all pairs.
    pub fn all(&mut self) -> &mut [[Shown<T>; UNITS]] {
        self.0.as_mut()
    }

    /// Resets the shares of all pairs of a unit whose calibration was replaced.
    pub fn forget(&mut self, unit: usize) {
        for other in (0..UNITS).filter(|other| *other != unit) {
            for sensor in SENSORS {
                if let Some(shown) = shown_mut(self.all(), sensor, [unit, other]) {
                    *shown = Shown::new();
                }
            }
        }
    }
}

/// Returns the shares of a pair out of those of all pairs.
pub fn shown<T: Real, const UNITS: usize>(
    all: &[[Shown<T>; UNITS]],
    sensor: Sensor,
    pair: [usize; 2],
) -> Option<&Shown<T>> {
    let [row, column] = place(sensor, pair);
    all.get(row)?.get(column)
}

/// Returns the shares of a pair out of those of all pairs, mutable.
pub fn shown_mut<T: Real, const UNITS: usize>(
    all: &mut [[Shown<T>; UNITS]],
    sensor: Sensor,
    pair: [usize; 2],
) -> Option<&mut Shown<T>> {
    let [row, column] = place(sensor, pair);
    all.get_mut(row)?.get_mut(column)
}

fn place(sensor: Sensor, [i, j]: [usize; 2]) -> [usize; 2] {
    match sensor {
        Sensor::Accelerometer => [i.min(j), i.max(j)],
        Sensor::Gyroscope => [i.max(j).saturating_sub(1), i.min(j)],
    }
}

/// Difference of two disagreeing sensors over one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement<T: Real> {
    /// Difference, m/s^2 or rad/s.
    pub apart: T,
    /// Largest difference that is accepted.
    pub threshold: T,
}

/// Comparison of two sensors over one scale, in squares, which saves square roots on devices that compute them
/// in software.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Squares<T: Real> {
    /// Squared difference, (m/s^2)^2 or (rad/s)^2.
    apart: T,
    /// Squared difference over squared threshold: above one the sensors disagree.
    ratio: T,
    /// Variance that motion predicts.
    strain: T,
    /// Share of that variance that the pair shows.
    share: T,
    /// Variance that vibration leaves.
    shaken: T,
}

/// Comparison of two sensors over the scales that both have filled, the shortest first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison<T: Real> {
    scales: usize,
    squares: [Squares<T>; SCALES],
    worst: T,
}

impl<T: Real> Comparison<T> {
    /// Creates an empty comparison.
    pub fn none() -> Self {
        let nothing = Squares {
            apart: T::zero(),
            ratio: T::zero(),
            strain: T::zero(),
            share: T::zero(),
            shaken: T::zero(),
        };
        Self {
            scales: 0,
            squares: [nothing; SCALES],
            worst: T::zero(),
        }
    }

    /// Empties the comparison.
    pub fn clear(&mut self) {
        (self.scales, self.worst) = (0, T::zero());
    }

    fn filled(&self) -> &[Squares<T>] {
        self.squares.get(..self.scales).unwrap_or(&self.squares)
    }

    /// Returns whether any scale was compared.
    pub fn is_some(&self) -> bool {
        self.scales > 0
    }

    /// Squared difference over squared threshold on one scale.
    pub fn ratio_squared(&self, scale: usize) -> Option<T> {
        self.filled().get(scale).map(|squares| squares.ratio)
    }

    /// Largest such ratio over all scales; zero if no scale was compared.
    pub fn worst_squared(&self) -> T {
        self.worst
    }

    /// Difference and threshold over one scale.
    pub fn figures(&self, scale: usize) -> Option<Disagreement<T>> {
        let squares = self.filled().get(scale)?;
        Some(Disagreement {
            apart: squares.apart.square_root(),
            threshold: (squares.apart / squares.ratio).square_root(),
        })
    }
}

/// Comparisons of all pairs of a set: of pair `(i, j)`, `i < j`, at row `i`.
pub struct Comparisons<T: Real, const UNITS: usize>([[Comparison<T>; UNITS]; UNITS]);

impl<T: Real, const UNITS: usize> Comparisons<T, UNITS> {
    /// Creates empty comparisons.
    pub fn none() -> Self {
        Self(core::array::from_fn(|_| {
            core::array::from_fn(|_| Comparison::none())
        }))
    }

    /// Returns the comparison of a pair, in either order.
    pub fn of(&self, i: usize, j: usize) -> Option<&Comparison<T>> {
        self.0.get(i.min(j))?.get(i.max(j))
    }

    /// Returns the comparison of a pair, the lower number first, mutable.
    pub fn of_mut(&mut self, [i, j]: [usize; 2]) -> Option<&mut Comparison<T>> {
        self.0.get_mut(i)?.get_mut(j)
    }
}

/// Prior knowledge about two units that are compared.
pub struct Knowledge<T: Real> {
    /// Uncertainties that turn motion into a difference.
    pub tolerance: Tolerance<T>,
    /// Squared residuals of a channel that their calibrations leave, `(m/s^2)^2` or `(rad/s)^2`, together.
    pub residual: T,
    /// Square of the largest error that a calibration could find in an uncalibrated unit among them.
    pub uncertainty: T,
    /// Square of the difference that drift since the calibrations may have caused, by temperature or common to
    /// all units.
    pub drifted: T,
    /// Variance that vibration leaves in a window of each.
    pub shaken: [LeftByVibration<T>; 2],
}

/// Means of two units over scales, the shortest first.
pub type TwoMeans<'a, T> = (&'a [Vector3<T>], &'a [Vector3<T>]);

impl<T: Real> Comparison<T> {
    /// Compares two units' means over so many scales at most (docs/theory/isolation.md, eq. 8).
    pub fn fill(
        &mut self,
        sensor: Sensor,
        tolerated: T,
        (first, second): TwoMeans<'_, T>,
        strains: &[Strain<T>; SCALES],
        known: &Knowledge<T>,
        shown: &Shown<T>,
    ) {
        let scales = CONSTANTS.iter().zip(strains).zip(&shown.0);
        let places = self.squares.iter_mut().zip(first.iter().zip(second)).zip(scales);
        for ((squares, (first, second)), ((of, strain), shown)) in places {
            let drift = tolerated * tabulated(of.tolerated);
            let tail = tabulated::<T>(of.tail);
            let vibration = strain.vibration;
            let [a, b] = &known.shaken;
            let shaken = (a.variance(vibration) + b.variance(vibration)) * tabulated::<T>(of.shaken);
            let shaken = smaller(vibration, shaken + shaken); // isolation.md, eq. 17
            let straight = known.tolerance.straight_lines(strain) * real(STRAIGHT * STRAIGHT);
            let strain = known.tolerance.variance(strain);
            let share = shown.share(of);
            let explained = of.noise_variance::<T>(sensor) + share * strain + shaken;
            let residuals = known.residual * real(3.0 * RESIDUALS * RESIDUALS) / tabulated(of.averaged); // eq. 7
            let allowed = drift * drift + known.drifted + straight;
            let threshold = allowed + tail * tail * explained + residuals + known.uncertainty; // eq. 8
            let apart = squared(&difference(first, second)); // isolation.md, eq. 1
            let ratio = apart / threshold;
            *squares = Squares {
                apart,
                ratio,
                strain,
                share,
                shaken,
            };
            self.worst = larger(self.worst, ratio);
            self.scales += 1;
        }
    }
}
