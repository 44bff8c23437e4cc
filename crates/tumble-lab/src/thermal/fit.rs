//! One axis: polynomials of temperature by generalised least squares, in noise that is white and wanders
//! (docs/theory/thermal.md).
//!
//! The noise is not given: `N` and `B` are those that make what is left over most likely (restricted maximum
//! likelihood; Patterson and Thompson, Biometrika 58, 1971). Errors of successive means hang together, and least squares
//! that took them for independent would promise far too much.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{DMatrix, DVector};
use tumble_core::resolution::variance_of_rounding;

use crate::distributions::{INTERVAL, student_quantile};

use super::block::RestBlock;
use super::whitening::{SlowNoise, Wander, Whitening};

/// Averaging times, s, at which slow noise is as strong as white noise, over which is averaged: the bias wanders within
/// a day, or within a second.
const AS_STRONG: [f64; 2] = [0.1, 1e5];
const TIMES_EACH_DECADE: u32 = 4;

/// Share below the end of a 95 % interval.
const BELOW: f64 = 0.975;

/// Sigmas from which on a power is there, however little of it stretches that were left out show.
const CERTAIN: f64 = 5.0;

/// Rounds of a fit with scale, after which what a pose reads at the reference no longer changes.
const ROUNDS: usize = 3;
/// Share of a column that the columns before it must leave, for its coefficient to mean something.
const SINGULAR: f64 = 1e-9;

/// Temperatures at which a difference between warming and cooling that is no constant is found, straight between them.
pub const KNOTS: usize = 7;
/// Share of a leg from which on a block is on it.
const ON_A_LEG: f64 = 0.5;

/// Which terms are fitted besides a constant for each pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// Highest power of temperature in the bias, 0 for none.
    pub bias: usize,
    /// The same in the scale factor.
    pub scale: usize,
    /// Terms of the difference between warming and cooling: 0 for none, 1 for a constant, [`KNOTS`] for a curve.
    pub hysteresis: usize,
}

impl Terms {
    /// Number of terms.
    pub fn count(&self) -> usize {
        self.bias + self.scale + self.hysteresis
    }
}

/// Regressors of an axis at the blocks: temperatures, legs and poses, and their noise.
#[derive(Clone, Debug)]
pub struct DriftDesign<'a> {
    whitening: &'a Whitening,
    /// Temperature less the reference, over the largest there is, for each block.
    temperature: Vec<f64>,
    legs: Vec<f64>,
    poses: Vec<usize>,
    held: usize,
    largest: f64,
    /// Temperatures that both legs reached in one pose, scaled alike.
    shared: [f64; 2],
}

/// DriftRounding of a channel whose noise is smaller than a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftRounding {
    /// In the unit of the channel.
    pub step: f64,
    /// Variance that it leaves on a mean while the truth stays within a step; zero where noise spreads the readings.
    pub variance: f64,
    /// Amplitude of the part of its error that goes with the place of the truth within a step, whatever the noise.
    pub wave: f64,
}

impl DriftRounding {
    /// DriftRounding to a step, if there is one, of readings that scatter by this variance.
    pub fn of(step: Option<f64>, scatter: f64) -> Self {
        let variance = variance_of_rounding(step, scatter);
        let step = step.unwrap_or(0.0);
        let noise = (scatter - step * step / 12.0).max(0.0);
        let left = if variance > 0.0 {
            (-2.0 * (PI / step).powi(2) * noise).exp() // eq. 7b
        } else {
            0.0
        };
        Self {
            step,
            variance,
            wave: step / PI * left,
        }
    }
}

/// Residuals of a fit at one strength of slow noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WithSlowNoise {
    /// Logarithm of the restricted likelihood, but for a constant.
    pub restricted_likelihood: f64,
    /// Sum of the squares of the whitened residuals.
    pub squares: f64,
    /// Blocks less unknowns.
    pub freedom: f64,
}

/// Fit of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftFit {
    /// Which terms.
    pub terms: Terms,
    /// Reading of the axis at the reference temperature in each pose, in its unit.
    pub constants: Vec<f64>,
    /// Coefficients of `t`, `t^2` ... of the bias, then those of the scale factor, then by how much more is read while
    /// warming than while cooling, at one temperature or several.
    pub coefficients: DVector<f64>,
    /// Covariance of the coefficients.
    pub covariance: DMatrix<f64>,
    /// Temperatures less the reference, K, between which warming and cooling are compared.
    pub shared: [f64; 2],
    /// `N^2` of what is left.
    pub white: f64,
    /// The slow noise beside it under which what is left is likeliest.
    pub slow: SlowNoise,
    /// Logarithm of the restricted likelihood, but for a constant: of noise, the terms given.
    pub restricted_likelihood: f64,
    /// Logarithm of the likelihood, but for a constant: of other temperatures of the same blocks.
    pub likelihood: f64,
    /// Residuals at each strength of each kind of slow noise.
    pub with_slow_noise: Vec<WithSlowNoise>,
}

impl DriftFit {
    /// Coefficients of the powers of the bias.
    pub fn bias(&self) -> &[f64] {
        &self.coefficients.as_slice()[..self.terms.bias]
    }

    /// Coefficients of the powers of the scale factor.
    pub fn scale(&self) -> &[f64] {
        &self.coefficients.as_slice()[self.terms.bias..self.terms.bias + self.terms.scale]
    }

    /// By how much more is read while warming than while cooling: a constant, or at each knot.
    pub fn hysteresis(&self) -> &[f64] {
        &self.coefficients.as_slice()[self.terms.bias + self.terms.scale..]
    }

    /// Square of the strength of slow noise of one kind; zero where another is likelier.
    pub fn strength(&self, wander: Wander) -> f64 {
        if wander == self.slow.wander {
            self.white * self.slow.ratio
        } else {
            0.0
        }
    }

    /// One of the coefficients and its 1-sigma.
    pub fn coefficient(&self, place: usize) -> Option<[f64; 2]> {
        let value = self.coefficients.get(place)?;
        Some([*value, self.covariance[(place, place)].sqrt()])
    }

    /// Tests whether its highest powers are significant.
    pub fn is_certain(&self) -> bool {
        let is_clear = |count: usize, last: usize| {
            let of_last = last.checked_sub(1).and_then(|place| self.coefficient(place));
            count == 0 || of_last.is_some_and(|[value, sigma]| value.abs() > CERTAIN * sigma)
        };
        let Terms { bias, scale, .. } = self.terms;
        is_clear(bias, bias) && is_clear(scale, bias + scale)
    }

    /// Reading of the axis in a pose `t` K above the reference, on a leg.
    pub fn reading(&self, pose: usize, t: f64, leg: f64) -> f64 {
        let hysteresis: f64 = self
            .hysteresis()
            .iter()
            .enumerate()
            .map(|(knot, value)| value * share_of_knot(self.terms.hysteresis, knot, t, self.shared))
            .sum();
        self.without_bias(pose, t) + polynomial(self.bias(), t) + 0.5 * leg * hysteresis // eq. 3
    }

    /// The same, had its bias no drift.
    pub fn without_bias(&self, pose: usize, t: f64) -> f64 {
        let constant = self.constants[pose];
        constant + (constant - middle(&self.constants)) * polynomial(self.scale(), t) // eq. 3
    }
}

/// Means and regressors whose errors have nothing in common in one kind of slow noise.
struct Whitened {
    y: DVector<f64>,
    rows: DMatrix<f64>,
}

impl<'a> DriftDesign<'a> {
    /// Blocks that `whitening` was made of, temperatures counted from `reference`, degC.
    pub fn new(whitening: &'a Whitening, blocks: &[RestBlock], reference: f64) -> Self {
        let off = blocks.iter().map(|block| block.temperature - reference);
        let largest = off.clone().map(f64::abs).fold(f64::MIN_POSITIVE, f64::max);
        Self {
            whitening,
            temperature: off.map(|t| t / largest).collect(),
            legs: blocks.iter().map(|block| 0.5 * block.leg).collect(),
            poses: blocks.iter().map(|block| block.pose).collect(),
            held: blocks.iter().map(|block| block.pose + 1).max().unwrap_or(0),
            largest,
            shared: shared_by_legs(blocks).map(|temperature| (temperature - reference) / largest),
        }
    }

    /// Fits the terms to the means of one axis, in the order of the blocks; None where there are too few, or the terms
    /// cannot be separated.
    pub fn fit(&self, means: &[f64], terms: &Terms) -> Option<DriftFit> {
        let mut constants = self.pose_means(means);
        let mut found = None;
        // The reading of a pose at the reference is known well from the first round on.
        for _ in 0..if terms.scale > 0 { ROUNDS } else { 1 } {
            let fit = self.averaged(means, &self.rows(terms, &constants), terms)?;
            constants.clone_from(&fit.constants);
            found = Some(fit);
        }
        found.map(|fit| self.in_kelvin(fit))
    }

    /// Fits the terms where the noise is known, `N^2` and what is beside it: with the covariance that no unbiased fit can
    /// beat.
    pub fn fit_with_noise(
        &self,
        means: &[f64],
        terms: &Terms,
        white: f64,
        slow: SlowNoise,
    ) -> Option<DriftFit> {
        let data = self.whitened(slow.wander, means, &self.rows(terms, &self.pose_means(means)));
        let mut fit = self.with_noise(&data, slow, terms)?;
        fit.covariance *= white / fit.white;
        Some(self.in_kelvin(fit))
    }

    /// The same fit, with what rounding adds to the covariance of its coefficients: blocks that read the same within a step
    /// share its error (docs/theory/thermal.md, eq. 7a). None where the terms cannot be separated.
    pub fn with_rounding(
        &self,
        mut fit: DriftFit,
        means: &[f64],
        rounding: &DriftRounding,
    ) -> Option<DriftFit> {
        if rounding.variance == 0.0 {
            return Some(fit);
        }
        let rows = self.rows(&fit.terms, &fit.constants);
        let levels: Vec<f64> = means.iter().map(|mean| (mean / rounding.step).round()).collect();
        let mut each = levels.clone();
        each.sort_by(f64::total_cmp);
        each.dedup();
        let alike = each.iter().map(|level| -> Vec<f64> {
            let is_alike = |of: &f64| rounding.variance.sqrt() * f64::from(u8::from(of == level));
            levels.iter().map(is_alike).collect()
        });
        let waves = [0.0, FRAC_PI_2].map(|phase| -> Vec<f64> {
            let at = |mean: &f64| rounding.wave * (2.0 * PI * mean / rounding.step + phase).sin();
            means.iter().map(at).collect()
        });
        for error in alike.chain(waves) {
            let data = self.whitened(fit.slow.wander, &error, &rows);
            let response = self.with_noise(&data, fit.slow, &fit.terms)?;
            let moved = self.in_kelvin(response).coefficients;
            fit.covariance += &moved * moved.transpose(); // eq. 7a
        }
        Some(fit)
    }

    fn whitened(&self, wander: Wander, means: &[f64], rows: &DMatrix<f64>) -> Whitened {
        let column = DMatrix::from_column_slice(means.len(), 1, means);
        Whitened {
            y: self.whitening.apply(wander, &column).column(0).into_owned(),
            rows: self.whitening.apply(wander, rows),
        }
    }

    /// Rows of what is fitted: a pose each, then the terms; `constants` are what the poses read, which, less the bias, a
    /// change of scale multiplies.
    fn rows(&self, terms: &Terms, constants: &[f64]) -> DMatrix<f64> {
        let middle = middle(constants);
        DMatrix::from_fn(
            self.temperature.len(),
            self.held + terms.count(),
            |row, column| {
                let (t, pose) = (self.temperature[row], self.poses[row]);
                let power = |of: usize| (0..of).fold(t, |power, _| power * t);
                match column.checked_sub(self.held) {
                    None => f64::from(u8::from(column == pose)),
                    Some(term) if term < terms.bias => power(term),
                    Some(term) if term < terms.bias + terms.scale => {
                        power(term - terms.bias) * (constants[pose] - middle) // eq. 3
                    }
                    Some(term) => {
                        let knot = term - terms.bias - terms.scale;
                        self.legs[row] * share_of_knot(terms.hysteresis, knot, t, self.shared)
                    }
                }
            },
        )
    }

    fn pose_means(&self, means: &[f64]) -> Vec<f64> {
        let of_pose = |pose: usize| {
            let mine = means.iter().zip(&self.poses).filter(move |(_, of)| **of == pose);
            let (sum, count) = mine.fold((0.0, 0.0), |(sum, count), (mean, _)| (sum + mean, count + 1.0));
            sum / f64::max(count, 1.0)
        };
        (0..self.held).map(of_pose).collect()
    }

    /// The mean over all kinds and strengths of slow noise, each as likely as what is left makes it: the data do not show
    /// it well, and a sigma for the most likely one alone would be too small.
    fn averaged(&self, means: &[f64], rows: &DMatrix<f64>, terms: &Terms) -> Option<DriftFit> {
        let of_kind = |wander: Wander| {
            let data = self.whitened(wander, means, rows);
            as_strong_at().filter_map(move |time| self.with_noise(&data, wander.from(time), terms))
        };
        let fits: Vec<DriftFit> = Wander::ALL.into_iter().flat_map(of_kind).collect();
        let likeliest = fits
            .iter()
            .max_by(|a, b| a.restricted_likelihood.total_cmp(&b.restricted_likelihood))?
            .clone();
        let shares = fits
            .iter()
            .map(|fit| (fit.restricted_likelihood - likeliest.restricted_likelihood).exp());
        let total: f64 = shares.clone().sum();
        let weighted: Vec<(&DriftFit, f64)> = fits.iter().zip(shares.map(|share| share / total)).collect();
        let none = DVector::zeros(likeliest.coefficients.len());
        let coefficients = weighted
            .iter()
            .fold(none, |sum, (fit, share)| sum + &fit.coefficients * *share); // eq. 6
        let nothing = DMatrix::zeros(coefficients.len(), coefficients.len());
        let covariance = weighted.iter().fold(nothing, |sum, (fit, share)| {
            let off = &fit.coefficients - &coefficients;
            sum + (&fit.covariance + &off * off.transpose()) * *share // eq. 6
        });
        let freedom = (means.len() - rows.ncols()) as f64;
        let widening = widening(&weighted, &covariance, freedom);
        let covariance = &widening * covariance * &widening;
        Some(DriftFit {
            coefficients,
            covariance,
            with_slow_noise: fits.iter().flat_map(|fit| fit.with_slow_noise.clone()).collect(),
            ..likeliest
        })
    }

    fn with_noise(&self, data: &Whitened, slow: SlowNoise, terms: &Terms) -> Option<DriftFit> {
        let Whitened { y, rows } = data;
        let freedom = y.len().checked_sub(rows.ncols()).filter(|freedom| *freedom > 0)? as f64;
        let variance = self.whitening.variances(slow);
        let weights = variance.map(|v| v.sqrt().recip());
        let mut weighted = rows.clone();
        for (mut row, weight) in weighted.row_iter_mut().zip(weights.iter()) {
            row *= *weight;
        }
        let y = y.component_mul(&weights);
        let qr = weighted.clone().qr();
        let (q, r) = (qr.q(), qr.r());
        let told_apart = |column: usize| r[(column, column)].abs() > SINGULAR * r.column(column).norm();
        let inverse = (0..r.ncols())
            .all(told_apart)
            .then(|| r.try_inverse())
            .flatten()?;
        let x = &inverse * q.tr_mul(&y);
        // Data without any noise are as likely as possible, but not infinitely so.
        let squares = (&y - &weighted * &x).norm_squared().max(f64::MIN_POSITIVE);
        let white = squares / freedom; // eq. 5
        let covariance = &inverse * inverse.transpose() * white;
        let of_noise: f64 = variance.iter().map(|v| v.ln()).sum();
        let of_fit: f64 = -2.0 * inverse.diagonal().map(|v| v.abs().ln()).sum();
        let restricted_likelihood = -0.5 * (freedom * white.ln() + of_noise + of_fit); // eq. 4
        let held = self.held;
        Some(DriftFit {
            terms: *terms,
            constants: x.rows(0, held).iter().copied().collect(),
            coefficients: x.rows(held, x.len() - held).into_owned(),
            covariance: covariance
                .view((held, held), (x.len() - held, x.len() - held))
                .into_owned(),
            shared: self.shared,
            white,
            slow,
            restricted_likelihood,
            likelihood: -0.5 * (y.len() as f64 * squares.ln() + of_noise), // eq. 11
            with_slow_noise: vec![WithSlowNoise {
                restricted_likelihood,
                squares,
                freedom,
            }],
        })
    }

    /// Undoes the scaling of temperature.
    fn in_kelvin(&self, mut fit: DriftFit) -> DriftFit {
        let terms = fit.terms;
        let factor = DVector::from_fn(terms.count(), |term, _| {
            let power = if term < terms.bias {
                term
            } else {
                term - terms.bias
            } + 1;
            let is_power = term < terms.bias + terms.scale;
            if is_power {
                (0..power).fold(1.0, |factor, _| factor / self.largest)
            } else {
                1.0
            }
        });
        let scaling = DMatrix::from_diagonal(&factor);
        fit.shared = self.shared.map(|temperature| temperature * self.largest);
        fit.coefficients.component_mul_assign(&factor);
        fit.covariance = &scaling * fit.covariance * &scaling;
        fit
    }
}

fn as_strong_at() -> impl Iterator<Item = f64> {
    let decades = (AS_STRONG[1] / AS_STRONG[0]).log10().round();
    let each = f64::from(TIMES_EACH_DECADE);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let steps = (decades * each) as u32;
    (0..=steps).map(move |step| AS_STRONG[0] * 10f64.powf(f64::from(step) / each))
}

/// By how much the sigma of each coefficient is to be widened, as its variance is itself uncertain.
fn widening(weighted: &[(&DriftFit, f64)], covariance: &DMatrix<f64>, freedom: f64) -> DMatrix<f64> {
    let each = DVector::from_fn(covariance.ncols(), |term, _| {
        let variance = covariance[(term, term)];
        let spread: f64 = weighted
            .iter()
            .map(|(fit, share)| {
                let own = fit.covariance[(term, term)];
                share * ((own - variance).powi(2) + own * own * 2.0 / freedom)
            })
            .sum();
        student_quantile(BELOW, 2.0 * variance * variance / spread) / INTERVAL // eq. 7
    });
    DMatrix::from_diagonal(&each)
}

/// Share of the value at a knot in the difference at a temperature: straight from knot to knot, held beyond the last.
fn share_of_knot(knots: usize, knot: usize, t: f64, [low, high]: [f64; 2]) -> f64 {
    if knots < 2 || high <= low {
        return f64::from(u8::from(knot == 0));
    }
    let place = ((t - low) / (high - low)).clamp(0.0, 1.0) * (knots - 1) as f64;
    (1.0 - (place - knot as f64).abs()).max(0.0) // eq. 12
}

/// Lowest and highest temperature, degC, that some pose was held at both while it warmed and while it cooled.
fn shared_by_legs(blocks: &[RestBlock]) -> [f64; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let range = |pose: usize, leg: f64| {
        let on_leg = blocks.iter().filter(|b| b.pose == pose && leg * b.leg > ON_A_LEG);
        on_leg.fold(nothing, |[low, high], b| {
            [low.min(b.temperature), high.max(b.temperature)]
        })
    };
    let poses = blocks.iter().map(|block| block.pose + 1).max().unwrap_or(0);
    (0..poses)
        .map(|pose| (range(pose, 1.0), range(pose, -1.0)))
        .map(|(warming, cooling)| [warming[0].max(cooling[0]), warming[1].min(cooling[1])])
        .filter(|[low, high]| low < high)
        .fold(nothing, |[low, high], both| [low.min(both[0]), high.max(both[1])])
}

fn polynomial(powers: &[f64], t: f64) -> f64 {
    powers.iter().rev().fold(0.0, |sum, power| (sum + power) * t)
}

/// Midway between the least and the largest: what an axis reads where it feels nothing, if it was turned over.
fn middle(constants: &[f64]) -> f64 {
    let least = constants.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = constants.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    0.5 * (least + largest)
}
