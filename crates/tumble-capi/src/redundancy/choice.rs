//! Choices in the settings of a redundant set.

use core::mem::MaybeUninit;

use tumble_core::redundancy::settings::thresholds::Threshold as CoreThreshold;
use tumble_core::redundancy::settings::{
    Adoption as CoreAdoption, Data as CoreData, Gate as CoreGate, Scope as CoreScope,
};

use crate::code::{Code, code};
use crate::status::{Status, StatusResult};

/// Ways to set a threshold.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ThresholdKind {
    /// Always the same; the number is m/s^2 or rad/s, above 0.
    Fixed,
    /// The error at the last calibration and a margin upon it; the number is m/s^2 or rad/s, above 0.
    ByMargin,
    /// The error at the last calibration times a ratio; the number is above 1.
    ByRatio,
    /// The error from the factory and a margin upon it; the number is m/s^2 or rad/s, above 0.
    FactoryByMargin,
    /// Threshold of a unit that follows the settings; the number does not count. Not for settings.
    OfSettings,
}

/// A threshold.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Threshold {
    /// Way in which it is set.
    pub kind: MaybeUninit<ThresholdKind>,
    /// Number with the meaning given by the kind.
    pub number: f32,
}

/// Which data deviations at rest are taken from.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Data {
    /// Raw readings: thresholds have to allow for the error that is known.
    Raw,
    /// After the stored error, and the primary's own calibration, were taken off.
    Compensated,
}

/// Sensors whose deviations let a calibration be triggered.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gate {
    /// The secondary's alone.
    SecondaryAlone,
    /// The secondary's, with both sensors of the primary valid.
    WholePrimary,
    /// The secondary's, sensor by sensor, each with the primary's sensor of its kind valid.
    SensorBySensor,
}

/// Sensors that a trigger has calibrated.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Accelerometer and gyroscope of the secondary.
    AllSensors,
    /// Only the sensor that deviates.
    TriggeringSensor,
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for ThresholdKind {
    const COUNT: u32 = 5;
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Data {
    const COUNT: u32 = 2;
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Gate {
    const COUNT: u32 = 3;
}

/// Which fits replace what is stored.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adoption {
    /// One that is plausible and explains held-out pairs better than what is stored.
    IfBetter,
    /// Each, as in the literature: what is stored is that of the last calibration.
    Always,
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Adoption {
    const COUNT: u32 = 2;
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Scope {
    const COUNT: u32 = 2;
}

impl Threshold {
    /// Converts the core's type.
    pub fn of(threshold: CoreThreshold<f32>) -> Self {
        let (kind, number) = match threshold {
            CoreThreshold::Fixed(number) => (ThresholdKind::Fixed, number),
            CoreThreshold::VariableByMargin(number) => (ThresholdKind::ByMargin, number),
            CoreThreshold::VariableByRatio(number) => (ThresholdKind::ByRatio, number),
            CoreThreshold::FactoryByMargin(number) => (ThresholdKind::FactoryByMargin, number),
        };
        Self {
            kind: MaybeUninit::new(kind),
            number,
        }
    }

    /// None of a unit's own.
    pub fn of_settings() -> Self {
        Self {
            kind: MaybeUninit::new(ThresholdKind::OfSettings),
            number: 0.0,
        }
    }

    /// Converts it to the core's type, for settings.
    pub fn in_core(self) -> StatusResult<CoreThreshold<f32>> {
        self.of_unit()?.ok_or(Status::TumbleErrorCode)
    }

    /// Converts it to the core's type, for a unit.
    pub fn of_unit(self) -> StatusResult<Option<CoreThreshold<f32>>> {
        Ok(match code(self.kind)? {
            ThresholdKind::Fixed => Some(CoreThreshold::Fixed(self.number)),
            ThresholdKind::ByMargin => Some(CoreThreshold::VariableByMargin(self.number)),
            ThresholdKind::ByRatio => Some(CoreThreshold::VariableByRatio(self.number)),
            ThresholdKind::FactoryByMargin => Some(CoreThreshold::FactoryByMargin(self.number)),
            ThresholdKind::OfSettings => None,
        })
    }
}

impl Data {
    /// Converts the core's type.
    pub fn of(data: CoreData) -> Self {
        match data {
            CoreData::Raw => Self::Raw,
            CoreData::Compensated => Self::Compensated,
        }
    }

    /// Converts it to the core's type.
    pub fn in_core(self) -> CoreData {
        match self {
            Self::Raw => CoreData::Raw,
            Self::Compensated => CoreData::Compensated,
        }
    }
}

impl Gate {
    /// Converts the core's type.
    pub fn of(gate: CoreGate) -> Self {
        match gate {
            CoreGate::SecondaryAlone => Self::SecondaryAlone,
            CoreGate::WholePrimary => Self::WholePrimary,
            CoreGate::SensorBySensor => Self::SensorBySensor,
        }
    }

    /// Converts it to the core's type.
    pub fn in_core(self) -> CoreGate {
        match self {
            Self::SecondaryAlone => CoreGate::SecondaryAlone,
            Self::WholePrimary => CoreGate::WholePrimary,
            Self::SensorBySensor => CoreGate::SensorBySensor,
        }
    }
}

impl Scope {
    /// Converts the core's type.
    pub fn of(scope: CoreScope) -> Self {
        match scope {
            CoreScope::AllSensors => Self::AllSensors,
            CoreScope::TriggeringSensor => Self::TriggeringSensor,
        }
    }

    /// Converts it to the core's type.
    pub fn in_core(self) -> CoreScope {
        match self {
            Self::AllSensors => CoreScope::AllSensors,
            Self::TriggeringSensor => CoreScope::TriggeringSensor,
        }
    }
}

impl Adoption {
    /// Converts the core's type.
    pub fn of(adoption: CoreAdoption) -> Self {
        match adoption {
            CoreAdoption::IfBetter => Self::IfBetter,
            CoreAdoption::Always => Self::Always,
        }
    }

    /// Converts it to the core's type.
    pub fn in_core(self) -> CoreAdoption {
        match self {
            Self::IfBetter => CoreAdoption::IfBetter,
            Self::Always => CoreAdoption::Always,
        }
    }
}
