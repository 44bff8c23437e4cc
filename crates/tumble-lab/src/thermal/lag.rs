//! How far the thermometer is behind the sensor, or before it (docs/theory/thermal.md, Temperature).

use super::block::{Block, ThermalBlocks};
use super::fit::{AxisFit, Design, Terms};
use super::whitening::Whitening;

/// Time constants that are tried first, s, evenly over their square roots.
const LARGEST: f64 = 600.0;
const EACH_SIDE: i32 = 12;
/// Between the neighbours of the best of these, so many more.
const FINER: i32 = 8;
/// Logarithm of the ratio of likelihoods from which a lag is believed.
const CLEARLY: f64 = 5.0;
/// From which on hysteresis is more than chance.
const SIGMAS: f64 = 4.0;

/// A time constant of the thermometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lag {
    /// s; negative where the sensor is behind the thermometer.
    pub value: f64,
    /// 1-sigma, s.
    pub sigma: f64,
}

/// A channel, and the most terms that it may need.
pub type Needs = (usize, Terms);

/// Lag under which all channels together are most likely, where that is clearly more likely than none and leaves no
/// hysteresis: of a steady ramp nobody can tell one from the other, so where some is left, all may be.
///
/// None as well where hysteresis is not among the terms, as one leg is missing.
pub fn thermometer_lag(data: &ThermalBlocks, whitening: &Whitening, channels: &[Needs]) -> Option<Lag> {
    let channels: Vec<(Vec<f64>, Terms)> = channels
        .iter()
        .filter(|(_, terms)| terms.hysteresis)
        .map(|(channel, terms)| (data.channel(*channel), *terms))
        .collect();
    let fits = |lag: f64| -> Vec<Option<AxisFit>> {
        let blocks: Vec<Block> = data.blocks.iter().map(|block| block.lagged(lag)).collect();
        let design = Design::new(
            whitening,
            &blocks,
            blocks.first().map_or(0.0, |block| block.temperature),
        );
        channels
            .iter()
            .map(|(means, terms)| design.fit(means, terms))
            .collect()
    };
    let likelihood = |lag: f64| -> f64 {
        let of_channel = |fit: Option<AxisFit>| fit.map_or(f64::NEG_INFINITY, |fit| fit.likelihood);
        fits(lag).into_iter().map(of_channel).sum() // eq. 11
    };
    let coarse: Vec<f64> = (-EACH_SIDE..=EACH_SIDE).map(coarse_lag).collect();
    let best = best_of(&coarse, likelihood)?;
    let step = (coarse[best.0 + 1] - coarse[best.0 - 1]) / f64::from(FINER);
    let fine: Vec<f64> = (0..=FINER)
        .map(|place| coarse[best.0 - 1] + step * f64::from(place))
        .collect();
    let (place, [before, at, after]) = best_of(&fine, likelihood)?;
    let curvature = (before - 2.0 * at + after) / (step * step);
    let lag = Lag {
        value: fine[place] - 0.5 * (after - before) / (step * curvature),
        sigma: (-curvature).sqrt().recip(),
    };
    let is_clear = at > likelihood(0.0) + CLEARLY && lag.sigma.is_finite();
    (is_clear && !fits(lag.value).iter().flatten().any(has_hysteresis)).then_some(lag)
}

fn has_hysteresis(fit: &AxisFit) -> bool {
    let last = fit
        .terms
        .count()
        .checked_sub(1)
        .and_then(|last| fit.coefficient(last));
    last.is_some_and(|[value, sigma]| value.abs() > SIGMAS * sigma)
}

fn coarse_lag(place: i32) -> f64 {
    let share = f64::from(place) / f64::from(EACH_SIDE);
    LARGEST * share * share.abs()
}

/// Place of the best, and values before, at and after it; None where it is at the edge.
fn best_of(lags: &[f64], likelihood: impl Fn(f64) -> f64) -> Option<(usize, [f64; 3])> {
    let values: Vec<f64> = lags.iter().map(|lag| likelihood(*lag)).collect();
    let best = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]))?;
    let around = [
        *values.get(best.checked_sub(1)?)?,
        values[best],
        *values.get(best + 1)?,
    ];
    around
        .iter()
        .all(|value| value.is_finite())
        .then_some((best, around))
}
