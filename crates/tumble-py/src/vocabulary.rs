//! Words of core and lab, for whoever explains them.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use tumble_core::redundancy::aiding::{AidingKind, AidingRejection};
use tumble_core::redundancy::fit::adoption::RefusalReason;
use tumble_core::redundancy::gate::Withheld;
use tumble_core::redundancy::health::HealthFault;
use tumble_core::redundancy::isolation::attribution::Ground;
use tumble_core::redundancy::monitor::Command;
use tumble_core::redundancy::monitor::event::{Abandoned, Check, EventKind, RecordRejection};
use tumble_core::redundancy::platform::PlatformError;
use tumble_core::redundancy::selection::SelectionReason;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::validate::SettingError;
use tumble_core::redundancy::settings::{Data, FitModel, Gate, Scope};
use tumble_core::spin::failure::SpinFailure;
use tumble_core::spin::machine::{SpinEvent, SpinState};
use tumble_lab::acquisition::RestRejection;
use tumble_lab::acquisition::channels::ChannelFaultKind;
use tumble_lab::align::AlignError;
use tumble_lab::magnetometer::MagnetometerError;
use tumble_lab::multipose::{MultiposeError, SectionLabel};
use tumble_lab::noise::disturbance::DisturbanceKind;
use tumble_lab::noise::term::NoiseTerm;
use tumble_lab::thermal::procedure::ThermalError;
use tumble_lab::turntable::{PairingError, TurntableError};
use tumble_lab::verdict::Verdict;

/// Every kind of word, and its words in the core's order.
const KINDS: [(&str, &[&str]); 34] = [
    ("event", EventKind::<f64>::NAMES),
    ("check", Check::NAMES),
    ("withheld", Withheld::NAMES),
    ("refused", RefusalReason::NAMES),
    ("abandoned", Abandoned::NAMES),
    ("record rejected", RecordRejection::NAMES),
    ("aiding", AidingKind::NAMES),
    ("aiding left out", AidingRejection::NAMES),
    ("unhealthy", HealthFault::<f64>::NAMES),
    ("ground", Ground::NAMES),
    ("selected", SelectionReason::NAMES),
    ("command", Command::NAMES),
    ("sensor", Sensor::NAMES),
    ("fit_model", FitModel::NAMES),
    ("data", Data::NAMES),
    ("gate", Gate::NAMES),
    ("scope", Scope::NAMES),
    ("setting error", SettingError::NAMES),
    ("platform error", PlatformError::NAMES),
    ("align error", AlignError::NAMES),
    ("turntable error", TurntableError::NAMES),
    ("pairing error", PairingError::NAMES),
    ("magnetometer error", MagnetometerError::NAMES),
    ("multipose error", MultiposeError::NAMES),
    ("section", SectionLabel::NAMES),
    ("rejected rest", RestRejection::NAMES),
    ("channel fault", ChannelFaultKind::NAMES),
    ("spin event", SpinEvent::NAMES),
    ("spin state", SpinState::<f64>::NAMES),
    ("spin failure", SpinFailure::<f64>::NAMES),
    ("noise term", NoiseTerm::NAMES),
    ("disturbance", DisturbanceKind::NAMES),
    ("thermal error", ThermalError::NAMES),
    ("verdict", Verdict::NAMES),
];

/// Adds this part to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let vocabulary = PyDict::new(py);
    for (kind, words) in KINDS {
        // Two events may bear one word: that there is a source, and that there is none any more.
        let mut words = words.to_vec();
        words.dedup();
        vocabulary.set_item(kind, PyTuple::new(py, words)?)?;
    }
    module.add("VOCABULARY", vocabulary)
}
