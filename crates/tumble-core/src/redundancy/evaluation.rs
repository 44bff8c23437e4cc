//! Deviations at rest, where physics predicts the readings: |f| = g and w = 0.

use nalgebra::Vector3;

use crate::products::{
    Length, identity, product, squared, squared_matrix, transposed_product, unit_beyond, zeros,
};
use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::{difference, scaled, sum};
use crate::redundancy::platform::{MountedUnit, PrimaryCalibration};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::{Axes, SLOW_OFFSET, Sensor};
use crate::redundancy::settings::thresholds::KnownErrors;
use crate::redundancy::settings::{Data, EvaluationSettings};
use crate::redundancy::unit_count::{UnitCount, Units};

/// A deviation and its threshold, m/s^2 or rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation<T: Real> {
    /// Magnitude of the deviation.
    pub value: T,
    /// Threshold at the time.
    pub threshold: T,
}

impl<T: Real> Deviation<T> {
    /// Returns whether the deviation exceeds its threshold or is not a number.
    pub fn exceeds(&self) -> bool {
        let within = self.value <= self.threshold;
        !within
    }
}

/// Standard deviations, m/s^2 and rad/s: of the change of a bias between runs; of its drift in a second; and of
/// the error of a calibrated sensor at a rest that depends on the attitude (docs/theory/isolation.md, section
/// 14).
const AGEING: [f32; 2] = [0.1, 0.006];
const DRIFT: [f32; 2] = [1.3e-3, 1.3e-4];
const BY_ATTITUDE: [f32; 2] = [0.01, 2e-4];

/// Stored calibration of one sensor of a secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredCalibration<T: Real> {
    /// Error of the sensor relative to the primary.
    pub error: RelativeError<T>,
    /// Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s; zero before the first calibration.
    pub residual: T,
    /// Number of the calibration; zero before the first, and for one given from outside.
    pub sequence: u32,
    /// True if the sensor was calibrated.
    pub calibrated: bool,
    /// Error of the first calibration in the unit of thresholds, m/s^2 or rad/s; zero before.
    pub factory: T,
    /// True if motion showed all directions of the matrix.
    pub matrix_shown: bool,
    /// Sigma of the estimated lever arm, m; infinite without an estimate.
    pub place_sigma: T,
    /// Difference from a valid primary at the last rest, m/s^2 or rad/s; infinite before.
    pub apart: T,
    /// True if that difference was within the threshold.
    pub agrees: bool,
    /// Correction that follows the primary without proof, m/s^2 or rad/s, in the axes of the secondary.
    pub followed: Vector3<T>,
    /// True if the deviation exceeds its trigger beside a primary that agrees with physics: the sensor has no
    /// vote until it is calibrated.
    pub stale: bool,
    /// Difference from the primary over the latest rests, m/s^2 or rad/s, in the axes of the primary.
    pub trimmed: Vector3<T>,
    /// Variance of that difference, per axis.
    pub trim_variance: T,
    /// True if the calibration is from an earlier run and no rest has yet shown its ageing.
    pub aged: bool,
    /// True if physics, the other units or an aiding measurement showed the sensor faulty: its next calibration
    /// may follow the primary by any amount.
    pub freed: bool,
}

impl<T: Real> StoredCalibration<T> {
    /// Creates the state of a sensor without a calibration.
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

    /// Replaces the error by an adopted or stored one; the first counts as the factory's.
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

    /// Marks the calibration as one of an earlier run, since when biases may have changed.
    pub fn age(&mut self, sensor: Sensor) {
        let aged = tabulated::<T>(*sensor.of(&AGEING));
        (self.aged, self.trim_variance) = (true, aged * aged);
    }

    /// Adds the drift by bias instability and warming over a time, s (docs/theory/isolation.md, eq. 19).
    pub fn drift(&mut self, sensor: Sensor, passed: T) {
        let drift = tabulated::<T>(*sensor.of(&DRIFT));
        self.trim_variance += drift * drift * passed; // isolation.md, eq. 19
    }

    /// Updates the trim with the difference from a valid primary at a rest, in the axes of the primary; returns
    /// the change of the trim.
    pub fn trim(&mut self, sensor: Sensor, apart: &Vector3<T>) -> Vector3<T> {
        let by_attitude = tabulated::<T>(*sensor.of(&BY_ATTITUDE));
        let noise = by_attitude * by_attitude;
        let gain = self.trim_variance / (self.trim_variance + noise); // isolation.md, eq. 20
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

    /// Stores the difference from a valid primary at rest.
    pub fn compare(&mut self, deviation: &Deviation<T>) {
        self.apart = deviation.value;
        self.agrees = !deviation.exceeds();
    }

    /// Resets the unproven correction where a rest with a valid primary proves it: along gravity `u`, in the
    /// axes of the secondary, and for gyroscopes altogether (docs/theory/redundancy.md, eq. 21).
    pub fn prove(&mut self, sensor: Sensor, u: &Vector3<T>) {
        self.followed = match sensor {
            Sensor::Accelerometer => across(&self.followed, u), // eq. 21
            Sensor::Gyroscope => zeros(),
        };
    }

    /// Remaining difference from the primary, m/s^2 or rad/s, as far as it is known.
    pub fn error_left(&self) -> T {
        if self.calibrated {
            self.residual
        } else {
            self.apart
        }
    }
}

/// Stored calibrations of all secondaries; the primary, unit 0, has none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredCalibrations<T: Real, const UNITS: usize>(
    <Units<UNITS> as UnitCount>::OfSecondaries<[StoredCalibration<T>; 2]>,
)
where
    Units<UNITS>: UnitCount;

impl<T: Real, const UNITS: usize> StoredCalibrations<T, UNITS>
where
    Units<UNITS>: UnitCount,
{
    /// Creates the states of secondaries without calibrations.
    pub fn none() -> Self {
        Self(Units::filled([StoredCalibration::nothing(); 2]))
    }

    /// Both sensors of a secondary, accelerometer first; `None` of the primary.
    #[inline]
    pub fn get(&self, unit: usize) -> Option<&[StoredCalibration<T>; 2]> {
        self.of_secondaries().get(unit.checked_sub(1)?)
    }

    /// Both sensors of a secondary, accelerometer first, mutable; `None` of the primary.
    #[inline]
    pub fn get_mut(&mut self, unit: usize) -> Option<&mut [StoredCalibration<T>; 2]> {
        self.of_secondaries_mut().get_mut(unit.checked_sub(1)?)
    }

    /// Secondaries, in order.
    pub fn of_secondaries(&self) -> &[[StoredCalibration<T>; 2]] {
        self.0.as_ref()
    }

    /// Secondaries, in order, mutable.
    pub fn of_secondaries_mut(&mut self) -> &mut [[StoredCalibration<T>; 2]] {
        self.0.as_mut()
    }
}

/// Sensor of the primary at rest.
pub struct PrimaryAtRest<'a, T: Real> {
    /// Kind of sensor.
    pub sensor: Sensor,
    /// Mounting of the primary.
    pub unit: &'a MountedUnit<T>,
    /// Mean of the raw readings.
    pub mean: Vector3<T>,
    /// Calibration of the primary.
    pub calibration: &'a PrimaryCalibration<T>,
}

impl<T: Real> PrimaryAtRest<'_, T> {
    /// Deviation from physics, with its threshold.
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

    /// Deviation of these data from physics, m/s^2 or rad/s. If an axis is missing, the remaining ones may
    /// measure at most gravity.
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

/// Sensor of a secondary at rest.
pub struct SecondaryAtRest<'a, T: Real> {
    /// Kind of sensor.
    pub sensor: Sensor,
    /// Mounting of the secondary.
    pub unit: &'a MountedUnit<T>,
    /// Mean of the raw readings.
    pub mean: Vector3<T>,
    /// Stored calibration of the sensor.
    pub stored: &'a StoredCalibration<T>,
    /// Calibration of the primary.
    pub calibration: &'a PrimaryCalibration<T>,
    /// Axes that correspond to axes of the primary.
    pub comparable: &'a Axes,
    /// Direction of up in the case frame of the primary, measured by a valid primary, length one: an
    /// accelerometer with missing axes measures only a share of gravity.
    pub up: Option<Vector3<T>>,
}

impl<T: Real> SecondaryAtRest<'_, T> {
    /// Deviation from physics, with its threshold; `None` if an axis is missing and the direction of up is
    /// unknown.
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
            // At rest the primary measures its bias, whichever axes the secondary has.
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

    /// Deviation of these data from physics, m/s^2 or rad/s; `None` under the condition of [`Self::norm`].
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

    /// Deviation from the raw reading of the primary at the same rest, with its threshold.
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

    /// Gravity in the axes of the secondary, and the reading of it that the stored error predicts.
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

    /// Reading in the axes of the secondary, corrected to that of the primary.
    fn compensated(&self) -> Vector3<T> {
        self.stored.error.correct(&self.mean)
    }

    /// Reading corrected by the stored error and by the calibration of the primary, in the case frame of the
    /// primary.
    fn as_truth(&self) -> Vector3<T> {
        let as_primary = transposed_product(&self.unit.sensor_from_primary, &self.compensated());
        self.calibration.correct(self.sensor, &as_primary)
    }

    /// Sets axes that the secondary lacks to zero.
    fn present(&self, v: &Vector3<T>) -> Vector3<T> {
        self.unit.axes.present(self.sensor, v)
    }

    /// Threshold of a deviation `found`. For raw data the last known error is the part of the stored correction
    /// of this reading, `stored`, along the deviation, because an error across it is another one. For
    /// compensated data it is the residual of held-out pairs.
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

/// Magnitude of an error that counts as one from the factory, m/s^2 or rad/s: for compensated data its
/// residual, for raw data its effect on a reading at rest, root mean square over all attitudes.
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

/// Magnitude of the error of the primary, from its own calibration.
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

/// Length of a vector with the same value on each existing axis.
fn of_all_axes<T: Real>(axes: &Axes, sensor: Sensor, each: T) -> T {
    let there = axes.of(sensor).iter().filter(|has| **has).count();
    each * count::<T>(u32::try_from(there).unwrap_or(3)).square_root()
}

/// Part of a known error along a deviation (docs/theory/redundancy.md, eq. 15).
#[inline(never)]
fn along<T: Real>(known: &Vector3<T>, deviation: &Vector3<T>) -> T {
    let length = deviation.length();
    if length > T::zero() {
        (known.dot(deviation) / length).max(T::zero())
    } else {
        T::zero()
    }
}

/// Returns the part of a vector perpendicular to a direction.
pub fn across<T: Real>(vector: &Vector3<T>, direction: &Vector3<T>) -> Vector3<T> {
    let along = unit_beyond(direction, T::default_epsilon());
    along.map_or(*vector, |along| vector - along * along.dot(vector))
}

/// Smallest change of a reading that makes it agree with physics at rest.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::redundancy::sensor::SENSORS;

    #[test]
    fn a_calibration_is_trimmed_by_what_it_may_have_drifted_alone() {
        let apart = Vector3::new(1e-3, -2e-3, 5e-4);
        for sensor in SENSORS {
            let mut stored = StoredCalibration::<f64>::nothing();
            stored.age(sensor);
            assert!(stored.trim(sensor, &apart).norm() > 0.9 * apart.norm());
            stored.age(sensor);
            stored.replace(RelativeError::none(), 1e-3, 1, 0.0);
            assert_eq!(stored.trim(sensor, &apart), Vector3::zeros());
            let mut before = 0.0;
            for passed in [1.0, 10.0, 100.0] {
                let mut drifted = stored;
                drifted.drift(sensor, passed);
                let change = drifted.trim(sensor, &apart).norm();
                assert!(before < change && change < apart.norm());
                before = change;
            }
        }
    }
}
