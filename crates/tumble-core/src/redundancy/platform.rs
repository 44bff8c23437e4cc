//! The set as it is built: which units there are, how they are mounted, and the settings.

use nalgebra::{Matrix3, Vector3};

use crate::model::{Correction, ErrorModel};
use crate::products::{self, Length, matrix_product, zeros};
use crate::real::{Real, real};
use crate::redundancy::record::{Record, Storage};
use crate::redundancy::sensor::{Axes, SENSORS, Sensor};
use crate::redundancy::settings::RedundancySettings;
use crate::redundancy::settings::thresholds::{SensorThresholds, Threshold};
use crate::redundancy::settings::validate::InvalidSetting;

/// Ends of the range of a unit's sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range<T: Real> {
    /// m/s^2; `None` where nobody knows.
    pub specific_force: Option<T>,
    /// rad/s; `None` where nobody knows.
    pub angular_rate: Option<T>,
}

/// A unit as it is built in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountedUnit<T: Real> {
    /// Serial number, or whatever tells it from others for life: records carry it.
    pub identity: u64,
    /// Which channels it has.
    pub axes: Axes,
    /// Where its readings end.
    pub range: Range<T>,
    /// Added to the time of its samples, microseconds.
    pub time_offset: i64,
    /// Nominal rotation to its axes from the primary's case frame.
    pub sensor_from_primary: Matrix3<T>,
    /// From the primary to it, m, primary's case frame; `None` where it is to be found.
    pub lever_arm: Option<Vector3<T>>,
    /// Its own thresholds of deviation, accelerometer first; `None` where those of the settings do.
    pub thresholds: [Option<Threshold<T>>; 2],
}

impl<T: Real> MountedUnit<T> {
    /// With six channels of unknown range on the common clock, mounted as the primary, lever arm unknown.
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

    /// Its own threshold of a sensor's deviation, or else that of its kind.
    pub fn threshold<'a>(&'a self, sensor: Sensor, kind: &'a SensorThresholds<T>) -> &'a Threshold<T> {
        sensor.of(&self.thresholds).as_ref().unwrap_or(kind.of(sensor))
    }

    fn is_sound(&self) -> bool {
        let r = &self.sensor_from_primary;
        let off = matrix_product(r, &r.transpose()) - products::identity();
        let finite = self.lever_arm.is_none_or(|r| r.iter().all(|x| x.is_finite()));
        // What single precision leaves of a rotation written with four digits.
        finite && off.length() < real(1e-3) && r.determinant() > T::zero()
    }
}

/// The primary's own calibration, with which the output is calibrated whoever is its source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryCalibration<T: Real> {
    models: [ErrorModel<T>; 2],
    corrections: [Correction<T>; 2],
    residuals: [T; 2],
}

impl<T: Real> PrimaryCalibration<T> {
    /// None: its readings are taken for the truth.
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

    /// `y = M u + b` of its accelerometer and of its gyroscope; `None` where one has no inverse.
    pub fn new(accelerometer: ErrorModel<T>, gyroscope: ErrorModel<T>) -> Option<Self> {
        let corrections = [accelerometer.correction().ok()?, gyroscope.correction().ok()?];
        Some(Self {
            models: [accelerometer, gyroscope],
            corrections,
            residuals: [T::zero(); 2],
        })
    }

    /// The same with what it left, root mean square of a channel of accelerometer and gyroscope, m/s^2 and rad/s.
    pub fn with_residuals(self, residuals: [T; 2]) -> Self {
        Self { residuals, ..self }
    }

    /// What it left of a sensor's errors, root mean square of a channel, m/s^2 or rad/s; zero where nobody said.
    pub fn residual(&self, sensor: Sensor) -> T {
        *sensor.of(&self.residuals)
    }

    /// As it was stored for the primary, whose records relate its readings to the truth; `None` where none is stored
    /// that can be inverted. A sensor without a record is taken to be right.
    ///
    /// # Errors
    /// What storage gives.
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

    /// The same with what a record of the primary says of one sensor; `None` where that is not finite or has no inverse.
    pub fn with_record(self, record: &Record<T>) -> Option<Self> {
        let sensor = record.sensor;
        let correction = record.model.correction().ok().filter(|_| record.is_finite())?;
        let mut with = self;
        *sensor.of_mut(&mut with.models) = record.model;
        *sensor.of_mut(&mut with.corrections) = correction;
        *sensor.of_mut(&mut with.residuals) = record.residual;
        Some(with)
    }

    /// The same of a primary that has these axes only: what is known of others is of no use, and would be taken off what is
    /// read of these.
    fn of_axes(self, axes: &Axes) -> Self {
        if *axes == Axes::ALL {
            return self;
        }
        let mut limited = self;
        for sensor in SENSORS {
            let has = axes.of(sensor);
            let model = sensor.of_mut(&mut limited.models);
            model.bias = axes.present(sensor, &model.bias);
            // By `from_fn`: a row or column by its number would reach a panic.
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

    /// Whether a sensor has one; else nobody says how far off it may be.
    pub fn is_known(&self, sensor: Sensor) -> bool {
        *self.model(sensor) != ErrorModel::identity()
    }

    /// That of a sensor.
    pub fn model(&self, sensor: Sensor) -> &ErrorModel<T> {
        sensor.of(&self.models)
    }

    /// The truth behind a reading of the primary, or behind what a secondary makes of one.
    pub fn correct(&self, sensor: Sensor, y: &Vector3<T>) -> Vector3<T> {
        sensor.of(&self.corrections).apply(y)
    }
}

/// A checked set of a primary, unit 0, and its secondaries. Nothing in it changes, so that it may lie in read-only
/// memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Platform<T: Real, const UNITS: usize> {
    settings: RedundancySettings<T>,
    calibration: PrimaryCalibration<T>,
    units: [MountedUnit<T>; UNITS],
}

crate::vocabulary! {
    /// Why a platform cannot be.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum PlatformError {
        /// Settings contradict each other.
        Settings(InvalidSetting) = "contradictory settings",
        /// A primary and at least one secondary make a set.
        TooFewUnits = "too few units",
        /// The primary has no channel, or is said to be turned against itself.
        Primary = "unfit primary",
        /// The rotation of this unit is none, or its lever arm is not finite.
        Mounting(usize) = "unfit mounting",
        /// This unit has the identity of one before it.
        SameIdentity(usize) = "same identity",
        /// A threshold of this unit's own would always be exceeded, or never.
        Threshold(usize) = "unfit threshold",
    }
}

impl<T: Real, const UNITS: usize> Platform<T, UNITS> {
    /// Checks the settings and the units.
    ///
    /// # Errors
    /// [`PlatformError`] with the first thing that cannot be.
    pub fn new(
        settings: RedundancySettings<T>,
        calibration: PrimaryCalibration<T>,
        units: [MountedUnit<T>; UNITS],
    ) -> Result<Self, PlatformError> {
        settings.validate().map_err(PlatformError::Settings)?;
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
                let meets = |own: &Threshold<T>| {
                    own.is_possible() && (i == 0 || settings.may_be_exceeded(sensor, own))
                };
                if !own.as_ref().is_none_or(meets) {
                    return Err(PlatformError::Threshold(i));
                }
            }
            if units.iter().take(i).any(|other| other.identity == unit.identity) {
                return Err(PlatformError::SameIdentity(i));
            }
        }
        let platform = Self {
            settings,
            calibration,
            units,
        };
        Ok(platform.with_calibration(calibration))
    }

    /// The settings.
    pub fn settings(&self) -> &RedundancySettings<T> {
        &self.settings
    }

    /// The primary's own calibration.
    pub fn calibration(&self) -> &PrimaryCalibration<T> {
        &self.calibration
    }

    /// The same with another calibration of the primary's own.
    pub fn with_calibration(self, calibration: PrimaryCalibration<T>) -> Self {
        Self {
            calibration: calibration.of_axes(&self.primary_axes()),
            ..self
        }
    }

    /// Axes that the primary has.
    pub fn primary_axes(&self) -> Axes {
        self.units.first().map_or(Axes::ALL, |primary| primary.axes)
    }

    /// Axes of a unit that can be told from those of the primary.
    pub fn comparable(&self, unit: &MountedUnit<T>) -> Axes {
        unit.axes
            .comparable(&self.primary_axes(), &unit.sensor_from_primary)
    }

    /// Whether a unit says something of all axes of the primary.
    pub fn replaces_primary(&self, unit: &MountedUnit<T>) -> bool {
        let axes = || self.output_axes(unit);
        let covers = |sensor: Sensor| self.primary_axes().within(&axes(), sensor);
        unit.axes == Axes::ALL || SENSORS.into_iter().all(covers)
    }

    /// Axes of the primary's case of which a unit says something.
    pub fn output_axes(&self, unit: &MountedUnit<T>) -> Axes {
        Axes::ALL.comparable(&unit.axes, &unit.sensor_from_primary.transpose())
    }

    /// The units, the primary first.
    pub fn units(&self) -> &[MountedUnit<T>; UNITS] {
        &self.units
    }
}
