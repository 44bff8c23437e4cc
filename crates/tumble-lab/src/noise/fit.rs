//! Noise terms of a record, with their uncertainty.
//!
//! Weighted least squares on the Allan variances of octaves, no strength below zero and none above what the curve
//! allows; intervals from the covariance of these variances, from how skewed their chance is, and from how far the
//! terms are from explaining them (docs/theory/noise.md, eq. 24 to 31).

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::chance::{Shared, Strengths, Stretches, freedom};
use super::deviation::Variance;
use super::lowpass::LowPass;
use super::non_negative::{gain, non_negative};
use super::skewed::quantile;
use super::term::{NoiseTerm, TERMS};
use super::variance_kind::VarianceKind;
use crate::distributions::{INTERVAL, chi_square_quantile, chi_square_tail};

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
/// Share of the chi-square without a filter that one with a filter may leave, to be taken.
const CLEARLY_BETTER: f64 = 0.5;
/// Relative variance of the variances among which a filter is chosen: none has exactly one of the shapes tried.
const ROUGHLY: f64 = 1e-3;
/// Longest time constant of a filter in a sensor, s, and, for logs of few samples a second, in samples.
const LONGEST_FILTER: [f64; 2] = [0.1, 4.0];
/// Largest variance beyond chance, relative, and the halvings of its logarithm that find it.
const LARGEST_EXCESS: f64 = 100.0;
const EXCESS_DECADES: f64 = 12.0;
const EXCESS_HALVINGS: usize = 24;
/// Relative accuracy of the variances of variances.
const ACCURACY: f64 = 1e-3;
/// Share of white noise that a filter passes at an averaging time which bounds it.
const PASSED: f64 = 0.8;
/// Chance that the bound of a curve is below the truth, over all of its averaging times.
const BEYOND_BOUND: f64 = 0.025;
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
    /// Its upper end; nowhere does the term alone exceed the curve.
    pub high: f64,
    /// True if the term is identifiable: its interval does not begin at zero.
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

/// Noise terms of one channel.
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
    /// Scatter of the deviations about the sum of the terms beyond chance, as a share of them; 0 where chance explains it.
    pub misfit: f64,
    /// White noise as the filter of the sensor passes it.
    pub filtered: LowPass,
}

/// Averaging times of the octaves, and the covariance of Allan variances at them.
#[derive(Debug)]
struct Design {
    stretches: Stretches,
    samples: Vec<usize>,
    shared: Vec<Vec<Shared>>,
    filtered: LowPass,
}

impl Design {
    fn new(stretches: &Stretches, filtered: LowPass) -> Self {
        let long_enough =
            |m: &usize| stretches.starts_in_all(VarianceKind::Allan, *m) >= LEAST_STARTS * *m as f64;
        let samples: Vec<usize> = (0..48)
            .map(|octave| 1 << octave)
            .take_while(long_enough)
            .collect();
        let row = |a: &usize| {
            let longer = samples.iter().filter(|b| *b >= a);
            longer
                .map(|b| Shared::between(VarianceKind::Allan, *a, *b, stretches, &filtered))
                .collect()
        };
        let shared = samples.iter().map(row).collect();
        Self {
            stretches: stretches.clone(),
            samples,
            shared,
            filtered,
        }
    }

    /// Allan variances of terms of strength one, (octaves, terms).
    fn columns(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.samples.len(), TERMS, |i, k| {
            NoiseTerm::ALL[k].allan_variance(self.samples[i] as f64, &self.filtered)
        })
    }

    fn covariance(&self, strengths: &Strengths) -> DMatrix<f64> {
        let n = self.samples.len();
        let mut covariance = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in i..n {
                let value = self.shared[i][j - i].covariance(strengths);
                covariance[(i, j)] = value;
                covariance[(j, i)] = value;
            }
        }
        covariance
    }

    fn variances(&self, strengths: &Strengths) -> DVector<f64> {
        DVector::from_fn(self.samples.len(), |i, _| self.shared[i][0].covariance(strengths))
    }
}

/// Fits terms to records of one set of stretches, any number of channels.
#[derive(Debug)]
pub struct Fitter {
    interval: f64,
    total: f64,
    design: Design,
    /// With white noise that a filter passed.
    filtered: OnceLock<Vec<Design>>,
    /// Designs for one stretch, two, four ... times as long as all together.
    longer: [OnceLock<Design>; DOUBLINGS],
}

/// A fit while it is made.
struct NoiseSolution<'a> {
    design: &'a Design,
    columns: DMatrix<f64>,
    y: DVector<f64>,
    terms: Vec<usize>,
    strengths: Strengths,
    weight: DVector<f64>,
    /// Variance of the variances beyond chance, relative.
    excess: f64,
    chi_square: f64,
    freedom: usize,
}

/// Estimate of one strength, not bounded by zero.
struct Chance {
    found: f64,
    sigma: f64,
    skewness: f64,
}

impl NoiseSolution<'_> {
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

    fn model(&self, strengths: &Strengths) -> DVector<f64> {
        &self.columns * DVector::from_row_slice(strengths)
    }

    /// Largest strength of each term that the curve alone allows, at any of its averaging times.
    fn bounds(&self, curve: &[Variance]) -> Strengths {
        let tail = 1.0 - BEYOND_BOUND / curve.len() as f64;
        let filtered = &self.design.filtered;
        // The shape of a filter is known no better than the terms follow the curve.
        let of_shape = if *filtered == LowPass::default() {
            1.0
        } else {
            1.0 + INTERVAL * self.excess.sqrt()
        };
        let highest = |each: &Variance| {
            let freedom = self.freedom(each.samples);
            of_shape * each.variance * freedom / chi_square_quantile(tail, freedom)
        };
        let highest: Vec<(f64, f64)> = curve
            .iter()
            .map(|each| (each.samples as f64, highest(each)))
            .collect();
        std::array::from_fn(|k| {
            let term = NoiseTerm::ALL[k];
            let of_one = |samples: f64| term.allan_variance(samples, filtered);
            highest
                .iter()
                // Where the filter decides, its shape is what is bounded.
                .filter(|(samples, _)| term != NoiseTerm::White || of_one(*samples) * samples >= PASSED)
                .map(|(samples, highest)| highest / of_one(*samples)) // eq. 31
                .fold(f64::INFINITY, f64::min)
        })
    }

    /// Degrees of freedom at an averaging time, samples. Beyond a gap there may be a single difference where the octave
    /// below has thousands, so that none follow from its own.
    fn freedom(&self, samples: usize) -> f64 {
        let Design {
            stretches, filtered, ..
        } = self.design;
        let own = Shared::between(VarianceKind::Allan, samples, samples, stretches, filtered);
        freedom(VarianceKind::Allan, samples, &own, &self.strengths, filtered).max(1.0) // eq. 23
    }
}

impl Fitter {
    /// For stretches of samples an interval apart, s.
    pub fn new(stretches: &Stretches, interval: f64) -> Self {
        Self {
            interval,
            total: stretches.samples(),
            design: Design::new(stretches, LowPass::default()),
            filtered: OnceLock::new(),
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
        let solution = usable.then(|| self.explain(&DVector::from_vec(y))).flatten()?;
        let bounds = solution.bounds(variances);
        let terms = std::array::from_fn(|k| self.estimate(NoiseTerm::ALL[k], &solution, bounds[k]));
        Some(NoiseFit {
            terms,
            strengths: std::array::from_fn(|k| solution.strengths[k].min(bounds[k])),
            chi_square: solution.chi_square,
            freedom: solution.freedom,
            misfit: 0.5 * solution.excess.sqrt(),
            filtered: solution.design.filtered.clone(),
        })
    }

    /// Terms alone; where they explain too little, with white noise that a filter passed; where that is too little,
    /// with scatter beyond chance.
    fn explain(&self, y: &DVector<f64>) -> Option<NoiseSolution<'_>> {
        let plain = self.with_terms_shown(&self.design, y, 0.0)?;
        let short = self.behind_a_short_filter(y, plain.chi_square);
        if plain.likelihood() >= UNLIKELY {
            return Some(short.unwrap_or(plain));
        }
        if let Some(found) = short.filter(|found| found.likelihood() >= UNLIKELY) {
            return Some(found);
        }
        let roughly = |design| self.with_terms_shown(design, y, ROUGHLY);
        let filtered = self
            .filters()
            .par_iter()
            .filter_map(roughly)
            .min_by(|a, b| a.chi_square.total_cmp(&b.chi_square));
        let unfiltered = roughly(&self.design)?.chi_square;
        let best = filtered
            .filter(|found| found.chi_square < CLEARLY_BETTER * unfiltered)
            .and_then(|found| self.with_terms_shown(found.design, y, 0.0))
            .unwrap_or(plain);
        if best.likelihood() >= UNLIKELY {
            return Some(best);
        }
        self.beyond_chance(&best)
    }

    /// The fit with the filter that leaves least, where quantisation would have to be negative and the filter explains that.
    fn behind_a_short_filter(&self, y: &DVector<f64>, chi_square: f64) -> Option<NoiseSolution<'_>> {
        if !self.shows_a_filter(y) {
            return None;
        }
        self.filters()
            .par_iter()
            .filter_map(|design| self.with_terms_shown(design, y, 0.0))
            .min_by(|a, b| a.chi_square.total_cmp(&b.chi_square))
            .filter(|found| found.chi_square < chi_square - SHOWN * SHOWN)
    }

    /// Returns whether quantisation would have to be negative: a filter of a part of a sample takes from the shortest averages what
    /// quantisation adds (docs/theory/noise.md, eq. 28).
    fn shows_a_filter(&self, y: &DVector<f64>) -> bool {
        let k = NoiseTerm::Quantisation as usize;
        let mut terms: Vec<usize> = ALWAYS.iter().map(|term| *term as usize).collect();
        terms.push(k);
        let chance = self
            .solve(&self.design, y, &terms, 0.0)
            .and_then(|found| self.chance(&found, k, found.strengths[k]));
        chance.is_some_and(|chance| chance.found < -SHOWN * chance.sigma)
    }

    fn filters(&self) -> &[Design] {
        self.filtered.get_or_init(|| {
            let [seconds, samples] = LONGEST_FILTER;
            LowPass::candidates((seconds / self.interval).max(samples))
                .into_par_iter()
                .map(|filter| Design::new(&self.design.stretches, filter))
                .collect()
        })
    }

    /// The fit with as much relative scatter beyond chance as makes chi-square its degrees of freedom.
    fn beyond_chance<'a>(&self, best: &NoiseSolution<'a>) -> Option<NoiseSolution<'a>> {
        let (mut low, mut high) = (
            LARGEST_EXCESS.ln() - EXCESS_DECADES * std::f64::consts::LN_10,
            LARGEST_EXCESS.ln(),
        );
        for _ in 0..EXCESS_HALVINGS {
            let middle = 0.5 * (low + high);
            let found = self.solve(best.design, &best.y, &best.terms, middle.exp())?;
            if found.chi_square > found.freedom as f64 {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.with_terms_shown(best.design, &best.y, high.exp()) // eq. 29, 30
    }

    fn with_terms_shown<'a>(
        &self,
        design: &'a Design,
        y: &DVector<f64>,
        excess: f64,
    ) -> Option<NoiseSolution<'a>> {
        let mut terms: Vec<usize> = ALWAYS.iter().map(|term| *term as usize).collect();
        for term in IF_SHOWN {
            let mut more = terms.clone();
            more.push(term as usize);
            let Some(found) = self.solve(design, y, &more, excess) else {
                continue;
            };
            let k = term as usize;
            let chance = self.chance(&found, k, found.strengths[k]);
            if chance.is_some_and(|chance| chance.found > SHOWN * chance.sigma) {
                terms = more;
            }
        }
        self.solve(design, y, &terms, excess)
    }

    fn solve<'a>(
        &self,
        design: &'a Design,
        y: &DVector<f64>,
        terms: &[usize],
        excess: f64,
    ) -> Option<NoiseSolution<'a>> {
        let columns = design.columns();
        // Before any term is known: as many degrees of freedom as averages fit into the record.
        let mut weight = DVector::from_iterator(
            y.len(),
            design
                .samples
                .iter()
                .zip(y.iter())
                .map(|(m, v)| ((*m as f64 / self.total + excess) * v * v).recip()),
        );
        let mut strengths = [0.0; TERMS];
        for _ in 0..ROUNDS {
            strengths = non_negative(&columns, y, &weight, terms); // eq. 24
            let model = &columns * DVector::from_row_slice(&strengths);
            weight = (design.variances(&strengths) + beyond(y, &model, excess)).map(f64::recip);
            if !weight.iter().all(|w| w.is_finite()) {
                return None;
            }
        }
        let mut solution = NoiseSolution {
            design,
            columns,
            y: y.clone(),
            terms: terms.to_vec(),
            strengths,
            weight,
            excess,
            chi_square: 0.0,
            freedom: 0,
        };
        (solution.chi_square, solution.freedom) = misfit(&solution);
        Some(solution)
    }

    fn estimate(&self, term: NoiseTerm, solution: &NoiseSolution<'_>, bound: f64) -> TermEstimate {
        let k = term as usize;
        let with;
        let solution = if solution.terms.contains(&k) {
            solution
        } else {
            let mut terms = solution.terms.clone();
            terms.push(k);
            match self.solve(solution.design, &solution.y, &terms, solution.excess) {
                Some(found) => {
                    with = found;
                    &with
                }
                None => return TermEstimate::unknown(term),
            }
        };
        let (low, high) = self.interval_of(solution, k);
        let coefficient = |strength: f64| term.coefficient(strength, self.interval);
        // A term that exceeds the curve was not found: what the curve allows is all that is known of it. Where the terms
        // follow the curve, its scatter is in their intervals.
        let identifiable = low > 0.0 && low < bound;
        let largest = high.min(bound);
        let high = if identifiable && solution.excess == 0.0 {
            high
        } else {
            largest
        };
        TermEstimate {
            term,
            value: coefficient(solution.strengths[k])
                .clamp(coefficient(low.min(largest)), coefficient(largest)),
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
    fn interval_of(&self, solution: &NoiseSolution<'_>, k: usize) -> (f64, f64) {
        let apart = |strength: f64, side: f64| {
            let Some(chance) = self.chance(solution, k, strength) else {
                return f64::NAN;
            };
            // A strength below zero counts as zero: a bound must not shrink to nothing by it.
            let found = if side < 0.0 {
                chance.found.max(0.0)
            } else {
                chance.found
            };
            (found - strength) / chance.sigma - quantile(side, chance.skewness) // eq. 26
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

    /// Estimate of a term with the weights that are right if it has that strength, the others fitted beside it, and the
    /// scatter of that estimate.
    fn chance(&self, solution: &NoiseSolution<'_>, k: usize, strength: f64) -> Option<Chance> {
        let strengths = solution.beside(k, strength);
        let model = solution.model(&strengths);
        let mut covariance = solution.design.covariance(&strengths);
        let beyond = beyond(&solution.y, &model, solution.excess);
        covariance.set_diagonal(&(covariance.diagonal() + beyond));
        let weight = covariance.diagonal().map(f64::recip);
        let gain = gain(&solution.columns, &weight, &solution.terms)?;
        let row = gain.row(solution.place_of(k)).transpose();
        let spread = covariance * &row;
        let variance = row.dot(&spread); // eq. 25
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
    fn needed(&self, solution: &NoiseSolution<'_>, k: usize, bound: f64) -> Option<f64> {
        let asked = bound * ASKED * ASKED;
        let strengths = solution.beside(k, asked);
        (1..).zip(&self.longer).find_map(|(doubling, longer)| {
            let samples = self.total * f64::from(1 << doubling);
            let design = longer.get_or_init(|| Design::new(&Stretches::single(samples), LowPass::default()));
            let columns = design.columns();
            let model = &columns * DVector::from_row_slice(&strengths);
            let mut covariance = design.covariance(&strengths);
            let beyond = beyond(&model, &model, solution.excess);
            covariance.set_diagonal(&(covariance.diagonal() + beyond));
            let weight = covariance.diagonal().map(f64::recip);
            let gain = gain(&columns, &weight, &solution.terms)?;
            let row = gain.row(solution.place_of(k)).transpose();
            let sigma = row.dot(&(covariance * &row)).sqrt();
            (asked > SURELY * sigma).then_some(samples * self.interval) // eq. 35
        })
    }
}

/// Variance of each variance beyond chance: a share of what was found or expected, whichever is more.
fn beyond(y: &DVector<f64>, model: &DVector<f64>, excess: f64) -> DVector<f64> {
    y.zip_map(model, |found, expected| excess * found.max(expected).powi(2)) // eq. 29
}

/// Chi-square of what is left and its degrees of freedom, of variances whose chance is near normal.
fn misfit(solution: &NoiseSolution<'_>) -> (f64, usize) {
    let model = solution.model(&solution.strengths);
    let chance = solution.design.covariance(&solution.strengths);
    let counts: Vec<usize> = (0..model.len())
        .filter(|i| 2.0 * model[*i] * model[*i] >= LEAST_FREEDOM * chance[(*i, *i)])
        .collect();
    let mut covariance = chance;
    let beyond = beyond(&solution.y, &model, solution.excess);
    // Sums over lags have a covariance to a part in a thousand; what filters make alike would be singular.
    covariance.set_diagonal(&(covariance.diagonal() * (1.0 + ACCURACY) + beyond));
    let residual = (&solution.y - model).select_rows(&counts);
    let covariance = covariance.select_rows(&counts).select_columns(&counts);
    let chi_square = covariance
        .cholesky()
        .map_or(f64::INFINITY, |factor| residual.dot(&factor.solve(&residual)));
    (chi_square, counts.len().saturating_sub(solution.terms.len())) // eq. 27
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
