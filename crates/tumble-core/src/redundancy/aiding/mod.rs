//! Aiding measurements: measurements of the motion of the set by other equipment on board.
//!
//! Two units that disagree may leave open which one is faulty. A satellite receiver, wheels, a barometer or the
//! innovations of an estimator are independent of both and decide (docs/theory/set.md, section 9).

mod course;
mod errors;
mod evidence;
mod navigation;
mod track;

pub(crate) use evidence::{AidedReading, AidingEvidence, AidingWindow, Trust};

use nalgebra::Vector3;

use crate::real::Real;

/// Measurement of the motion of the set by other equipment on board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aiding<T: Real> {
    /// Velocity of the place of the primary in a level frame of constant, possibly unknown heading, m/s: x and
    /// y horizontal, z up. An axis that is not measured has an infinite sigma; a climb rate has one in x and y.
    Velocity {
        /// m/s.
        value: Vector3<T>,
        /// Standard deviation of each axis, m/s.
        sigma: Vector3<T>,
    },
    /// Velocity of the place of the primary in the axes of the primary, for example of wheels, m/s; sigmas like
    /// those of a velocity.
    BodyVelocity {
        /// m/s.
        value: Vector3<T>,
        /// Standard deviation of each axis, m/s.
        sigma: Vector3<T>,
    },
    /// Heading of the primary, for example of a magnetometer or of two antennas: the angle about the vertical
    /// of its x axis, counter-clockwise seen from above, from any constant direction.
    Heading {
        /// rad.
        value: T,
        /// Standard deviation, rad.
        sigma: T,
    },
    /// Consistency of an estimator that runs on one unit with its other sensors.
    Score {
        /// Number of the unit.
        unit: usize,
        /// Normalised innovation squared per degree of freedom: 1 in health.
        value: T,
    },
}

crate::vocabulary! {
    /// Kind of an aiding measurement.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum AidingKind {
        /// `Aiding::Velocity`.
        Velocity = "velocity",
        /// `Aiding::BodyVelocity`.
        BodyVelocity = "body velocity",
        /// `Aiding::Heading`.
        Heading = "heading",
        /// `Aiding::Score`.
        Score = "score",
    }
}

crate::vocabulary! {
    /// Reason for rejecting an aiding measurement.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum AidingRejection {
        /// A value or a sigma is not a number.
        NotFinite = "not finite",
        /// A sigma is not positive, or no axis is measured.
        NoSigma = "no sigma",
        /// The score is negative.
        NegativeScore = "negative score",
        /// The unit is unknown.
        NoSuchUnit = "no such unit",
        /// The measurement is older than the stored windows.
        Late = "late",
        /// The time of the measurement is in the future.
        Early = "early",
    }
}

#[cfg(test)]
mod tests;

impl<T: Real> Aiding<T> {
    /// Creates an aiding measurement of a kind: a velocity takes `value` and `sigma`, a heading the first
    /// elements of both, a score `unit` and the first element of `value`.
    pub fn of_kind(kind: AidingKind, unit: usize, value: Vector3<T>, sigma: Vector3<T>) -> Self {
        match kind {
            AidingKind::Velocity => Self::Velocity { value, sigma },
            AidingKind::BodyVelocity => Self::BodyVelocity { value, sigma },
            AidingKind::Heading => Self::Heading {
                value: value.x,
                sigma: sigma.x,
            },
            AidingKind::Score => Self::Score { unit, value: value.x },
        }
    }

    /// Checks that a set of so many units can use the measurement.
    pub(crate) fn check(&self, units: usize) -> Result<(), AidingRejection> {
        match self {
            Self::Velocity { value, sigma } | Self::BodyVelocity { value, sigma } => {
                check_measured(value.as_slice(), sigma.as_slice())
            }
            Self::Heading { value, sigma } => {
                check_measured(core::slice::from_ref(value), core::slice::from_ref(sigma))
            }
            Self::Score { unit, .. } if *unit >= units => Err(AidingRejection::NoSuchUnit),
            Self::Score { value, .. } if !value.is_finite() => Err(AidingRejection::NotFinite),
            Self::Score { value, .. } if *value < T::zero() => Err(AidingRejection::NegativeScore),
            Self::Score { .. } => Ok(()),
        }
    }
}

/// Checks values and their sigmas, which are infinite for values that are not measured.
fn check_measured<T: Real>(values: &[T], sigmas: &[T]) -> Result<(), AidingRejection> {
    let axes = || values.iter().zip(sigmas);
    let not_finite = |(value, sigma): (&T, &T)| {
        let no_number = sigma.partial_cmp(&T::zero()).is_none();
        no_number || (sigma.is_finite() && !value.is_finite())
    };
    if axes().any(not_finite) {
        Err(AidingRejection::NotFinite)
    } else if axes().any(|(_, sigma)| *sigma <= T::zero()) || !axes().any(|(_, sigma)| sigma.is_finite()) {
        Err(AidingRejection::NoSigma)
    } else {
        Ok(())
    }
}
