//! Every setting once: where it stands in the core, the name, unit and bounds that users meet, and what it means.
//! Defaults stand in the core alone. Python's models, JSON schemas, `--explain`, the tables of the manual and the C
//! structs are made from these tables and from the core's defaults, the last by `scripts/write_settings.py`.

use tumble_core::real::Real;
use tumble_core::spin::settings::SpinSettings;

use crate::setting::Bound::{Any, MoreThan, NotNegative, Positive};
use crate::setting::{Field, Setting, setting};

/// Settings of a spin. Angles are in rad, times in s.
pub fn spin<T: Real + Field>() -> Vec<Setting<SpinSettings<T>>> {
    macro_rules! row {
        ($($row:tt)+) => { setting!(SpinSettings<T>, $($row)+) };
    }
    vec![
        row!(still, "s", Positive, "How long to stand still."),
        row!(
            still_timeout,
            "s",
            MoreThan("still"),
            "How long to wait until the robot has stood still."
        ),
        row!(
            spin_timeout,
            "s",
            Positive,
            "How long to wait for the turn to be made."
        ),
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
        row!(
            turn,
            "rad",
            Positive,
            "How far to turn, both directions together."
        ),
        row!(
            rate,
            "rad/s",
            Positive,
            "Speed to turn at. It is not judged: it is what a robot may be told."
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
            "Bias instability of the accelerometer; 0 where it is not known or does not matter."
        ),
        row!(
            angular_rate_instability,
            "rad/s",
            NotNegative,
            "Bias instability of the gyroscope; 0 where it is not known or does not matter."
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
            "How much larger than the noise floor the variance of a quiet block may be."
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
            "How far the specific force of a block may stray from its rest besides noise."
        ),
        row!(
            stillness.angular_rate_drift,
            "rad/s",
            NotNegative,
            "How far the angular rate of a block may stray from its rest besides noise."
        ),
        row!(
            stillness.sigmas,
            "",
            NotNegative,
            "How many sigma of the mean a block may stray besides."
        ),
        row!(
            level_floor,
            "",
            Any,
            "Take the floor for level, as the published estimator does."
        ),
    ]
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;

    use super::*;
    use crate::setting::{Bound, Kind, Unfit, Value, stated};

    /// What is learnt of every table, in both precisions.
    fn for_each_table(law: &dyn Fn(&dyn Table)) {
        law(&spin::<f32>());
        law(&spin::<f64>());
    }

    /// A table, whatever its settings are.
    trait Table {
        fn rows(&self) -> Vec<(&'static str, &'static str, Kind, Bound)>;
        fn default_of(&self, name: &str) -> Value;
        /// All values, once some were stated.
        fn values_with(&self, stated: &[(&str, Value)]) -> Result<Vec<Value>, Unfit>;
        /// The core's settings, printed.
        fn printed(&self) -> String;
    }

    impl<S: Default + Debug> Table for Vec<Setting<S>> {
        fn rows(&self) -> Vec<(&'static str, &'static str, Kind, Bound)> {
            self.iter()
                .map(|row| (row.name, row.path, row.kind, row.bound))
                .collect()
        }

        fn default_of(&self, name: &str) -> Value {
            let row = self.iter().find(|row| row.name == name).expect("a row");
            (row.get)(&S::default())
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
    fn another(value: &Value) -> Value {
        match value {
            Value::Number(number) => Value::Number(number * 2.0 + 1.0),
            Value::Flag(flag) => Value::Flag(!flag),
            Value::None => Value::Number(5.0),
            Value::Text(text) => panic!("no other than {text}"),
        }
    }

    #[test]
    fn every_field_of_the_core_is_a_setting_and_every_setting_a_field() {
        for_each_table(&|table| {
            let mut of_core = fields(&table.printed());
            let mut of_table: Vec<_> = table
                .rows()
                .iter()
                .map(|(_, path, ..)| (*path).to_string())
                .collect();
            of_core.sort();
            of_table.sort();
            assert_eq!(of_core, of_table);
        });
    }

    #[test]
    fn what_is_read_of_a_setting_sets_it_again() {
        for_each_table(&|table| {
            let defaults = table.values_with(&[]).unwrap();
            let all: Vec<_> = table
                .rows()
                .iter()
                .map(|(name, ..)| (*name, table.default_of(name)))
                .collect();
            assert_eq!(table.values_with(&all), Ok(defaults));
        });
    }

    #[test]
    fn no_two_settings_share_a_name_and_each_changes_something_of_its_own() {
        for_each_table(&|table| {
            let (rows, defaults) = (table.rows(), table.values_with(&[]).unwrap());
            for (i, (name, ..)) in rows.iter().enumerate() {
                assert!(rows[..i].iter().all(|(other, ..)| other != name), "{name}");
                let changed = table.values_with(&[(name, another(&defaults[i]))]).unwrap();
                for (j, (before, after)) in defaults.iter().zip(&changed).enumerate() {
                    assert_eq!(before != after, i == j, "{name}");
                }
            }
        });
    }

    #[test]
    fn a_setting_out_of_its_bounds_is_refused_by_name() {
        for_each_table(&|table| {
            for (name, _, kind, bound) in table.rows() {
                let outside: &[f64] = match (kind, bound) {
                    (Kind::Flag, _) => continue,
                    (_, Bound::Any) => &[f64::NAN, f64::INFINITY],
                    (_, Bound::NotNegative) => &[-1e-9, f64::NAN, f64::INFINITY],
                    (_, Bound::Positive | Bound::MoreThan(_)) => &[0.0, -1e-9, f64::NAN, f64::INFINITY],
                };
                for number in outside {
                    let refused = table.values_with(&[(name, Value::Number(*number))]);
                    assert_eq!(refused, Err(Unfit::Bound(name)), "{name} {number}");
                }
            }
        });
    }

    #[test]
    fn a_bound_names_a_setting() {
        for_each_table(&|table| {
            for (name, _, _, bound) in table.rows() {
                let Bound::MoreThan(other) = bound else { continue };
                assert!(table.rows().iter().any(|(known, ..)| *known == other), "{name}");
            }
        });
    }

    #[test]
    fn a_setting_that_is_not_known_or_of_another_kind_is_refused() {
        for_each_table(&|table| {
            let unknown = table.values_with(&[("stil", Value::Number(1.0))]);
            assert_eq!(unknown, Err(Unfit::Unknown("stil".to_string())));
            for (name, _, kind, _) in table.rows() {
                let wrong = match kind {
                    Kind::Flag => Value::Number(1.0),
                    Kind::Number | Kind::Time | Kind::Count => Value::Flag(true),
                };
                assert_eq!(
                    table.values_with(&[(name, wrong)]),
                    Err(Unfit::Kind(name)),
                    "{name}"
                );
            }
        });
    }
}
