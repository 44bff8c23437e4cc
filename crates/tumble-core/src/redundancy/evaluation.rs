//! Deviations at rest, where physics says what a sensor has to say: |f| = g and w = 0.

use nalgebra::Vector3;

use crate::real::{Real, count, real};
use crate::redundancy::platform::{MountedUnit, PrimaryCalibration};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::Sensor;
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
    /// Its difference to a valid primary at the last rest, m/s^2 or rad/s; infinite before.
    pub apart: T,
    /// Whether that was within the threshold.
    pub agrees: bool,
}

impl<T: Real> StoredCalibration<T> {
    /// Nothing.
    pub fn nothing() -> Self {
        Self {
            error: RelativeError::none(),
            residual: T::zero(),
            sequence: 0,
            calibrated: false,
            apart: real(f64::INFINITY),
            agrees: false,
        }
    }

    /// Takes in how far it was from a valid primary at rest.
    pub fn compare(&mut self, deviation: &Deviation<T>) {
        self.apart = deviation.value;
        self.agrees = !deviation.exceeds();
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
    /// Its mean, as read.
    pub mean: Vector3<T>,
    /// Its own calibration.
    pub calibration: &'a PrimaryCalibration<T>,
    /// Its deviation when it was last found valid.
    pub last_valid: T,
}

impl<T: Real> PrimaryAtRest<'_, T> {
    /// Against its threshold.
    pub fn deviation(&self, settings: &EvaluationSettings<T>) -> Deviation<T> {
        let last = match settings.data {
            Data::Raw => (self.mean - self.corrected()).norm(),
            Data::Compensated => self.last_valid,
        };
        Deviation {
            value: self.off_physics(settings.data, settings.gravity),
            threshold: settings.thresholds.primary.of(self.sensor).value(last),
        }
    }

    /// How far these data are from what physics says, m/s^2 or rad/s.
    pub fn off_physics(&self, data: Data, gravity: T) -> T {
        let reading = match data {
            Data::Raw => self.mean,
            Data::Compensated => self.corrected(),
        };
        from_physics(self.sensor, reading.norm(), gravity)
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
}

impl<T: Real> SecondaryAtRest<'_, T> {
    /// Against physics; `None` where an axis is missing without which there is no magnitude of gravity. A secondary that
    /// agrees with its primary deviates as much as that, `primary_deviation`, and no calibration against it helps.
    pub fn norm(&self, settings: &EvaluationSettings<T>, primary_deviation: T) -> Option<Deviation<T>> {
        Some(Deviation {
            value: self.off_physics(settings.data, settings.gravity)?,
            threshold: self.threshold(settings) + primary_deviation,
        })
    }

    /// How far these data are from what physics says, m/s^2 or rad/s; `None` as of [`Self::norm`].
    pub fn off_physics(&self, data: Data, gravity: T) -> Option<T> {
        let complete = self.unit.axes.complete(self.sensor);
        if self.sensor == Sensor::Accelerometer && !complete {
            return None;
        }
        let magnitude = match (data, self.sensor) {
            (Data::Raw, _) => self.over_axes(&self.mean),
            (Data::Compensated, Sensor::Accelerometer) => {
                let as_primary = self.unit.sensor_from_primary.tr_mul(&self.compensated());
                self.calibration.correct(self.sensor, &as_primary).norm()
            }
            // At rest the primary says its bias, whichever axes the secondary has.
            (Data::Compensated, Sensor::Gyroscope) => {
                let bias = self.unit.sensor_from_primary * self.calibration.model(self.sensor).bias;
                self.over_axes(&(self.compensated() - bias))
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
        Deviation {
            value: self.over_axes(&(data - self.unit.sensor_from_primary * primary)),
            threshold: self.threshold(settings),
        }
    }

    /// As the primary would read, in the axes of the secondary.
    fn compensated(&self) -> Vector3<T> {
        self.stored.error.correct(&self.mean)
    }

    fn over_axes(&self, v: &Vector3<T>) -> T {
        let present = v.iter().zip(self.unit.axes.of(self.sensor));
        let squares = present.fold(T::zero(), |sum, (x, has)| if *has { sum + *x * *x } else { sum });
        squares.sqrt()
    }

    /// The last error is, of raw data, what the stored error makes of this very reading; of compensated data, what the
    /// stored error left on held-out pairs.
    fn threshold(&self, settings: &EvaluationSettings<T>) -> T {
        let last = match settings.data {
            Data::Raw => self.over_axes(&(self.mean - self.compensated())),
            Data::Compensated => {
                let axes = self.unit.axes.of(self.sensor).iter().filter(|has| **has).count();
                self.stored.residual * count::<T>(u32::try_from(axes).unwrap_or(3)).sqrt()
            }
        };
        settings.thresholds.secondary.of(self.sensor).value(last)
    }
}

fn from_physics<T: Real>(sensor: Sensor, magnitude: T, gravity: T) -> T {
    match sensor {
        Sensor::Accelerometer => (magnitude - gravity).abs(),
        Sensor::Gyroscope => magnitude,
    }
}
