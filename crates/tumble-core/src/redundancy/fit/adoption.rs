//! Whether a new calibration may replace the stored one.

use nalgebra::Vector3;

use crate::products::{Length, columns, identity, zeros};
use crate::real::{Real, real};
use crate::redundancy::fit::residual::{Layout, PairMoments, RowResidual};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::{Adoption, AdoptionSettings, RedundancySettings};

crate::vocabulary! {
    /// Why a new calibration was refused; the stored one stays.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RefusalReason {
        /// Numbers failed.
        Unsolvable = "unsolvable",
        /// Fewer pairs than there have to be.
        TooFewPairs = "too few pairs",
        /// Pairs kept from the fit are farther from it than any sound pair of sensors, m/s^2 or rad/s.
        ResidualTooLarge = "residual too large",
        /// The bias is larger than is plausible, m/s^2 or rad/s.
        ImplausibleBias = "implausible bias",
        /// A scale factor is farther from one.
        ImplausibleScale = "implausible scale",
        /// Axes are farther from where they are nominally, rad.
        ImplausibleMisalignment = "implausible misalignment",
        /// The lever arm is longer, m.
        ImplausibleLeverArm = "implausible lever arm",
        /// One of the two changed while pairs were collected, m/s^2 or rad/s.
        Drifting = "drifting",
        /// At the rest before, the two related otherwise, m/s^2 or rad/s.
        DisagreesWithRest = "disagrees with rest",
        /// The stored one explains the pairs kept from the fit as well, or better, m/s^2 or rad/s.
        NotBetter = "not better",
        /// Other secondaries are from the primary as this one is: it is the primary that changed, m/s^2 or rad/s.
        SharedBySiblings = "shared by siblings",
        /// With the calibrations before, it would follow the primary farther than anything supports, m/s^2 or rad/s.
        BeyondSupport = "beyond support",
    }
}

/// A refusal with its figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AdoptionRefusal<T: Real> {
    /// Numbers failed.
    Unsolvable,
    /// Fewer pairs than there have to be.
    TooFewPairs {
        /// There were.
        pairs: u32,
        /// There have to be.
        needed: u32,
    },
    /// A figure exceeds its limit.
    Exceeds(RefusalReason, Excess<T>),
}

impl<T: Real> AdoptionRefusal<T> {
    /// Why.
    pub const fn reason(&self) -> RefusalReason {
        match self {
            Self::Unsolvable => RefusalReason::Unsolvable,
            Self::TooFewPairs { .. } => RefusalReason::TooFewPairs,
            Self::Exceeds(reason, _) => *reason,
        }
    }
}

/// A figure and what it may be at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess<T: Real> {
    /// It is.
    pub value: T,
    /// It may be.
    pub limit: T,
}

impl<T: Real> Excess<T> {
    /// Refuses what exceeds its limit, and what is not a number.
    fn refuse(value: T, limit: T, reason: RefusalReason) -> Result<(), AdoptionRefusal<T>> {
        if value <= limit {
            return Ok(());
        }
        Err(AdoptionRefusal::Exceeds(reason, Self { value, limit }))
    }
}

/// What both said at the rest before, in the axes of the secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestReadings<T: Real> {
    /// The primary.
    pub first: Vector3<T>,
    /// The secondary.
    pub second: Vector3<T>,
}

/// A calibration on trial.
pub struct FitCandidate<'a, T: Real> {
    /// Which sensor.
    pub sensor: Sensor,
    /// Axes the sensor has.
    pub axes: [bool; 3],
    /// Channels of the pairs.
    pub layout: Layout,
    /// Fitted to all pairs alone: what was fitted to a rest cannot be held against it.
    pub motion: &'a RelativeError<T>,
    /// Fitted to all pairs and rests: what would be stored.
    pub whole: &'a RelativeError<T>,
    /// What is stored.
    pub stored: &'a RelativeError<T>,
    /// How well a fit to the pairs of every other second, and to the rests, explains those of the other seconds.
    pub residuals: &'a Residuals<T>,
    /// All pairs.
    pub all: &'a dyn PairMoments<T>,
    /// The rest before.
    pub rest: &'a RestReadings<T>,
    /// What may speak against following the primary.
    pub following: &'a Following<T>,
}

/// How far a secondary would follow its primary, and what its siblings say of that. All is zero for a first calibration, and
/// for a secondary that was found wrong by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Following<T: Real> {
    /// What this calibration and those before make differ of a mean reading without proof that the primary was right, m/s^2
    /// or rad/s, in the axes of the secondary.
    pub followed: Vector3<T>,
    /// How far siblings are from the primary just as this one is, m/s^2 or rad/s.
    pub shared: T,
}

impl<T: Real> Following<T> {
    /// Of one that may go wherever its pairs say.
    pub fn free() -> Self {
        Self {
            followed: zeros(),
            shared: T::zero(),
        }
    }
}

/// Root mean square residual of a channel on held-out pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residuals<T: Real> {
    /// With the candidate.
    pub after: T,
    /// With the stored error.
    pub before: T,
}

impl<T: Real> Residuals<T> {
    /// How well a fit, and what is stored, explain pairs to which neither was fitted, on the axes that the sensor has.
    #[inline(never)]
    pub fn of(
        fit: &RelativeError<T>,
        stored: &RelativeError<T>,
        held_out: &dyn PairMoments<T>,
        layout: &Layout,
        axes: [bool; 3],
    ) -> Self {
        let root_mean_square = |error: &RelativeError<T>| {
            let (sum, number) = present(axes).fold((T::zero(), T::zero()), |(sum, number), i| {
                let square = RowResidual::new(error, stored, layout, i).mean_square(held_out);
                (sum + square, number + T::one())
            });
            (sum / number.max(T::one())).square_root()
        };
        Self {
            after: root_mean_square(fit),
            before: root_mean_square(stored),
        }
    }
}

/// Axes that a sensor has.
fn present(axes: [bool; 3]) -> impl Iterator<Item = usize> {
    (0..3).zip(axes).filter(|(_, present)| *present).map(|(i, _)| i)
}

impl<T: Real> FitCandidate<'_, T> {
    /// Judges it.
    ///
    /// # Errors
    /// The first [`AdoptionRefusal`].
    #[inline(never)]
    pub fn judge(&self, settings: &RedundancySettings<T>) -> Result<(), AdoptionRefusal<T>> {
        let (sensor, residuals) = (self.sensor, self.residuals);
        let tolerated = settings.health.tolerated.of(sensor);
        let settings = &settings.adoption;
        if settings.adoption == Adoption::Always {
            return Ok(());
        }
        Excess::refuse(
            residuals.after,
            settings.residual.of(sensor),
            RefusalReason::ResidualTooLarge,
        )?;
        settings.allows(sensor, self.whole)?;
        Excess::refuse(self.drift(), settings.drift.of(sensor), RefusalReason::Drifting)?;
        Excess::refuse(
            self.apart_at_rest(),
            settings.drift.of(sensor),
            RefusalReason::DisagreesWithRest,
        )?;
        let better = residuals.before * (T::one() - settings.improvement);
        Excess::refuse(residuals.after, better, RefusalReason::NotBetter)?;
        let Following { followed, shared } = self.following;
        Excess::refuse(*shared, tolerated, RefusalReason::SharedBySiblings)?;
        Excess::refuse(
            followed.length(),
            settings.followed.of(sensor),
            RefusalReason::BeyondSupport,
        )
    }

    /// Change of the residual over the collection, as a straight line has it, largest axis. A step halfway shows as
    /// one and a half times itself (docs/theory/redundancy.md, eq. 13).
    fn drift(&self) -> T {
        let time = self.layout.time;
        let spread = self.all.covariance_of(time, time).max(T::default_epsilon());
        let duration_over_spread = (spread * real(12.0)).square_root() / spread;
        present(self.axes).fold(T::zero(), |most, i| {
            let residual = RowResidual::new(self.motion, self.stored, &self.layout, i);
            most.max(residual.covariance_with(self.all, time).abs() * duration_over_spread) // eq. 13
        })
    }

    fn apart_at_rest(&self) -> T {
        let [apart] = (self.rest.second - self.motion.predict(&self.rest.first)).data.0;
        let axes = apart.iter().zip(self.axes).filter(|(_, present)| *present);
        axes.fold(T::zero(), |sum, (apart, _)| sum + *apart * *apart)
            .square_root()
    }
}

impl<T: Real> AdoptionSettings<T> {
    /// Whether an error lies within plausible bounds.
    ///
    /// # Errors
    /// The first [`AdoptionRefusal`].
    pub fn allows(&self, sensor: Sensor, error: &RelativeError<T>) -> Result<(), AdoptionRefusal<T>> {
        // The largest, and what is not a number above all.
        let larger = |most: T, value: T| if value <= most { most } else { value };
        let (mut scale, mut misalignment) = (T::zero(), T::zero());
        for (row, nominal) in columns(&error.matrix.transpose())
            .into_iter()
            .zip(columns(&identity()))
        {
            let norm = row.length();
            scale = larger(scale, (norm - T::one()).abs());
            // The chord to the nominal axis: the angle where it is small, two for an axis turned over.
            misalignment = larger(misalignment, (row / norm - nominal).length());
        }
        Excess::refuse(
            misalignment,
            self.largest_misalignment,
            RefusalReason::ImplausibleMisalignment,
        )?;
        Excess::refuse(scale, self.largest_scale_error, RefusalReason::ImplausibleScale)?;
        Excess::refuse(
            error.bias.length(),
            self.bias.of(sensor),
            RefusalReason::ImplausibleBias,
        )?;
        Excess::refuse(
            error.lever_arm.length(),
            self.largest_lever_arm,
            RefusalReason::ImplausibleLeverArm,
        )
    }
}
