//! Bias instability as the residuals of a fit show it.
//!
//! A rest of seconds hardly separates flicker from white noise, so the ladder of one short session gives B^2 poorly.
//! The residuals of a fit at rests minutes apart are more informative: there flicker is larger and white noise smaller.
//! Both are combined by their variances (docs/theory/noise.md, eq. 8 to 10).

use nalgebra::{DMatrix, DVector};
use tumble_core::noise::{Flicker, Interval, Noise};
use tumble_core::turntable::observation::{FitInputs, Observation};

/// Beyond this many sigma residuals and ladder speak of different things, and the fit has another flaw than flicker.
const AGREE: f64 = 4.0;

/// Rounds in which the variance of the estimate settles.
const ROUNDS: u32 = 3;

/// One axis: residuals and flicker in units of the white noise of each interval. With R the projector on what the fit
/// leaves and C the covariance of flicker of B = 1:
struct Axis {
    /// Intervals less unknowns, `tr R`.
    freedom: f64,
    /// Sum of squared residuals less what white noise leaves.
    excess: f64,
    /// Contribution of flicker of B = 1, `tr R C`.
    signal: f64,
    /// `tr (R C)^2`.
    squares: f64,
}

/// The noise of a triad with what its residuals add to the inputs of B^2.
pub(super) fn refine<const P: usize, const Q: usize>(
    observations: &[Observation<f64, P, Q>],
    inputs: &FitInputs<f64, Q>,
) -> [Noise<f64>; 3] {
    let unchanged = inputs.noise;
    let intervals: Vec<_> = observations.iter().map(|o| o.interval).collect();
    let remembered = remembered(&intervals, &inputs.session);
    let axes: Option<Vec<Axis>> = (0..3)
        .map(|axis| Axis::of(observations, inputs, &remembered, axis))
        .collect();
    let Some(axes) = axes else { return unchanged };
    let signal: f64 = axes.iter().map(|axis| axis.signal).sum();
    if observations.len() <= P || signal <= 0.0 {
        return unchanged;
    }
    let shown = axes.iter().map(|axis| axis.excess).sum::<f64>() / signal; // eq. 9
    let (ladder, ladder_sigma) = (unchanged[0].flicker_shown, unchanged[0].flicker_sigma);
    let mut flicker = unchanged[0].flicker;
    for _ in 0..ROUNDS {
        let sigma = axes.iter().map(|axis| axis.variance(flicker)).sum::<f64>().sqrt() / signal;
        if (shown - ladder).abs() > AGREE * sigma.hypot(ladder_sigma) {
            return unchanged;
        }
        let (own, others) = (sigma.powi(-2), ladder_sigma.powi(-2));
        flicker = ((own * shown + others * ladder) / (own + others)).max(0.0); // eq. 10
    }
    let sigma = |noise: &Noise<f64>| {
        let own = axes.iter().map(|axis| axis.variance(flicker)).sum::<f64>().sqrt() / signal;
        (own.powi(-2) + noise.flicker_sigma.powi(-2)).powf(-0.5) // eq. 10
    };
    unchanged.map(|noise| Noise {
        flicker,
        flicker_sigma: sigma(&noise),
        ..noise
    })
}

/// Degrees of freedom of the variances themselves (Satterthwaite 1946): without bound where noise is white, few where
/// a B^2 that is poorly known makes up most of it (docs/theory/noise.md, eq. 11).
pub(super) fn variance_freedom<const P: usize, const Q: usize>(
    observations: &[Observation<f64, P, Q>],
    inputs: &FitInputs<f64, Q>,
) -> f64 {
    let noise = &inputs.noise[0];
    let variance = |noise: &Noise<f64>| -> f64 {
        observations
            .iter()
            .map(|o| noise.covariance(&o.interval, &o.interval, &inputs.session))
            .sum()
    };
    let of_flicker = variance(&Noise { white: 0.0, ..*noise });
    // B^2 is not more uncertain than it is large: zero is certain to be its lower end.
    let uncertain = (noise.flicker_sigma / noise.flicker).min(1.0);
    let share = of_flicker / variance(noise) * uncertain;
    if noise.flicker > 0.0 {
        2.0 / (share * share) // eq. 11
    } else {
        f64::INFINITY
    }
}

/// Covariance of flicker of B = 1 among intervals.
pub(crate) fn remembered(intervals: &[Interval<f64>], session: &Interval<f64>) -> DMatrix<f64> {
    let flicker = Flicker::over(session);
    let placed: Vec<_> = intervals
        .iter()
        .map(|interval| flicker.placed(interval))
        .collect();
    let mut covariance = DMatrix::zeros(placed.len(), placed.len());
    for (i, a) in placed.iter().enumerate() {
        for (j, b) in placed.iter().enumerate().take(i + 1) {
            covariance[(i, j)] = flicker.covariance(a, b);
            covariance[(j, i)] = covariance[(i, j)];
        }
    }
    covariance
}

impl Axis {
    /// `None` where the regressors do not span their space.
    fn of<const P: usize, const Q: usize>(
        observations: &[Observation<f64, P, Q>],
        inputs: &FitInputs<f64, Q>,
        remembered: &DMatrix<f64>,
        axis: usize,
    ) -> Option<Self> {
        let n = observations.len();
        let m = inputs.nominal.row(axis);
        let sigma = DVector::from_iterator(
            n,
            observations.iter().map(|o| {
                let of_truth = (m * o.truth_covariance * m.transpose())[0];
                (inputs.noise[axis].white / o.interval.duration() + of_truth + o.reading_variance[axis])
                    .sqrt()
            }),
        );
        let regressors = DMatrix::from_fn(n, P, |i, j| observations[i].regressor[j] / sigma[i]);
        let readings = DVector::from_fn(n, |i, _| observations[i].reading[axis] / sigma[i]);
        let flicker = DMatrix::from_fn(n, n, |i, j| remembered[(i, j)] / (sigma[i] * sigma[j]));
        // R = 1 - X S, in which X has few columns: R itself would cost the cube of the intervals.
        let solver = (regressors.transpose() * &regressors).try_inverse()? * regressors.transpose();
        let residuals = &readings - &regressors * (&solver * &readings);
        let left = &flicker - &regressors * (&solver * &flicker);
        #[allow(clippy::cast_precision_loss)]
        let freedom = n as f64 - P as f64;
        Some(Self {
            freedom,
            excess: residuals.norm_squared() - freedom, // eq. 9
            signal: left.trace(),                       // eq. 9: tr R K
            squares: left.tr_dot(&left),
        })
    }

    /// Variance of the sum of squared residuals under white noise and this much flicker: `2 tr (R (1 + B^2 C))^2`.
    fn variance(&self, flicker: f64) -> f64 {
        2.0 * (self.freedom + flicker * (2.0 * self.signal + flicker * self.squares)) // eq. 8
    }
}
