//! What the set does, and the difference that this makes between two sound units before anything is known of them.

use nalgebra::Vector3;

use crate::real::{Real, real};
use crate::redundancy::judgement::scales::{SCALES, follow};
use crate::redundancy::sensor::Sensor;

/// Strengths of what tells two sound units apart in motion, each a square (docs/theory/judgement.md, eq. 3 and 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strain<T: Real> {
    /// Squared rate of change: weighs with the square of a difference in time.
    pub change: T,
    /// Squared angular acceleration and fourth power of the rate: weighs with the square of a distance.
    pub place: T,
    /// Squared reading, of an accelerometer beyond what it usually is: weighs with the square of an error of a matrix.
    pub reading: T,
    /// Squared second derivative: weighs with the square of the error of straight lines between samples.
    pub curvature: T,
    /// Variance of vibration from sample to sample.
    pub vibration: T,
}

impl<T: Real> Strain<T> {
    const fn fields(&self) -> [&T; 5] {
        [
            &self.change,
            &self.place,
            &self.reading,
            &self.curvature,
            &self.vibration,
        ]
    }
}

/// Means of strains over each scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrainMeans<T: Real>([[T; SCALES]; 5]);

impl<T: Real> StrainMeans<T> {
    /// At rest.
    pub fn new() -> Self {
        Self([[T::zero(); SCALES]; 5])
    }

    /// Takes in that of a window.
    pub fn push(&mut self, strain: &Strain<T>, shares: &[T; SCALES]) {
        for (means, value) in self.0.iter_mut().zip(strain.fields()) {
            follow(means, *value, shares); // judgement.md, eq. 5
        }
    }

    /// Over one scale.
    pub fn at(&self, scale: usize) -> Strain<T> {
        let [change, place, reading, curvature, vibration] =
            self.0.map(|means| means.get(scale).copied().unwrap_or(T::zero()));
        Strain {
            change,
            place,
            reading,
            curvature,
            vibration,
        }
    }
}

/// How far two units may be apart in what makes them differ in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance<T: Real> {
    /// Of their clocks, s, squared.
    pub time: T,
    /// Of the lever arm, m, squared.
    pub place: T,
    /// Of a matrix, squared.
    pub matrix: T,
    /// Of straight lines between samples, s^2, squared.
    pub interpolation: T,
}

/// Share of the variance of vibration that is left in the mean of a window.
const VIBRATION_LEFT: f64 = 0.3;

impl<T: Real> Tolerance<T> {
    /// Variance of their difference that motion explains (eq. 3 and 4).
    pub fn variance(&self, strain: &Strain<T>) -> T {
        self.time * strain.change
            + self.place * strain.place
            + self.matrix * strain.reading
            + self.interpolation * strain.curvature
            + strain.vibration * real(VIBRATION_LEFT) // judgement.md, eq. 3, 4
    }
}

/// What the set reads, over the latest windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetMotion<T: Real> {
    /// The window before, and the one before that, accelerometer first.
    before: [[Option<Vector3<T>>; 2]; 2],
    /// Specific force as it usually is.
    usual: Option<Vector3<T>>,
}

/// Time over which the usual specific force is taken, s.
const USUAL: f64 = 60.0;

impl<T: Real> SetMotion<T> {
    /// Nothing seen.
    pub fn new() -> Self {
        Self {
            before: [[None; 2]; 2],
            usual: None,
        }
    }

    /// Takes in what the set reads over the next window, specific force and angular rate, and the variance of vibration
    /// in both; gives the strain on each sensor. `window` is its length, s.
    pub fn push(&mut self, readings: &[Vector3<T>; 2], vibration: [T; 2], window: T) -> [Strain<T>; 2] {
        let derivatives = [Sensor::Accelerometer, Sensor::Gyroscope]
            .map(|sensor| derivatives(sensor.of(&self.before), sensor.of(readings), window));
        for (before, reading) in self.before.iter_mut().zip(readings) {
            let [latest, _] = *before;
            *before = [Some(*reading), latest];
        }
        let [f, w] = readings;
        let usual = self.usual.get_or_insert(*f);
        *usual += (f - *usual) * (window / real(USUAL));
        let [(jerk, snap), (acceleration, angular_jerk)] = derivatives;
        let w2 = w.norm_squared();
        let place = acceleration + w2 * w2;
        let [force_vibration, rate_vibration] = vibration;
        [
            Strain {
                change: jerk,
                place,
                reading: (f - *usual).norm_squared(),
                curvature: snap,
                vibration: force_vibration,
            },
            Strain {
                change: acceleration,
                place: T::zero(),
                reading: w2,
                curvature: angular_jerk,
                vibration: rate_vibration,
            },
        ]
    }
}

/// Squared first and second derivative.
fn derivatives<T: Real>(before: &[Option<Vector3<T>>; 2], now: &Vector3<T>, window: T) -> (T, T) {
    match before {
        [Some(latest), Some(earlier)] => {
            let (second, first) = ((now - latest) / window, (latest - earlier) / window);
            let larger = first.norm_squared().max(second.norm_squared());
            (larger, ((second - first) / window).norm_squared())
        }
        [Some(latest), None] => (((now - latest) / window).norm_squared(), T::zero()),
        _ => (T::zero(), T::zero()),
    }
}
