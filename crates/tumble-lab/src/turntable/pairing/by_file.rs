//! Recordings that come as one file a pose: files of one name show one pose.
//!
//! The time from one file to the next is unknown, so no clock leads from the reference to the target.

use tumble_core::real::seconds;
use tumble_core::turntable::clock::ClockFit;

use super::rests::{Met, PairedRest, Pairing, reference_stayed_put, stayed_put};
use crate::acquisition::Acquired;
use crate::turntable::error::PairingError;

/// Lays a target beside its reference, file by file.
pub(super) fn pair_by_file(reference: &Acquired, target: &Acquired) -> Result<Pairing, PairingError> {
    let (mut pairs, mut continued) = (Vec::new(), Vec::new());
    for (number, part) in reference.parts.iter().enumerate() {
        let Some(other) = target.parts.iter().position(|other| other.name == part.name) else {
            continue;
        };
        let (ours, theirs) = (rests_of(reference, number), rests_of(target, other));
        let (found, more) = meet(reference, target, &ours, &theirs)?;
        pairs.extend(found);
        continued.extend(more);
    }
    if pairs.is_empty() {
        return Err(PairingError::NoCommonFile);
    }
    Ok(Pairing {
        clock: ClockFit::known(reference.origin - target.origin),
        shared: true,
        pairs,
        continued,
        contradiction: None,
    })
}

/// Indices of the rests of one file.
fn rests_of(unit: &Acquired, part: usize) -> Vec<usize> {
    let start = unit.parts[part].start;
    let end = unit.parts.get(part + 1).map_or(f64::INFINITY, |next| next.start);
    let within = |rest: &usize| (start..end).contains(&seconds(unit.rests[*rest].start));
    (0..unit.rests.len()).filter(within).collect()
}

/// Rests of one file of each unit: one by one if there are as many, else all are taken for one that was interrupted.
fn meet(
    reference: &Acquired,
    target: &Acquired,
    ours: &[usize],
    theirs: &[usize],
) -> Result<Met, PairingError> {
    let one = |k: usize, first: usize, last: usize| {
        target.joined(first, last).map(|segment| PairedRest {
            reference: k,
            target: (first, last),
            segment,
        })
    };
    if ours.len() == theirs.len() {
        let pairs = ours.iter().zip(theirs).filter_map(|(&k, &j)| one(k, j, j));
        return Ok((pairs.collect(), Vec::new()));
    }
    let ([first, more @ ..], Some(from), Some(to)) = (ours, theirs.first(), theirs.last()) else {
        return Ok((Vec::new(), Vec::new()));
    };
    stayed_put(target, *first, *from, *to)?;
    more.iter()
        .try_for_each(|&k| reference_stayed_put(reference, k))?;
    Ok((one(*first, *from, *to).into_iter().collect(), more.to_vec()))
}
