//! A unit that was turned without a rest: every sample is a reading, and neighbours may err alike
//! (docs/theory/magnetometer.md, section 4).

use nalgebra::{DVector, Vector3};
use tumble_core::model::ModelCovariance;

use super::error::MagnetometerError;
use super::fit::{FieldFit, FieldSettings, fit_field};
use super::readings::{FieldReading, FieldReadings};
use super::rests::FieldSamples;
use crate::constant_length::influence::Influence;
use crate::distributions::{chi_square_tail, median};

/// Samples that a fit takes at most; of more, every second, third and so on.
const MOST: usize = 40_000;

/// Blocks that a log is cut into, by which influence and disturbance are judged.
const BLOCKS: usize = 40;

/// Share of the range of lags up to which correlation of residuals is looked for.
const LONGEST_LAG: usize = 10;

/// Scatter over the median of absolute deviates.
const SIGMA_OF_MEDIAN: f64 = 1.482_602;

/// A stretch of the log.
#[derive(Clone, Copy, Debug)]
pub(super) struct FieldBlock {
    /// First sample, and the one after the last, among those of the fit.
    pub span: (usize, usize),
    /// Mean field in the case frame, uT.
    pub field: Vector3<f64>,
    /// Mean of `|u|` less the strength, uT.
    pub value: f64,
    /// Its 1-sigma, uT.
    pub sigma: f64,
    /// Chance that noise makes any block disagree as much.
    pub chance: f64,
    /// Change of the fit without it.
    pub influence: Influence,
    /// The value by a fit without it, uT.
    pub held_out: Option<f64>,
}

/// A magnetometer that was turned by hand.
#[derive(Clone, Debug)]
pub(super) struct TurnedField {
    /// The fit; its covariance holds for correlated residuals.
    pub fit: FieldFit,
    /// Scatter of `|u|` of a sample, uT.
    pub scatter: f64,
    /// Samples that are worth one independent reading.
    pub correlated: f64,
    /// Blocks of it.
    pub blocks: Vec<FieldBlock>,
    /// Every how many samples one was taken.
    pub stride: usize,
    /// Samples that were taken.
    pub readings: FieldReadings,
}

/// Fits a magnetometer to the samples of a unit that was turned through all directions.
///
/// # Errors
/// [`MagnetometerError`] where the samples do not show all unknowns.
pub(super) fn turned(
    samples: &FieldSamples<'_>,
    settings: &FieldSettings,
) -> Result<TurnedField, MagnetometerError> {
    let stride = samples.field.len().div_ceil(MOST).max(1);
    let chosen: Vec<usize> = (0..samples.field.len()).step_by(stride).collect();
    let mut variance = first_variance(samples, &chosen);
    let mut data = readings(samples, &chosen, variance);
    let mut found = fit_field(&data, settings)?;
    for _ in 0..2 {
        let factor = scatter_of(&found) / found.length_sigma();
        variance = (variance * factor * factor).max(f64::MIN_POSITIVE);
        data = readings(samples, &chosen, variance);
        found = fit_field(&data, settings)?;
    }
    let scatter = scatter_of(&found);
    let correlated = correlation(&found);
    found.covariance *= correlated;
    let blocks = blocks(&found, scatter, correlated);
    Ok(TurnedField {
        fit: found,
        scatter,
        correlated,
        blocks,
        stride,
        readings: data,
    })
}

fn first_variance(samples: &FieldSamples<'_>, chosen: &[usize]) -> f64 {
    let size = |axis: usize| {
        let values = chosen.iter().map(|k| samples.field[*k][axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
            (a.min(v), b.max(v))
        });
        high - low
    };
    (0.01 * (size(0) + size(1) + size(2)) / 6.0).powi(2)
}

fn readings(samples: &FieldSamples<'_>, chosen: &[usize], variance: f64) -> FieldReadings {
    let of = |k: &usize| FieldReading {
        mean: Vector3::from(samples.field[*k]),
        variance: Vector3::repeat(variance),
        current: samples.current.get(*k).copied().unwrap_or(0.0),
        up: None,
    };
    FieldReadings {
        readings: chosen.iter().map(of).collect(),
        accelerometer: ModelCovariance::zeros(),
    }
}

impl FieldFit {
    /// Usual sigma of the length of a reading, uT.
    fn length_sigma(&self) -> f64 {
        let mut sigmas: Vec<f64> = self
            .used
            .iter()
            .map(|k| self.residuals[*k].covariance[(0, 0)].sqrt())
            .collect();
        median(&mut sigmas).unwrap_or(f64::NAN)
    }
}

/// Scatter of the length of used readings, uT: root mean square, corrected for the unknowns.
fn scatter_of(fit: &FieldFit) -> f64 {
    let mut sizes: Vec<f64> = fit
        .used
        .iter()
        .map(|k| fit.residuals[*k].values.x.abs())
        .collect();
    #[allow(clippy::cast_precision_loss)]
    let freedom = (sizes.len().saturating_sub(fit.places.len())).max(1) as f64;
    let square: f64 = sizes
        .iter()
        .zip(&fit.used)
        .map(|(size, k)| fit.weights[*k] * size * size)
        .sum();
    let usual = SIGMA_OF_MEDIAN * median(&mut sizes).unwrap_or(0.0);
    (square / freedom).sqrt().max(usual * 0.9)
}

/// Samples that are worth one: one plus twice the correlations of the residuals, up to the first that is negative
/// (Geyer 1992; docs/theory/magnetometer.md, eq. 10).
fn correlation(fit: &FieldFit) -> f64 {
    let values: Vec<f64> = fit.used.iter().map(|k| fit.residuals[*k].values.x).collect();
    #[allow(clippy::cast_precision_loss)]
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let centred: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let power: f64 = centred.iter().map(|value| value * value).sum();
    let at = |lag: usize| {
        centred
            .iter()
            .zip(&centred[lag..])
            .map(|(a, b)| a * b)
            .sum::<f64>()
            / power
    };
    let pairs = (1..centred.len() / LONGEST_LAG)
        .step_by(2)
        .map(|lag| at(lag) + at(lag + 1));
    1.0 + 2.0 * pairs.take_while(|pair| *pair > 0.0).sum::<f64>() // eq. 10
}

fn blocks(fit: &FieldFit, scatter: f64, correlated: f64) -> Vec<FieldBlock> {
    let mut rows = fit.linear.rows.clone();
    fit.linear.whitening.apply(&mut rows);
    let values = fit.linear.whitening.of(fit.linear.values.clone());
    let information = rows.tr_mul(&rows);
    let sigmas: DVector<f64> = fit.linear.covariance.diagonal().map(|v| (v * correlated).sqrt());
    let size = fit.used.len().div_ceil(BLOCKS);
    let count = fit.used.len().div_ceil(size);
    let of = |k: usize| {
        let (first, end) = (k * size, ((k + 1) * size).min(fit.used.len()));
        let own = rows.rows(first, end - first);
        let within = values.rows(first, end - first);
        let others = &information - own.tr_mul(&own);
        // Without the block the unknowns go back up the slope of its residuals.
        let change = others.cholesky().map(|solver| solver.solve(&own.tr_mul(&within)));
        let leverage = (&fit.linear.covariance * own.tr_mul(&own)).trace();
        #[allow(clippy::cast_precision_loss)]
        let number = (end - first) as f64;
        let raw = fit.linear.values.rows(first, end - first);
        let moved = |change: &DVector<f64>| (fit.linear.rows.rows(first, end - first) * change).mean();
        let held_out = change.as_ref().map(|change| raw.mean() + moved(change));
        let field = fit.used[first..end]
            .iter()
            .map(|k| fit.residuals[*k].field)
            .sum::<Vector3<f64>>()
            / number;
        let value = raw.mean();
        let sigma = scatter * (correlated / number).sqrt();
        #[allow(clippy::cast_precision_loss)]
        let chance = (count as f64 * chi_square_tail((value / sigma).powi(2), 1.0)).min(1.0);
        FieldBlock {
            span: (fit.used[first], fit.used[end - 1] + 1),
            field,
            value,
            sigma,
            chance,
            influence: Influence {
                leverage,
                change: change.map_or(f64::INFINITY, |change| change.component_div(&sigmas).amax()),
            },
            held_out,
        }
    };
    (0..count).map(of).collect()
}
