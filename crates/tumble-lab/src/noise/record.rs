//! A record of several channels: deviations with intervals, and the terms of each (docs/theory/noise.md).

use rayon::prelude::*;

use super::chance::{Shared, Strengths, Stretches, freedom};
use super::deviation::Deviations;
use super::fit::{Fitter, NoiseFit};
use super::lowpass::LowPass;
use super::term::{NoiseTerm, TERMS};
use super::variance_kind::VarianceKind;
use crate::distributions::chi_square_quantile;

/// Share of records whose truth lies beyond one end of an interval.
const BEYOND: f64 = 0.025;

/// A deviation at one averaging time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviationEstimate {
    /// Averaging time, samples.
    pub samples: usize,
    /// unit.
    pub deviation: f64,
    /// 95 % interval.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// Equivalent degrees of freedom.
    pub freedom: f64,
}

/// Noise of one channel.
#[derive(Clone, Debug)]
pub struct ChannelNoise {
    /// In the order of [`VarianceKind::ALL`]; empty for a kind that was not asked for.
    pub deviations: [Vec<DeviationEstimate>; VarianceKind::COUNT],
    /// None where the record is too short to fit anything, or the channel shows no noise.
    pub fit: Option<NoiseFit>,
}

/// Channels of one sensor, or of several that were sampled together.
#[derive(Clone, Debug)]
pub struct NoiseRecord {
    kinds: Vec<VarianceKind>,
    channels: Vec<Deviations>,
}

impl NoiseRecord {
    /// No samples yet.
    pub fn new(channels: usize, kinds: &[VarianceKind]) -> Self {
        Self {
            kinds: kinds.to_vec(),
            channels: vec![Deviations::new(kinds); channels],
        }
    }

    /// Number of channels.
    pub fn width(&self) -> usize {
        self.channels.len()
    }

    /// Takes in successive samples, all channels of one after the other.
    pub fn push(&mut self, rows: &[f64]) {
        let width = self.width();
        self.channels
            .par_iter_mut()
            .enumerate()
            .for_each(|(number, channel)| {
                channel.push(rows.iter().skip(number).step_by(width).copied());
            });
    }

    /// Ends a stretch: what follows lies beyond a gap, or in another record.
    pub fn end_stretch(&mut self) {
        self.channels.iter_mut().for_each(Deviations::end_stretch);
    }

    /// Estimates the noise of the stretches that were ended, of samples an interval apart, s.
    pub fn conclude(&self, interval: f64) -> Vec<ChannelNoise> {
        let Some(first) = self.channels.first() else {
            return Vec::new();
        };
        let stretches = Stretches::new(first.stretches());
        let fitter = Fitter::new(&stretches, interval);
        let chances = |filtered: &LowPass| -> Vec<(VarianceKind, Vec<Shared>)> {
            let of_kind = |kind: &VarianceKind| {
                let variances = first.variances(*kind);
                let of = |samples| Shared::between(*kind, samples, samples, &stretches, filtered);
                (*kind, variances.iter().map(|each| of(each.samples)).collect())
            };
            self.kinds.iter().map(of_kind).collect()
        };
        let unfiltered = LowPass::default();
        let usual = chances(&unfiltered);
        let conclude = |channel: &Deviations| {
            let fit = fitter.fit(&channel.variances(VarianceKind::Allan));
            let strengths = fit.as_ref().map_or_else(|| white(channel), |fit| fit.strengths);
            let filtered = fit.as_ref().map_or(&unfiltered, |fit| &fit.filtered);
            let own = (*filtered != unfiltered).then(|| chances(filtered));
            let mut deviations: [Vec<DeviationEstimate>; VarianceKind::COUNT] = Default::default();
            for (kind, shared) in own.as_ref().unwrap_or(&usual) {
                deviations[*kind as usize] = with_intervals(channel, *kind, shared, &strengths, filtered);
            }
            ChannelNoise { deviations, fit }
        };
        self.channels.par_iter().map(conclude).collect()
    }
}

/// Strengths of a channel of which no more than its shortest average is known.
fn white(channel: &Deviations) -> Strengths {
    let mut strengths = [0.0; TERMS];
    let shortest = channel
        .variances(VarianceKind::Allan)
        .first()
        .map_or(1.0, |each| each.variance);
    strengths[NoiseTerm::White as usize] = if shortest > 0.0 { shortest } else { 1.0 };
    strengths
}

fn with_intervals(
    channel: &Deviations,
    kind: VarianceKind,
    shared: &[Shared],
    strengths: &Strengths,
    filtered: &LowPass,
) -> Vec<DeviationEstimate> {
    let variances = channel.variances(kind);
    let each = variances.iter().zip(shared).map(|(found, shared)| {
        let freedom = freedom(kind, found.samples, shared, strengths, filtered).max(1.0); // eq. 23
        let bound = |tail| (found.variance * freedom / chi_square_quantile(tail, freedom)).sqrt();
        DeviationEstimate {
            samples: found.samples,
            deviation: found.variance.sqrt(),
            low: bound(BEYOND),
            high: bound(1.0 - BEYOND),
            freedom,
        }
    });
    each.collect()
}
