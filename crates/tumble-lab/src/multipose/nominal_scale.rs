//! Counts of an unknown scale: where zero is and how many make a unit, well enough to find rests by.

use nalgebra::Vector3;

use crate::constant_length::sphere::sphere;

/// Nominal scale of counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NominalScale {
    /// m/s^2 of one count of the accelerometer.
    pub force: f64,
    /// rad/s of one count of the gyroscope.
    pub rate: f64,
}

/// Scatter of a gyroscope at rest, rad/s, while nothing better is known.
const USUAL_RATE_SCATTER: f64 = 0.003;

/// Samples of a window in which scatter is judged.
const WINDOW: usize = 50;

/// Statistics of counts in quiet windows: zero and size of both triads.
pub(super) struct Counts {
    /// Zero of the accelerometer, counts.
    pub force_zero: Vector3<f64>,
    /// Zero of the gyroscope, counts.
    pub rate_zero: Vector3<f64>,
    /// The first guess.
    pub scale: NominalScale,
}

/// Judges counts by the quietest half of all windows; `None` where these do not surround a centre.
pub(super) fn counts(force: &[[f64; 3]], rate: &[[f64; 3]], gravity: f64) -> Option<Counts> {
    let mut windows: Vec<_> = force
        .chunks_exact(WINDOW)
        .zip(rate.chunks_exact(WINDOW))
        .map(|(force, rate)| (mean_and_scatter(force), mean_and_scatter(rate)))
        .collect();
    windows.sort_by(|a, b| (a.0.1 * a.1.1).total_cmp(&(b.0.1 * b.1.1)));
    windows.truncate(windows.len() / 2);
    let forces: Vec<_> = windows.iter().map(|(force, _)| force.0).collect();
    let (force_zero, radius) = sphere(&forces)?;
    let (_, (rate_zero, scatter)) = windows.first()?;
    Some(Counts {
        force_zero,
        rate_zero: *rate_zero,
        scale: NominalScale {
            force: rounded(radius / gravity).recip(),
            rate: if *scatter > 0.0 {
                USUAL_RATE_SCATTER / scatter
            } else {
                1.0
            },
        },
    })
}

fn mean_and_scatter(readings: &[[f64; 3]]) -> (Vector3<f64>, f64) {
    #[allow(clippy::cast_precision_loss)]
    let count = readings.len() as f64;
    let mean = readings.iter().map(|y| Vector3::from(*y)).sum::<Vector3<f64>>() / count;
    let squares = readings
        .iter()
        .map(|y| (Vector3::from(*y) - mean).norm_squared())
        .sum::<f64>();
    (mean, (squares / count).sqrt())
}

/// Four digits, as a user types them.
pub(super) fn rounded(scale: f64) -> f64 {
    let unit = 10.0_f64.powf(scale.log10().floor() - 3.0);
    (scale / unit).round() * unit
}
