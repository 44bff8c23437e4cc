//! Which rests of the target belong to which of the reference.

use crate::acquisition::Acquired;
use crate::turntable::error::PairingError;
use crate::turntable::settings::Clocks;

mod by_clock;
mod by_file;
mod rests;

pub use rests::{PairedRest, Pairing};

/// Lays the target beside the reference.
///
/// # Errors
/// [`PairingError`] as it says.
pub fn pair(reference: &Acquired, target: &Acquired, clocks: Clocks) -> Result<Pairing, PairingError> {
    match (in_files(reference), in_files(target)) {
        (true, true) => by_file::pair_by_file(reference, target),
        (false, false) => by_clock::pair_by_clock(reference, target, clocks),
        _ => Err(PairingError::OneInFiles),
    }
}

fn in_files(unit: &Acquired) -> bool {
    unit.parts.first().is_some_and(|part| !part.name.is_empty())
}
