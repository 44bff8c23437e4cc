//! Every setting once: where it stands in the core, the name, unit and bounds that users meet, and what it means.
//! Defaults stand in the core alone. Python's models, JSON schemas, `--explain`, the tables of the manual and the C
//! structs are made from these tables and from the core's defaults, the last by `scripts/write_settings.py`.

use tumble_core::real::Real;
use tumble_core::redundancy::settings::RedundancySettings;
use tumble_core::spin::settings::SpinSettings;

use crate::setting::Bound::{AboveOne, Any, MoreThan, NotNegative, Positive, Share};
use crate::setting::{Setting, SettingField, setting};

/// Settings of a spin. Angles are in rad, times in s.
pub fn spin<T: Real + SettingField>() -> Vec<Setting<SpinSettings<T>>> {
    macro_rules! row {
        ($($row:tt)+) => { setting!(SpinSettings<T>, $($row)+) };
    }
    vec![
        row!(still, "s", Positive, "Time to stand still."),
        row!(
            still_timeout,
            "s",
            MoreThan("still"),
            "Longest wait until the robot has stood still."
        ),
        row!(spin_timeout, "s", Positive, "Longest wait for the turn."),
        row!(longest_gap, "s", Positive, "Longest pause in the samples."),
        row!(
            block,
            "s",
            Positive,
            "Length of the blocks over which samples are averaged."
        ),
        row!(
            shortest_stop,
            "s",
            NotNegative,
            "Shortest stop after the first rest that is counted as a rest."
        ),
        row!(gravity, "m/s^2", Positive, "Local gravity."),
        row!(turn, "rad", Positive, "Angle to turn, both directions together."),
        row!(
            rate,
            "rad/s",
            Positive,
            "Speed to turn at, which a robot may be asked for; no limit depends on it."
        ),
        row!(largest_floor_tilt, "rad", Positive, "Largest floor tilt."),
        row!(
            scale_sigma,
            "",
            Positive,
            "1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it."
        ),
        row!(
            specific_force_instability,
            "m/s^2",
            NotNegative,
            "Bias instability of the accelerometer; that of a consumer grade where none is stated."
        ),
        row!(
            angular_rate_instability,
            "rad/s",
            NotNegative,
            "Bias instability of the gyroscope; that of a consumer grade where none is stated."
        ),
        row!(
            specific_force_range,
            "m/s^2",
            Positive,
            "End of the accelerometer's range.",
            none = "not known"
        ),
        row!(
            angular_rate_range,
            "rad/s",
            Positive,
            "End of the gyroscope's range.",
            none = "not known"
        ),
        row!(
            earth_rate_up,
            "rad/s",
            Any,
            "Upward part of the Earth's rotation; 0 where the latitude is not known."
        ),
        row!(
            largest_lift,
            "m/s^2",
            Positive,
            "Largest change of the force along the turning axis."
        ),
        row!(
            largest_rate_across,
            "rad/s",
            Positive,
            "Largest rate across the turning axis."
        ),
        row!(
            largest_share_across,
            "",
            Positive,
            "Largest rate across the turning axis as a share of the rate about it."
        ),
        row!(
            largest_rate_bias,
            "rad/s",
            Positive,
            "Largest plausible bias of the gyroscope. A robot that seems to turn faster does not stand still."
        ),
        row!(
            largest_step,
            "rad",
            Positive,
            "Largest turn from one sample to the next."
        ),
        row!(
            largest_specific_force_scatter,
            "m/s^2",
            Positive,
            "Largest scatter of specific force at which a robot may stand still."
        ),
        row!(
            largest_angular_rate_scatter,
            "rad/s",
            Positive,
            "Largest scatter of angular rate at which a robot may stand still."
        ),
        row!(
            stillness.variance_ratio,
            "",
            Positive,
            "Largest ratio of the variance of a quiet block to the noise floor."
        ),
        row!(
            stillness.smallest_specific_force_scatter,
            "m/s^2",
            NotNegative,
            "Scatter of specific force below which a block is quiet whatever the floor."
        ),
        row!(
            stillness.smallest_angular_rate_scatter,
            "rad/s",
            NotNegative,
            "Scatter of angular rate below which a block is quiet whatever the floor."
        ),
        row!(
            stillness.specific_force_drift,
            "m/s^2",
            NotNegative,
            "Largest deviation of the specific force of a block from its rest besides noise."
        ),
        row!(
            stillness.angular_rate_drift,
            "rad/s",
            NotNegative,
            "Largest deviation of the angular rate of a block from its rest besides noise."
        ),
        row!(
            stillness.sigmas,
            "",
            NotNegative,
            "Further deviation of the mean of a block, in sigmas."
        ),
        row!(
            level_floor,
            "",
            Any,
            "Take the floor for level, as the published estimator does."
        ),
    ]
}

/// Settings of the redundancy monitor. Angles are in rad, times in s.
pub fn redundancy<T: Real + SettingField>() -> Vec<Setting<RedundancySettings<T>>> {
    macro_rules! row {
        ($($row:tt)+) => { setting!(RedundancySettings<T>, $($row)+) };
    }
    let rest = vec![
        row!(
            evaluation.thresholds.rest_scatter.specific_force as rest_specific_force_scatter,
            "m/s^2",
            Positive,
            "Scatter of specific force, and change of its mean, below which a unit is at rest."
        ),
        row!(
            evaluation.thresholds.rest_scatter.angular_rate as rest_angular_rate_scatter,
            "rad/s",
            Positive,
            "Scatter of angular rate, and change of its mean, below which a unit is at rest."
        ),
        row!(
            evaluation.rest_settle,
            "s",
            NotNegative,
            "Rest that is let pass before readings count."
        ),
        row!(
            evaluation.rest_duration,
            "s",
            MoreThan("window"),
            "Rest over which readings are averaged before units are evaluated."
        ),
        row!(
            window,
            "s",
            Positive,
            "Length of the windows over which all units are averaged, whatever their rates; a whole part of 1 s."
        ),
        row!(evaluation.gravity, "m/s^2", Positive, "Local gravity."),
    ];
    let evaluation = vec![
        row!(
            evaluation.uncalibrated.specific_force as uncalibrated_specific_force,
            "m/s^2",
            Positive,
            "Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated relative to it, where they deviate as well."
        ),
        row!(
            evaluation.uncalibrated.angular_rate as uncalibrated_angular_rate,
            "rad/s",
            Positive,
            "Deviation at rest of a primary without a calibration of its own up to which secondaries are calibrated relative to it, where they deviate as well."
        ),
        row!(
            evaluation.evaluate_after_start,
            "",
            Any,
            "Evaluate the first rest after the start."
        ),
        row!(
            evaluation.evaluate_every,
            "s",
            MoreThan("rest_duration"),
            "Calibrate what deviates at a rest once so much time has passed.",
            none = "on command only"
        ),
        row!(
            evaluation.data,
            "",
            Any,
            "Take deviations from compensated data or from raw data, with thresholds to match."
        ),
        row!(
            evaluation.vector_check,
            "",
            Any,
            "Compare a secondary also with a valid primary, axis by axis: the norm is blind across gravity."
        ),
        row!(
            evaluation.thresholds.secondary.accelerometer as secondary_accelerometer_threshold,
            "m/s^2",
            Any,
            "Deviation of a secondary's accelerometer above which its calibration is triggered."
        ),
        row!(
            evaluation.thresholds.secondary.gyroscope as secondary_gyroscope_threshold,
            "rad/s",
            Any,
            "Deviation of a secondary's gyroscope above which its calibration is triggered."
        ),
        row!(
            evaluation.thresholds.primary.accelerometer as primary_accelerometer_threshold,
            "m/s^2",
            Any,
            "Deviation of the primary's accelerometer above which it is invalid."
        ),
        row!(
            evaluation.thresholds.primary.gyroscope as primary_gyroscope_threshold,
            "rad/s",
            Any,
            "Deviation of the primary's gyroscope above which it is invalid."
        ),
    ];
    let gate = vec![row!(
        evaluation.gate,
        "",
        Any,
        "Trigger on the secondary alone, with both sensors of the primary valid, or each with its own kind."
    )];
    let calibration = vec![
        row!(
            collection.scope,
            "",
            Any,
            "Calibrate both sensors of a secondary, or only the one that deviates."
        ),
        row!(
            collection.motion.specific_force as motion_specific_force,
            "m/s^2",
            MoreThan("rest_specific_force_scatter"),
            "Change of the primary's mean specific force since the rest that counts as motion."
        ),
        row!(
            collection.motion.angular_rate as motion_angular_rate,
            "rad/s",
            MoreThan("rest_angular_rate_scatter"),
            "Change of the primary's mean angular rate since the rest that counts as motion."
        ),
        row!(
            collection.motion_timeout,
            "s",
            MoreThan("window"),
            "Longest wait for motion; then the calibration is abandoned."
        ),
        row!(
            collection.collect,
            "s",
            MoreThan("window"),
            "Motion to be collected."
        ),
        row!(
            collection.collect_timeout,
            "s",
            MoreThan("collect"),
            "Longest time for collecting; then what there is has to do, or the calibration is abandoned."
        ),
        row!(
            collection.fewest_pairs,
            "",
            Positive,
            "Fewest pairs with which a fit is tried when time is up."
        ),
    ];
    let fit = vec![
        row!(
            fit.largest_fit_model,
            "",
            Any,
            "Largest model that may be fitted: the largest up to it that the motion shows is used."
        ),
        row!(
            fit.fit_rests,
            "",
            Any,
            "Fit to means at rests at which the primary is valid as well as to pairs in motion."
        ),
        row!(
            fit.excitation.specific_force as excitation_specific_force,
            "m/s^2",
            Positive,
            "Standard deviation of specific force along a direction from which on the matrix is fitted along it."
        ),
        row!(
            fit.excitation.angular_rate as excitation_angular_rate,
            "rad/s",
            Positive,
            "Standard deviation of angular rate along a direction from which on the matrix is fitted along it."
        ),
        row!(
            fit.excitation_lever_arm,
            "1/s^2",
            Positive,
            "Specific force for each metre of lever arm, root mean square, from which on the lever arm is fitted."
        ),
    ];
    let adoption = vec![
        row!(
            adoption.adoption,
            "",
            Any,
            "Replace what is stored where the fit is plausible and better, or by each calibration."
        ),
        row!(
            adoption.improvement,
            "",
            Share,
            "Share by which its residual on held-out pairs has to be smaller than the stored one's."
        ),
        row!(
            adoption.bias.specific_force as largest_specific_force_bias,
            "m/s^2",
            MoreThan("tolerated_specific_force"),
            "Largest bias of an accelerometer."
        ),
        row!(
            adoption.bias.angular_rate as largest_angular_rate_bias,
            "rad/s",
            MoreThan("tolerated_angular_rate"),
            "Largest bias of a gyroscope."
        ),
        row!(
            adoption.largest_scale_error,
            "",
            Positive,
            "Largest deviation of a scale factor from one."
        ),
        row!(
            adoption.largest_misalignment,
            "rad",
            Positive,
            "Largest misalignment beside the nominal mounting."
        ),
        row!(adoption.largest_lever_arm, "m", Positive, "Longest lever arm."),
        row!(
            adoption.drift.specific_force as largest_specific_force_drift,
            "m/s^2",
            Positive,
            "Largest drift of an accelerometer while pairs were collected."
        ),
        row!(
            adoption.drift.angular_rate as largest_angular_rate_drift,
            "rad/s",
            Positive,
            "Largest drift of a gyroscope while pairs were collected."
        ),
        row!(
            adoption.residual.specific_force as largest_specific_force_residual,
            "m/s^2",
            Positive,
            "Largest residual of an accelerometer on held-out pairs, root mean square."
        ),
        row!(
            adoption.residual.angular_rate as largest_angular_rate_residual,
            "rad/s",
            Positive,
            "Largest residual of a gyroscope on held-out pairs, root mean square."
        ),
        row!(
            adoption.followed.specific_force as largest_followed_specific_force,
            "m/s^2",
            Positive,
            "Largest shift by which calibrations of an accelerometer may follow the primary where no rest proves it right."
        ),
        row!(
            adoption.followed.angular_rate as largest_followed_angular_rate,
            "rad/s",
            Positive,
            "Largest shift by which calibrations of a gyroscope may follow the primary where no rest proves it right."
        ),
    ];
    let health = vec![
        row!(
            health.late,
            "s",
            Positive,
            "Time without a sample after which a unit is late."
        ),
        row!(
            health.frozen,
            "s",
            Positive,
            "Time in which all axes of a sensor repeat their readings, and 16 readings at least, until it is \
             frozen; three times that for a sensor of one axis."
        ),
        row!(
            health.saturated,
            "s",
            Positive,
            "Time at the end of its range, or without finite numbers, that a sensor may spend; forgiven slowly."
        ),
        row!(
            health.spike.specific_force as spike_specific_force,
            "m/s^2",
            Positive,
            "Specific force that leaves by more, and is back with the next sample, is a spike."
        ),
        row!(
            health.spike.angular_rate as spike_angular_rate,
            "rad/s",
            Positive,
            "Angular rate that leaves by more, and is back with the next sample, is a spike."
        ),
        row!(
            health.tolerated.specific_force as tolerated_specific_force,
            "m/s^2",
            Positive,
            "Drift of specific force that is within specification: a difference of two units that is none."
        ),
        row!(
            health.tolerated.angular_rate as tolerated_angular_rate,
            "rad/s",
            Positive,
            "Drift of angular rate that is within specification: a difference of two units that is none."
        ),
        row!(
            health.per_kelvin.specific_force as drift_per_kelvin_specific_force,
            "m/s^2/K",
            Positive,
            "Drift of specific force of an axis with temperature, of units whose logs or samples state one."
        ),
        row!(
            health.per_kelvin.angular_rate as drift_per_kelvin_angular_rate,
            "rad/s/K",
            Positive,
            "Drift of angular rate of an axis with temperature, of units whose logs or samples state one."
        ),
        row!(
            health.noise_ratio,
            "",
            AboveOne,
            "Scatter of a unit, as a multiple of that expected from the others, beyond which it is noisy."
        ),
        row!(
            health.rest.specific_force as rest_specific_force,
            "m/s^2",
            Positive,
            "Deviation of specific force from gravity at rest that no error of a working unit explains."
        ),
        row!(
            health.rest.angular_rate as rest_angular_rate,
            "rad/s",
            Positive,
            "Angular rate at rest that no error of a working unit explains."
        ),
        row!(
            health.recovery,
            "s",
            NotNegative,
            "Time in which nothing may have been wrong until a unit is healthy again."
        ),
    ];
    let selection = vec![
        row!(
            selection.hold,
            "s",
            NotNegative,
            "Time a source has to be unhealthy before another takes over."
        ),
        row!(
            selection.return_after,
            "s",
            MoreThan("hold"),
            "Health to be proven by the primary before it takes over again.",
            none = "on command only"
        ),
        row!(
            selection.calibrated_only,
            "",
            Any,
            "Select only secondaries that have a stored error."
        ),
    ];
    grouped([
        ("rest", rest),
        ("evaluation", evaluation),
        ("gate", gate),
        ("calibration", calibration),
        ("fit", fit),
        ("adoption", adoption),
        ("health", health),
        ("selection", selection),
    ])
}

/// Groups one after the other.
fn grouped<S, const N: usize>(groups: [(&'static str, Vec<Setting<S>>); N]) -> Vec<Setting<S>> {
    let each = |(group, rows): (&'static str, Vec<Setting<S>>)| {
        rows.into_iter().map(move |row| Setting { group, ..row })
    };
    groups.into_iter().flat_map(each).collect()
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;

    use super::*;
    use crate::setting::{Bound, SettingKind, Unfit, Value, stated};

    /// Holds every table to a property, in both precisions.
    fn for_each_table(law: &dyn Fn(&dyn AnyTable)) {
        law(&redundancy::<f32>());
        law(&redundancy::<f64>());
        law(&spin::<f32>());
        law(&spin::<f64>());
    }

    /// A row, whatever its settings are.
    struct Row {
        name: &'static str,
        path: &'static str,
        kind: SettingKind,
        choices: Vec<&'static str>,
        bound: Bound,
        default: Value,
    }

    /// A table, whatever its settings are.
    trait AnyTable {
        fn rows(&self) -> Vec<Row>;
        /// All values, once some were stated.
        fn values_with(&self, stated: &[(&str, Value)]) -> Result<Vec<Value>, Unfit>;
        /// The core's settings, printed.
        fn printed(&self) -> String;
    }

    impl<S: Default + Debug> AnyTable for Vec<Setting<S>> {
        fn rows(&self) -> Vec<Row> {
            let row = |row: &Setting<S>| Row {
                name: row.name,
                path: row.path,
                kind: row.kind,
                choices: row.choices.clone(),
                bound: row.bound,
                default: (row.get)(&S::default()),
            };
            self.iter().map(row).collect()
        }

        fn values_with(&self, values: &[(&str, Value)]) -> Result<Vec<Value>, Unfit> {
            let settings = stated(self, values.iter().map(|(name, value)| (*name, value)))?;
            Ok(self.iter().map(|row| (row.get)(&settings)).collect())
        }

        fn printed(&self) -> String {
            format!("{:?}", S::default())
        }
    }

    /// Paths of all fields of a printed struct, those of structs within it included.
    fn fields(printed: &str) -> Vec<String> {
        let (mut path, mut found) = (Vec::new(), Vec::new());
        for part in printed.split_inclusive(['{', ',', '}']) {
            let name = part.split_once(':').map(|(name, _)| name.trim().to_string());
            match part.chars().last() {
                Some('{') => path.push(name.unwrap_or_default()),
                _ => {
                    let whole = |name| {
                        path.iter()
                            .skip(1)
                            .cloned()
                            .chain([name])
                            .collect::<Vec<_>>()
                            .join(".")
                    };
                    found.extend(name.map(whole));
                    if part.ends_with('}') {
                        path.pop();
                    }
                }
            }
        }
        found
    }

    /// Another value that a setting may have.
    fn another(row: &Row) -> Value {
        match &row.default {
            Value::Number(_) if row.bound == Bound::Share => Value::Number(0.5),
            Value::Number(number) => Value::Number(number * 2.0 + 1.0),
            Value::Flag(flag) => Value::Flag(!flag),
            Value::None => Value::Number(5.0),
            Value::Text(_) if row.kind == SettingKind::Threshold => Value::Text("last+0.25".to_string()),
            Value::Text(text) => {
                let mut others = row.choices.iter().filter(|other| *other != text);
                Value::Text((*others.next().expect("another choice")).to_string())
            }
        }
    }

    #[test]
    fn fields_of_the_core_and_settings_correspond() {
        for_each_table(&|table| {
            let mut of_core = fields(&table.printed());
            let mut of_table: Vec<_> = table.rows().iter().map(|row| row.path.to_string()).collect();
            of_core.sort();
            of_table.sort();
            assert_eq!(of_core, of_table);
        });
    }

    #[test]
    fn what_is_read_of_a_setting_sets_it_again() {
        for_each_table(&|table| {
            let rows = table.rows();
            let all: Vec<_> = rows.iter().map(|row| (row.name, row.default.clone())).collect();
            assert_eq!(table.values_with(&all), table.values_with(&[]));
        });
    }

    #[test]
    fn no_settings_share_a_name_and_each_changes_its_own_value() {
        for_each_table(&|table| {
            let rows = table.rows();
            for (i, row) in rows.iter().enumerate() {
                assert!(
                    rows[..i].iter().all(|other| other.name != row.name),
                    "{}",
                    row.name
                );
                let stated = another(row);
                let changed = table.values_with(&[(row.name, stated.clone())]).unwrap();
                for (j, (other, after)) in rows.iter().zip(&changed).enumerate() {
                    assert_eq!(other.default != *after, i == j, "{} by {}", other.name, row.name);
                }
                assert_eq!(table.values_with(&[(row.name, changed[i].clone())]), Ok(changed));
            }
        });
    }

    #[test]
    fn a_setting_out_of_its_bounds_is_refused_by_name() {
        for_each_table(&|table| {
            for row in table.rows() {
                let beyond: &[f64] = match (row.kind, row.bound) {
                    (SettingKind::Flag | SettingKind::Choice(_) | SettingKind::Threshold, _) => continue,
                    (_, Bound::Any) => &[],
                    (_, Bound::NotNegative) => &[-1e-9],
                    (_, Bound::Positive | Bound::MoreThan(_)) => &[0.0, -1e-9],
                    (_, Bound::AboveOne) => &[1.0, 0.0],
                    (_, Bound::Share) => &[1.0, -1e-9],
                };
                for number in beyond.iter().chain(&[f64::NAN, f64::INFINITY]) {
                    let refused = table.values_with(&[(row.name, Value::Number(*number))]);
                    assert_eq!(refused, Err(Unfit::Bound(row.name)), "{} {number}", row.name);
                }
            }
        });
    }

    #[test]
    fn a_bound_names_a_setting_of_its_kind() {
        for_each_table(&|table| {
            let rows = table.rows();
            for row in &rows {
                let Bound::MoreThan(other) = row.bound else {
                    continue;
                };
                let found = rows.iter().find(|known| known.name == other);
                assert_eq!(found.map(|found| found.kind), Some(row.kind), "{}", row.name);
            }
        });
    }

    #[test]
    fn a_setting_that_is_not_known_or_of_another_kind_is_refused() {
        for_each_table(&|table| {
            let unknown = table.values_with(&[("unheard of", Value::Number(1.0))]);
            assert_eq!(unknown, Err(Unfit::Unknown("unheard of".to_string())));
            for row in table.rows() {
                let wrong = match row.kind {
                    SettingKind::Flag => Value::Number(1.0),
                    SettingKind::Number | SettingKind::Time | SettingKind::Count => Value::Flag(true),
                    SettingKind::Choice(_) | SettingKind::Threshold => Value::Text("unheard of".to_string()),
                };
                let refused = table.values_with(&[(row.name, wrong)]);
                assert_eq!(refused, Err(Unfit::Kind(row.name)), "{}", row.name);
            }
        });
    }

    #[test]
    fn every_setting_has_a_group_and_a_meaning_in_sentences() {
        for row in redundancy::<f64>() {
            assert!(
                !row.group.is_empty() && row.meaning.ends_with('.'),
                "{}",
                row.name
            );
        }
        for row in spin::<f64>() {
            assert!(row.meaning.ends_with('.'), "{}", row.name);
        }
    }
}
