//! Every setting of the monitor by its name, in SI units, times in seconds.

use tumble_core::real::{Real, real};
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_core::redundancy::settings::{Data, Gate, RedundancySettings, Rung, Scope};

pub use crate::setting::{Value, in_microseconds, in_seconds, wide};
use crate::setting::{number, whole};

/// A setting: its name, and how to read and change it; changing says whether the value can be.
pub struct Named<T: Real> {
    /// As users write it.
    pub name: &'static str,
    /// Its value.
    pub get: fn(&RedundancySettings<T>) -> Value,
    /// Sets it.
    pub set: fn(&mut RedundancySettings<T>, &Value) -> Option<()>,
}

/// A setting that cannot be set so.
#[derive(Clone, Debug, PartialEq)]
pub enum NameError {
    /// There is none of this name.
    Unknown(String),
    /// It cannot have such a value.
    Unfit(&'static str),
}

/// Applies named values to the defaults.
///
/// # Errors
/// [`NameError`] for the first that cannot be.
pub fn settings<'a, T: Real>(
    values: impl Iterator<Item = (&'a str, Value)>,
) -> Result<RedundancySettings<T>, NameError> {
    let mut settings = RedundancySettings::default();
    let named = all::<T>();
    for (name, value) in values {
        let found = named.iter().find(|named| named.name == name);
        let found = found.ok_or_else(|| NameError::Unknown(name.to_string()))?;
        (found.set)(&mut settings, &value).ok_or(NameError::Unfit(found.name))?;
    }
    Ok(settings)
}

macro_rules! number {
    ($name:literal, $($field:ident).+) => {
        Named {
            name: $name,
            get: |settings| Value::Number(wide(settings.$($field).+)),
            set: |settings, value| { settings.$($field).+ = real(number(value)?); Some(()) },
        }
    };
}

macro_rules! time {
    ($name:literal, $($field:ident).+) => {
        Named {
            name: $name,
            get: |settings| Value::Number(in_seconds(settings.$($field).+)),
            set: |settings, value| { settings.$($field).+ = in_microseconds(number(value)?)?; Some(()) },
        }
    };
}

macro_rules! optional_time {
    ($name:literal, $($field:ident).+) => {
        Named {
            name: $name,
            get: |settings| settings.$($field).+.map_or(Value::None, |time| Value::Number(in_seconds(time))),
            set: |settings, value| {
                settings.$($field).+ = match value {
                    Value::None => None,
                    value => Some(in_microseconds(number(value)?)?),
                };
                Some(())
            },
        }
    };
}

macro_rules! flag {
    ($name:literal, $($field:ident).+) => {
        Named {
            name: $name,
            get: |settings| Value::Flag(settings.$($field).+),
            set: |settings, value| {
                let Value::Flag(flag) = value else { return None };
                settings.$($field).+ = *flag;
                Some(())
            },
        }
    };
}

macro_rules! choice {
    ($name:literal, $choices:ident, $($field:ident).+) => {
        Named {
            name: $name,
            get: |settings| Value::Text(word(&$choices, &settings.$($field).+).to_string()),
            set: |settings, value| {
                let Value::Text(text) = value else { return None };
                settings.$($field).+ = $choices.iter().find(|(word, _)| word == text)?.1;
                Some(())
            },
        }
    };
}

macro_rules! threshold {
    ($name:literal, $field:ident) => {
        Named {
            name: $name,
            get: |settings| Value::Text(written(&settings.evaluation.thresholds.$field)),
            set: |settings, value| {
                settings.evaluation.thresholds.$field = threshold(value)?;
                Some(())
            },
        }
    };
}

const DATA: [(&str, Data); 2] = [("raw", Data::Raw), ("compensated", Data::Compensated)];

const GATES: [(&str, Gate); 3] = [
    ("secondary alone", Gate::SecondaryAlone),
    ("whole primary", Gate::WholePrimary),
    ("sensor by sensor", Gate::SensorBySensor),
];

const SCOPES: [(&str, Scope); 2] = [
    ("all sensors", Scope::AllSensors),
    ("triggering sensor", Scope::TriggeringSensor),
];

/// Rungs of the ladder in words.
pub const RUNGS: [(&str, Rung); 4] = [
    ("offset", Rung::Offset),
    ("gain", Rung::Gain),
    ("affine", Rung::Affine),
    ("affine and lever arm", Rung::AffineAndLeverArm),
];

/// All settings, in the order they are explained.
pub fn all<T: Real>() -> Vec<Named<T>> {
    vec![
        number!("gravity", evaluation.gravity),
        time!("window", window),
        number!("first_threshold", evaluation.thresholds.first),
        number!("second_threshold", evaluation.thresholds.second),
        time!("rest_settle", evaluation.settle),
        time!("rest_duration", evaluation.duration),
        flag!("evaluate_after_start", evaluation.after_start_up),
        optional_time!("evaluate_every", evaluation.every),
        choice!("data", DATA, evaluation.data),
        flag!("vector_check", evaluation.vector_check),
        threshold!("third_threshold", third),
        threshold!("fourth_threshold", fourth),
        threshold!("fifth_threshold", fifth),
        threshold!("sixth_threshold", sixth),
        choice!("gate", GATES, evaluation.gate),
        choice!("scope", SCOPES, collection.scope),
        number!("motion_specific_force", collection.motion.specific_force),
        number!("motion_angular_rate", collection.motion.angular_rate),
        time!("motion_timeout", collection.motion_timeout),
        time!("collect", collection.collect),
        time!("collect_timeout", collection.collect_timeout),
        Named {
            name: "fewest_pairs",
            get: |settings| Value::Number(settings.collection.fewest_pairs.into()),
            set: |settings, value| {
                settings.collection.fewest_pairs = whole(number(value)?)?;
                Some(())
            },
        },
        choice!("highest_rung", RUNGS, fit.highest_rung),
        number!("excitation_specific_force", fit.excitation.specific_force),
        number!("excitation_angular_rate", fit.excitation.angular_rate),
        number!("excitation_lever_arm", fit.lever_arm_excitation),
        number!("improvement", adoption.improvement),
        number!("largest_specific_force_bias", adoption.bias.specific_force),
        number!("largest_angular_rate_bias", adoption.bias.angular_rate),
        number!("largest_scale_error", adoption.scale),
        number!("largest_misalignment", adoption.misalignment),
        number!("largest_lever_arm", adoption.lever_arm),
        number!("largest_specific_force_drift", adoption.drift.specific_force),
        number!("largest_angular_rate_drift", adoption.drift.angular_rate),
        number!(
            "largest_specific_force_residual",
            adoption.residual.specific_force
        ),
        number!("largest_angular_rate_residual", adoption.residual.angular_rate),
        time!("late", health.late),
        time!("frozen", health.frozen),
        time!("saturated", health.saturated),
        number!("spike_specific_force", health.spike.specific_force),
        number!("spike_angular_rate", health.spike.angular_rate),
        number!("family_specific_force", health.family.specific_force),
        number!("family_angular_rate", health.family.angular_rate),
        time!("family_time", health.family_time),
        number!("noise_ratio", health.noise_ratio),
        number!("rest_specific_force", health.rest.specific_force),
        number!("rest_angular_rate", health.rest.angular_rate),
        time!("recovery", health.recovery),
        time!("hold", selection.hold),
        optional_time!("return_after", selection.return_after),
        flag!("calibrated_only", selection.calibrated_only),
    ]
}

fn word<'a, C: PartialEq>(choices: &[(&'a str, C)], choice: &C) -> &'a str {
    choices
        .iter()
        .find(|(_, other)| other == choice)
        .map_or("", |(word, _)| word)
}

/// A rung in words.
pub fn rung(rung: Rung) -> &'static str {
    word(&RUNGS, &rung)
}

fn threshold<T: Real>(value: &Value) -> Option<Threshold<T>> {
    let text = match value {
        Value::Number(number) => return Some(Threshold::Fixed(real(*number))),
        Value::Text(text) => text.trim(),
        Value::Flag(_) | Value::None => return None,
    };
    let parsed = |text: &str| text.trim().parse::<f64>().ok().map(real);
    let Some(variable) = text.strip_prefix("last") else {
        return parsed(text).map(Threshold::Fixed);
    };
    match variable.trim_start().split_at_checked(1)? {
        ("+", margin) => parsed(margin).map(Threshold::VariableByMargin),
        ("*", ratio) => parsed(ratio).map(Threshold::VariableByRatio),
        _ => None,
    }
}

fn written<T: Real>(threshold: &Threshold<T>) -> String {
    match *threshold {
        Threshold::Fixed(value) => format!("{}", wide(value)),
        Threshold::VariableByMargin(margin) => format!("last+{}", wide(margin)),
        Threshold::VariableByRatio(ratio) => format!("last*{}", wide(ratio)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_of_a_setting_sets_it_again() {
        for named in all::<f64>() {
            let mut settings = RedundancySettings::default();
            let value = (named.get)(&settings);
            assert_eq!((named.set)(&mut settings, &value), Some(()), "{}", named.name);
            assert_eq!(settings, RedundancySettings::default(), "{}", named.name);
        }
    }

    #[test]
    fn no_two_settings_share_a_name_and_each_changes_something_of_its_own() {
        let named = all::<f64>();
        for (i, one) in named.iter().enumerate() {
            assert!(
                named[..i].iter().all(|other| other.name != one.name),
                "{}",
                one.name
            );
            let mut settings = RedundancySettings::default();
            let other = match (one.get)(&settings) {
                Value::Number(number) => Value::Number(number * 2.0 + 1.0),
                Value::Flag(flag) => Value::Flag(!flag),
                Value::None => Value::Number(5.0),
                Value::Text(text) if text.parse::<f64>().is_ok() => Value::Text("last+0.25".to_string()),
                Value::Text(text) => {
                    let words = ["raw", "secondary alone", "triggering sensor", "gain"];
                    let mut fit = words.iter().filter(|word| **word != text);
                    let set =
                        |word: &&&str| (one.set)(&mut settings, &Value::Text((**word).to_string())).is_some();
                    Value::Text((*fit.find(set).expect("one of them")).to_string())
                }
            };
            (one.set)(&mut settings, &other).expect(one.name);
            assert_eq!((one.get)(&settings), other, "{}", one.name);
            let changed = named
                .iter()
                .filter(|named| (named.get)(&settings) != (named.get)(&RedundancySettings::default()));
            assert_eq!(changed.count(), 1, "{}", one.name);
        }
    }

    #[test]
    fn thresholds_are_written_as_they_are_meant() {
        for (text, meant) in [
            ("0.1", Threshold::Fixed(0.1)),
            ("last+0.1", Threshold::VariableByMargin(0.1)),
            ("last * 1.5", Threshold::VariableByRatio(1.5)),
        ] {
            assert_eq!(threshold::<f64>(&Value::Text(text.to_string())), Some(meant));
        }
        for text in ["", "last", "last-0.1", "first+0.1", "0,1", "last+"] {
            assert_eq!(threshold::<f64>(&Value::Text(text.to_string())), None, "{text}");
        }
    }
}
