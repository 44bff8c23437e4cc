//! Motion of the set, and the difference that it predicts between two healthy units.

use nalgebra::Vector3;

use crate::products::{squared, zeros};
use crate::real::{Real, real};
use crate::redundancy::components::{difference, follow, larger, scaled};
use crate::redundancy::isolation::scales::SCALES;
use crate::redundancy::sensor::{SENSORS, Sensor};

/// Tolerance of clocks, s (docs/theory/isolation.md, table 1).
const CLOCKS: f64 = 1e-3;

/// Share of the variance of vibration that is left in the mean of a window.
const VIBRATION_LEFT: f64 = 0.3;

/// Strengths of the effects by which two healthy units differ in motion, each a square
/// (docs/theory/isolation.md, eq. 3 and 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strain<T: Real> {
    /// Variance that clock errors cause in any pair.
    pub any_pair: T,
    /// Largest variance that vibration leaves in the mean of a window.
    pub vibration: T,
    /// Squared angular acceleration plus fourth power of the rate: its weight is the square of a distance.
    pub place: T,
    /// Squared reading, for an accelerometer minus its usual reading: its weight is the square of a matrix
    /// error.
    pub reading: T,
    /// Squared second derivative: its weight is the square of the error of straight lines between samples.
    pub curvature: T,
}

impl<T: Real> Strain<T> {
    fn none() -> Self {
        Self {
            any_pair: T::zero(),
            vibration: T::zero(),
            place: T::zero(),
            reading: T::zero(),
            curvature: T::zero(),
        }
    }

    /// Squared rate of change of the readings of the set.
    pub fn change(&self) -> T {
        self.any_pair * real(1.0 / (CLOCKS * CLOCKS))
    }

    fn follow(&mut self, strain: &Self, share: T) {
        self.any_pair += (strain.any_pair - self.any_pair) * share;
        self.vibration += (strain.vibration - self.vibration) * share;
        self.place += (strain.place - self.place) * share;
        self.reading += (strain.reading - self.reading) * share;
        self.curvature += (strain.curvature - self.curvature) * share;
    }
}

/// Means of strains over each scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrainMeans<T: Real>([Strain<T>; SCALES]);

impl<T: Real> StrainMeans<T> {
    /// Creates the means of a set at rest.
    pub fn new() -> Self {
        Self([Strain::none(); SCALES])
    }

    /// Updates the means with the strain of a window.
    pub fn push(&mut self, strain: &Strain<T>, shares: &[T; SCALES]) {
        for (mean, share) in self.0.iter_mut().zip(shares) {
            mean.follow(strain, *share); // isolation.md, eq. 5
        }
    }

    /// Mean strain over each scale.
    pub fn scales(&self) -> &[Strain<T>; SCALES] {
        &self.0
    }
}

/// Uncertainties of two units that turn motion into a difference, squared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance<T: Real> {
    /// Squared uncertainty of the lever arm, m^2.
    pub place: T,
    /// Squared uncertainty of the matrix.
    pub matrix: T,
    /// Squared error of straight lines between samples, s^4.
    pub interpolation: T,
}

impl<T: Real> Tolerance<T> {
    /// Variance that straight lines between samples leave: every pair shows all of it.
    pub fn straight_lines(&self, strain: &Strain<T>) -> T {
        self.interpolation * strain.curvature
    }

    /// Variance of the difference that motion explains (eq. 3 and 4).
    pub fn variance(&self, strain: &Strain<T>) -> T {
        strain.any_pair
            + self.place * strain.place
            + self.matrix * strain.reading
            + self.interpolation * strain.curvature // isolation.md, eq. 3, 4
    }
}

/// Variance that clock errors cause in any pair, from the squared rate of change.
fn any_pair<T: Real>(change: T) -> T {
    change * real(CLOCKS * CLOCKS) // isolation.md, eq. 3, 4
}

/// Readings of the set over the latest windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetMotion<T: Real> {
    /// Windows received, counted as far as derivatives need them.
    windows: u8,
    /// Readings of each sensor in the last window and the one before.
    before: [[Vector3<T>; 2]; 2],
    /// Usual specific force, m/s^2.
    usual: Vector3<T>,
}

/// Time constant of the usual specific force, s.
const USUAL: f64 = 60.0;

impl<T: Real> SetMotion<T> {
    /// Creates a motion without any window.
    pub fn new() -> Self {
        Self {
            windows: 0,
            before: [[zeros(); 2]; 2],
            usual: zeros(),
        }
    }

    /// Updates the motion with the readings of the set over the next window, specific force and angular rate,
    /// and the variance of vibration in both; returns the strain on each sensor. `window` is its length, s.
    pub fn push(&mut self, readings: &[Vector3<T>; 2], vibration: [T; 2], window: T) -> [Strain<T>; 2] {
        let inverse = T::one() / window;
        let derivatives = SENSORS.map(|sensor| self.derivatives(sensor, sensor.of(readings), inverse));
        let [f, w] = readings;
        if self.windows == 0 {
            self.usual = *f;
        }
        self.windows = self.windows.saturating_add(1).min(2);
        for (before, reading) in self.before.iter_mut().zip(readings) {
            let [latest, _] = *before;
            *before = [*reading, latest];
        }
        follow(&mut self.usual, f, window / real(USUAL));
        let [(jerk, snap), (acceleration, angular_jerk)] = derivatives;
        let w2 = squared(w);
        let [of_forces, of_rates] = vibration;
        [
            Strain {
                any_pair: any_pair(jerk),
                vibration: of_forces * real(VIBRATION_LEFT),
                place: acceleration + w2 * w2,
                reading: squared(&difference(f, &self.usual)),
                curvature: snap,
            },
            Strain {
                any_pair: any_pair(acceleration),
                vibration: of_rates * real(VIBRATION_LEFT),
                place: T::zero(),
                reading: w2,
                curvature: angular_jerk,
            },
        ]
    }

    /// Usual specific force, m/s^2.
    pub fn usual(&self) -> &Vector3<T> {
        &self.usual
    }

    /// Angular acceleration over the previous window, rad/s^2, given the rate over the next one, rad/s; `None`
    /// before two windows.
    pub fn acceleration(&self, rate: &Vector3<T>, window: T) -> Option<Vector3<T>> {
        let [_, [_, earlier]] = &self.before;
        let over_both = scaled(&difference(rate, earlier), real::<T>(0.5) / window);
        (self.windows > 1).then_some(over_both)
    }

    /// Squared first and second derivative; `inverse` is the inverse of the length of a window, 1/s.
    fn derivatives(&self, sensor: Sensor, now: &Vector3<T>, inverse: T) -> (T, T) {
        let [latest, earlier] = sensor.of(&self.before);
        if self.windows == 0 {
            return (T::zero(), T::zero());
        }
        let second = scaled(&difference(now, latest), inverse);
        if self.windows == 1 {
            return (squared(&second), T::zero());
        }
        let first = scaled(&difference(latest, earlier), inverse);
        let change = larger(squared(&first), squared(&second));
        (change, squared(&scaled(&difference(&second, &first), inverse)))
    }
}
