//! Settings that cannot be meant, alone or together. Bounds, and what has to be more than another, are made from the
//! table of settings; here stands what is particular.

use crate::real::{Real, SECOND, tabulated, whole_spans};
use crate::redundancy::judgement::SLOW_OFFSET;
use crate::redundancy::leaky::LONGEST;
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::thresholds::Threshold;
use crate::redundancy::settings::{Data, RedundancySettings};

crate::vocabulary! {
    /// Why a setting cannot be meant.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum SettingError {
        /// It has to be a number above zero.
        NotPositive = "not positive",
        /// It has to be a share, from 0 up to below 1.
        NotAShare = "not a share",
        /// A threshold by ratio has to be above one, others above zero: everything would exceed it.
        AlwaysExceeded = "always exceeded",
        /// A ratio of the last error needs one, and the primary has none in compensated data.
        NoLastError = "no last error",
        /// It has to be longer than the other.
        ShorterThan(&'static str) = "shorter than",
        /// It has to be larger than the other.
        SmallerThan(&'static str) = "smaller than",
        /// Not that many windows fit into the other.
        MoreThanFit(&'static str) = "more than fit",
        /// It is longer than time is kept count of; at most this many microseconds.
        TooLong(u64) = "too long",
        /// A second has to be a whole number of windows, since every other second is held out.
        NotAPartOfASecond = "not a part of a second",
    }
}

/// A setting that contradicts another, or itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InvalidSetting {
    /// By its name.
    pub setting: &'static str,
    /// What is wrong with it.
    pub error: SettingError,
}

impl<T: Real> RedundancySettings<T> {
    /// Looks for contradictions.
    ///
    /// # Errors
    /// The first [`InvalidSetting`] there is.
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
            // A secondary between the two would be disputed for ever, and never be calibrated.
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

/// Objects to what is not so.
fn require(good: bool, setting: &'static str, error: SettingError) -> Result<(), InvalidSetting> {
    if good {
        Ok(())
    } else {
        Err(InvalidSetting { setting, error })
    }
}

/// Objects to the first that is not a number above zero.
pub(super) fn require_positive<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value)| {
        let positive = value.is_finite() && *value > T::zero();
        require(positive, setting, SettingError::NotPositive)
    })
}

/// Objects to the first that is zero.
pub(super) fn require_some(settings: &[(&'static str, u64)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, count)| require(*count > 0, setting, SettingError::NotPositive))
}

/// Objects to the first that is not above one.
pub(super) fn require_above_one<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings
        .try_for_each(|(setting, value)| require(*value > T::one(), setting, SettingError::AlwaysExceeded))
}

/// Objects to the first that is no share.
pub(super) fn require_share<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value)| {
        let share = *value >= T::zero() && *value < T::one();
        require(share, setting, SettingError::NotAShare)
    })
}

/// A setting by name, and another by name, than which it has to be more.
pub(super) type Pair<V> = (&'static str, V, &'static str, V);

/// Objects to the first that is not larger than the other.
pub(super) fn require_larger<T: Real>(settings: &[Pair<T>]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value, other, less)| {
        require(value > less, setting, SettingError::SmallerThan(other))
    })
}

/// Objects to the first that is not longer than the other.
pub(super) fn require_longer(settings: &[Pair<u64>]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, time, other, less)| {
        require(time > less, setting, SettingError::ShorterThan(other))
    })
}
