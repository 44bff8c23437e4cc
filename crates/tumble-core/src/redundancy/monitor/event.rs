//! Events, their reasons and figures.

use crate::real::Real;
use crate::redundancy::aiding::AidingRejection;
use crate::redundancy::fit::adoption::AdoptionRefusal;
use crate::redundancy::gate::Withheld;
use crate::redundancy::health::HealthFault;
use crate::redundancy::record::Record;
use crate::redundancy::selection::SelectionReason;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::FitModel;

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<T: Real> {
    /// Microseconds of the common clock.
    pub time: u64,
    /// Unit concerned, 0 for the primary.
    pub unit: usize,
    /// Kind of the event, with its figures.
    pub kind: EventKind<T>,
}

crate::vocabulary! {
    /// Kind of a check at rest.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Check {
        /// Magnitude of specific force compared with gravity, or of angular rate with zero.
        Norm = "norm",
        /// Difference from a valid primary.
        Vector = "vector",
    }
}

crate::vocabulary! {
    /// Reason for abandoning pairs, or the wait for them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Abandoned {
        /// The platform did not move in time.
        NoMotion = "no motion",
        /// The platform moved too little in time.
        TimedOut = "timed out",
        /// The primary deviated.
        PrimaryInvalid = "primary invalid",
        /// The primary failed.
        PrimaryUnhealthy = "primary unhealthy",
        /// The secondary failed.
        SecondaryUnhealthy = "secondary unhealthy",
        /// The primary is in an unresolved dispute with another unit.
        Disputed = "disputed",
        /// The common clock jumped.
        TimeJumped = "time jumped",
        /// The stored record of the secondary was replaced from outside.
        RecordReplaced = "record replaced",
    }
}

crate::vocabulary! {
    /// Reason for rejecting a stored record.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RecordRejection {
        /// No secondary has its identity, or the secondary has no such sensor.
        OfAnotherUnit = "of another unit",
        /// A value is not a number.
        NotFinite = "not finite",
        /// The error exceeds the limits of the settings for a calibration.
        Implausible = "implausible",
    }
}

crate::vocabulary! {
    /// Kind of an event.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum EventKind<T: Real> {
        /// The platform came to rest.
        RestBegan = "rest began",
        /// The platform moves again.
        RestEnded = "rest ended",
        /// A deviation at rest was compared with its threshold.
        Evaluated {
            /// Sensor concerned.
            sensor: Sensor,
            /// Kind of the check.
            check: Check,
            /// m/s^2 or rad/s.
            deviation: T,
            /// Threshold at the time.
            threshold: T,
        } = "evaluated",
        /// A sensor deviates but is not calibrated.
        Withheld {
            /// Sensor concerned.
            sensor: Sensor,
            /// Reason.
            why: Withheld,
        } = "withheld",
        /// A calibration starts and waits for motion.
        Triggered {
            /// Sensors that are to be calibrated, accelerometer first.
            sensors: [bool; 2],
        } = "triggered",
        /// Pairs are collected from now on.
        MotionBegan = "motion began",
        /// A fit was made of the pairs.
        Fitted {
            /// Sensor concerned.
            sensor: Sensor,
            /// Model that the fit estimated.
            fit_model: FitModel,
            /// Directions along which the matrix was fitted.
            directions: u8,
            /// Pairs, both fitted and held out.
            pairs: u32,
            /// Root mean square residual on held-out pairs.
            residual: T,
            /// Root mean square residual on held-out pairs with the stored calibration.
            residual_before: T,
        } = "fitted",
        /// The fit replaces the stored calibration.
        Adopted {
            /// Record for the caller to store.
            record: Record<T>,
        } = "adopted",
        /// The fit does not replace the stored calibration.
        Refused {
            /// Sensor concerned.
            sensor: Sensor,
            /// Reason.
            why: AdoptionRefusal<T>,
        } = "refused",
        /// A calibration ended without a fit.
        Abandoned {
            /// Reason.
            why: Abandoned,
        } = "abandoned",
        /// A unit failed.
        Unhealthy {
            /// Fault of the unit.
            fault: HealthFault<T>,
        } = "unhealthy",
        /// A unit is healthy again.
        Healthy = "healthy",
        /// The unit contradicts another, and the faulty one is not isolated yet.
        Disagree {
            /// Sensor concerned.
            sensor: Sensor,
            /// The other unit.
            other: usize,
            /// Difference of the two, m/s^2 or rad/s.
            apart: T,
            /// Threshold of the difference.
            limit: T,
            /// Time scale on which the difference shows, s.
            scale: T,
        } = "disagree",
        /// The unit agrees with the other again.
        Agree {
            /// Sensor concerned.
            sensor: Sensor,
            /// The other unit.
            other: usize,
        } = "agree",
        /// An aiding measurement was rejected; reported once for each reason.
        AidingLeftOut {
            /// Reason.
            why: AidingRejection,
        } = "aiding left out",
        /// An aiding measurement contradicts all units: it decides nothing until it fits again.
        AidingDistrusted {
            /// Mean square misfit with the unit that fits best, sigmas squared.
            misfit: T,
            /// Limit of the misfit.
            limit: T,
        } = "aiding distrusted",
        /// Aiding measurements fit again.
        AidingTrusted = "aiding trusted",
        /// The unit became the source of the output.
        Selected {
            /// Reason.
            reason: SelectionReason,
        } = "selected",
        /// No unit is usable as source.
        NoneSelected = "selected",
        /// A stored record was restored.
        Restored {
            /// Sensor concerned.
            sensor: Sensor,
            /// Number of the calibration.
            sequence: u32,
        } = "restored",
        /// A stored record was rejected.
        RecordRejected {
            /// Sensor concerned.
            sensor: Sensor,
            /// Reason.
            why: RecordRejection,
        } = "record rejected",
        /// The common clock jumped; windows restart.
        TimeJumped {
            /// Jump, microseconds.
            by: i64,
        } = "time jumped",
        /// All units are at the ends of their ranges: the platform, none of them, is the cause.
        AllSaturated {
            /// Sensor concerned.
            sensor: Sensor,
        } = "all saturated",
    }
}
