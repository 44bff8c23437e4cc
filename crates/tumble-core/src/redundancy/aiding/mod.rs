//! An aiding measurement: what something else on board says of the motion of the set, and what that says of its units.
//!
//! Two units that disagree may leave open which is wrong. A satellite receiver, wheels, a barometer or the innovations
//! of an estimator know nothing of either, and settle it (docs/theory/judgement.md, section 12).

mod errors;
mod evidence;
mod navigation;
mod track;

pub(crate) use evidence::{AidingEvidence, Surroundings, Trust};

use nalgebra::Vector3;

use crate::real::Real;

/// What something else on board says of the motion of the set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aiding<T: Real> {
    /// Velocity of the primary's place in a level frame whose heading does not change and need not be known, m/s: x and y
    /// horizontal, z up. The sigma of an axis that is not measured is infinite, as of x and y of a climb rate.
    Velocity {
        /// m/s.
        value: Vector3<T>,
        /// Standard deviation of each axis, m/s.
        sigma: Vector3<T>,
    },
    /// Velocity of the primary's place in the primary's axes, as of wheels, m/s; sigmas as of a velocity.
    BodyVelocity {
        /// m/s.
        value: Vector3<T>,
        /// Standard deviation of each axis, m/s.
        sigma: Vector3<T>,
    },
    /// Heading of the primary, as of a magnetometer or of two antennas: the angle about the vertical of its x axis, counter-clockwise
    /// seen from above, from any direction that stays.
    Heading {
        /// rad.
        value: T,
        /// Standard deviation, rad.
        sigma: T,
    },
    /// How badly an estimator that runs on one unit fits its other sensors.
    Score {
        /// Number of the unit.
        unit: usize,
        /// Innovation squared over its variance, a degree of freedom: 1 in health.
        value: T,
    },
}

crate::vocabulary! {
    /// What an aiding measurement speaks of.
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
    /// Why what an aiding measurement said was left out.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum AidingRejection {
        /// Not all that it measures are numbers.
        NotFinite = "not finite",
        /// A sigma is not above zero, or no axis is measured.
        NoSigma = "no sigma",
        /// A score below zero.
        NegativeScore = "negative score",
        /// There is no unit of that number.
        NoSuchUnit = "no such unit",
        /// It is of a time that is not kept any more.
        Late = "late",
        /// It is of a time that has yet to come.
        Early = "early",
    }
}

#[cfg(test)]
mod tests;

impl<T: Real> Aiding<T> {
    /// What one of a kind says: of a velocity `value` and `sigma`, of a heading the first of both, of a score of `unit` the first of
    /// `value`.
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

    /// Whether it can be listened to, of a set of so many units.
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

/// Whether values and their sigmas, infinite where one is not measured, can be used.
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
