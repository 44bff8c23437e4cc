//! A wrong sample rate makes a gyroscope's scale wrong, on all axes alike (docs/theory/multipose.md, eq. 32).

use crate::turntable::TriadCalibration;

/// Largest scale over the smallest, where axes count as alike.
const ALIKE: f64 = 1.05;

/// Scale that no gyroscope in SI units has: data sheets allow some 5 %.
const IMPLAUSIBLE: f64 = 1.15;

/// Sigmas by which the scale must be beyond.
const SIGMAS: f64 = 3.0;

/// Place of scale x among bias, scale, non-orthogonality and mounting.
const SCALE: usize = 3;

/// Scale of all three axes where it is alike, and that of no sensor.
pub(super) fn implausible_scale(gyroscope: &TriadCalibration) -> Option<f64> {
    let scale = gyroscope.parts.scale;
    let logarithms = scale.map(f64::ln);
    let variance = gyroscope.parts_covariance.fixed_view::<3, 3>(SCALE, SCALE);
    let relative = variance.component_div(&(scale * scale.transpose()));
    let sigma = relative.sum().sqrt() / 3.0;
    let beyond = logarithms.mean().abs() > libm::log(IMPLAUSIBLE) + SIGMAS * sigma; // eq. 32
    let alike = logarithms.max() - logarithms.min() < libm::log(ALIKE);
    (beyond && alike).then(|| libm::exp(logarithms.mean()))
}
