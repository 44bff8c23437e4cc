//! Which rests of the target belong to which of the reference.

use tumble_core::noise::Interval;
use tumble_core::segmenter::Stretch;
use tumble_core::turntable::clock::{ClockFit, TurnMark, centre_sigma, fit_clock, search_offset};

use crate::acquisition::{Acquired, interval, seconds};

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
    /// Offset the turns show although the clocks were said to be shared, s, with its sigma.
    pub contradiction: Option<(f64, f64)>,
}

/// Offsets below this are the latency of a logger, not another clock, s.
const SAME_CLOCK: f64 = 0.1;

/// Lays the target beside the reference.
///
/// # Errors
/// [`PairingError`] as it says.
pub fn pair(reference: &Acquired, target: &Acquired, clocks: Clocks) -> Result<Pairing, PairingError> {
    let given = reference.origin - target.origin;
    let estimated = estimate(reference, target);
    let coincide = |clock: &ClockFit<f64>| (clock.offset - given).abs() <= SAME_CLOCK;
    let (clock, shared) = match (clocks, estimated) {
        (Clocks::Shared, _) => (ClockFit::known(given), true),
        (Clocks::Unknown, Some(clock)) if coincide(&clock) => (ClockFit::known(given), true),
        (_, Some(clock)) => (clock, false),
        (Clocks::Unknown, None) if overlap(reference, target, given) => (ClockFit::known(given), true),
        (_, None) => return Err(PairingError::NoCommonTime),
    };
    let contradiction = estimated
        .filter(|clock| shared && !coincide(clock))
        .map(|clock| (clock.offset - given, clock.covariance[(0, 0)].sqrt()));
    let pairs = meet(reference, target, &clock)?;
    if pairs.is_empty() {
        return Err(PairingError::NoCommonTime);
    }
    Ok(Pairing {
        clock,
        shared,
        pairs,
        contradiction,
    })
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

fn meet(reference: &Acquired, target: &Acquired, clock: &ClockFit<f64>) -> Result<Vec<Pair>, PairingError> {
    let mut pairs = Vec::new();
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
        let taken = pairs.last().is_some_and(|pair: &Pair| pair.target.1 >= first);
        let Some(stretch) = target.joined(first, last).filter(|_| !taken) else {
            continue;
        };
        pairs.push(Pair {
            reference: k,
            target: (first, last),
            stretch,
        });
    }
    Ok(pairs)
}

/// Turning of gravity within one rest that a target at peace does not show, rad.
const MOVED: f64 = 0.005;

fn stayed_put(target: &Acquired, rest: usize, first: usize, last: usize) -> Result<(), PairingError> {
    for j in first + 1..=last {
        let (before, after) = (&target.rests[j - 1], &target.rests[j]);
        let angle = before.specific_force().angle(&after.specific_force());
        if angle > MOVED {
            return Err(PairingError::MovedDuringRest {
                rest,
                time: target.origin + seconds(before.end),
                angle: angle.to_degrees(),
            });
        }
    }
    Ok(())
}
