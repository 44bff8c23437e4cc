//! Which rests of the target belong to which of the reference.

use tumble_core::noise::Interval;
use tumble_core::turntable::clock::ClockFit;

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
/// Those of [`PairingError`].
pub fn pair(reference: &Acquired, target: &Acquired, clocks: Clocks) -> Result<Pairing, PairingError> {
    match (in_files(reference), in_files(target)) {
        (true, true) => by_file::pair_by_file(reference, target),
        (false, false) => by_clock::pair_by_clock(reference, target, clocks),
        _ => Err(PairingError::OneInFiles),
    }
}

/// Lays the target beside a reference that shows constant rates and hardly any rest: by the clock they share.
///
/// # Errors
/// [`PairingError`] where the recordings have no time in common, or clocks of their own.
pub fn pair_rates(reference: &Acquired, target: &Acquired, clocks: Clocks) -> Result<Pairing, PairingError> {
    if let Ok(pairing) = pair(reference, target, clocks) {
        return Ok(pairing);
    }
    let offset = reference.origin - target.origin;
    let clock = ClockFit::known(offset);
    let span = reference.session();
    let seen = Interval {
        start: span.start + offset,
        end: span.end + offset,
    };
    if clocks == Clocks::Apart || target.motion.within(&seen).is_empty() {
        return Err(PairingError::NoCommonTime);
    }
    Ok(Pairing {
        clock,
        shared: true,
        pairs: Vec::new(),
        continued: Vec::new(),
        contradiction: None,
    })
}

fn in_files(unit: &Acquired) -> bool {
    unit.parts.first().is_some_and(|part| !part.name.is_empty())
}
