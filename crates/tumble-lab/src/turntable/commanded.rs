//! Rates that a table was commanded, as truth of gyroscopes (docs/theory/turntable.md, eq. 39 to 42).
//!
//! The table reports the rate at which the units turned, the reference measures the axis. Specific force is a poorer
//! measure of it: a unit beside the axis is pulled outwards, and an axis off the vertical shows its own gravity.

use nalgebra::{Matrix3, SMatrix, Vector3};
use tumble_core::gravity::{EARTH_RATE, vertical_earth_rate};
use tumble_core::turntable::reference::earth_variance;
use tumble_core::turntable::truth::RateObservation;

use super::error::TurntableError;
use super::reference::{Reference, TableTruth};
use super::settings::TurntableSettings;
use crate::acquisition::plateaus::LARGEST_REFERENCE_BIAS;
use crate::acquisition::{Acquired, Plateau};

/// Rates that the table was commanded.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandedRates {
    /// Magnitudes, rad/s; the reference shows the sign.
    pub rates: Vec<f64>,
    /// 1-sigma of what all of them are wrong by alike, relative.
    pub accuracy: f64,
}

/// Largest deviation of the reference's rate from the commanded one, relative.
const SAME_RATE: f64 = 0.05;

/// Least cosine of the axis of the table with the vertical.
const VERTICAL: f64 = 0.98;

/// Share of the lowest commanded rate below which a table stands.
const STANDING: f64 = 0.5;

impl Reference {
    /// Takes the commanded rates for the truth of gyroscopes.
    ///
    /// # Errors
    /// [`TurntableError`] where the constant rates of the reference are not those that were commanded.
    pub fn with_commanded(
        mut self,
        unit: &Acquired,
        settings: &TurntableSettings,
        commanded: &CommandedRates,
    ) -> Result<Self, TurntableError> {
        if unit.parts.len() > 1 || unit.constant_rates().next().is_none() {
            return Err(TurntableError::NoConstantRates);
        }
        if unit.rests.is_empty() {
            self.assume_earth(settings.latitude);
        }
        let matched = unit.constant_rates().map(|plateau| {
            let rate = self.commanded_at(plateau, &commanded.rates)?;
            self.refuse_tilted(plateau, rate, settings.gravity)?;
            Ok(rate)
        });
        let first = unit
            .rests
            .first()
            .map(tumble_core::segmenter::Segment::specific_force);
        let table = TableTruth {
            by_rate: matched.collect::<Result<_, TurntableError>>()?,
            accuracy: commanded.accuracy,
            up: first.map_or_else(Vector3::z, |force| (force - self.sphere.bias).normalize()),
        };
        self.table = Some(table);
        Ok(self)
    }

    /// Without rests nothing shows the rotation of the Earth: only its vertical part counts, along z here.
    fn assume_earth(&mut self, latitude: Option<f64>) {
        match latitude {
            Some(latitude) => self.earth.earth_rate = Vector3::z() * vertical_earth_rate(latitude),
            None => self.earth.covariance[(5, 5)] = earth_variance::<f64>(),
        }
    }

    fn commanded_at(&self, plateau: &Plateau, rates: &[f64]) -> Result<f64, TurntableError> {
        let seen = (plateau.rate - self.earth.bias).norm();
        let apart = |rate: f64| (seen - rate).abs();
        let nearest = rates
            .iter()
            .copied()
            .min_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        let lowest = rates.iter().copied().fold(f64::INFINITY, f64::min);
        let bias = 3.0 * self.earth.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
        if seen < (STANDING * lowest).min(3.0_f64.sqrt() * LARGEST_REFERENCE_BIAS + EARTH_RATE) {
            return Ok(0.0);
        }
        nearest
            .filter(|rate| apart(*rate) <= SAME_RATE * rate + bias)
            .ok_or(TurntableError::NotCommanded {
                time: plateau.interval.start,
                rate: seen.to_degrees(),
            })
    }

    /// Along another axis the part of the Earth's rotation is not known.
    fn refuse_tilted(&self, plateau: &Plateau, rate: f64, gravity: f64) -> Result<(), TurntableError> {
        let axis = (plateau.rate - self.earth.bias).normalize();
        let vertical = self.vertical_share(&axis, &plateau.force, gravity).abs();
        if rate > 0.0 && vertical < VERTICAL {
            return Err(TurntableError::AxisNotVertical {
                time: plateau.interval.start,
                angle: vertical.acos().to_degrees(),
            });
        }
        Ok(())
    }

    /// Cosine of an axis with the vertical: what pulls outwards is at a right angle to the axis, and does not count.
    fn vertical_share(&self, axis: &Vector3<f64>, force: &Vector3<f64>, gravity: f64) -> f64 {
        (axis.dot(&(force - self.sphere.bias)) / gravity).clamp(-1.0, 1.0) // eq. 39
    }

    /// The truth of a constant rate with the commanded rate along the axis about which the reference turned, given the truth
    /// from the reference itself and its mean specific force, m/s^2.
    pub(super) fn as_commanded(
        &self,
        table: &TableTruth,
        rate: f64,
        seen: &RateObservation<f64>,
        plateau: &Plateau,
        gravity: f64,
    ) -> RateObservation<f64> {
        let truth = seen.regressor.fixed_rows::<3>(0).into_owned();
        let standing = rate == 0.0;
        let axis = if standing {
            (plateau.force - self.sphere.bias).normalize()
        } else {
            truth.normalize()
        };
        let along = axis * axis.transpose();
        let across = Matrix3::identity() - along;
        let share = self.vertical_share(&axis, &plateau.force, gravity);
        let earth = share * table.up.dot(&self.earth.earth_rate);
        let horizontal = 0.5 * EARTH_RATE * EARTH_RATE;
        let mut found = *seen;
        let mut sensitivity = SMatrix::<f64, 3, 6>::zeros();
        found
            .regressor
            .fixed_rows_mut::<3>(0)
            .copy_from(&(axis * (rate + earth))); // eq. 40
        if standing {
            found.truth_covariance = across * horizontal;
        } else {
            sensitivity.copy_from(&(across * seen.sensitivity));
            found.truth_covariance =
                across * seen.truth_covariance * across + along * (horizontal * (1.0 - share * share)); // eq. 41
        }
        let by_earth = axis * table.up.transpose() * share; // eq. 40
        sensitivity.fixed_columns_mut::<3>(3).copy_from(&by_earth);
        found.sensitivity = sensitivity;
        found
    }
}
