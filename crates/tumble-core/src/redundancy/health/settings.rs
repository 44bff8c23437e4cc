//! What condemns a unit.

use crate::real::{Real, real};
use crate::redundancy::contradiction::{Contradiction, Objection, require, require_positive, require_some};
use crate::redundancy::health::leaky::LONGEST;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::Both;

/// Limits of what a healthy unit does; lengths of time in microseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HealthSettings<T: Real> {
    /// Longest time without a sample.
    pub late: u64,
    /// Longest time over which all axes of a sensor may repeat their readings, and 16 readings at least; three times that
    /// for a sensor of one axis.
    pub frozen: u64,
    /// Longest time that may be spent at the end of the range or with readings that are not numbers; a quarter of the
    /// good time after that is counted against it.
    pub saturated: u64,
    /// A reading that leaves by more, m/s^2 or rad/s, and comes back at once, is a spike.
    pub spike: Both<T>,
    /// Largest distance from the median of the units, m/s^2 and rad/s.
    pub family: Both<T>,
    /// How much longer than within it a unit may be beyond that distance, or noisier than is allowed.
    pub family_time: u64,
    /// Largest ratio of the scatter of a unit to the median of the units.
    pub noise_ratio: T,
    /// Largest deviation at rest from gravity, m/s^2, and from zero, rad/s.
    pub rest: Both<T>,
    /// How long nothing may have been wrong until a unit is healthy again.
    pub recovery: u64,
}

impl<T: Real> Default for HealthSettings<T> {
    fn default() -> Self {
        let both = |specific_force, angular_rate| Both {
            specific_force: real(specific_force),
            angular_rate: real(angular_rate),
        };
        Self {
            late: 100_000,
            frozen: 100_000,
            saturated: 50_000,
            spike: both(40.0, 10.0),
            family: both(1.0, 0.1),
            family_time: 500_000,
            noise_ratio: real(5.0),
            rest: both(1.5, 0.2),
            recovery: 500_000,
        }
    }
}

/// Share of the distance allowed from the median that a scatter may have whatever that of the others is: units of
/// different grades at rest differ in noise by more than any ratio worth having, and none of it matters.
const QUIET: f64 = 0.05;

impl<T: Real> HealthSettings<T> {
    /// Looks for numbers that cannot be meant.
    ///
    /// # Errors
    /// The first [`Contradiction`] there is.
    pub fn check(&self) -> Result<(), Contradiction> {
        require_some(&[
            ("late", self.late),
            ("frozen", self.frozen),
            ("saturated", self.saturated),
            ("family_time", self.family_time),
        ])?;
        require_positive(&[
            ("spike_specific_force", self.spike.specific_force),
            ("spike_angular_rate", self.spike.angular_rate),
            ("family_specific_force", self.family.specific_force),
            ("family_angular_rate", self.family.angular_rate),
            ("noise_ratio", self.noise_ratio),
            ("rest_specific_force", self.rest.specific_force),
            ("rest_angular_rate", self.rest.angular_rate),
        ])?;
        for (setting, time, most) in [
            ("frozen", self.frozen, LONGEST / 3),
            ("saturated", self.saturated, LONGEST),
            ("family_time", self.family_time, LONGEST),
        ] {
            require(time <= most, setting, Objection::TooLong(most))?;
        }
        require(
            self.noise_ratio > T::one(),
            "noise_ratio",
            Objection::AlwaysExceeded,
        )
    }

    /// What a scatter is compared with.
    pub(super) fn usual_scatter(&self, sensor: Sensor, median: T) -> T {
        median.max(self.family.of(sensor) * real(QUIET))
    }
}
