//! What may be chosen in the settings, in words.

use tumble_core::redundancy::settings::{Data, Gate, Rung, Scope};

/// Which data deviations are taken from.
pub const DATA: [(&str, Data); 2] = [("compensated", Data::Compensated), ("raw", Data::Raw)];

/// Whose deviations count.
pub const GATES: [(&str, Gate); 3] = [
    ("secondary alone", Gate::SecondaryAlone),
    ("whole primary", Gate::WholePrimary),
    ("sensor by sensor", Gate::SensorBySensor),
];

/// What is calibrated.
pub const SCOPES: [(&str, Scope); 2] = [
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

/// The word for a choice.
pub fn word<'a, C: PartialEq>(choices: &[(&'a str, C)], choice: &C) -> &'a str {
    choices
        .iter()
        .find(|(_, other)| other == choice)
        .map_or("", |(word, _)| word)
}

/// A rung in words.
pub fn rung(rung: Rung) -> &'static str {
    word(&RUNGS, &rung)
}
