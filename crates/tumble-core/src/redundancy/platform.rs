//! Configuration of the set: its units, their mountings, and the settings.

use nalgebra::{Matrix3, Vector3};

use crate::model::{Correction, ErrorModel};
use crate::products::{self, Length, matrix_product, zeros};
use crate::real::{Real, real};
use crate::redundancy::record::{Record, Storage};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::RedundancySettings;
use crate::redundancy::settings::thresholds::{SensorThresholds, Threshold};
use crate::redundancy::settings::validate::InvalidSetting;

/// Ends of the ranges of the sensors of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<T: Real> {
    /// End of the range, m/s^2; `None` if unknown.
    pub specific_force: Option<T>,
    /// End of the range, rad/s; `None` if unknown.
    pub angular_rate: Option<T>,
}

/// Unit with its mounting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountedUnit<T: Real> {
    /// Serial number, or another number that identifies the unit for life; records bear it.
    pub identity: u64,
    /// Channels of the unit.
    pub axes: Axes,
    /// Ends of the ranges.
    pub range: Range<T>,
    /// Offset added to the time of samples, microseconds.
    pub time_offset: i64,
    /// Nominal rotation from the case frame of the primary to the axes of the unit.
    pub sensor_from_primary: Matrix3<T>,
    /// Vector from the primary to the unit, m, case frame of the primary; `None` if it is to be estimated.
    pub lever_arm: Option<Vector3<T>>,
    /// Thresholds of deviation of this unit, accelerometer first; `None` for those of the settings.
    pub thresholds: [Option<Threshold<T>>; 2],
}

impl<T: Real> MountedUnit<T> {
    /// Creates a unit with six channels of unknown range on the common clock, mounted like the primary, lever
    /// arm unknown.
    pub fn new(identity: u64) -> Self {
        Self {
            identity,
            axes: Axes::ALL,
            range: Range {
                specific_force: None,
                angular_rate: None,
            },
            time_offset: 0,
            sensor_from_primary: products::identity(),
            lever_arm: None,
            thresholds: [None; 2],
        }
    }

    /// Time on the common clock.
    pub fn common_time(&self, time: u64) -> u64 {
        time.saturating_add_signed(self.time_offset)
    }

    /// Threshold of the deviation of a sensor: that of the unit, or else that of the settings.
    pub fn threshold<'a>(&'a self, sensor: Sensor, kind: &'a SensorThresholds<T>) -> &'a Threshold<T> {
        sensor.of(&self.thresholds).as_ref().unwrap_or(kind.of(sensor))
    }

    fn is_sound(&self) -> bool {
        let r = &self.sensor_from_primary;
        let off = matrix_product(r, &r.transpose()) - products::identity();
        let finite = self.lever_arm.is_none_or(|r| r.iter().all(|x| x.is_finite()));
        // Single precision and four written digits leave this much of a rotation.
        finite && off.length() < real(1e-3) && r.determinant() > T::zero()
    }
}

/// Calibration of the primary, which is applied to the output of every source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryCalibration<T: Real> {
    models: [ErrorModel<T>; 2],
    corrections: [Correction<T>; 2],
    residuals: [T; 2],
}

impl<T: Real> PrimaryCalibration<T> {
    /// Creates the calibration of a primary whose readings are taken for the truth.
    pub fn none() -> Self {
        let correction = Correction {
            matrix: products::identity(),
            bias: zeros(),
        };
        Self {
            models: [ErrorModel::identity(); 2],
            corrections: [correction; 2],
            residuals: [T::zero(); 2],
        }
    }

    /// Creates `y = M u + b` of its accelerometer and of its gyroscope; `None` if one has no inverse.
    pub fn new(accelerometer: ErrorModel<T>, gyroscope: ErrorModel<T>) -> Option<Self> {
        let corrections = [accelerometer.correction().ok()?, gyroscope.correction().ok()?];
        Some(Self {
            models: [accelerometer, gyroscope],
            corrections,
            residuals: [T::zero(); 2],
        })
    }

    /// Adds its residuals, root mean square of a channel of accelerometer and gyroscope, m/s^2 and rad/s.
    pub fn with_residuals(self, residuals: [T; 2]) -> Self {
        Self { residuals, ..self }
    }

    /// Residual of a sensor, root mean square of a channel, m/s^2 or rad/s; zero if unknown.
    pub fn residual(&self, sensor: Sensor) -> T {
        *sensor.of(&self.residuals)
    }

    /// Loads the stored calibration of the primary, whose records relate its readings to the truth; `None` if
    /// no invertible one is stored. A sensor without a record is taken to be right.
    ///
    /// # Errors
    /// The error of the storage.
    pub fn stored<S: Storage<T>>(identity: u64, storage: &mut S) -> Result<Option<Self>, S::Error> {
        let mut found = None;
        for sensor in SENSORS {
            if let Some(record) = storage.load(identity, sensor)? {
                let Some(calibration) = found.unwrap_or(Self::none()).with_record(&record) else {
                    return Ok(None);
                };
                found = Some(calibration);
            }
        }
        Ok(found)
    }

    /// Adds a record of one sensor of the primary; `None` if it is not finite or has no inverse.
    pub fn with_record(self, record: &Record<T>) -> Option<Self> {
        let sensor = record.sensor;
        let correction = record.model.correction().ok().filter(|_| record.is_finite())?;
        let mut with = self;
        *sensor.of_mut(&mut with.models) = record.model;
        *sensor.of_mut(&mut with.corrections) = correction;
        *sensor.of_mut(&mut with.residuals) = record.residual;
        Some(with)
    }

    /// Restricts the calibration to the axes that the primary has: missing axes must not affect the others.
    fn of_axes(self, axes: &Axes) -> Self {
        if *axes == Axes::ALL {
            return self;
        }
        let mut limited = self;
        for sensor in SENSORS {
            let has = axes.of(sensor);
            let model = sensor.of_mut(&mut limited.models);
            model.bias = axes.present(sensor, &model.bias);
            // `from_fn` avoids a row or column by its number, which could panic.
            model.matrix = Matrix3::from_fn(|row, column| {
                let both = [row, column].into_iter().all(|i| has.get(i) == Some(&true));
                match model.matrix.get((row, column)) {
                    Some(entry) if both => *entry,
                    _ if row == column => T::one(),
                    _ => T::zero(),
                }
            });
            let correction = model.correction();
            if let Ok(correction) = correction {
                *sensor.of_mut(&mut limited.corrections) = correction;
            }
        }
        limited
    }

    /// Returns whether a sensor is calibrated; otherwise its error is unknown.
    pub fn is_known(&self, sensor: Sensor) -> bool {
        *self.model(sensor) != ErrorModel::identity()
    }

    /// Error model of a sensor.
    pub fn model(&self, sensor: Sensor) -> &ErrorModel<T> {
        sensor.of(&self.models)
    }

    /// Corrects a reading of the primary, or a reading of a secondary converted to one.
    pub fn correct(&self, sensor: Sensor, y: &Vector3<T>) -> Vector3<T> {
        sensor.of(&self.corrections).apply(y)
    }
}

/// Checked set of a primary, unit 0, and its secondaries. It is constant, so that it may lie in read-only
/// memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Platform<T: Real, const UNITS: usize> {
    settings: RedundancySettings<T>,
    calibration: PrimaryCalibration<T>,
    units: [MountedUnit<T>; UNITS],
}

crate::vocabulary! {
    /// Reason for rejecting a platform.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum PlatformError {
        /// Settings contradict each other.
        Settings(InvalidSetting) = "contradictory settings",
        /// A set needs a primary and at least one secondary.
        TooFewUnits = "too few units",
        /// The primary has no channel, or a rotation against itself.
        Primary = "unfit primary",
        /// The matrix is no rotation, or the lever arm is not finite.
        Mounting(usize) = "unfit mounting",
        /// The unit has the identity of one before it.
        SameIdentity(usize) = "same identity",
        /// A threshold of the unit would always be exceeded, or never.
        Threshold(usize) = "unfit threshold",
    }
}

impl<T: Real, const UNITS: usize> Platform<T, UNITS> {
    /// Checks the settings and the units.
    ///
    /// # Errors
    /// [`PlatformError`] of the first contradiction.
    pub fn new(
        settings: RedundancySettings<T>,
        calibration: PrimaryCalibration<T>,
        units: [MountedUnit<T>; UNITS],
    ) -> Result<Self, PlatformError> {
        settings.validate().map_err(PlatformError::Settings)?;
        check_units(&settings, &units)?;
        let mut platform = Self {
            settings,
            calibration,
            units,
        };
        platform.set_calibration(calibration);
        Ok(platform)
    }

    /// Replaces all by what [`Self::new`] takes, in place: a copy would take as much stack as a platform. That the settings
    /// are valid is for the caller to know. Where the units are rejected, nothing changes.
    ///
    /// # Errors
    /// Those of [`check_units`].
    pub fn set(
        &mut self,
        settings: &RedundancySettings<T>,
        calibration: &PrimaryCalibration<T>,
        units: &[MountedUnit<T>; UNITS],
    ) -> Result<(), PlatformError> {
        check_units(settings, units)?;
        self.settings = *settings;
        self.units = *units;
        self.set_calibration(*calibration);
        Ok(())
    }

    /// Settings of the set.
    pub fn settings(&self) -> &RedundancySettings<T> {
        &self.settings
    }

    /// Calibration of the primary.
    pub fn calibration(&self) -> &PrimaryCalibration<T> {
        &self.calibration
    }

    /// Replaces the calibration of the primary.
    pub fn set_calibration(&mut self, calibration: PrimaryCalibration<T>) {
        self.calibration = calibration.of_axes(&self.primary_axes());
    }

    /// Axes of the primary.
    pub fn primary_axes(&self) -> Axes {
        self.units.first().map_or(Axes::ALL, |primary| primary.axes)
    }

    /// Axes of a unit that correspond to axes of the primary.
    pub fn comparable(&self, unit: &MountedUnit<T>) -> Axes {
        unit.axes
            .comparable(&self.primary_axes(), &unit.sensor_from_primary)
    }

    /// Returns whether a unit measures all axes of the primary.
    pub fn replaces_primary(&self, unit: &MountedUnit<T>) -> bool {
        let axes = || self.output_axes(unit);
        let covers = |sensor: Sensor| self.primary_axes().within(&axes(), sensor);
        unit.axes == Axes::ALL || SENSORS.into_iter().all(covers)
    }

    /// Axes of the case of the primary that a unit measures.
    pub fn output_axes(&self, unit: &MountedUnit<T>) -> Axes {
        Axes::ALL.comparable(&unit.axes, &unit.sensor_from_primary.transpose())
    }

    /// Units, the primary first.
    pub fn units(&self) -> &[MountedUnit<T>; UNITS] {
        &self.units
    }
}

/// Checks the units of a platform, beside settings that are valid.
///
/// # Errors
/// [`PlatformError`] of the first contradiction.
#[inline(never)]
pub fn check_units<T: Real, const UNITS: usize>(
    settings: &RedundancySettings<T>,
    units: &[MountedUnit<T>; UNITS],
) -> Result<(), PlatformError> {
    let primary = units
        .first()
        .filter(|_| UNITS > 1)
        .ok_or(PlatformError::TooFewUnits)?;
    if !SENSORS.into_iter().any(|sensor| primary.axes.any(sensor))
        || primary.sensor_from_primary != products::identity()
    {
        return Err(PlatformError::Primary);
    }
    for (i, unit) in units.iter().enumerate() {
        if !unit.is_sound() {
            return Err(PlatformError::Mounting(i));
        }
        for (sensor, own) in SENSORS.into_iter().zip(&unit.thresholds) {
            let meets =
                |own: &Threshold<T>| own.is_possible() && (i == 0 || settings.may_be_exceeded(sensor, own));
            if !own.as_ref().is_none_or(meets) {
                return Err(PlatformError::Threshold(i));
            }
        }
        if units.iter().take(i).any(|other| other.identity == unit.identity) {
            return Err(PlatformError::SameIdentity(i));
        }
    }
    Ok(())
}
