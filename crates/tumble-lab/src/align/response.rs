//! Response of one sensor against another beyond a delay: filters differ in their second and third order.

use nalgebra::Vector3;

/// 1-sigma of the time by which one sensor is later than another, s: low-passes of 30 Hz and above. Twice as much
/// doubles what a slow motion leaves open of the lever arm, along gravity four times.
pub const LARGEST_DELAY: f64 = 0.005;

/// Delay below which a gyroscope has no filter of its own beside its accelerometer, s: that of one sample of 10 kHz. Doubled, it
/// still takes part of a millionth off a motion of 2 Hz.
pub const SMALLEST_DELAY: f64 = 1e-4;

/// Covariance of the noise of a mean under a triangle with that of the second derivative beside it, over the variance of the mean
/// and the inverse square of the window (docs/theory/align.md, eq. 20).
const SHARED_NOISE: f64 = 3.0;

/// A filter against another: `1 + second s^2 + third s^3`, its delay apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResponseTerms {
    /// Factor of the second derivative, s^2: loss of amplitude with frequency where positive.
    pub second: f64,
    /// Factor of the third derivative, s^3.
    pub third: f64,
}

impl ResponseTerms {
    /// Longest time that delay and terms show, s, or `least`: a filter has one (docs/theory/align.md, eq. 20).
    pub fn time(&self, delay: f64, least: f64) -> f64 {
        let of_terms = self.second.abs().sqrt().max(self.third.abs().cbrt());
        least.max(delay.abs()).max(of_terms) // eq. 20: T
    }

    /// 1-sigma of both before any data, s^2 and s^3 (docs/theory/align.md, eq. 20).
    pub fn sigma(&self, delay: f64) -> (f64, f64) {
        let time = self.time(delay, LARGEST_DELAY);
        (time.powi(2), time.powi(3)) // eq. 20
    }

    /// Second order, s^2, that noise has to stay below so that the motion shows the one that was found: the prior without it, or
    /// half of it (docs/theory/align.md, eq. 21).
    pub fn shown_from(&self, delay: f64) -> f64 {
        let without = Self { second: 0.0, ..*self };
        without.sigma(delay).0.max(SHARE_OF_NOISE * self.second.abs())
    }
}

/// Share of a second-order term that noise may be, so that the term is one of a filter.
const SHARE_OF_NOISE: f64 = 0.5;

/// 1-sigma of the fourth order, which is not fitted, s^4 (docs/theory/align.md, eq. 22a).
pub fn fourth_sigma(response: &ResponseTerms, delay: f64) -> f64 {
    response.time(delay, LARGEST_DELAY).powi(4) // eq. 22a
}

/// Mean fourth derivatives beside the pairs: second differences of the second ones, as three bells in a row lie; none beside a gap.
pub fn fourth_derivatives(times: &[f64], curvatures: &[Vector3<f64>], window: f64) -> Vec<Vector3<f64>> {
    let of_three = |k: usize| {
        let (before, after) = (k.checked_sub(1)?, k + 1);
        let reach = times.get(after)? - times[before];
        let adjoin = (reach - 2.0 * window).abs() < 0.5 * window;
        adjoin.then(|| {
            (curvatures[before] - curvatures[k] * 2.0 + curvatures[after]) / (window * window) // eq. 22a
        })
    };
    (0..curvatures.len())
        .map(|k| of_three(k).unwrap_or_else(Vector3::zeros))
        .collect()
}

/// Product of the noise of a component of a residual and of the second derivative beside it, where all of the noise, of a
/// 1-sigma `scale`, is of one unit: the two units' shares of the mean derivative have opposite signs.
pub fn shared_noise(scale: f64, window: f64) -> f64 {
    0.5 * SHARED_NOISE * (scale / window).powi(2) // eq. 20: n
}

/// Returns whether noise leaves the second-order term less uncertain than its prior does.
pub fn is_shown(
    derivatives: impl Iterator<Item = Vector3<f64>>,
    scale: f64,
    window: f64,
    sigma: f64,
) -> bool {
    let (mut energy, mut count) = (0.0, 0.0);
    for derivative in derivatives {
        energy += derivative.norm_squared();
        count += 3.0;
    }
    shared_noise(scale, window) * count < sigma * energy // eq. 20
}
