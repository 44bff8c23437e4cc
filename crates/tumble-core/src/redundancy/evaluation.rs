//! Deviations at rest, where physics says what a sensor has to say: |f| = g and w = 0.

use nalgebra::Vector3;

use crate::products::{
    Length, identity, product, squared, squared_matrix, transposed_product, unit_beyond, zeros,
};
use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::{difference, scaled, sum};
use crate::redundancy::judgement::SLOW_OFFSET;
use crate::redundancy::platform::{MountedUnit, PrimaryCalibration};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::{Axes, Sensor};
use crate::redundancy::settings::thresholds::KnownErrors;
use crate::redundancy::settings::{Data, EvaluationSettings};

/// A deviation and its threshold, m/s^2 or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation<T: Real> {
    /// How far from what it should be.
    pub value: T,
    /// As it is at the time.
    pub threshold: T,
}

impl<T: Real> Deviation<T> {
    /// Also where the deviation is not a number.
    pub fn exceeds(&self) -> bool {
        let within = self.value <= self.threshold;
        !within
    }
}

/// Standard deviation of the change of a bias from one run to the next; of its drift in a second; and of what a calibration
/// leaves at a rest that goes with the attitude: m/s^2 and rad/s (docs/theory/judgement.md, section 14).
const AGEING: [f32; 2] = [0.1, 0.006];
const DRIFT: [f32; 2] = [1.3e-3, 1.3e-4];
const BY_ATTITUDE: [f32; 2] = [0.01, 2e-4];

/// What is stored of one sensor of a secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredCalibration<T: Real> {
    /// Its error.
    pub error: RelativeError<T>,
    /// Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s; zero before the first calibration.
    pub residual: T,
    /// Counts the calibrations; zero before the first, and for one given from outside.
    pub sequence: u32,
    /// Whether there was any.
    pub calibrated: bool,
    /// Of the first calibration there was, as thresholds count it, m/s^2 or rad/s; zero before.
    pub factory: T,
    /// Whether motion showed all directions of its matrix.
    pub matrix_shown: bool,
    /// Sigma of the lever arm that was found, m; infinite where none was.
    pub place_sigma: T,
    /// Its difference to a valid primary at the last rest, m/s^2 or rad/s; infinite before.
    pub apart: T,
    /// Whether that was within the threshold.
    pub agrees: bool,
    /// How far it has followed the primary without proof, m/s^2 or rad/s, in the axes of the secondary.
    pub followed: Vector3<T>,
    /// Whether it is off by more than its trigger beside a primary that physics found right: it says nothing of others until it
    /// is calibrated anew.
    pub stale: bool,
    /// What it says beyond the primary, by the latest rests, m/s^2 or rad/s, in the axes of the primary, and its variance.
    pub trimmed: Vector3<T>,
    /// Of each axis.
    pub trim_variance: T,
    /// Whether it comes from before the start, and no rest has shown yet how it has aged.
    pub aged: bool,
    /// Whether physics, the others or an aiding measurement found it wrong: its next calibration may follow as far as it leads.
    pub freed: bool,
}

impl<T: Real> StoredCalibration<T> {
    /// Nothing.
    pub fn nothing() -> Self {
        Self {
            error: RelativeError::none(),
            residual: T::zero(),
            sequence: 0,
            calibrated: false,
            factory: T::zero(),
            matrix_shown: false,
            place_sigma: real(f64::INFINITY),
            apart: real(f64::INFINITY),
            agrees: false,
            followed: zeros(),
            stale: false,
            trimmed: zeros(),
            trim_variance: T::zero(),
            aged: false,
            freed: false,
        }
    }

    /// Replaces the error, as was adopted or stored; the first is the factory's.
    pub fn replace(&mut self, error: RelativeError<T>, residual: T, sequence: u32, factory: T) {
        if !self.calibrated {
            self.factory = factory;
        }
        *self = Self {
            error,
            residual,
            sequence,
            calibrated: true,
            stale: false,
            trimmed: zeros(),
            trim_variance: T::zero(),
            aged: false,
            freed: false,
            ..*self
        };
    }

    /// It comes from before the start: biases may have changed meanwhile.
    pub fn age(&mut self, sensor: Sensor) {
        let aged = tabulated::<T>(*sensor.of(&AGEING));
        (self.aged, self.trim_variance) = (true, aged * aged);
    }

    /// Bias instability and warming have gone on for so long, s (docs/theory/judgement.md, eq. 26).
    pub fn drift(&mut self, sensor: Sensor, passed: T) {
        let drift = tabulated::<T>(*sensor.of(&DRIFT));
        self.trim_variance += drift * drift * passed; // judgement.md, eq. 26
    }

    /// Takes in how far from a valid primary it is at a rest, trimmed as it was, in the axes of the primary; gives what is
    /// taken off beyond what was before.
    pub fn trim(&mut self, sensor: Sensor, apart: &Vector3<T>) -> Vector3<T> {
        let by_attitude = tabulated::<T>(*sensor.of(&BY_ATTITUDE));
        let noise = by_attitude * by_attitude;
        let gain = self.trim_variance / (self.trim_variance + noise); // judgement.md, eq. 27
        let before = self.trimmed;
        let trimmed = sum(&before, &scaled(apart, gain));
        let (size, most) = (trimmed.length(), tabulated::<T>(*sensor.of(&SLOW_OFFSET)));
        self.trimmed = if size > most {
            scaled(&trimmed, most / size)
        } else {
            trimmed
        };
        self.trim_variance *= T::one() - gain;
        self.aged = false;
        difference(&self.trimmed, &before)
    }

    /// Takes in how far it was from a valid primary at rest.
    pub fn compare(&mut self, deviation: &Deviation<T>) {
        self.apart = deviation.value;
        self.agrees = !deviation.exceeds();
    }

    /// A valid primary said `u` at rest, in the axes of the secondary: along gravity it was right, and at no rate altogether
    /// (docs/theory/redundancy.md, eq. 21).
    pub fn prove(&mut self, sensor: Sensor, u: &Vector3<T>) {
        self.followed = match sensor {
            Sensor::Accelerometer => across(&self.followed, u), // eq. 21
            Sensor::Gyroscope => zeros(),
        };
    }

    /// How far it is from the primary, as far as is known, m/s^2 or rad/s.
    pub fn error_left(&self) -> T {
        if self.calibrated {
            self.residual
        } else {
            self.apart
        }
    }
}

/// The primary's sensor at rest.
pub struct PrimaryAtRest<'a, T: Real> {
    /// Which.
    pub sensor: Sensor,
    /// How it is built in.
    pub unit: &'a MountedUnit<T>,
    /// Its mean, as read.
    pub mean: Vector3<T>,
    /// Its own calibration.
    pub calibration: &'a PrimaryCalibration<T>,
}

impl<T: Real> PrimaryAtRest<'_, T> {
    /// Against its threshold.
    pub fn deviation(&self, settings: &EvaluationSettings<T>) -> Deviation<T> {
        let sensor = self.sensor;
        let known = KnownErrors {
            last: match settings.data {
                Data::Raw => {
                    let found = off_rest(sensor, &self.mean, settings.gravity);
                    along(&(self.mean - self.corrected()), &found)
                }
                Data::Compensated => of_all_axes(&self.unit.axes, sensor, self.calibration.residual(sensor)),
            },
            factory: primary_factory_error(sensor, &self.unit.axes, self.calibration, settings),
        };
        Deviation {
            value: self.off_physics(settings.data, settings.gravity),
            threshold: self
                .unit
                .threshold(sensor, &settings.thresholds.primary)
                .value(&known),
        }
    }

    /// How far these data are from what physics says, m/s^2 or rad/s. Of axes of which one is missing, gravity is the most they
    /// may have together.
    pub fn off_physics(&self, data: Data, gravity: T) -> T {
        let reading = match data {
            Data::Raw => self.mean,
            Data::Compensated => self.corrected(),
        };
        let magnitude = reading.length();
        if self.sensor == Sensor::Accelerometer && !self.unit.axes.complete(self.sensor) {
            return (magnitude - gravity).max(T::zero()); // redundancy.md, eq. 25
        }
        from_physics(self.sensor, magnitude, gravity)
    }

    fn corrected(&self) -> Vector3<T> {
        self.calibration.correct(self.sensor, &self.mean)
    }
}

/// A secondary's sensor at rest.
pub struct SecondaryAtRest<'a, T: Real> {
    /// Which.
    pub sensor: Sensor,
    /// How it is built in.
    pub unit: &'a MountedUnit<T>,
    /// Its mean, as read.
    pub mean: Vector3<T>,
    /// What is stored of it.
    pub stored: &'a StoredCalibration<T>,
    /// The primary's own calibration.
    pub calibration: &'a PrimaryCalibration<T>,
    /// Axes of it that can be told from those of the primary.
    pub comparable: &'a Axes,
    /// Where a valid primary has up, in its case frame, length one: an accelerometer that lacks axes has no magnitude of
    /// gravity, but its share of it.
    pub up: Option<Vector3<T>>,
}

impl<T: Real> SecondaryAtRest<'_, T> {
    /// Against physics; `None` where an axis is missing without which there is no magnitude of gravity, nor is it known
    /// where up is.
    pub fn norm(&self, settings: &EvaluationSettings<T>) -> Option<Deviation<T>> {
        if self.has_share_of_gravity() {
            let [truth, expected] = self.share_of_gravity(settings.gravity)?;
            let found = self.present(&(self.mean - self.of_data(settings.data, truth, expected)));
            return Some(Deviation {
                value: found.length(),
                threshold: self.threshold(settings, &(expected - truth), &found),
            });
        }
        let turn = &self.unit.sensor_from_primary;
        let truth = match self.sensor {
            Sensor::Accelerometer => product(turn, &self.as_truth()),
            // At rest the primary says its bias, whichever axes the secondary has.
            Sensor::Gyroscope => {
                self.compensated() - product(turn, &self.calibration.model(self.sensor).bias)
            }
        };
        let found = off_rest(self.sensor, &self.present(&self.mean), settings.gravity);
        Some(Deviation {
            value: self.off_physics(settings.data, settings.gravity)?,
            threshold: self.threshold(settings, &(self.mean - truth), &found),
        })
    }

    /// How far these data are from what physics says, m/s^2 or rad/s; `None` as of [`Self::norm`].
    pub fn off_physics(&self, data: Data, gravity: T) -> Option<T> {
        if self.has_share_of_gravity() {
            let [truth, expected] = self.share_of_gravity(gravity)?;
            return Some(
                self.present(&(self.mean - self.of_data(data, truth, expected)))
                    .length(),
            );
        }
        let magnitude = match (data, self.sensor) {
            (Data::Raw, _) => self.present(&self.mean).length(),
            (Data::Compensated, Sensor::Accelerometer) => self.as_truth().length(),
            (Data::Compensated, Sensor::Gyroscope) => {
                let bias = &self.calibration.model(self.sensor).bias;
                let bias = product(&self.unit.sensor_from_primary, bias);
                self.present(&(self.compensated() - bias)).length()
            }
        };
        Some(from_physics(self.sensor, magnitude, gravity))
    }

    /// Against what the primary says at the same rest, `primary` as read.
    pub fn vector(&self, primary: &Vector3<T>, settings: &EvaluationSettings<T>) -> Deviation<T> {
        let data = match settings.data {
            Data::Raw => self.mean,
            Data::Compensated => self.compensated(),
        };
        let apart = data - product(&self.unit.sensor_from_primary, primary);
        let found = self.comparable.present(self.sensor, &apart);
        Deviation {
            value: found.length(),
            threshold: self.threshold(settings, &(self.mean - self.compensated()), &found),
        }
    }

    fn has_share_of_gravity(&self) -> bool {
        self.sensor == Sensor::Accelerometer && !self.unit.axes.complete(self.sensor)
    }

    /// Gravity in the axes of the secondary, and what its stored error makes of it.
    fn share_of_gravity(&self, gravity: T) -> Option<[Vector3<T>; 2]> {
        let (turn, gravity) = (&self.unit.sensor_from_primary, self.up? * gravity);
        let of_primary = self.calibration.model(self.sensor).measure(&gravity);
        Some([
            product(turn, &gravity),
            self.stored.error.predict(&product(turn, &of_primary)),
        ])
    }

    fn of_data(&self, data: Data, truth: Vector3<T>, expected: Vector3<T>) -> Vector3<T> {
        match data {
            Data::Raw => truth,
            Data::Compensated => expected,
        }
    }

    /// As the primary would read, in the axes of the secondary.
    fn compensated(&self) -> Vector3<T> {
        self.stored.error.correct(&self.mean)
    }

    /// What the primary would say with its own calibration applied, in its case frame.
    fn as_truth(&self) -> Vector3<T> {
        let as_primary = transposed_product(&self.unit.sensor_from_primary, &self.compensated());
        self.calibration.correct(self.sensor, &as_primary)
    }

    /// With zeros where it has no axis.
    fn present(&self, v: &Vector3<T>) -> Vector3<T> {
        self.unit.axes.present(self.sensor, v)
    }

    /// The last error is, of raw data, what the stored error makes of this very reading, `stored`, along the deviation
    /// that was `found`: an error across it is another one. Of compensated data it is what was left on held-out pairs.
    fn threshold(&self, settings: &EvaluationSettings<T>, stored: &Vector3<T>, found: &Vector3<T>) -> T {
        let known = KnownErrors {
            last: match settings.data {
                Data::Raw => along(stored, found),
                Data::Compensated => of_all_axes(&self.unit.axes, self.sensor, self.stored.residual),
            },
            factory: self.stored.factory,
        };
        let thresholds = &settings.thresholds.secondary;
        self.unit.threshold(self.sensor, thresholds).value(&known)
    }
}

/// What the error of a sensor counts as one from the factory, m/s^2 or rad/s: of compensated data what it left, of raw
/// data what it makes of a reading at rest, root mean square over all attitudes.
pub fn factory_error<T: Real>(
    sensor: Sensor,
    axes: &Axes,
    error: &RelativeError<T>,
    residual: T,
    settings: &EvaluationSettings<T>,
) -> T {
    let RelativeError { matrix, bias, .. } = error;
    match (settings.data, sensor) {
        (Data::Compensated, _) => of_all_axes(axes, sensor, residual),
        (Data::Raw, Sensor::Gyroscope) => bias.length(),
        (Data::Raw, Sensor::Accelerometer) => {
            let of_gravity = (matrix - identity()) * settings.gravity;
            (squared(bias) + squared_matrix(&of_gravity) / real(3.0)).square_root()
        }
    }
}

/// The same of the primary, by its own calibration.
pub fn primary_factory_error<T: Real>(
    sensor: Sensor,
    axes: &Axes,
    calibration: &PrimaryCalibration<T>,
    settings: &EvaluationSettings<T>,
) -> T {
    let model = calibration.model(sensor);
    let error = RelativeError {
        matrix: model.matrix,
        bias: model.bias,
        ..RelativeError::none()
    };
    factory_error(sensor, axes, &error, calibration.residual(sensor), settings)
}

/// The length over the axes there are of what is so large on each.
fn of_all_axes<T: Real>(axes: &Axes, sensor: Sensor, each: T) -> T {
    let there = axes.of(sensor).iter().filter(|has| **has).count();
    each * count::<T>(u32::try_from(there).unwrap_or(3)).square_root()
}

/// How much of a known error lies in the direction of a deviation (docs/theory/redundancy.md, eq. 15).
#[inline(never)]
fn along<T: Real>(known: &Vector3<T>, deviation: &Vector3<T>) -> T {
    let length = deviation.length();
    if length > T::zero() {
        (known.dot(deviation) / length).max(T::zero())
    } else {
        T::zero()
    }
}

/// The part of a vector across a direction.
pub fn across<T: Real>(vector: &Vector3<T>, direction: &Vector3<T>) -> Vector3<T> {
    let along = unit_beyond(direction, T::default_epsilon());
    along.map_or(*vector, |along| vector - along * along.dot(vector))
}

/// The least by which a reading is off what physics says at rest.
fn off_rest<T: Real>(sensor: Sensor, reading: &Vector3<T>, gravity: T) -> Vector3<T> {
    match sensor {
        Sensor::Accelerometer => reading * (T::one() - gravity / reading.length()),
        Sensor::Gyroscope => *reading,
    }
}

fn from_physics<T: Real>(sensor: Sensor, magnitude: T, gravity: T) -> T {
    match sensor {
        Sensor::Accelerometer => (magnitude - gravity).abs(),
        Sensor::Gyroscope => magnitude,
    }
}
