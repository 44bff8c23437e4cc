//! What a record shows of each term of its noise.
//!
//! Weighted least squares on the Allan variances of octaves, no strength below zero; intervals from the covariance of
//! these variances, and from how skewed their chance is (docs/theory/noise.md, eq. 24 to 28).

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use super::chance::{Shared, Strengths, Stretches};
use super::deviation::{Kind, Variance};
use super::non_negative::{gain, non_negative};
use super::skewed::quantile;
use super::term::{NoiseTerm, TERMS};
use crate::distributions::{INTERVAL, chi_square_tail};

/// Terms that every fit has: where chance could stand for one of them, the others must be as uncertain as that makes them.
const ALWAYS: [NoiseTerm; 3] = [
    NoiseTerm::White,
    NoiseTerm::BiasInstability,
    NoiseTerm::RandomWalk,
];
/// Terms that a fit has where they show.
const IF_SHOWN: [NoiseTerm; 2] = [NoiseTerm::Quantisation, NoiseTerm::Ramp];
/// Sigmas above zero from which on they do.
const SHOWN: f64 = 2.5;
/// Rounds in which weights settle.
const ROUNDS: usize = 8;
/// Averaging times that at least go into a fit.
const FEWEST: usize = 6;
/// Averaging times that starts of differences stretch over at least, to go into it.
const LEAST_STARTS: f64 = 2.0;
/// Degrees of freedom from which on a variance counts for chi-square: below, its chance is far from normal.
const LEAST_FREEDOM: f64 = 10.0;
/// Chance of a chi-square below which a fit is no explanation.
const UNLIKELY: f64 = 1e-3;
/// Doublings of a record that are tried to show a term.
const DOUBLINGS: usize = 12;
/// Sigmas at which it shows it.
const SURELY: f64 = 3.0;
/// Doublings after which nothing bounds a strength.
const DOUBLINGS_OF_A_BOUND: i32 = 20;
/// Halvings after which a bound is known to more digits than anybody asks for.
const HALVINGS: usize = 30;
/// Share of the bound on a coefficient that a longer record is asked to show.
const ASKED: f64 = 0.5;

/// One term as a record shows it, in the units of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TermEstimate {
    /// Which.
    pub term: NoiseTerm,
    /// Coefficient; where it is not identifiable, what fits best.
    pub value: f64,
    /// 95 % interval; from zero where the term is not identifiable.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// Whether the record shows it: its interval does not begin at zero.
    pub identifiable: bool,
    /// Length of a record that shows a term half as large as its bound, s, where it is not identifiable; None where
    /// thousands of times the length would not.
    pub needed: Option<f64>,
}

impl TermEstimate {
    fn unknown(term: NoiseTerm) -> Self {
        Self {
            term,
            value: 0.0,
            low: 0.0,
            high: f64::INFINITY,
            identifiable: false,
            needed: None,
        }
    }
}

/// What was found of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseFit {
    /// All terms, in their order.
    pub terms: [TermEstimate; TERMS],
    /// Strengths that fit best, as [`super::chance`] takes them.
    pub strengths: Strengths,
    /// Weighted squares of the residuals against their covariance, of those with ten degrees of freedom or more.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub freedom: usize,
    /// What sigmas were multiplied by, because terms do not explain the variances; 1 where they do.
    pub widening: f64,
    /// Shortest averaging time that went into the fit, samples.
    pub shortest: usize,
}

/// Averaging times of the octaves, and the covariance of Allan variances at them.
#[derive(Debug)]
struct Design {
    samples: Vec<usize>,
    shared: Vec<Vec<Shared>>,
}

impl Design {
    fn new(stretches: &Stretches) -> Self {
        let long_enough = |m: &usize| stretches.starts_in_all(Kind::Allan, *m) >= LEAST_STARTS * *m as f64;
        let samples: Vec<usize> = (0..48)
            .map(|octave| 1 << octave)
            .take_while(long_enough)
            .collect();
        let row = |a: &usize| {
            let longer = samples.iter().filter(|b| *b >= a);
            longer
                .map(|b| Shared::between(Kind::Allan, *a, *b, stretches))
                .collect()
        };
        let shared = samples.iter().map(row).collect();
        Self { samples, shared }
    }

    /// Allan variances of terms of strength one, (octaves, terms), from an octave on.
    fn columns(&self, from: usize) -> DMatrix<f64> {
        DMatrix::from_fn(self.samples.len() - from, TERMS, |i, k| {
            NoiseTerm::ALL[k].allan_variance(self.samples[from + i] as f64)
        })
    }

    fn covariance(&self, from: usize, strengths: &Strengths) -> DMatrix<f64> {
        let n = self.samples.len() - from;
        let mut covariance = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in i..n {
                let value = self.shared[from + i][j - i].covariance(strengths);
                covariance[(i, j)] = value;
                covariance[(j, i)] = value;
            }
        }
        covariance
    }

    fn weights(&self, from: usize, strengths: &Strengths) -> DVector<f64> {
        let n = self.samples.len() - from;
        DVector::from_fn(n, |i, _| 1.0 / self.shared[from + i][0].covariance(strengths))
    }
}

/// Fits terms to records of one set of stretches, any number of channels.
#[derive(Debug)]
pub struct Fitter {
    interval: f64,
    total: f64,
    design: Design,
    /// Of one stretch, two, four ... times as long as all together.
    longer: [OnceLock<Design>; DOUBLINGS],
}

/// A fit while it is made.
struct Solution {
    from: usize,
    columns: DMatrix<f64>,
    y: DVector<f64>,
    terms: Vec<usize>,
    strengths: Strengths,
    weight: DVector<f64>,
    chi_square: f64,
    freedom: usize,
}

/// Estimate of one strength, not bounded by zero.
struct Chance {
    found: f64,
    sigma: f64,
    skewness: f64,
}

impl Solution {
    fn likelihood(&self) -> f64 {
        if self.freedom == 0 {
            return 1.0;
        }
        chi_square_tail(self.chi_square, self.freedom as f64)
    }

    fn place_of(&self, term: usize) -> usize {
        self.terms.iter().position(|k| *k == term).unwrap_or_default()
    }

    /// Strengths that fit best where that of one term is known.
    fn beside(&self, term: usize, strength: f64) -> Strengths {
        let others: Vec<usize> = self.terms.iter().copied().filter(|k| *k != term).collect();
        let rest = &self.y - self.columns.column(term) * strength;
        let mut strengths = non_negative(&self.columns, &rest, &self.weight, &others);
        strengths[term] = strength;
        strengths
    }

    fn reduced(&self) -> f64 {
        self.chi_square / self.freedom.max(1) as f64
    }
}

impl Fitter {
    /// For stretches of samples an interval apart, s.
    pub fn new(stretches: &Stretches, interval: f64) -> Self {
        Self {
            interval,
            total: stretches.samples(),
            design: Design::new(stretches),
            longer: [const { OnceLock::new() }; DOUBLINGS],
        }
    }

    /// Finds the terms of one channel from its Allan variances; None where the record is too short for any, or shows no
    /// noise at all.
    pub fn fit(&self, variances: &[Variance]) -> Option<NoiseFit> {
        let y: Vec<f64> = self
            .design
            .samples
            .iter()
            .map_while(|m| variance_at(variances, *m))
            .collect();
        let usable = y.len() == self.design.samples.len() && y.len() >= FEWEST && y.iter().all(|v| *v > 0.0);
        let solution = usable.then(|| self.explain(&y)).flatten()?;
        let widening = if solution.likelihood() < UNLIKELY {
            solution.reduced().sqrt()
        } else {
            1.0
        };
        let terms = std::array::from_fn(|k| self.estimate(NoiseTerm::ALL[k], &solution, widening));
        Some(NoiseFit {
            terms,
            strengths: solution.strengths,
            chi_square: solution.chi_square,
            freedom: solution.freedom,
            widening,
            shortest: self.design.samples[solution.from],
        })
    }

    /// Leaves out the shortest averages, which filters of a sensor shape, until terms explain the others.
    fn explain(&self, y: &[f64]) -> Option<Solution> {
        let mut best: Option<Solution> = None;
        for from in 0..=y.len() - FEWEST {
            let Some(solution) = self.with_terms_shown(from, y) else {
                continue;
            };
            if solution.likelihood() >= UNLIKELY {
                return Some(solution);
            }
            if best
                .as_ref()
                .is_none_or(|best| solution.reduced() < best.reduced())
            {
                best = Some(solution);
            }
        }
        best
    }

    fn with_terms_shown(&self, from: usize, y: &[f64]) -> Option<Solution> {
        let mut terms: Vec<usize> = ALWAYS.iter().map(|term| *term as usize).collect();
        for term in IF_SHOWN {
            let mut more = terms.clone();
            more.push(term as usize);
            let Some(found) = self.solve(from, y, &more) else {
                continue;
            };
            let k = term as usize;
            let chance = self.chance(&found, k, found.strengths[k]);
            if chance.is_some_and(|chance| chance.found > SHOWN * chance.sigma) {
                terms = more;
            }
        }
        self.solve(from, y, &terms)
    }

    fn solve(&self, from: usize, y: &[f64], terms: &[usize]) -> Option<Solution> {
        let columns = self.design.columns(from);
        let y = DVector::from_column_slice(&y[from..]);
        let starts = self.design.samples[from..].iter();
        // Before any term is known: as many degrees of freedom as averages fit into the record.
        let mut weight = DVector::from_iterator(
            y.len(),
            starts
                .zip(y.iter())
                .map(|(m, v)| self.total / (*m as f64 * v * v)),
        );
        let mut strengths = [0.0; TERMS];
        for _ in 0..ROUNDS {
            strengths = non_negative(&columns, &y, &weight, terms); // eq. 24
            weight = self.design.weights(from, &strengths);
            if !weight.iter().all(|w| w.is_finite()) {
                return None;
            }
        }
        let (chi_square, freedom) = self.misfit(from, &columns, &y, &strengths, terms.len());
        Some(Solution {
            from,
            columns,
            y,
            terms: terms.to_vec(),
            strengths,
            weight,
            chi_square,
            freedom,
        })
    }

    fn misfit(
        &self,
        from: usize,
        columns: &DMatrix<f64>,
        y: &DVector<f64>,
        strengths: &Strengths,
        terms: usize,
    ) -> (f64, usize) {
        let covariance = self.design.covariance(from, strengths);
        let model = columns * DVector::from_row_slice(strengths);
        let counts: Vec<usize> = (0..y.len())
            .filter(|i| 2.0 * model[*i] * model[*i] >= LEAST_FREEDOM * covariance[(*i, *i)])
            .collect();
        let residual = (y - model).select_rows(&counts);
        let covariance = covariance.select_rows(&counts).select_columns(&counts);
        let chi_square = covariance
            .cholesky()
            .map_or(0.0, |factor| residual.dot(&factor.solve(&residual)));
        (chi_square, counts.len().saturating_sub(terms)) // eq. 27
    }

    fn estimate(&self, term: NoiseTerm, solution: &Solution, widening: f64) -> TermEstimate {
        let k = term as usize;
        let with;
        let solution = if solution.terms.contains(&k) {
            solution
        } else {
            let mut terms = solution.terms.clone();
            terms.push(k);
            let y: Vec<f64> = std::iter::repeat_n(0.0, solution.from)
                .chain(solution.y.iter().copied())
                .collect();
            match self.solve(solution.from, &y, &terms) {
                Some(found) => {
                    with = found;
                    &with
                }
                None => return TermEstimate::unknown(term),
            }
        };
        let (low, high) = self.interval_of(solution, k, widening);
        let coefficient = |strength: f64| term.coefficient(strength, self.interval);
        let identifiable = low > 0.0 && high.is_finite();
        TermEstimate {
            term,
            value: coefficient(solution.strengths[k]).clamp(coefficient(low), coefficient(high)),
            low: if identifiable { coefficient(low) } else { 0.0 },
            high: coefficient(high),
            identifiable,
            needed: if identifiable || high.is_infinite() {
                None
            } else {
                self.needed(solution, k, high)
            },
        }
    }

    /// All strengths of a term that leave what was found within 95 % of what chance gives, were they the truth.
    fn interval_of(&self, solution: &Solution, k: usize, widening: f64) -> (f64, f64) {
        let apart = |strength: f64, side: f64| {
            let Some(chance) = self.chance(solution, k, strength) else {
                return f64::NAN;
            };
            // What lies below zero says no more than zero does: a bound must not shrink to nothing by it.
            let found = if side < 0.0 {
                chance.found.max(0.0)
            } else {
                chance.found
            };
            (found - strength) / (widening * chance.sigma) - quantile(side, chance.skewness) // eq. 26
        };
        let best = solution.strengths[k];
        let least = best.max(self.chance(solution, k, best).map_or(0.0, |chance| chance.sigma));
        let mut doubled = (1..DOUBLINGS_OF_A_BOUND).map(|times| least * 2f64.powi(times));
        let beyond = doubled.find(|strength| apart(*strength, -INTERVAL) <= 0.0);
        let high = beyond.map_or(f64::INFINITY, |beyond| {
            crossing(best, beyond, |q| apart(q, -INTERVAL))
        });
        let shown = best > 0.0 && apart(0.0, INTERVAL) > 0.0;
        let low = if shown {
            crossing(0.0, best, |strength| apart(strength, INTERVAL))
        } else {
            0.0
        };
        (low, high)
    }

    /// What is found of a term with the weights that are right if it has that strength, the others as they fit best
    /// beside it, and how that would scatter.
    fn chance(&self, solution: &Solution, k: usize, strength: f64) -> Option<Chance> {
        let strengths = solution.beside(k, strength);
        let covariance = self.design.covariance(solution.from, &strengths);
        let weight = covariance.diagonal().map(f64::recip);
        let gain = gain(&solution.columns, &weight, &solution.terms)?;
        let row = gain.row(solution.place_of(k)).transpose();
        let spread = covariance * &row;
        let variance = row.dot(&spread); // eq. 25
        let model = &solution.columns * DVector::from_row_slice(&strengths);
        let third: f64 = (0..row.len())
            .map(|i| 2.0 * row[i] * spread[i] * spread[i] / model[i])
            .sum(); // eq. 26
        Some(Chance {
            found: row.dot(&solution.y),
            sigma: variance.sqrt(),
            skewness: third / variance.powf(1.5),
        })
    }

    /// Length, s, of a record without gaps that shows a term half as large as its bound.
    fn needed(&self, solution: &Solution, k: usize, bound: f64) -> Option<f64> {
        let asked = bound * ASKED * ASKED;
        let strengths = solution.beside(k, asked);
        (1..).zip(&self.longer).find_map(|(doubling, longer)| {
            let samples = self.total * f64::from(1 << doubling);
            let design = longer.get_or_init(|| Design::new(&Stretches::single(samples)));
            let weight = design.weights(solution.from, &strengths);
            let gain = gain(&design.columns(solution.from), &weight, &solution.terms)?;
            let row = gain.row(solution.place_of(k)).transpose();
            let sigma = row
                .dot(&(design.covariance(solution.from, &strengths) * &row))
                .sqrt();
            (asked > SURELY * sigma).then_some(samples * self.interval) // eq. 28
        })
    }
}

/// Where a falling function is zero between two places.
fn crossing(mut low: f64, mut high: f64, of: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if of(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

fn variance_at(variances: &[Variance], samples: usize) -> Option<f64> {
    let found = variances
        .binary_search_by_key(&samples, |each| each.samples)
        .ok()?;
    Some(variances[found].variance)
}
