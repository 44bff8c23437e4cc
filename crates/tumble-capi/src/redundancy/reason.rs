//! Why things happen in a redundant set.

use tumble_core::redundancy::aiding::AidingRejection;
use tumble_core::redundancy::fit::adoption::RefusalReason;
use tumble_core::redundancy::gate::Withheld;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::isolation::attribution::Ground;
use tumble_core::redundancy::monitor::event::{Abandoned, RecordRejection};
use tumble_core::redundancy::selection::SelectionReason;

/// Why it happened.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// No reason is given.
    None,
    /// Withheld, abandoned: the primary deviates itself.
    PrimaryInvalid,
    /// Withheld, abandoned: the primary is not in health.
    PrimaryUnhealthy,
    /// Withheld, abandoned: the secondary is not in health.
    SecondaryUnhealthy,
    /// Withheld, abandoned: units contradict each other, and nobody knows which is wrong.
    Disputed,
    /// Withheld: a calibration is under way already.
    AlreadyCalibrating,
    /// Abandoned: nothing moved in time.
    NoMotion,
    /// Abandoned: too little moved in time.
    TimedOut,
    /// Abandoned: the common clock jumped.
    TimeJumped,
    /// Abandoned: what was stored of the secondary was replaced from outside.
    RecordReplaced,
    /// Record rejected: no secondary has its identity, or the secondary has no such sensor.
    OfAnotherUnit,
    /// Record rejected, aiding measurement left out: not all of it are numbers. Unhealthy: nor are too many readings,
    /// the last on `channel`.
    NotFinite,
    /// Record rejected: it lies outside what the settings allow a calibration to be.
    Implausible,
    /// Refused: numbers failed.
    Unsolvable,
    /// Refused: fewer `pairs` than `limit`.
    TooFewPairs,
    /// Refused: the residual on held-out pairs is too large, m/s^2 or rad/s.
    ResidualTooLarge,
    /// Refused: the bias is too large, m/s^2 or rad/s.
    ImplausibleBias,
    /// Refused: a scale factor is too far from one.
    ImplausibleScale,
    /// Refused: axes are too far from where they are nominally, rad.
    ImplausibleMisalignment,
    /// Refused: the lever arm is too long, m.
    ImplausibleLeverArm,
    /// Refused: one of the two changed while pairs were collected, m/s^2 or rad/s.
    Drifting,
    /// Refused: at the rest before, the two related otherwise, m/s^2 or rad/s.
    DisagreesWithRest,
    /// Refused: the stored calibration explains the held-out pairs as well, or better, m/s^2 or rad/s.
    NotBetter,
    /// Aiding measurement left out: a sigma is not above zero, or no axis is measured.
    NoSigma,
    /// Aiding measurement left out: a score below zero.
    NegativeScore,
    /// Aiding measurement left out: there is no unit of that number.
    NoSuchUnit,
    /// Aiding measurement left out: its time is yet to come.
    Early,
    /// Unhealthy: no sample came for `value` s. Aiding measurement left out: its time is not kept any more.
    Late,
    /// Unhealthy: all axes of a sensor repeated their readings for `value` s.
    Frozen,
    /// Unhealthy: `channel` repeats its reading `value`, m/s^2 or rad/s, while the others of its sensor move.
    Stuck,
    /// Unhealthy: `channel` is at the end of its range too often; `value`: its last reading, m/s^2 or rad/s.
    Saturated,
    /// Unhealthy: readings of `channel` leave and come back too often, the last by `value`, m/s^2 or rad/s.
    Spikes,
    /// Unhealthy: `units` agree with each other without it; a sensor is `value` from one of them, m/s^2 or rad/s.
    OutOfFamily,
    /// Unhealthy: a sensor scatters by `value`, m/s^2 or rad/s, more than the others make one expect.
    Noisy,
    /// Unhealthy: of two units that disagree, a sensor of this one stepped from one sample to the next; `value`: by this share of
    /// what they are apart.
    OwnStep,
    /// Unhealthy: two units disagree, and the readings of this one at rest differ from those in health by `value`,
    /// m/s^2 or rad/s.
    Rest,
    /// Unhealthy: of two units that disagree, gravity as its own gyroscope carries it is not where its accelerometer finds it;
    /// `value`: logarithm of the ratio of likelihoods.
    OwnGyroscope,
    /// Unhealthy: an aiding measurement contradicts it; `value`: logarithm of the ratio of likelihoods.
    Aiding,
    /// Unhealthy: it is `value` from a valid primary at rest, more than any error that calibration can find, m/s^2 or rad/s.
    Refuted,
    /// Unhealthy: at rest a sensor deviates from physics by `value`, m/s^2 or rad/s.
    ImplausibleAtRest,
    /// Unhealthy: its clock left that of the other units.
    ClockJumped,
    /// Selected: there was no source, and the primary is fit.
    Start,
    /// Selected: the primary failed.
    PrimaryFailed,
    /// Selected: a secondary that was the source failed.
    SourceFailed,
    /// Selected: the primary has been healthy for long enough.
    PrimaryProven,
    /// Selected: the primary was asked for.
    Command,
    /// None selected: the source failed, and nobody else is fit.
    NoneFit,
    /// Withheld: nobody asked, and the settings have it calibrated on command only.
    OnCommandOnly,
    /// Refused: other secondaries are from the primary as this one is, by `value`, m/s^2 or rad/s; it is the primary that changed.
    SharedBySiblings,
    /// Refused: with the calibrations before, it would follow the primary by `value`, m/s^2 or rad/s, farther than anything
    /// supports.
    BeyondSupport,
    /// Unhealthy: it gives each reading twice, and did not do so before.
    Duplicated,
    /// Unhealthy: its readings are those of another unit, in `units`.
    Copy,
    /// Unhealthy: by `value` s its samples come later, or earlier, than they did beside those of the others.
    Clock,
    /// Unhealthy: `value` of its time lacks samples, a share of 1.
    Lossy,
}

/// The twin of a core's reason, which has a variant of the same name.
macro_rules! twin {
    ($name:ident, $core:ident: $($variant:ident)+) => {
        /// Converts the core's type.
        pub fn $name(why: $core) -> Self {
            match why {
                $($core::$variant => Self::$variant),+
            }
        }
    };
}

#[rustfmt::skip]
impl Reason {
    /// Converts the core's type.
    pub fn of_ground(ground: Ground) -> Self {
        match ground {
            Ground::Step => Self::OwnStep,
            Ground::Rest => Self::Rest,
            Ground::Gravity => Self::OwnGyroscope,
            Ground::Aiding => Self::Aiding,
        }
    }

    /// Converts the core's type.
    pub fn of_fault(fault: &HealthFault<f32>) -> Self {
        match *fault {
            HealthFault::Late { .. } => Self::Late,
            HealthFault::Frozen { .. } => Self::Frozen,
            HealthFault::Stuck { .. } => Self::Stuck,
            HealthFault::Saturated { .. } => Self::Saturated,
            HealthFault::NotFinite { .. } => Self::NotFinite,
            HealthFault::Spikes { .. } => Self::Spikes,
            HealthFault::OutOfFamily { .. } => Self::OutOfFamily,
            HealthFault::Noisy { .. } => Self::Noisy,
            HealthFault::Isolated { ground, .. } => Self::of_ground(ground),
            HealthFault::Refuted { .. } => Self::Refuted,
            HealthFault::ImplausibleAtRest { .. } => Self::ImplausibleAtRest,
            HealthFault::ClockJumped => Self::ClockJumped,
            HealthFault::Duplicated => Self::Duplicated,
            HealthFault::Copy { .. } => Self::Copy,
            HealthFault::Clock { .. } => Self::Clock,
            HealthFault::Lossy { .. } => Self::Lossy,
        }
    }

    twin!(of_withheld, Withheld: PrimaryInvalid PrimaryUnhealthy SecondaryUnhealthy Disputed
        AlreadyCalibrating OnCommandOnly);
    twin!(of_abandoned, Abandoned: NoMotion TimedOut PrimaryInvalid PrimaryUnhealthy SecondaryUnhealthy Disputed
        TimeJumped RecordReplaced);
    twin!(of_left_out, AidingRejection: NotFinite NoSigma NegativeScore NoSuchUnit Late Early);
    twin!(of_rejected, RecordRejection: OfAnotherUnit NotFinite Implausible);
    twin!(of_selection, SelectionReason: Start PrimaryFailed SourceFailed PrimaryProven Command NoneFit);
    twin!(of_refusal, RefusalReason: Unsolvable TooFewPairs ResidualTooLarge ImplausibleBias ImplausibleScale
        ImplausibleMisalignment ImplausibleLeverArm Drifting DisagreesWithRest NotBetter
        SharedBySiblings BeyondSupport);
}
