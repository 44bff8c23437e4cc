//! Covariance of the variances of a record by chance, within and between averaging times.
//!
//! Differences of Gaussian noise have a covariance that follows from its terms; squares of them have twice its square
//! (Greenhall and Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003, whose sums are
//! formed here as they stand, for any mixture of terms and any set of gaps; docs/theory/noise.md).

use std::collections::BTreeMap;

use super::deviation::stride;
use super::lowpass::LowPass;
use super::term::{NoiseTerm, RANDOM, TERMS, autocovariances};
use super::variance_kind::VarianceKind;

/// Strengths of all terms, in their order.
pub type Strengths = [f64; TERMS];

/// Lags a shorter averaging time is divided into.
const LAGS: usize = 16;
/// Longer averaging times on both sides after which differences have nothing in common.
const BEYOND: f64 = 2.0;
/// From this ratio of averaging times on, variances have next to nothing in common.
const FARTHEST: usize = 64;
/// Classes an octave into which stretches are sorted by the samples over which their differences start.
const CLASSES: f64 = 16.0;

/// Stretches of a record without gaps: length in samples, and how many there are.
#[derive(Clone, Debug)]
pub struct Stretches(Vec<(f64, f64)>);

impl Stretches {
    /// One stretch.
    pub fn single(samples: f64) -> Self {
        Self(vec![(samples, 1.0)])
    }

    /// Stretches by their number of samples, each with how many there are.
    pub fn new(stretches: &BTreeMap<u64, u64>) -> Self {
        let each = stretches.iter();
        Self(
            each.map(|(&samples, &count)| (samples as f64, count as f64))
                .collect(),
        )
    }

    /// All samples.
    pub fn samples(&self) -> f64 {
        self.0.iter().map(|(samples, count)| samples * count).sum()
    }

    /// Samples over which differences start, in each stretch; none in one that is too short.
    fn starts(&self, kind: VarianceKind, samples: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        let step = stride(samples) as f64;
        let span = kind.span(samples) as f64;
        self.0.iter().map(move |(length, count)| {
            let starts = (((length - span) / step).floor() * step + step).max(0.0);
            (starts, *count)
        })
    }

    /// Samples over which differences start at two averaging times, the first not above the second, in stretches that
    /// have any of both. Those that have alike many of the second are taken together: alike *lengths* would give the
    /// differences of the longest of them to all.
    fn starts_of_both(&self, kind: VarianceKind, a: usize, b: usize) -> Vec<(f64, f64, f64)> {
        let mut classes: BTreeMap<u64, (f64, f64, f64)> = BTreeMap::new();
        for ((of_a, count), (of_b, _)) in self.starts(kind, a).zip(self.starts(kind, b)) {
            if of_b > 0.0 {
                let sums = classes.entry((of_b.log2() * CLASSES) as u64).or_default();
                *sums = (sums.0 + of_a * count, sums.1 + of_b * count, sums.2 + count);
            }
        }
        let mean = |(of_a, of_b, count): (f64, f64, f64)| (of_a / count, of_b / count, count);
        classes.into_values().map(mean).collect()
    }

    /// Samples over which differences start, of all stretches.
    pub fn starts_in_all(&self, kind: VarianceKind, samples: usize) -> f64 {
        self.starts(kind, samples)
            .map(|(starts, count)| starts * count)
            .sum()
    }
}

/// Covariance of two variances, as a quadratic form in the strengths.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shared {
    random: [[f64; RANDOM]; RANDOM],
    with_ramp: [f64; RANDOM],
}

impl Shared {
    /// Computes it for variances at two averaging times, samples, the first not above the second; white noise is
    /// `filtered`.
    pub fn between(
        kind: VarianceKind,
        a: usize,
        b: usize,
        stretches: &Stretches,
        filtered: &LowPass,
    ) -> Self {
        let mut shared = Self::default();
        if b > FARTHEST * a {
            return shared;
        }
        let starts = stretches.starts_of_both(kind, a, b);
        let longest = starts.iter().fold(0.0, |most: f64, each| most.max(each.0));
        let step = (a / LAGS).max(1).min((longest as usize / 4).max(1));
        let (reach, of_a, of_b) = (kind.reach() as f64, a as f64, b as f64);
        let first = -((reach + BEYOND) * of_b).min(longest) / step as f64;
        let last = (reach * of_a + BEYOND * of_b).min(longest) / step as f64;
        for number in first.floor() as i64..=last.ceil() as i64 {
            let lag = (number * step as i64) as f64;
            let weight = step as f64 * pairs(&starts, lag);
            if weight > 0.0 {
                let covariance = covariances(kind, of_a, of_b, lag, filtered);
                for k in 0..RANDOM {
                    for l in 0..RANDOM {
                        shared.random[k][l] += 2.0 * weight * covariance[k] * covariance[l]; // eq. 22
                    }
                    let ramp = ramp(kind, of_a) * ramp(kind, of_b);
                    shared.with_ramp[k] += 4.0 * weight * ramp * covariance[k]; // eq. 22
                }
            }
        }
        let starts = stretches.starts_in_all(kind, a) * stretches.starts_in_all(kind, b);
        let scale = 1.0 / (starts * kind.divisor(of_a) * kind.divisor(of_b));
        shared.random.iter_mut().flatten().for_each(|each| *each *= scale);
        shared.with_ramp.iter_mut().for_each(|each| *each *= scale);
        shared
    }

    /// unit^4.
    pub fn covariance(&self, strengths: &Strengths) -> f64 {
        let ramp = strengths[TERMS - 1];
        let of = |k: usize| {
            let random: f64 = (0..RANDOM).map(|l| strengths[l] * self.random[k][l]).sum();
            strengths[k] * (random + ramp * self.with_ramp[k])
        };
        (0..RANDOM).map(of).sum()
    }
}

/// Pairs of starts that lie a lag apart, over all stretches: per sample of the lag and of the start.
fn pairs(starts: &[(f64, f64, f64)], lag: f64) -> f64 {
    let overlap = |of_a: f64, of_b: f64| (of_a.min(of_b - lag) - (-lag).max(0.0)).max(0.0);
    starts
        .iter()
        .map(|(of_a, of_b, count)| count * overlap(*of_a, *of_b))
        .sum()
}

/// Coefficients of a difference.
fn coefficients(kind: VarianceKind) -> &'static [f64] {
    match kind {
        VarianceKind::Allan => &[1.0, -2.0, 1.0],
        VarianceKind::Modified | VarianceKind::Hadamard => &[1.0, -3.0, 3.0, -1.0],
    }
}

/// Covariance of a difference with another that starts a lag later, for each term of strength one.
fn covariances(kind: VarianceKind, a: f64, b: f64, lag: f64, filtered: &LowPass) -> [f64; RANDOM] {
    let mut sum = [0.0; RANDOM];
    for (p, of_a) in coefficients(kind).iter().enumerate() {
        for (q, of_b) in coefficients(kind).iter().enumerate() {
            let terms = autocovariances(kind, lag + q as f64 * b - p as f64 * a, filtered);
            for k in 0..RANDOM {
                sum[k] += of_a * of_b * terms[k];
            }
        }
    }
    sum
}

/// Difference of a ramp of strength one.
fn ramp(kind: VarianceKind, samples: f64) -> f64 {
    match kind {
        VarianceKind::Allan => samples.powi(2),
        VarianceKind::Modified => samples.powi(3),
        VarianceKind::Hadamard => 0.0,
    }
}

/// Variance of that kind expected at an averaging time, of white noise that was `filtered` and the other terms.
pub fn expected(kind: VarianceKind, samples: usize, strengths: &Strengths, filtered: &LowPass) -> f64 {
    let m = samples as f64;
    if kind == VarianceKind::Allan {
        let terms = NoiseTerm::ALL.iter().zip(strengths);
        return terms
            .map(|(term, strength)| strength * term.allan_variance(m, filtered))
            .sum();
    }
    let random = covariances(kind, m, m, 0.0, filtered);
    let sum: f64 = random
        .iter()
        .zip(strengths)
        .map(|(one, strength)| one * strength)
        .sum();
    (sum + strengths[TERMS - 1] * ramp(kind, m).powi(2)) / kind.divisor(m)
}

/// Equivalent degrees of freedom of a variance at an averaging time, of noise of those strengths; `own` is what it
/// shares with itself.
pub fn freedom(
    kind: VarianceKind,
    samples: usize,
    own: &Shared,
    strengths: &Strengths,
    filtered: &LowPass,
) -> f64 {
    let expected = expected(kind, samples, strengths, filtered);
    2.0 * expected * expected / own.covariance(strengths) // eq. 23
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn freedom_in(samples: usize, term: NoiseTerm, stretches: &Stretches) -> f64 {
        let white = LowPass::default();
        let own = Shared::between(VarianceKind::Allan, samples, samples, stretches, &white);
        freedom(VarianceKind::Allan, samples, &own, &only(term), &white)
    }

    fn only(term: NoiseTerm) -> Strengths {
        let mut strengths = [0.0; TERMS];
        strengths[term as usize] = 1.0;
        strengths
    }

    /// Greenhall and Riley, table 2 and IEEE Std 1139-2008: white frequency noise, fully overlapping.
    fn published(n: f64, m: f64) -> f64 {
        // Lesage and Audoin; Howe, Allan and Barnes 1981: 3(N-1)/2m - 2(N-2)/N times 4m^2/(4m^2+5), N samples of phase.
        let phases = n + 1.0;
        (3.0 * (phases - 1.0) / (2.0 * m) - 2.0 * (phases - 2.0) / phases) * 4.0 * m * m / (4.0 * m * m + 5.0)
    }

    #[test]
    fn a_single_difference_has_one_degree_of_freedom() {
        for term in [
            NoiseTerm::White,
            NoiseTerm::BiasInstability,
            NoiseTerm::RandomWalk,
        ] {
            let freedom = freedom_in(10, term, &Stretches::single(20.0));
            assert!((freedom - 1.0).abs() < 1e-9, "{} {freedom}", term.name());
        }
    }

    #[test]
    fn degrees_of_freedom_of_white_noise_follow_howe_allan_barnes() {
        for (n, m) in [(1000, 1), (1000, 10), (10_000, 64), (1000, 100), (1000, 250)] {
            let freedom = freedom_in(m, NoiseTerm::White, &Stretches::single(n as f64));
            let published = published(n as f64, m as f64);
            assert!(
                (freedom / published - 1.0).abs() < 0.05,
                "{n} {m}: {freedom} {published}"
            );
        }
    }

    proptest! {
        #[test]
        fn stretches_of_any_lengths_add_what_their_differences_show(
            lengths in prop::collection::btree_map(900_u64..1100, 1_u64..4, 1..40),
            samples in 430_usize..560,
        ) {
            let stretches = Stretches::new(&lengths);
            let differences = |each: &Stretches| each.starts_in_all(VarianceKind::Allan, samples);
            let all = differences(&stretches);
            prop_assume!(all > 0.0);
            let alone = lengths.iter().map(|(length, count)| (Stretches::single(*length as f64), *count as f64));
            let variance: f64 = alone
                .map(|(one, count)| (differences(&one), count, one))
                .filter(|(starts, _, _)| *starts > 0.0)
                .map(|(starts, count, one)| count * starts * starts / freedom_in(samples, NoiseTerm::White, &one))
                .sum();
            let found = freedom_in(samples, NoiseTerm::White, &stretches);
            // Lags are up to a quarter of the longest run of starts apart. Classes of alike lengths were off a hundredfold.
            prop_assert!((found * variance / (all * all) - 1.0).abs() < 0.25, "{found} {}", all * all / variance);
        }
    }

    #[test]
    fn stretches_add_their_degrees_of_freedom() {
        let one = freedom_in(16, NoiseTerm::White, &Stretches::single(500.0));
        let three = Stretches::new(&BTreeMap::from([(500, 3)]));
        let together = freedom_in(16, NoiseTerm::White, &three);
        assert!((together / one - 3.0).abs() < 1e-9);
    }
}
