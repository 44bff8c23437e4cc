//! Which rests of the target belong to which of the reference.

use tumble_core::noise::Interval;
use tumble_core::segmenter::Stretch;
use tumble_core::turntable::clock::{ClockFit, TurnMark, centre_sigma, fit_clock, search_offset};

use crate::acquisition::{Acquired, interval, seconds};
use crate::turntable::FEWEST_RESTS;

mod files;
use files::pair_files;

/// How the two clocks are related.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clocks {
    /// One clock stamped both recordings.
    Shared,
    /// Each recording has its own; offset and skew are estimated.
    Apart,
    /// Shared if the recordings overlap in time and their turns coincide, else apart.
    Unknown,
}

/// A rest both units saw.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Index of the reference rest.
    pub reference: usize,
    /// First and last of the target's rests within it.
    pub target: (usize, usize),
    /// The target's rest, joined.
    pub stretch: Stretch<f64>,
}

/// Why a target could not be laid beside the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairingError {
    /// No turn or rest of the target meets one of the reference.
    NoCommonTime,
    /// The target turned in itself while the reference stood still.
    MovedDuringRest {
        /// Index of the reference rest.
        rest: usize,
        /// When, s of the target's own clock.
        time: f64,
        /// By how much its gravity turned, deg.
        angle: f64,
    },
    /// The reference turned in itself while the target stood still.
    ReferenceMoved {
        /// When, s of the reference's clock.
        time: f64,
        /// By how much its gravity turned, deg.
        angle: f64,
    },
    /// One unit was recorded in one file a pose, the other continuously.
    OneInFiles,
    /// No file of the target has the name of one of the reference.
    NoCommonFile,
    /// Both units rested often enough, but hardly ever at the same time.
    FewMeet {
        /// Rests both saw.
        met: usize,
        /// Rests of the target.
        rests: usize,
    },
    /// The clocks are said to be shared, and then hardly any rest meets another.
    ClocksApart {
        /// What the turns show the offset to be, s.
        offset: f64,
    },
}

/// Both units laid beside each other.
#[derive(Clone, Debug)]
pub struct Pairing {
    /// The clocks.
    pub clock: ClockFit<f64>,
    /// Whether one clock stamped both.
    pub shared: bool,
    /// Rests both saw, in order.
    pub pairs: Vec<Pair>,
    /// Rests of the reference that only go on with the one before, as the target shows.
    pub continued: Vec<usize>,
    /// Offset the turns show although the clocks were said to be shared, s, with its sigma.
    pub contradiction: Option<(f64, f64)>,
}

/// Offsets below this are the latency of a logger, not another clock, s.
const SAME_CLOCK: f64 = 0.1;

/// Skew below this is none: it would change a scale by as much.
const SAME_RATE: f64 = 1e-6;

/// Whether the turns meet as they do under one clock.
fn coincide(clock: &ClockFit<f64>, given: f64) -> bool {
    let skew_sigma = clock.covariance[(1, 1)].sqrt();
    (clock.offset - given).abs() <= SAME_CLOCK && clock.skew.abs() <= SAME_RATE.max(5.0 * skew_sigma)
}

/// Lays the target beside the reference.
///
/// # Errors
/// [`PairingError`] as it says.
pub fn pair(reference: &Acquired, target: &Acquired, clocks: Clocks) -> Result<Pairing, PairingError> {
    match (in_files(reference), in_files(target)) {
        (true, true) => return pair_files(reference, target),
        (false, false) => {}
        _ => return Err(PairingError::OneInFiles),
    }
    let given = reference.origin - target.origin;
    let estimated = estimate(reference, target);
    let (clock, shared) = match (clocks, estimated) {
        (Clocks::Shared, _) => (ClockFit::known(given), true),
        (Clocks::Unknown, Some(clock)) if coincide(&clock, given) => (ClockFit::known(given), true),
        (_, Some(clock)) => (clock, false),
        (Clocks::Unknown, None) if overlap(reference, target, given) => (ClockFit::known(given), true),
        (_, None) => return Err(PairingError::NoCommonTime),
    };
    let contradiction = estimated
        .filter(|clock| shared && (clock.offset - given).abs() > SAME_CLOCK)
        .map(|clock| (clock.offset - given, clock.covariance[(0, 0)].sqrt()));
    let (pairs, continued) = meet(reference, target, &clock)?;
    match contradiction {
        Some((offset, _)) if pairs.len() < FEWEST_RESTS => Err(PairingError::ClocksApart { offset }),
        _ if pairs.is_empty() => Err(PairingError::NoCommonTime),
        _ if pairs.len() < FEWEST_RESTS && reference.rests.len().min(target.rests.len()) >= FEWEST_RESTS => {
            Err(PairingError::FewMeet {
                met: pairs.len(),
                rests: target.rests.len(),
            })
        }
        _ => Ok(Pairing {
            clock,
            shared,
            pairs,
            continued,
            contradiction,
        }),
    }
}

fn in_files(unit: &Acquired) -> bool {
    unit.parts.first().is_some_and(|part| !part.name.is_empty())
}

fn overlap(reference: &Acquired, target: &Acquired, offset: f64) -> bool {
    let (r, t) = (reference.session(), target.session());
    r.start + offset < t.end && t.start < r.end + offset
}

fn estimate(reference: &Acquired, target: &Acquired) -> Option<ClockFit<f64>> {
    let (a, b) = (marks(reference), marks(target));
    let first = search_offset(&a, &b)?;
    fit_clock(&a, &b, first).ok()
}

/// The turns of a unit, with the bias taken from the rests beside them.
fn marks(unit: &Acquired) -> Vec<TurnMark<f64>> {
    let noise = unit.rate_noise();
    let mean = |f: fn(&tumble_core::noise::Noise<f64>) -> f64| noise.iter().map(f).sum::<f64>() / 3.0;
    let noise = tumble_core::noise::Noise {
        white: mean(|n| n.white),
        flicker: mean(|n| n.flicker),
        flicker_shown: 0.0,
        flicker_sigma: 0.0,
    };
    unit.turns
        .iter()
        .zip(unit.rests.windows(2))
        .filter(|(turn, _)| turn.complete)
        .filter_map(|(turn, rests)| {
            let bias = (rests[0].angular_rate() + rests[1].angular_rate()) * 0.5;
            let centre = turn.centre_of_turn(&bias)?;
            let duration = turn.duration();
            let angle = (turn.angle() - bias * duration).norm();
            let sigma = centre_sigma(&noise, duration, angle);
            Some(TurnMark {
                centre: seconds(turn.start) + centre,
                sigma,
                angle,
            })
        })
        .collect()
}

/// Two intervals are the same rest if they share half of the shorter.
fn same_rest(a: &Interval<f64>, b: &Interval<f64>) -> bool {
    let common = a.end.min(b.end) - a.start.max(b.start);
    common > 0.5 * a.duration().min(b.duration())
}

/// Rests both saw, and those of the reference that only go on with the one before.
type Met = (Vec<Pair>, Vec<usize>);

fn meet(reference: &Acquired, target: &Acquired, clock: &ClockFit<f64>) -> Result<Met, PairingError> {
    let (mut pairs, mut continued) = (Vec::new(), Vec::new());
    for (k, rest) in reference.rests.iter().enumerate() {
        let when = interval(rest);
        let inside: Vec<usize> = (0..target.rests.len())
            .filter(|&j| {
                let own = interval(&target.rests[j]);
                let seen = Interval {
                    start: clock.to_reference(own.start),
                    end: clock.to_reference(own.end),
                };
                same_rest(&when, &seen)
            })
            .collect();
        let (Some(&first), Some(&last)) = (inside.first(), inside.last()) else {
            continue;
        };
        stayed_put(target, k, first, last)?;
        if pairs.last().is_some_and(|pair: &Pair| pair.target.1 >= first) {
            reference_stayed_put(reference, k)?;
            continued.push(k);
            continue;
        }
        let Some(stretch) = target.joined(first, last) else {
            continue;
        };
        pairs.push(Pair {
            reference: k,
            target: (first, last),
            stretch,
        });
    }
    Ok((pairs, continued))
}

/// Turning of gravity within one rest that a target at peace does not show, rad.
const MOVED: f64 = 0.005;

fn stayed_put(target: &Acquired, rest: usize, first: usize, last: usize) -> Result<(), PairingError> {
    match (first + 1..=last).find_map(|j| moved(target, j)) {
        Some((time, angle)) => Err(PairingError::MovedDuringRest { rest, time, angle }),
        None => Ok(()),
    }
}

/// The target stood still from the rest of the reference before until this one.
fn reference_stayed_put(reference: &Acquired, rest: usize) -> Result<(), PairingError> {
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
    let when = 0.5 * (seconds(before.end) + seconds(after.start));
    (angle > MOVED).then(|| (unit.origin + when, angle.to_degrees()))
}
