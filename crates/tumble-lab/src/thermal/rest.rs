//! Which spans of a session were at rest, and which of them in the same place.
//!
//! The segmenter of the core ends a rest that drifts; here drift is what is looked for. So a span is at rest where it
//! scatters as little as the quietest do. A unit that nobody touched is in one place whatever it drifts: another place
//! begins where specific force has changed by more than drift makes of that time, and, without motion or a pause between,
//! only where it jumps.

use tumble_core::sample::CHANNELS;
use tumble_core::stillness::{Scatter, Stillness, StillnessSettings};

use super::recorder::Span;
use crate::distributions::median;

/// Share of the spans that are quieter than the noise floor: a unit that moved for most of the time has one too.
const QUIETEST: f64 = 0.1;

/// m/s^2 that specific force changes by at least where the unit was turned, and where nothing showed that it moved.
const TURNED: f64 = 5e-3;
const JUMPED: f64 = 0.05;
/// Usual changes from span to span that drift stays below.
const USUAL_CHANGES: f64 = 6.0;
/// Spans over which drift is separated from noise.
const SLOWLY: usize = 30;
/// Usual lengths of a span from which on the time between two is a pause.
const PAUSE: f64 = 3.0;

/// The number of the rest that each span of a session belongs to; None where the unit moved.
pub fn rests(spans: &[Span]) -> Vec<Option<usize>> {
    let scatters: Vec<Scatter<f64>> = spans.iter().map(|span| Scatter::of(&span.moments)).collect();
    let with_floor = |floor| Stillness::with_floor(StillnessSettings::default(), floor);
    let quietest = with_floor(quietest(&scatters));
    let is_quiet: Vec<bool> = scatters
        .iter()
        .map(|scatter| quietest.is_quiet(scatter))
        .collect();
    let drift = Drift::of(spans, &is_quiet);
    let mut last: Option<&Span> = None;
    let mut rest = 0;
    spans
        .iter()
        .zip(&is_quiet)
        .enumerate()
        .map(|(number, (span, is_quiet))| {
            if !is_quiet {
                return None;
            }
            let follows = number > 0 && last.is_some_and(|last| last.time == spans[number - 1].time);
            rest += usize::from(last.is_some_and(|last| drift.moved(last, span, follows)));
            last = Some(span);
            Some(rest)
        })
        .collect()
}

/// Usual changes of specific force at rest.
struct Drift {
    /// From span to span, noise above all, m/s^2.
    change: f64,
    /// m/s^3.
    pace: f64,
    /// From span to span, s.
    interval: f64,
}

impl Drift {
    fn of(spans: &[Span], is_quiet: &[bool]) -> Self {
        let at_rest = |apart: usize| {
            spans
                .windows(apart + 1)
                .zip(is_quiet.windows(apart + 1))
                .filter(|(_, quiet)| quiet.iter().all(|quiet| *quiet))
                .map(move |(spans, _)| {
                    (
                        change(&spans[0], &spans[apart]),
                        spans[apart].middle() - spans[0].middle(),
                    )
                })
        };
        let usual =
            |values: &mut dyn Iterator<Item = f64>| median(&mut values.collect::<Vec<_>>()).unwrap_or(0.0);
        Self {
            change: usual(&mut at_rest(1).map(|(change, _)| change)),
            pace: usual(&mut at_rest(SLOWLY).map(|(change, time)| change / time)),
            interval: usual(&mut spans.windows(2).map(|pair| pair[1].middle() - pair[0].middle())),
        }
    }

    /// True where the unit is in another place than it was in an earlier span.
    fn moved(&self, earlier: &Span, later: &Span, follows: bool) -> bool {
        let time = later.middle() - earlier.middle();
        let least = if follows && time < PAUSE * self.interval {
            JUMPED
        } else {
            TURNED
        };
        change(earlier, later) > least.max(USUAL_CHANGES * (self.change + self.pace * time))
    }
}

/// m/s^2 between the specific forces of two spans.
fn change(a: &Span, b: &Span) -> f64 {
    let (a, b) = (a.moments.mean(), b.moments.mean());
    (0..CHANNELS / 2)
        .map(|axis| (b[axis] - a[axis]).powi(2))
        .sum::<f64>()
        .sqrt()
}

fn quietest(scatters: &[Scatter<f64>]) -> Scatter<f64> {
    let quiet = |of: fn(&Scatter<f64>) -> f64| {
        let mut all: Vec<f64> = scatters.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let place = (QUIETEST * all.len() as f64) as usize;
        all.get(place).copied().unwrap_or(0.0)
    };
    of_both(quiet)
}

fn of_both(value: impl Fn(fn(&Scatter<f64>) -> f64) -> f64) -> Scatter<f64> {
    Scatter {
        specific_force: value(|scatter| scatter.specific_force),
        angular_rate: value(|scatter| scatter.angular_rate),
    }
}
