//! Which spans of a session were at rest, and which of them in the same place.
//!
//! The segmenter of the core ends a rest that drifts; here drift is what is looked for. So a span is at rest where it
//! scatters as little as the quietest do, and rests on where it is level with the one before it: temperature drifts
//! slowly, motion does not.

use tumble_core::stillness::{Scatter, Stillness, StillnessSettings};

use super::recorder::Span;

/// Share of the spans that are quieter than the noise floor: a unit that moved for most of the time has one too.
const QUIETEST: f64 = 0.1;

/// The number of the rest that each span of a session belongs to; None where the unit moved.
pub fn rests(spans: &[Span]) -> Vec<Option<usize>> {
    let scatters: Vec<Scatter<f64>> = spans.iter().map(|span| Scatter::of(&span.moments)).collect();
    let with_floor = |floor| Stillness::with_floor(StillnessSettings::default(), floor);
    let quietest = with_floor(quietest(&scatters));
    let quiet: Vec<Scatter<f64>> = scatters
        .iter()
        .copied()
        .filter(|scatter| quietest.is_quiet(scatter))
        .collect();
    let usual = with_floor(mean(&quiet));
    let mut last: Option<&Span> = None;
    let mut rest = 0;
    spans
        .iter()
        .zip(&scatters)
        .map(|(span, scatter)| {
            if !quietest.is_quiet(scatter) {
                return None;
            }
            let moved = last.is_some_and(|last| !usual.is_level(&last.moments, &span.moments));
            rest += usize::from(moved);
            last = Some(span);
            Some(rest)
        })
        .collect()
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

fn mean(scatters: &[Scatter<f64>]) -> Scatter<f64> {
    let count = scatters.len().max(1) as f64;
    of_both(|of| scatters.iter().map(of).sum::<f64>() / count)
}

fn of_both(value: impl Fn(fn(&Scatter<f64>) -> f64) -> f64) -> Scatter<f64> {
    Scatter {
        specific_force: value(|scatter| scatter.specific_force),
        angular_rate: value(|scatter| scatter.angular_rate),
    }
}
