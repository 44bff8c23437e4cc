//! Everything that happened, and why, with figures.

use crate::real::Real;
use crate::redundancy::aiding::AidingRejection;
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

crate::vocabulary! {
    /// How a deviation was taken.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Check {
        /// Magnitude of specific force against gravity, or of angular rate against zero.
        Norm = "norm",
        /// Difference to a valid primary.
        Vector = "vector",
    }
}

crate::vocabulary! {
    /// Why pairs, or the wait for them, were given up.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Abandoned {
        /// Nothing moved in time.
        NoMotion = "no motion",
        /// Too little moved in time.
        TimedOut = "timed out",
        /// The primary was found to deviate.
        PrimaryInvalid = "primary invalid",
        /// The primary failed.
        PrimaryUnhealthy = "primary unhealthy",
        /// The secondary failed.
        SecondaryUnhealthy = "secondary unhealthy",
        /// The primary contradicts another unit, and nobody knows yet which is wrong.
        Disputed = "disputed",
        /// The common clock jumped.
        TimeJumped = "time jumped",
        /// What was stored of the secondary was replaced from outside.
        RecordReplaced = "record replaced",
    }
}

crate::vocabulary! {
    /// Why a stored record was not taken.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RecordRejection {
        /// No secondary has its identity, or the secondary has no such sensor.
        OfAnotherUnit = "of another unit",
        /// Not all of it are numbers.
        NotFinite = "not finite",
        /// It lies outside what the settings allow a calibration to be.
        Implausible = "implausible",
    }
}

crate::vocabulary! {
    /// What happened.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub enum EventKind<T: Real> {
        /// The platform came to rest.
        RestBegan = "rest began",
        /// It moves again.
        RestEnded = "rest ended",
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
        } = "evaluated",
        /// A sensor deviates but is not calibrated.
        Withheld {
            /// This sensor.
            sensor: Sensor,
            /// Why.
            why: Withheld,
        } = "withheld",
        /// Calibration mode: waiting for motion.
        Triggered {
            /// Which sensors are to be calibrated, accelerometer first.
            sensors: [bool; 2],
        } = "triggered",
        /// Pairs are collected from now on.
        MotionBegan = "motion began",
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
        } = "fitted",
        /// It replaces what was stored.
        Adopted {
            /// To be stored by whoever keeps records.
            record: Record<T>,
        } = "adopted",
        /// It does not.
        Refused {
            /// Of this sensor.
            sensor: Sensor,
            /// Why.
            why: AdoptionRefusal<T>,
        } = "refused",
        /// Calibration mode ended without a fit.
        Abandoned {
            /// Why.
            why: Abandoned,
        } = "abandoned",
        /// A unit failed.
        Unhealthy {
            /// In this way.
            fault: HealthFault<T>,
        } = "unhealthy",
        /// A unit is in health again.
        Healthy = "healthy",
        /// It contradicts another, and nobody knows yet which is wrong.
        Disagree {
            /// In this sensor.
            sensor: Sensor,
            /// The other unit.
            other: usize,
            /// How far apart they are, m/s^2 or rad/s.
            apart: T,
            /// How far they may be.
            limit: T,
            /// Time over which it shows, s.
            scale: T,
        } = "disagree",
        /// It agrees with that unit again.
        Agree {
            /// In this sensor.
            sensor: Sensor,
            /// The other unit.
            other: usize,
        } = "agree",
        /// What an aiding measurement said was left out; told once for each reason.
        AidingLeftOut {
            /// Why.
            why: AidingRejection,
        } = "aiding left out",
        /// An aiding measurement contradicts all units: it decides nothing until it fits again.
        AidingDistrusted {
            /// Mean square misfit with the unit that fits best, in sigmas.
            misfit: T,
            /// What it had to exceed.
            limit: T,
        } = "aiding distrusted",
        /// It fits again.
        AidingTrusted = "aiding trusted",
        /// The source of the output is this unit now.
        Selected {
            /// Why.
            reason: SelectionReason,
        } = "selected",
        /// There is no source any more: no unit is fit.
        NoneSelected = "selected",
        /// A stored record was taken.
        Restored {
            /// Of this sensor.
            sensor: Sensor,
            /// Its count.
            sequence: u32,
        } = "restored",
        /// A stored record was not taken.
        RecordRejected {
            /// Of this sensor.
            sensor: Sensor,
            /// Why.
            why: RecordRejection,
        } = "record rejected",
        /// The common clock jumped; windows begin anew.
        TimeJumped {
            /// By this much, microseconds.
            by: i64,
        } = "time jumped",
    }
}
