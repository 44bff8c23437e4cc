//! Error of a mean whose readings are whole steps of a converter.

/// Steps smaller than this share of the range are rounding of floats.
const NEGLIGIBLE: f64 = 1e-6;

/// Smallest step between readings that differ; zero where there is none.
pub(super) fn step_of(readings: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = readings.collect();
    sorted.sort_by(f64::total_cmp);
    let range = sorted.last().zip(sorted.first()).map_or(0.0, |(a, b)| a - b);
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let smallest = steps
        .filter(|step| *step > NEGLIGIBLE * range)
        .fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

/// Variance of a mean of readings in steps, whose noise has this variance: noise of half a step averages it away
/// (Widrow and Kollár 2008, ch. 5; docs/theory/magnetometer.md, eq. 10).
pub(super) fn variance_of_steps(step: f64, noise: f64) -> f64 {
    if step == 0.0 {
        return 0.0;
    }
    let turns = 2.0 * std::f64::consts::PI / step;
    step * step / 12.0 * (-turns * turns * noise).exp() // eq. 10
}
