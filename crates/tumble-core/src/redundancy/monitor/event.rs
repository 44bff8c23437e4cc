//! Everything that happened, and why, with figures.

use crate::real::Real;
use crate::redundancy::fit::adoption::AdoptionRefusal;
use crate::redundancy::gate::Withheld;
use crate::redundancy::health::HealthFault;
use crate::redundancy::record::Record;
use crate::redundancy::selection::SelectionReason;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::Rung;

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<T: Real> {
    /// Microseconds of the common clock.
    pub time: u64,
    /// The unit it concerns, 0 the primary.
    pub unit: usize,
    /// What happened.
    pub kind: EventKind<T>,
}

/// How a deviation was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// Magnitude of specific force against gravity, or of angular rate against zero.
    Norm,
    /// Difference to a valid primary.
    Vector,
}

/// Why pairs, or the wait for them, were given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abandoned {
    /// Nothing moved in time.
    NoMotion,
    /// Too little moved in time.
    TimedOut,
    /// The primary was found to deviate.
    PrimaryInvalid,
    /// The primary failed.
    PrimaryUnhealthy,
    /// The secondary failed.
    SecondaryUnhealthy,
    /// The common clock jumped.
    TimeJumped,
    /// What was stored of the secondary was replaced from outside.
    RecordReplaced,
}

/// Why a stored record was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordRejection {
    /// No secondary has its identity, or the secondary has no such sensor.
    OfAnotherUnit,
    /// Not all of it are numbers.
    NotFinite,
    /// It lies outside what the settings allow a calibration to be.
    Implausible,
}

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventKind<T: Real> {
    /// The platform came to rest.
    RestBegan,
    /// It moves again.
    RestEnded,
    /// A deviation at rest was compared with its threshold.
    Evaluated {
        /// Of this sensor.
        sensor: Sensor,
        /// Taken in this way.
        check: Check,
        /// m/s^2 or rad/s.
        deviation: T,
        /// As it was at the time.
        threshold: T,
    },
    /// A sensor deviates but is not calibrated.
    Withheld {
        /// This sensor.
        sensor: Sensor,
        /// Why.
        why: Withheld,
    },
    /// Calibration mode: waiting for motion.
    Triggered {
        /// Which sensors are to be calibrated, accelerometer first.
        sensors: [bool; 2],
    },
    /// Pairs are collected from now on.
    MotionBegan,
    /// A fit was made of the pairs.
    Fitted {
        /// Of this sensor.
        sensor: Sensor,
        /// How far up the ladder.
        rung: Rung,
        /// Directions along which the matrix was fitted.
        directions: u8,
        /// Pairs fitted to and held out together.
        pairs: u32,
        /// Root mean square residual on held-out pairs.
        residual: T,
        /// The same with what is stored.
        residual_before: T,
    },
    /// It replaces what was stored.
    Adopted {
        /// To be stored by whoever keeps records.
        record: Record<T>,
    },
    /// It does not.
    Refused {
        /// Of this sensor.
        sensor: Sensor,
        /// Why.
        why: AdoptionRefusal<T>,
    },
    /// Calibration mode ended without a fit.
    Abandoned {
        /// Why.
        why: Abandoned,
    },
    /// A unit failed.
    Unhealthy {
        /// In this way.
        fault: HealthFault<T>,
    },
    /// A unit is in health again.
    Healthy,
    /// The source of the output is this unit now.
    Selected {
        /// Why.
        reason: SelectionReason,
    },
    /// There is no source any more: no unit is fit.
    NoneSelected,
    /// A stored record was taken.
    Restored {
        /// Of this sensor.
        sensor: Sensor,
        /// Its count.
        sequence: u32,
    },
    /// A stored record was not taken.
    RecordRejected {
        /// Of this sensor.
        sensor: Sensor,
        /// Why.
        why: RecordRejection,
    },
    /// The common clock jumped; windows begin anew.
    TimeJumped {
        /// By this much, microseconds.
        by: i64,
    },
}
