//! Choice of the terms that the data bear, and what its uncertainty adds to that of their coefficients
//! (docs/theory/thermal.md, Order).

use nalgebra::DMatrix;

use super::fit::{DriftFit, Terms};

/// Cost of a coefficient by Akaike's criterion: by so much one that is not there raises the likelihood on average.
const COST: f64 = 1.0;

/// Weight of each of several sets of terms.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Which of them is stated.
    pub chosen: usize,
    /// Akaike weight of each: they add up to one.
    pub weights: Vec<f64>,
}

/// Chooses among fits, the first of which has no power of temperature; None where there are none.
pub fn choose(fits: &[DriftFit]) -> Option<Choice> {
    let simplest = fits.first()?;
    let blocks = simplest.with_slow_noise.first()?.freedom;
    let of_all = |cost: f64| -> Vec<f64> {
        fits.iter()
            .map(|fit| marginal_likelihood(fit, simplest, cost))
            .collect()
    };
    let scores = of_all((1.0 + blocks).ln()); // eq. 8
    let chosen = (0..fits.len()).max_by(|a, b| scores[*a].total_cmp(&scores[*b]))?;
    Some(Choice {
        chosen,
        weights: shares(&of_all(COST)),
    })
}

/// Logarithm of the likelihood of a set of terms as a mean over the kinds and strengths of slow noise, but for a constant,
/// less a cost of each coefficient.
fn marginal_likelihood(fit: &DriftFit, simplest: &DriftFit, cost: f64) -> f64 {
    let more = (fit.terms.count() - simplest.terms.count()) as f64;
    let each = fit.with_slow_noise.iter().zip(&simplest.with_slow_noise);
    let found: Vec<f64> = each
        .map(|(with, without)| {
            without.restricted_likelihood - 0.5 * without.freedom * (with.squares / without.squares).ln()
        })
        .collect();
    log_sum(&found) - cost * more
}

/// Logarithm of the sum of what has these logarithms.
fn log_sum(logarithms: &[f64]) -> f64 {
    let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    largest
        + logarithms
            .iter()
            .map(|each| (each - largest).exp())
            .sum::<f64>()
            .ln()
}

fn shares(logarithms: &[f64]) -> Vec<f64> {
    let all = log_sum(logarithms);
    logarithms.iter().map(|each| (each - all).exp()).collect()
}

/// The chosen fit; its covariance is that of the coefficients about their estimate over all sets of terms.
pub fn chosen_fit(fits: &[DriftFit], choice: &Choice) -> DriftFit {
    let fit = &fits[choice.chosen];
    let size = fit.terms.count();
    let nothing = DMatrix::zeros(size, size);
    let covariance = fits
        .iter()
        .zip(&choice.weights)
        .fold(nothing, |sum, (other, share)| {
            let places = places(&fit.terms, &other.terms);
            let at =
                |i: usize| places[i].map_or(0.0, |place| other.coefficients[place]) - fit.coefficients[i];
            let of = |i: usize, j: usize| {
                let both = places[i].zip(places[j]);
                both.map_or(0.0, |place| other.covariance[place]) + at(i) * at(j) // eq. 8a
            };
            sum + DMatrix::from_fn(size, size, of) * *share
        });
    DriftFit {
        covariance,
        ..fit.clone()
    }
}

/// Place of each coefficient of one set of terms among those of another; None where the other has it not.
fn places(terms: &Terms, other: &Terms) -> Vec<Option<usize>> {
    let of = |first: usize, count: usize, has: usize| (0..count).map(move |k| (k < has).then_some(first + k));
    of(0, terms.bias, other.bias)
        .chain(of(other.bias, terms.scale, other.scale))
        .chain(of(other.bias + other.scale, terms.hysteresis, other.hysteresis))
        .collect()
}
