//! Settings that cannot be meant, alone or together.

use crate::real::{Real, SECOND};
use crate::redundancy::leaky::LONGEST;
use crate::redundancy::settings::thresholds::Threshold;
use crate::redundancy::settings::{Data, HealthSettings, RedundancySettings, SelectionSettings};

/// Why a setting cannot be meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingError {
    /// It has to be a number above zero.
    NotPositive,
    /// It has to be a share, from 0 up to below 1.
    NotAShare,
    /// A threshold by ratio has to be above one, others above zero: everything would exceed it.
    AlwaysExceeded,
    /// A ratio of the last error needs one, and the primary has none in compensated data.
    NoLastError,
    /// It has to be longer than the other.
    ShorterThan(&'static str),
    /// It has to be larger than the other.
    SmallerThan(&'static str),
    /// Not that many windows fit into the other.
    MoreThanFit(&'static str),
    /// It is longer than time is kept count of; at most this many microseconds.
    TooLong(u64),
    /// A second has to be a whole number of windows, since every other second is held out.
    NotAPartOfASecond,
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
        self.validate_numbers()?;
        self.validate_thresholds()?;
        self.validate_times()?;
        self.selection.validate()?;
        self.health.validate()
    }

    fn validate_numbers(&self) -> Result<(), InvalidSetting> {
        let (motion, fit, adoption) = (&self.collection.motion, &self.fit, &self.adoption);
        let thresholds = &self.evaluation.thresholds;
        require_positive(&[
            ("gravity", self.evaluation.gravity),
            ("first_threshold", thresholds.first),
            ("second_threshold", thresholds.second),
            ("motion_specific_force", motion.specific_force),
            ("motion_angular_rate", motion.angular_rate),
            ("excitation_specific_force", fit.excitation.specific_force),
            ("excitation_angular_rate", fit.excitation.angular_rate),
            ("excitation_lever_arm", fit.lever_arm_excitation),
            ("largest_specific_force_bias", adoption.bias.specific_force),
            ("largest_angular_rate_bias", adoption.bias.angular_rate),
            ("largest_scale_error", adoption.scale),
            ("largest_misalignment", adoption.misalignment),
            ("largest_lever_arm", adoption.lever_arm),
            ("largest_specific_force_drift", adoption.drift.specific_force),
            ("largest_angular_rate_drift", adoption.drift.angular_rate),
            (
                "largest_specific_force_residual",
                adoption.residual.specific_force,
            ),
            ("largest_angular_rate_residual", adoption.residual.angular_rate),
        ])?;
        require_some(&[
            ("fewest_pairs", u64::from(self.collection.fewest_pairs)),
            ("window", self.window),
            ("rest_duration", self.evaluation.duration),
        ])?;
        let share = adoption.improvement;
        require(
            share >= T::zero() && share < T::one(),
            "improvement",
            SettingError::NotAShare,
        )
    }

    fn validate_thresholds(&self) -> Result<(), InvalidSetting> {
        let thresholds = &self.evaluation.thresholds;
        let limits = [
            ("third_threshold", &thresholds.third),
            ("fourth_threshold", &thresholds.fourth),
            ("fifth_threshold", &thresholds.fifth),
            ("sixth_threshold", &thresholds.sixth),
        ];
        for (i, (setting, limit)) in limits.into_iter().enumerate() {
            require(limit.is_possible(), setting, SettingError::AlwaysExceeded)?;
            let refers = matches!(limit, Threshold::VariableByRatio(_));
            let primary = i >= 2 && self.evaluation.data == Data::Compensated;
            require(!(refers && primary), setting, SettingError::NoLastError)?;
        }
        let motion = &self.collection.motion;
        let moves = SettingError::SmallerThan("first_threshold");
        require(
            motion.specific_force > thresholds.first,
            "motion_specific_force",
            moves,
        )?;
        let turns = SettingError::SmallerThan("second_threshold");
        require(
            motion.angular_rate > thresholds.second,
            "motion_angular_rate",
            turns,
        )
    }

    fn validate_times(&self) -> Result<(), InvalidSetting> {
        let (evaluation, collection) = (&self.evaluation, &self.collection);
        require(
            SECOND.is_multiple_of(self.window),
            "window",
            SettingError::NotAPartOfASecond,
        )?;
        let longer = |setting, time: u64, other, least: u64| {
            require(time > least, setting, SettingError::ShorterThan(other))
        };
        longer("rest_duration", evaluation.duration, "window", self.window)?;
        longer("collect", collection.collect, "window", self.window)?;
        longer("motion_timeout", collection.motion_timeout, "window", self.window)?;
        longer(
            "collect_timeout",
            collection.collect_timeout,
            "collect",
            collection.collect,
        )?;
        if let Some(every) = evaluation.every {
            longer("evaluate_every", every, "rest_duration", evaluation.duration)?;
        }
        let fits = u64::from(collection.fewest_pairs) <= self.windows(collection.collect);
        require(fits, "fewest_pairs", SettingError::MoreThanFit("collect"))
    }
}

impl<T: Real> HealthSettings<T> {
    /// Looks for numbers that cannot be meant.
    ///
    /// # Errors
    /// The first [`InvalidSetting`] there is.
    pub fn validate(&self) -> Result<(), InvalidSetting> {
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
            require(time <= most, setting, SettingError::TooLong(most))?;
        }
        require(
            self.noise_ratio > T::one(),
            "noise_ratio",
            SettingError::AlwaysExceeded,
        )
    }
}

impl SelectionSettings {
    /// Looks for contradictions.
    ///
    /// # Errors
    /// [`InvalidSetting`] where the primary would come back sooner than it is replaced.
    pub fn validate(&self) -> Result<(), InvalidSetting> {
        if self.return_after.is_none_or(|after| after > self.hold) {
            return Ok(());
        }
        Err(InvalidSetting {
            setting: "return_after",
            error: SettingError::ShorterThan("hold"),
        })
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
fn require_positive<T: Real>(settings: &[(&'static str, T)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, value)| {
        let positive = value.is_finite() && *value > T::zero();
        require(positive, setting, SettingError::NotPositive)
    })
}

/// Objects to the first that is zero.
fn require_some(settings: &[(&'static str, u64)]) -> Result<(), InvalidSetting> {
    let mut settings = settings.iter();
    settings.try_for_each(|(setting, count)| require(*count > 0, setting, SettingError::NotPositive))
}
