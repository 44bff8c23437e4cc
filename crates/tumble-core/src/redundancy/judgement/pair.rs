//! How far two units may be apart: what is allowed, what motion explains, and what they have shown in health.

use nalgebra::Vector3;

use crate::real::{Real, real, tabulated};
use crate::redundancy::judgement::motion::{Strain, Tolerance};
use crate::redundancy::judgement::scales::{SCALES, SECONDS};
use crate::redundancy::sensor::Sensor;

/// Constants of one scale (docs/theory/judgement.md, table 1).
struct ScaleConstants {
    /// What is left of the noise of samples, of accelerometers, m/s^2, and of gyroscopes, rad/s.
    noise: [f32; 2],
    /// Multiple of drift within specification that is let pass.
    tolerated: f32,
    /// Standard deviations of what motion explains that a sound pair stays within: its tail is heavier than a normal one.
    tail: f32,
    /// Share of what motion could make that a pair is taken to show before it has shown any.
    shown_at_first: f32,
    /// Least and most of it: what a pair has shown is believed within these only. The most keeps a fault from being learnt.
    shown: [f32; 2],
}

const CONSTANTS: [ScaleConstants; SCALES] = [
    ScaleConstants {
        noise: [0.02, 0.0015],
        tolerated: 1.6,
        tail: 5.0,
        shown_at_first: 1.0,
        shown: [0.05, 9.0],
    },
    ScaleConstants {
        noise: [0.008, 0.0006],
        tolerated: 1.0,
        tail: 5.0,
        shown_at_first: 0.5,
        shown: [0.03, 2.0],
    },
    ScaleConstants {
        noise: [0.003, 0.0002],
        tolerated: 1.0,
        tail: 4.5,
        shown_at_first: 0.1,
        shown: [0.005, 0.15],
    },
    ScaleConstants {
        noise: [0.001, 0.0001],
        tolerated: 1.0,
        tail: 4.0,
        shown_at_first: 0.03,
        shown: [0.002, 0.05],
    },
];

impl ScaleConstants {
    fn noise_variance<T: Real>(&self, sensor: Sensor) -> T {
        let noise = tabulated::<T>(*sensor.of(&self.noise));
        noise * noise
    }
}

/// Shortest time over which it is learnt, s, beyond two of the scale.
const LEARNT_OVER: f64 = 30.0;

/// Head start, s: the first windows are not all of what is known.
const HEAD_START: f64 = 5.0;

/// What a pair of sensors has shown of the strain of motion over one scale: a ratio of sums.
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
        let [least, most] = of.shown.map(tabulated::<T>);
        share.max(least).min(most)
    }

    fn learn(&mut self, of: &ScaleConstants, noise: T, strain: T, apart: T, gain: T) {
        if strain <= noise {
            return;
        }
        let share = self.share(of);
        let most = share * strain * real(2.0) + noise;
        let square = (apart * apart - noise).max(T::zero()).min(most);
        if self.strain == T::zero() {
            (self.square, self.strain) = (share * strain, strain);
        }
        self.square += (square - self.square) * gain; // eq. 6
        self.strain += (strain - self.strain) * gain; // eq. 6
    }
}

/// What a pair of sensors has shown, over each scale (docs/theory/judgement.md, eq. 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown<T: Real>([ShownOverScale<T>; SCALES]);

/// A window that a pair may learn from.
pub struct Lesson<'a, T: Real> {
    /// How it compares.
    pub comparison: &'a Comparison<T>,
    /// What motion could have made of it.
    pub strains: &'a [Strain<T>; SCALES],
    /// How far it may be apart in what makes it differ in motion.
    pub tolerance: &'a Tolerance<T>,
    /// Time of learning so far, s, and length of the window, s.
    pub age: T,
    /// s.
    pub window: T,
}

impl<T: Real> Shown<T> {
    /// Nothing.
    pub fn new() -> Self {
        let nothing = ShownOverScale {
            square: T::zero(),
            strain: T::zero(),
        };
        Self([nothing; SCALES])
    }

    /// Learns from a window in health.
    pub fn learn(&mut self, sensor: Sensor, lesson: &Lesson<'_, T>) {
        let scales = self.0.iter_mut().zip(&CONSTANTS).zip(SECONDS);
        let windows = lesson.comparison.iter().flatten().zip(lesson.strains);
        for (((shown, of), seconds), (disagreement, strain)) in scales.zip(windows) {
            let longest = real::<T>(LEARNT_OVER).max(tabulated::<T>(seconds) * real(2.0));
            let gain = lesson.window / (lesson.age + real(HEAD_START)).min(longest);
            let strain = lesson.tolerance.variance(strain);
            shown.learn(of, of.noise_variance(sensor), strain, disagreement.apart, gain);
        }
    }
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

/// How two sensors compare over each scale, the shortest first; `None` over those that are not filled, or do not count.
pub type Comparison<T> = [Option<Disagreement<T>>; SCALES];

/// Compares means over scales, the shortest first (docs/theory/judgement.md, eq. 8).
pub fn compare<T: Real>(
    sensor: Sensor,
    tolerated: T,
    differences: impl Iterator<Item = Vector3<T>>,
    strains: &[Strain<T>; SCALES],
    known: &Knowledge<T>,
    shown: &Shown<T>,
) -> Comparison<T> {
    let mut comparison = [None; SCALES];
    let scales = CONSTANTS.iter().zip(strains).zip(&shown.0);
    for ((slot, difference), ((of, strain), shown)) in comparison.iter_mut().zip(differences).zip(scales) {
        let drift = tolerated * tabulated(of.tolerated);
        let tail = tabulated::<T>(of.tail);
        let explained = of.noise_variance::<T>(sensor) + shown.share(of) * known.tolerance.variance(strain);
        *slot = Some(Disagreement {
            apart: difference.norm(),
            threshold: (drift * drift + tail * tail * explained + known.calibration).sqrt(), // eq. 8
        });
    }
    comparison
}
