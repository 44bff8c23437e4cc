//! Bounds of each setting by itself, and what has to be more than another. Made by scripts/write_settings.py from
//! crates/tumble-lab/src/setting_table.rs; edit that instead.

use crate::real::Real;
use crate::redundancy::settings::RedundancySettings;
use crate::redundancy::settings::validate::{
    InvalidSetting, require_above_one, require_larger, require_longer, require_positive, require_share,
    require_some,
};

impl<T: Real> RedundancySettings<T> {
    /// Looks at numbers first, then at times and counts, then at pairs.
    pub(super) fn validate_bounds(&self) -> Result<(), InvalidSetting> {
        require_positive(&[
            (
                "rest_specific_force_scatter",
                self.evaluation.thresholds.rest_scatter.specific_force,
            ),
            (
                "rest_angular_rate_scatter",
                self.evaluation.thresholds.rest_scatter.angular_rate,
            ),
            ("gravity", self.evaluation.gravity),
            (
                "uncalibrated_specific_force",
                self.evaluation.uncalibrated.specific_force,
            ),
            (
                "uncalibrated_angular_rate",
                self.evaluation.uncalibrated.angular_rate,
            ),
            ("motion_specific_force", self.collection.motion.specific_force),
            ("motion_angular_rate", self.collection.motion.angular_rate),
            ("excitation_specific_force", self.fit.excitation.specific_force),
            ("excitation_angular_rate", self.fit.excitation.angular_rate),
            ("excitation_lever_arm", self.fit.excitation_lever_arm),
            ("largest_specific_force_bias", self.adoption.bias.specific_force),
            ("largest_angular_rate_bias", self.adoption.bias.angular_rate),
            ("largest_scale_error", self.adoption.largest_scale_error),
            ("largest_misalignment", self.adoption.largest_misalignment),
            ("largest_lever_arm", self.adoption.largest_lever_arm),
            ("largest_specific_force_drift", self.adoption.drift.specific_force),
            ("largest_angular_rate_drift", self.adoption.drift.angular_rate),
            (
                "largest_specific_force_residual",
                self.adoption.residual.specific_force,
            ),
            (
                "largest_angular_rate_residual",
                self.adoption.residual.angular_rate,
            ),
            (
                "largest_followed_specific_force",
                self.adoption.followed.specific_force,
            ),
            (
                "largest_followed_angular_rate",
                self.adoption.followed.angular_rate,
            ),
            ("spike_specific_force", self.health.spike.specific_force),
            ("spike_angular_rate", self.health.spike.angular_rate),
            ("tolerated_specific_force", self.health.tolerated.specific_force),
            ("tolerated_angular_rate", self.health.tolerated.angular_rate),
            (
                "drift_per_kelvin_specific_force",
                self.health.per_kelvin.specific_force,
            ),
            (
                "drift_per_kelvin_angular_rate",
                self.health.per_kelvin.angular_rate,
            ),
            ("noise_ratio", self.health.noise_ratio),
            ("rest_specific_force", self.health.rest.specific_force),
            ("rest_angular_rate", self.health.rest.angular_rate),
        ])?;
        require_above_one(&[("noise_ratio", self.health.noise_ratio)])?;
        require_share(&[("improvement", self.adoption.improvement)])?;
        require_some(&[
            ("rest_duration", self.evaluation.rest_duration),
            ("window", self.window),
            ("motion_timeout", self.collection.motion_timeout),
            ("collect", self.collection.collect),
            ("collect_timeout", self.collection.collect_timeout),
            ("fewest_pairs", u64::from(self.collection.fewest_pairs)),
            ("late", self.health.late),
            ("frozen", self.health.frozen),
            ("saturated", self.health.saturated),
        ])?;
        require_larger(&[
            (
                "motion_specific_force",
                self.collection.motion.specific_force,
                "rest_specific_force_scatter",
                self.evaluation.thresholds.rest_scatter.specific_force,
            ),
            (
                "motion_angular_rate",
                self.collection.motion.angular_rate,
                "rest_angular_rate_scatter",
                self.evaluation.thresholds.rest_scatter.angular_rate,
            ),
            (
                "largest_specific_force_bias",
                self.adoption.bias.specific_force,
                "tolerated_specific_force",
                self.health.tolerated.specific_force,
            ),
            (
                "largest_angular_rate_bias",
                self.adoption.bias.angular_rate,
                "tolerated_angular_rate",
                self.health.tolerated.angular_rate,
            ),
        ])?;
        require_longer(&[
            (
                "rest_duration",
                self.evaluation.rest_duration,
                "window",
                self.window,
            ),
            (
                "evaluate_every",
                self.evaluation.evaluate_every.unwrap_or(u64::MAX),
                "rest_duration",
                self.evaluation.rest_duration,
            ),
            (
                "motion_timeout",
                self.collection.motion_timeout,
                "window",
                self.window,
            ),
            ("collect", self.collection.collect, "window", self.window),
            (
                "collect_timeout",
                self.collection.collect_timeout,
                "collect",
                self.collection.collect,
            ),
            (
                "return_after",
                self.selection.return_after.unwrap_or(u64::MAX),
                "hold",
                self.selection.hold,
            ),
        ])
    }
}
