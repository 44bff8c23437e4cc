//! Lag of the thermometer behind the sensor, or before it (docs/theory/thermal.md, Temperature).

use rayon::prelude::*;

use super::block::{RestBlock, ThermalBlocks};
use super::fit::{DriftDesign, KNOTS, Terms};
use super::whitening::Whitening;
use crate::distributions::chi_square_tail;

/// Time constants that are tried first, s, evenly over their square roots.
const LARGEST: f64 = 600.0;
const EACH_SIDE: i32 = 12;
/// Between the neighbours of the best of these, so many more.
const FINER: i32 = 8;
/// Logarithm of the ratio of likelihoods from which one explanation is clearly the better.
const CLEARLY: f64 = 5.0;
/// Chance of the likelihood of loops beside a lag, below which a lag alone is no explanation.
const UNLIKELY: f64 = 1e-3;
/// Share of the logarithm of the likelihood gained by a lag, below which loops beside it are no second cause.
const REMAINING: f64 = 0.1;
/// Axes with a loop that one lag explains all of, from which on chance does not make them agree.
const AGREEING: usize = 2;

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

/// A lag, and what is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lagging {
    /// None is needed.
    None,
    /// The data show it.
    Shown(Lag),
    /// It would explain the difference of warming and cooling as well as hysteresis does.
    OrHysteresis(Lag),
}

impl Lagging {
    /// The lag that the data show.
    pub fn shown(self) -> Option<Lag> {
        match self {
            Self::Shown(lag) => Some(lag),
            Self::None | Self::OrHysteresis(_) => None,
        }
    }
}

/// Loop of a channel that was chosen beside a lag.
#[derive(Clone, Copy)]
struct LagChoice {
    likelihood: f64,
    has_loop: bool,
}

struct Candidates<'a> {
    data: &'a ThermalBlocks,
    whitening: &'a Whitening,
    channels: Vec<(Vec<f64>, Terms)>,
}

/// Lag of the thermometer, fitted before hysteresis is: alone, and beside loops of any shape.
///
/// One time constant that explains the loops of several axes, or the shape of one, is a lag; loops that other axes have
/// beside it are hysteresis. One axis and a steady ramp cannot separate the two. Axes whose bias does not depend on
/// temperature show no lag. None as well where one leg is missing.
pub fn thermometer_lag(data: &ThermalBlocks, whitening: &Whitening, channels: &[Needs]) -> Lagging {
    let design = DriftDesign::new(whitening, &data.blocks, reference_of(&data.blocks));
    let channels: Vec<(Vec<f64>, Terms)> = channels
        .iter()
        .filter(|(_, terms)| terms.hysteresis > 0)
        .map(|(channel, terms)| (data.channel(*channel), *terms))
        .filter(|(means, terms)| has_drift(&design, means, terms))
        .collect();
    let of = Candidates {
        data,
        whitening,
        channels,
    };
    if of.channels.is_empty() {
        return Lagging::None;
    }
    let without_loops = of.likelihoods(0.0, 0);
    let constant_loops = of.likelihoods(0.0, 1);
    let alone = of.most_likely(|lag| sum(&of.likelihoods(lag, 0)));
    if let Some((lag, likelihood)) = alone {
        let beside: f64 = sum(&of.likelihoods(lag.value, 1)) - likelihood;
        // Where it turns, a first-order lag is no line: what remains of that is little beside what a lag explains.
        let explained = likelihood - sum(&without_loops);
        let sufficient = beside < REMAINING * explained
            || chi_square_tail(2.0 * beside.max(0.0), of.channels.len() as f64) > UNLIKELY;
        if sufficient {
            if likelihood < sum(&without_loops) + CLEARLY {
                return Lagging::None;
            }
            let pairs = without_loops.iter().zip(&constant_loops);
            let loops = pairs.filter(|(without, with)| *with - *without > CLEARLY).count();
            let alone = of.loops_alone(&constant_loops);
            return if loops >= AGREEING || likelihood > alone + CLEARLY {
                Lagging::Shown(lag)
            } else if alone > likelihood + CLEARLY {
                Lagging::None
            } else {
                Lagging::OrHysteresis(lag)
            };
        }
    }
    of.beside_loops(&without_loops)
}

impl Candidates<'_> {
    /// Likelihoods of each channel, with that many terms of hysteresis.
    fn likelihoods(&self, lag: f64, hysteresis: usize) -> Vec<f64> {
        let blocks: Vec<RestBlock> = self.data.blocks.iter().map(|block| block.lagged(lag)).collect();
        let design = DriftDesign::new(self.whitening, &blocks, reference_of(&blocks));
        let of_channel = |(means, terms): &(Vec<f64>, Terms)| {
            let terms = Terms { hysteresis, ..*terms };
            design
                .fit(means, &terms)
                .map_or(f64::NEG_INFINITY, |fit| fit.likelihood)
        };
        self.channels.par_iter().map(of_channel).collect()
    }

    /// The lag on which axes agree that have no loop beside it, whatever the loops of the others; none where fewer than two do.
    ///
    /// A loop of any shape takes up all of a lag on a steady ramp but what shows where it turns, so that an axis with a loop shows
    /// next to nothing of a lag.
    fn beside_loops(&self, without: &[f64]) -> Lagging {
        let at_zero = self.simplest(0.0, without);
        let sought = self.most_likely(|lag| sum_of(&self.simplest(lag, without)));
        let Some((lag, _)) = sought.filter(|(_, most)| *most > sum_of(&at_zero) + CLEARLY) else {
            return Lagging::None;
        };
        let pairs = at_zero.iter().zip(self.simplest(lag.value, without));
        let freed = pairs.filter(|(before, after)| before.has_loop && !after.has_loop);
        if freed.count() >= AGREEING {
            Lagging::Shown(lag)
        } else {
            Lagging::None
        }
    }

    /// Logarithm of the likelihood of loops without a lag: constants, or curves where these are worth their terms.
    fn loops_alone(&self, constants: &[f64]) -> f64 {
        let cost = 0.5 * (KNOTS - 1) as f64 * (self.data.blocks.len() as f64).ln();
        let curves = self.likelihoods(0.0, KNOTS);
        constants
            .iter()
            .zip(&curves)
            .map(|(constant, curve)| constant.max(curve - cost))
            .sum()
    }

    /// Simplest loop of each channel beside a lag, and the likelihood less what the loop costs; `without` lag or loop.
    fn simplest(&self, lag: f64, without: &[f64]) -> Vec<LagChoice> {
        let plain = self.likelihoods(lag, 0);
        let loops = [1, KNOTS].map(|terms| (terms, self.likelihoods(lag, terms)));
        let blocks = self.data.blocks.len() as f64;
        let choose = |channel: usize| {
            let none = LagChoice {
                likelihood: plain[channel],
                has_loop: false,
            };
            let remains = REMAINING * (plain[channel] - without[channel]).max(0.0);
            loops.iter().fold(none, |best, (terms, found)| {
                let cost = (0.5 * *terms as f64 * blocks.ln()).max(CLEARLY) + remains; // eq. 16
                let likelihood = found[channel] - cost;
                if likelihood > best.likelihood {
                    LagChoice {
                        likelihood,
                        has_loop: true,
                    }
                } else {
                    best
                }
            })
        };
        (0..plain.len()).map(choose).collect()
    }

    /// The lag under which all channels together are most likely, and that likelihood; None where it is at the edge.
    fn most_likely(&self, likelihood: impl Fn(f64) -> f64) -> Option<(Lag, f64)> {
        // eq. 11
        let coarse: Vec<f64> = (-EACH_SIDE..=EACH_SIDE).map(coarse_lag).collect();
        let best = best_of(&coarse, &likelihood)?;
        let step = (coarse[best.0 + 1] - coarse[best.0 - 1]) / f64::from(FINER);
        let fine: Vec<f64> = (0..=FINER)
            .map(|place| coarse[best.0 - 1] + step * f64::from(place))
            .collect();
        let (place, [before, at, after]) = best_of(&fine, &likelihood)?;
        let curvature = (before - 2.0 * at + after) / (step * step);
        let lag = Lag {
            value: fine[place] - 0.5 * (after - before) / (step * curvature),
            sigma: (-curvature).sqrt().recip(),
        };
        lag.sigma.is_finite().then_some((lag, at))
    }
}

fn reference_of(blocks: &[RestBlock]) -> f64 {
    blocks.first().map_or(0.0, |block| block.temperature)
}

/// True where the bias of an axis depends on temperature beyond chance, whatever its loop.
///
/// A lag moves the legs apart by the slope of the bias. An axis without slope shows none, and its wandering bias would
/// be explained by any.
fn has_drift(design: &DriftDesign, means: &[f64], most: &Terms) -> bool {
    (1..=most.bias).any(|bias| {
        let terms = Terms {
            bias,
            scale: 0,
            hysteresis: KNOTS,
        };
        design.fit(means, &terms).is_some_and(|fit| fit.is_certain())
    })
}

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

fn sum_of(choices: &[LagChoice]) -> f64 {
    choices.iter().map(|choice| choice.likelihood).sum()
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
