//! Checks of settings, alone and together. Bounds and orders come from the table of settings; this file has the
//! remaining checks.

use crate::real::{Real, SECOND, tabulated, whole_spans};
use crate::redundancy::leaky::LONGEST;
use crate::redundancy::sensor::{SLOW_OFFSET, Sensor};
use crate::redundancy::settings::thresholds::Threshold;
use crate::redundancy::settings::{Data, RedundancySettings};

crate::vocabulary! {
    /// Reason for rejecting a setting.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SettingError {
        /// The setting must be a number above zero.
        NotPositive = "not positive",
        /// The setting must be a share, from 0 up to below 1.
        NotAShare = "not a share",
        /// A threshold by ratio must be above one, others above zero: every reading would exceed it.
        AlwaysExceeded = "always exceeded",
        /// A ratio needs a last error, and the primary has none in compensated data.
        NoLastError = "no last error",
        /// The setting must be longer than the other.
        ShorterThan(&'static str) = "shorter than",
        /// The setting must be larger than the other.
        SmallerThan(&'static str) = "smaller than",
        /// Fewer windows fit into the other.
        MoreThanFit(&'static str) = "more than fit",
        /// The setting is longer than the largest time that is counted, microseconds.
        TooLong(u64) = "too long",
        /// A second must be a whole number of windows, because every other second is held out.
        NotAPartOfASecond = "not a part of a second",
    }
}

/// Setting that contradicts another, or itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidSetting {
    /// Name of the setting.
    pub setting: &'static str,
    /// Reason for rejecting the setting.
    pub error: SettingError,
}

impl<T: Real> RedundancySettings<T> {
    /// Checks for contradictions.
    ///
    /// # Errors
    /// The first [`InvalidSetting`].
    pub fn validate(&self) -> Result<(), InvalidSetting> {
        self.validate_bounds()?;
        self.validate_thresholds()?;
        self.validate_times()
    }

    fn validate_thresholds(&self) -> Result<(), InvalidSetting> {
        let thresholds = &self.evaluation.thresholds;
        let limits = [
            (
                "secondary_accelerometer_threshold",
                &thresholds.secondary.accelerometer,
            ),
            ("secondary_gyroscope_threshold", &thresholds.secondary.gyroscope),
            (
                "primary_accelerometer_threshold",
                &thresholds.primary.accelerometer,
            ),
            ("primary_gyroscope_threshold", &thresholds.primary.gyroscope),
        ];
        for (i, (setting, limit)) in limits.into_iter().enumerate() {
            require(limit.is_possible(), setting, SettingError::AlwaysExceeded)?;
            let refers = matches!(limit, Threshold::VariableByRatio(_));
            let primary = i >= 2 && self.evaluation.data == Data::Compensated;
            require(!(refers && primary), setting, SettingError::NoLastError)?;
        }
        for (sensor, bias, tolerated, setting) in [
            (
                Sensor::Accelerometer,
                "largest_specific_force_bias",
                "tolerated_specific_force",
                "secondary_accelerometer_threshold",
            ),
            (
                Sensor::Gyroscope,
                "largest_angular_rate_bias",
                "tolerated_angular_rate",
                "secondary_gyroscope_threshold",
            ),
        ] {
            let threshold = thresholds.secondary.of(sensor);
            let calibrates = self.may_be_exceeded(sensor, threshold);
            require(calibrates, bias, SettingError::SmallerThan(setting))?;
            // A secondary between the two limits would be disputed for ever, and never be calibrated.
            let most = self.health.tolerated.of(sensor) + tabulated(*sensor.of(&SLOW_OFFSET));
            let raw = self.evaluation.data == Data::Raw;
            let triggers = raw || threshold.least() <= most;
            require(triggers, tolerated, SettingError::SmallerThan(setting))?;
        }
        Ok(())
    }

    fn validate_times(&self) -> Result<(), InvalidSetting> {
        require(
            self.window > 0 && self.window <= SECOND && whole_spans(SECOND, self.window).1 == 0,
            "window",
            SettingError::NotAPartOfASecond,
        )?;
        let collection = &self.collection;
        let fits = u64::from(collection.fewest_pairs) <= self.windows(collection.collect);
        require(fits, "fewest_pairs", SettingError::MoreThanFit("collect"))?;
        for (setting, time, most) in [
            ("frozen", self.health.frozen, LONGEST / 3),
            ("saturated", self.health.saturated, LONGEST),
        ] {
            require(time <= most, setting, SettingError::TooLong(most))?;
        }
        Ok(())
    }
}

/// Returns an error unless a condition holds.
fn require(good: bool, setting: &'static str, error: SettingError) -> Result<(), InvalidSetting> {
    if good {
        Ok(())
    } else {
        Err(InvalidSetting { setting, error })
    }
}

/// Requires finite numbers above zero.
pub(super) fn require_positive<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value)| {
        let positive = value.is_finite() && *value > T::zero();
        require(positive, setting, SettingError::NotPositive)
    })
}

/// Requires values above zero.
pub(super) fn require_some(settings: &[(&'static str, u64)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, count)| require(*count > 0, setting, SettingError::NotPositive))
}

/// Requires numbers above one.
pub(super) fn require_above_one<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings
        .try_for_each(|(setting, value)| require(*value > T::one(), setting, SettingError::AlwaysExceeded))
}

/// Requires shares.
pub(super) fn require_share<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value)| {
        let share = *value >= T::zero() && *value < T::one();
        require(share, setting, SettingError::NotAShare)
    })
}

/// Name and value of a setting, and of another that must be smaller.
pub(super) type Pair<V> = (&'static str, V, &'static str, V);

/// Requires each number to be larger than the other.
pub(super) fn require_larger<T: Real>(settings: &[Pair<T>]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value, other, less)| {
        require(value > less, setting, SettingError::SmallerThan(other))
    })
}

/// Requires each time to be longer than the other.
pub(super) fn require_longer(settings: &[Pair<u64>]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, time, other, less)| {
        require(time > less, setting, SettingError::ShorterThan(other))
    })
}
