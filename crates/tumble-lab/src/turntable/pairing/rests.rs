//! Rests that two units saw, and whether both stood still for each.

use tumble_core::real::seconds;
use tumble_core::segmenter::Segment;
use tumble_core::turntable::clock::ClockFit;

use crate::acquisition::Acquired;
use crate::turntable::error::PairingError;

/// A rest both units saw.
#[derive(Clone, Debug)]
pub struct PairedRest {
    /// Index of the reference rest.
    pub reference: usize,
    /// First and last of the target's rests within it.
    pub target: (usize, usize),
    /// The target's rest, joined.
    pub segment: Segment<f64>,
}

/// Both units laid beside each other.
#[derive(Clone, Debug)]
pub struct Pairing {
    /// The clocks.
    pub clock: ClockFit<f64>,
    /// True if one clock stamped both.
    pub shared: bool,
    /// Rests both saw, in order.
    pub pairs: Vec<PairedRest>,
    /// Rests of the reference that only go on with the one before, as the target shows.
    pub continued: Vec<usize>,
    /// Offset by the turns although the clocks were stated to be shared, s, with its sigma.
    pub contradiction: Option<(f64, f64)>,
}

/// Rests both saw, and those of the reference that only go on with the one before.
pub(super) type Met = (Vec<PairedRest>, Vec<usize>);

/// Turning of gravity within one rest that a target at peace does not show, rad.
const MOVED: f64 = 0.005;

pub(super) fn stayed_put(
    target: &Acquired,
    rest: usize,
    first: usize,
    last: usize,
) -> Result<(), PairingError> {
    match (first + 1..=last).find_map(|j| moved(target, j)) {
        Some((time, angle)) => Err(PairingError::MovedDuringRest { rest, time, angle }),
        None => Ok(()),
    }
}

/// The target stood still from the rest of the reference before until this one.
pub(super) fn reference_stayed_put(reference: &Acquired, rest: usize) -> Result<(), PairingError> {
    match moved(reference, rest) {
        Some((time, angle)) => Err(PairingError::ReferenceMoved { time, angle }),
        None => Ok(()),
    }
}

/// When a unit turned since the rest before, s of its own clock, and by how much, deg; `None` if it did not.
fn moved(unit: &Acquired, rest: usize) -> Option<(f64, f64)> {
    let (before, after) = (unit.rests.get(rest.checked_sub(1)?)?, unit.rests.get(rest)?);
    let angle = before.specific_force().angle(&after.specific_force());
    // The rests beside it are cut short alike.
    let when = 0.5 * (seconds::<f64>(before.end) + seconds::<f64>(after.start));
    (angle > MOVED).then(|| (unit.origin + when, angle.to_degrees()))
}
