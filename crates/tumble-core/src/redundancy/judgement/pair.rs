//! How far two units may be apart: what is allowed, what motion explains, and what they have shown in health.

use nalgebra::Vector3;

use crate::real::{Real, real, tabulated};
use crate::redundancy::judgement::motion::{StrainMeans, Tolerance};
use crate::redundancy::judgement::scales::{SCALES, SECONDS};
use crate::redundancy::sensor::Sensor;

/// What is left of the noise of samples over each scale, of accelerometers, m/s^2, and of gyroscopes, rad/s
/// (docs/theory/judgement.md, table 1).
const NOISE: [[f32; SCALES]; 2] = [[0.02, 0.008, 0.003, 0.001], [0.0015, 0.0006, 0.0002, 0.0001]];

/// Multiple of drift within specification that is let pass over each scale.
const TOLERATED: [f32; SCALES] = [1.6, 1.0, 1.0, 1.0];

/// Standard deviations of what motion explains that a sound pair stays within: its tail is heavier than a normal one.
const TAIL: [f32; SCALES] = [5.0, 5.0, 4.5, 4.0];

/// Share of what motion could make that a pair is taken to show before it has shown any.
const SHOWN_AT_FIRST: [f32; SCALES] = [1.0, 0.5, 0.1, 0.03];

/// Least and most of it: what a pair has shown is believed within these only. The most keeps a fault from being learnt.
const SHOWN_LEAST: [f32; SCALES] = [0.05, 0.03, 0.005, 0.002];
const SHOWN_MOST: [f32; SCALES] = [9.0, 2.0, 0.15, 0.05];

/// Shortest time over which it is learnt, s, beyond two of the scale.
const LEARNT_OVER: f64 = 30.0;

/// Head start, s: the first windows are not all of what is known.
const HEAD_START: f64 = 5.0;

/// What a pair of sensors has shown of the strain of motion: a ratio of sums, over each scale
/// (docs/theory/judgement.md, eq. 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown<T: Real> {
    squares: [T; SCALES],
    strains: [T; SCALES],
}

/// A window that a pair may learn from, over each scale.
pub struct Lesson<T: Real> {
    /// How far apart it is; `None` over a scale that is not filled, m/s^2 or rad/s.
    pub apart: [Option<T>; SCALES],
    /// Variance that motion could have made of it.
    pub strain: [T; SCALES],
    /// Time of learning so far, s, and length of the window, s.
    pub age: T,
    /// s.
    pub window: T,
}

impl<T: Real> Shown<T> {
    /// Nothing.
    pub fn new() -> Self {
        Self {
            squares: [T::zero(); SCALES],
            strains: [T::zero(); SCALES],
        }
    }

    /// Share of the strain that the pair shows, over one scale.
    pub fn share(&self, scale: usize) -> T {
        let sums = self.squares.get(scale).zip(self.strains.get(scale));
        let shown = sums.filter(|(_, strains)| **strains > T::zero());
        let share = shown.map_or(at(&SHOWN_AT_FIRST, scale), |(squares, strains)| {
            *squares / *strains
        });
        share.max(at(&SHOWN_LEAST, scale)).min(at(&SHOWN_MOST, scale))
    }

    /// Learns from a window in health.
    pub fn learn(&mut self, sensor: Sensor, lesson: &Lesson<T>) {
        for scale in 0..SCALES {
            let share = self.share(scale);
            let noise: T = at(sensor.of(&NOISE), scale);
            let (noise, strain) = (noise * noise, at_scale(&lesson.strain, scale));
            let apart = lesson.apart.get(scale).copied().flatten();
            let sums = self.squares.get_mut(scale).zip(self.strains.get_mut(scale));
            let (Some(apart), Some((squares, strains))) = (apart.filter(|_| strain > noise), sums) else {
                continue;
            };
            let most = share * strain * real(2.0) + noise;
            let square = (apart * apart - noise).max(T::zero()).min(most);
            let longest: T = real::<T>(LEARNT_OVER).max(at::<T>(&SECONDS, scale) * real(2.0));
            let gain = lesson.window / (lesson.age + real(HEAD_START)).min(longest);
            if *strains == T::zero() {
                (*squares, *strains) = (share * strain, strain);
            }
            *squares += (square - *squares) * gain; // eq. 6
            *strains += (strain - *strains) * gain; // eq. 6
        }
    }
}

fn at<T: Real>(table: &[f32; SCALES], scale: usize) -> T {
    tabulated(table.get(scale).copied().unwrap_or(1.0))
}

fn at_scale<T: Real>(values: &[T; SCALES], scale: usize) -> T {
    values.get(scale).copied().unwrap_or(T::zero())
}

/// What all pairs of a set have shown: of pair `(i, j)`, `i < j`, accelerometers at row `i`, gyroscopes at row `j`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShownByPairs<T: Real, const UNITS: usize>([[Shown<T>; UNITS]; UNITS]);

impl<T: Real, const UNITS: usize> ShownByPairs<T, UNITS> {
    /// Nothing.
    pub fn new() -> Self {
        Self([[Shown::new(); UNITS]; UNITS])
    }

    /// That of a pair.
    pub fn of(&self, sensor: Sensor, i: usize, j: usize) -> Option<&Shown<T>> {
        let (row, column) = place(sensor, i, j);
        self.0.get(row)?.get(column)
    }

    /// That of a pair, to be changed.
    pub fn of_mut(&mut self, sensor: Sensor, i: usize, j: usize) -> Option<&mut Shown<T>> {
        let (row, column) = place(sensor, i, j);
        self.0.get_mut(row)?.get_mut(column)
    }

    /// Forgets what pairs of a unit have shown, whose calibration is another now.
    pub fn forget(&mut self, unit: usize) {
        for (i, row) in self.0.iter_mut().enumerate() {
            for (j, shown) in row.iter_mut().enumerate() {
                if i == unit || j == unit {
                    *shown = Shown::new();
                }
            }
        }
    }
}

fn place(sensor: Sensor, i: usize, j: usize) -> (usize, usize) {
    match sensor {
        Sensor::Accelerometer => (i.min(j), i.max(j)),
        Sensor::Gyroscope => (i.max(j), i.min(j)),
    }
}

/// How two sensors compare over one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement<T: Real> {
    /// How far apart, m/s^2 or rad/s.
    pub apart: T,
    /// How far they may be.
    pub threshold: T,
}

impl<T: Real> Disagreement<T> {
    /// Their ratio: beyond one the pair disagrees.
    pub fn ratio(&self) -> T {
        self.apart / self.threshold
    }
}

/// What is known of two units before they are compared.
pub struct Knowledge<T: Real> {
    /// How far apart they may be in what makes them differ in motion.
    pub tolerance: Tolerance<T>,
    /// Variance of what their calibrations leave, `(m/s^2)^2` or `(rad/s)^2` (eq. 7).
    pub calibration: T,
}

/// Compares two means over one scale (docs/theory/judgement.md, eq. 8).
pub fn compare<T: Real>(
    sensor: Sensor,
    scale: usize,
    tolerated: T,
    difference: &Vector3<T>,
    strains: &StrainMeans<T>,
    known: &Knowledge<T>,
    shown: &Shown<T>,
) -> Disagreement<T> {
    let (noise, tail) = (at::<T>(sensor.of(&NOISE), scale), at::<T>(&TAIL, scale));
    let drift = tolerated * at(&TOLERATED, scale);
    let strain = known.tolerance.variance(&strains.at(scale));
    let explained = noise * noise + shown.share(scale) * strain;
    Disagreement {
        apart: difference.norm(),
        threshold: (drift * drift + tail * tail * explained + known.calibration).sqrt(), // eq. 8
    }
}
