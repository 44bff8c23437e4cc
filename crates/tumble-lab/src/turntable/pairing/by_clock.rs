//! Recordings that go on from rest to rest: a rest of the target is one of the reference if both took place at a time.

use tumble_core::noise::Interval;
use tumble_core::real::seconds;
use tumble_core::segmenter::Segment;
use tumble_core::turntable::clock::{ClockFit, TurnMark, centre_sigma, fit_clock, search_offset, turns_met};

use super::rests::{Met, PairedRest, Pairing, reference_stayed_put, stayed_put};
use crate::acquisition::{Acquired, interval};
use crate::turntable::error::PairingError;
use crate::turntable::settings::{Clocks, FEWEST_RESTS};

/// Offsets below this are the latency of a logger, not another clock, s.
const SAME_CLOCK: f64 = 0.1;

/// Skew below this is none: it would change a scale by as much.
const SAME_RATE: f64 = 1e-6;

/// True where the turns meet as they do under one clock. Times that were fitted go alike only as far as their pace is known:
/// where turns show it better, what they show holds.
fn coincide(clock: &ClockFit<f64>, given: f64, pace_sigma: f64) -> bool {
    let skew_sigma = clock.covariance[(1, 1)].sqrt();
    pace_sigma <= SAME_RATE.max(skew_sigma)
        && (clock.offset - given).abs() <= SAME_CLOCK
        && clock.skew.abs() <= SAME_RATE.max(5.0 * skew_sigma)
}

/// Lays a target beside its reference, by the turns both felt.
pub(super) fn pair_by_clock(
    reference: &Acquired,
    target: &Acquired,
    clocks: Clocks,
) -> Result<Pairing, PairingError> {
    let given = reference.origin - target.origin;
    let pace_sigma = reference.pace_sigma.hypot(target.pace_sigma);
    let estimated = estimate(reference, target, (clocks != Clocks::Apart).then_some(given));
    let (clock, shared) = match (clocks, estimated) {
        (Clocks::Shared, _) => (ClockFit::known(given), true),
        (Clocks::Unknown, Some(clock)) if coincide(&clock, given, pace_sigma) => {
            (ClockFit::known(given), true)
        }
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

fn overlap(reference: &Acquired, target: &Acquired, offset: f64) -> bool {
    let (r, t) = (reference.session(), target.session());
    r.start + offset < t.end && t.start < r.end + offset
}

/// Turns alike, as those of a table are, meet as well one turn later where some are missing: of offsets that explain as
/// many turns, the one that the stamps give is the right one.
fn estimate(reference: &Acquired, target: &Acquired, given: Option<f64>) -> Option<ClockFit<f64>> {
    let (a, b) = (marks(reference), marks(target));
    let found = search_offset(&a, &b)?;
    let as_good = |given: &f64| turns_met(&a, &b, *given) >= turns_met(&a, &b, found);
    fit_clock(&a, &b, given.filter(as_good).unwrap_or(found)).ok()
}

/// A turn of which more is missing may be centred, and go, anywhere.
const LARGEST_UNSEEN: f64 = 0.2;

/// Share of a turn in which samples are missing.
fn unseen(turn: &Segment<f64>) -> f64 {
    let missing = f64::from(turn.interpolation.missing);
    missing / (missing + f64::from(turn.moments.samples()))
}

/// The turns of a unit, with the bias taken from the rests beside them.
fn marks(unit: &Acquired) -> Vec<TurnMark<f64>> {
    let noise = &unit.abrupt_rate_noise;
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
        .filter(|(turn, _)| turn.complete || unseen(turn) < LARGEST_UNSEEN)
        .filter_map(|(turn, rests)| {
            let bias = (rests[0].angular_rate() + rests[1].angular_rate()) * 0.5;
            let centre = turn.centre_of_turn(&bias)?;
            let duration = turn.duration();
            let angle = (turn.angle() - bias * duration).norm();
            let blind = if turn.complete {
                0.0
            } else {
                unseen(turn) * duration
            };
            let sigma = centre_sigma(&noise, duration, angle).hypot(blind);
            Some(TurnMark {
                centre: seconds::<f64>(turn.start) + centre,
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

fn meet(reference: &Acquired, target: &Acquired, clock: &ClockFit<f64>) -> Result<Met, PairingError> {
    let mut met: Vec<Common> = Vec::new();
    for k in 0..reference.rests.len() {
        let Some(common) = Common::of(reference, target, clock, k) else {
            continue;
        };
        stayed_put(target, k, common.first, common.last)?;
        if met.last().is_some_and(|before| before.shares(&common)) {
            reference_stayed_put(reference, k)?;
        }
        met.push(common);
    }
    let (mut pairs, mut continued) = (Vec::new(), Vec::new());
    for (i, common) in met.iter().enumerate() {
        let after = i > 0 && met[i - 1].shares(common);
        let before = met.get(i + 1).is_some_and(|next| common.shares(next));
        let cut = (after || before)
            .then(|| common.cut(reference, target, clock))
            .flatten();
        if cut.is_none() && after {
            continued.push(common.reference);
        } else if let Some(segment) = cut.or_else(|| target.joined(common.first, common.last)) {
            pairs.push(PairedRest {
                reference: common.reference,
                target: (common.first, common.last),
                segment,
            });
        }
    }
    Ok((pairs, continued))
}

/// A rest of the reference and those of the target that took place then.
struct Common {
    reference: usize,
    first: usize,
    last: usize,
}

impl Common {
    fn of(reference: &Acquired, target: &Acquired, clock: &ClockFit<f64>, k: usize) -> Option<Self> {
        let when = interval(&reference.rests[k]);
        let mut inside = (0..target.rests.len()).filter(|&j| {
            let own = interval(&target.rests[j]);
            let seen = Interval {
                start: clock.to_reference(own.start),
                end: clock.to_reference(own.end),
            };
            same_rest(&when, &seen)
        });
        let first = inside.next()?;
        Some(Self {
            reference: k,
            first,
            last: inside.next_back().unwrap_or(first),
        })
    }

    /// Tests whether the target rested on where the reference saw another rest.
    fn shares(&self, next: &Self) -> bool {
        self.last >= next.first
    }

    /// The rest of the target while the reference rested: what disturbed the reference may have turned both.
    fn cut(&self, reference: &Acquired, target: &Acquired, clock: &ClockFit<f64>) -> Option<Segment<f64>> {
        let when = interval(&reference.rests[self.reference]);
        let own = |time: f64| time + clock.offset_at(time).0;
        let span = Interval {
            start: own(when.start),
            end: own(when.end),
        };
        (self.first == self.last)
            .then(|| target.cut(self.first, &span))
            .flatten()
    }
}
