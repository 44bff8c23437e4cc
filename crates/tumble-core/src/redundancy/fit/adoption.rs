//! Decision on replacing the stored calibration by a new one.

use nalgebra::Vector3;

use crate::products::{Length, columns, identity, zeros};
use crate::real::{Real, real};
use crate::redundancy::fit::residual::{Layout, PairMoments, RowResidual, covariance_of};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::{Adoption, AdoptionSettings, RedundancySettings};

crate::vocabulary! {
    /// Reason for refusing a new calibration; the stored one stays.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RefusalReason {
        /// The system of equations has no solution.
        Unsolvable = "unsolvable",
        /// There are too few pairs.
        TooFewPairs = "too few pairs",
        /// The residual of held-out pairs is larger than that of any healthy pair of sensors, m/s^2 or rad/s.
        ResidualTooLarge = "residual too large",
        /// The bias exceeds its limit, m/s^2 or rad/s.
        ImplausibleBias = "implausible bias",
        /// The deviation of a scale factor from one exceeds its limit.
        ImplausibleScale = "implausible scale",
        /// The angle of an axis to its nominal direction exceeds its limit, rad.
        ImplausibleMisalignment = "implausible misalignment",
        /// The lever arm exceeds its limit, m.
        ImplausibleLeverArm = "implausible lever arm",
        /// One of the two units changed while pairs were collected, m/s^2 or rad/s.
        Drifting = "drifting",
        /// The fit contradicts the readings at the rest before, m/s^2 or rad/s.
        DisagreesWithRest = "disagrees with rest",
        /// The stored calibration explains the held-out pairs as well, or better, m/s^2 or rad/s.
        NotBetter = "not better",
        /// Other secondaries differ from the primary in the same way, so it is the primary that changed, m/s^2
        /// or rad/s.
        SharedBySiblings = "shared by siblings",
        /// Together with earlier calibrations, the correction would follow the primary too far without proof,
        /// m/s^2 or rad/s.
        BeyondSupport = "beyond support",
    }
}

/// Refusal with its figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AdoptionRefusal<T: Real> {
    /// The system of equations has no solution.
    Unsolvable,
    /// There are too few pairs.
    TooFewPairs {
        /// Number of pairs.
        pairs: u32,
        /// Least number of pairs.
        needed: u32,
    },
    /// A figure exceeds its limit.
    Exceeds(RefusalReason, Excess<T>),
}

impl<T: Real> AdoptionRefusal<T> {
    /// Reason of the refusal.
    pub const fn reason(&self) -> RefusalReason {
        match self {
            Self::Unsolvable => RefusalReason::Unsolvable,
            Self::TooFewPairs { .. } => RefusalReason::TooFewPairs,
            Self::Exceeds(reason, _) => *reason,
        }
    }
}

/// Figure that exceeds its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess<T: Real> {
    /// Value of the figure.
    pub value: T,
    /// Limit of the figure.
    pub limit: T,
}

impl<T: Real> Excess<T> {
    /// Refuses a value above its limit, or NaN.
    fn refuse(value: T, limit: T, reason: RefusalReason) -> Result<(), AdoptionRefusal<T>> {
        if value <= limit {
            return Ok(());
        }
        Err(AdoptionRefusal::Exceeds(reason, Self { value, limit }))
    }
}

/// Readings of both units at the rest before, in the axes of the secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestReadings<T: Real> {
    /// Reading of the primary.
    pub first: Vector3<T>,
    /// Reading of the secondary.
    pub second: Vector3<T>,
}

/// Candidate for adoption.
pub struct FitCandidate<'a, T: Real> {
    /// Kind of sensor.
    pub sensor: Sensor,
    /// Axes of the sensor.
    pub axes: [bool; 3],
    /// Channels of the pairs.
    pub layout: Layout,
    /// Fit to all pairs alone, which the rest can test independently.
    pub motion: &'a RelativeError<T>,
    /// Fit to all pairs and rests, which would be stored.
    pub whole: &'a RelativeError<T>,
    /// Stored error.
    pub stored: &'a RelativeError<T>,
    /// Residuals, on the pairs of the other seconds, of a fit to every other second and to the rests.
    pub residuals: &'a Residuals<T>,
    /// All pairs.
    pub all: &'a dyn PairMoments<T>,
    /// The rest before.
    pub rest: &'a RestReadings<T>,
    /// Limits on following the primary.
    pub following: &'a Following<T>,
}

/// Correction by which a secondary would follow its primary, and its share that siblings confirm. Both are zero
/// for a first calibration, and for a secondary that was found faulty independently.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Following<T: Real> {
    /// Change of a mean reading by this calibration and earlier ones without proof that the primary was right,
    /// m/s^2 or rad/s, in the axes of the secondary.
    pub followed: Vector3<T>,
    /// Difference from the primary that siblings share with this secondary, m/s^2 or rad/s.
    pub shared: T,
}

impl<T: Real> Following<T> {
    /// Creates the limits of a secondary that may follow its pairs without bound.
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
    /// Residuals of a fit, and of the stored error, on pairs to which neither was fitted, over existing axes.
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

/// Axes of a sensor.
fn present(axes: [bool; 3]) -> impl Iterator<Item = usize> {
    (0..3).zip(axes).filter(|(_, present)| *present).map(|(i, _)| i)
}

impl<T: Real> FitCandidate<'_, T> {
    /// Decides on adoption.
    ///
    /// # Errors
    /// The first [`AdoptionRefusal`].
    #[inline(never)]
    pub fn decide(&self, settings: &RedundancySettings<T>) -> Result<(), AdoptionRefusal<T>> {
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

    /// Linear change of the residual over the collection, largest axis. A step halfway appears 1.5 times as
    /// large (docs/theory/redundancy.md, eq. 13).
    fn drift(&self) -> T {
        let time = self.layout.time;
        let spread = covariance_of(self.all, time, time).max(T::default_epsilon());
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
    /// Checks an error against the limits of plausibility.
    ///
    /// # Errors
    /// The first [`AdoptionRefusal`].
    pub fn allows(&self, sensor: Sensor, error: &RelativeError<T>) -> Result<(), AdoptionRefusal<T>> {
        // NaN counts as the largest.
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
