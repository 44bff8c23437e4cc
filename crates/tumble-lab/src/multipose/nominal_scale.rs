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

/// Scatter of the noisiest gyroscope at rest, over the usual one.
const NOISIEST: f64 = 10.0;

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

/// Smallest turn of gravity between two quiet windows, rad, that shows the scale of a gyroscope.
const SMALLEST_TURN: f64 = 0.3;

/// Judges counts by the quietest half of all windows; `None` where these do not surround a centre.
pub(super) fn counts(time: &[f64], force: &[[f64; 3]], rate: &[[f64; 3]], gravity: f64) -> Option<Counts> {
    let mut windows: Vec<_> = force
        .chunks_exact(WINDOW)
        .zip(rate.chunks_exact(WINDOW))
        .map(|(force, rate)| (mean_and_scatter(force), mean_and_scatter(rate)))
        .enumerate()
        .collect();
    windows.sort_by(|(_, a), (_, b)| (a.0.1 * a.1.1).total_cmp(&(b.0.1 * b.1.1)));
    windows.truncate(windows.len() / 2);
    let (_, (_, (rate_zero, scatter))) = *windows.first()?;
    windows.sort_by_key(|(number, _)| *number);
    let quiet: Vec<_> = windows
        .iter()
        .map(|(number, (force, _))| (*number, force.0))
        .collect();
    let forces: Vec<_> = quiet.iter().map(|(_, force)| *force).collect();
    let (force_zero, radius) = sphere(&forces)?;
    let path = counted_path(time, rate, &rate_zero);
    let by_scatter = USUAL_RATE_SCATTER / scatter;
    let turned = quiet.windows(2).filter_map(|pair| {
        let [(first, before), (second, after)] = [pair[0], pair[1]];
        let angle = (before - force_zero).angle(&(after - force_zero));
        let [first, second] = [first, second].map(|number| number * WINDOW + WINDOW / 2);
        (angle > SMALLEST_TURN).then(|| angle / (path[second] - path[first]))
    });
    Some(Counts {
        force_zero,
        rate_zero,
        scale: NominalScale {
            force: rounded(radius / gravity).recip(),
            // No turn is shorter than that of gravity in it: the largest ratio is nearest to the scale. Where a log was
            // cut, gravity turns while nothing is counted.
            rate: match turned
                .filter(|scale| *scale < NOISIEST * by_scatter)
                .reduce(f64::max)
            {
                Some(scale) => scale,
                None if scatter > 0.0 => by_scatter,
                None => 1.0,
            },
        },
    })
}

/// Length of the way that a gyroscope counted up to each sample, counts times s.
fn counted_path(time: &[f64], rate: &[[f64; 3]], zero: &Vector3<f64>) -> Vec<f64> {
    let mut path = Vec::with_capacity(rate.len());
    let (mut sum, mut before) = (0.0, None);
    for (t, y) in time.iter().zip(rate) {
        sum += (Vector3::from(*y) - zero).norm() * (t - before.unwrap_or(*t));
        before = Some(*t);
        path.push(sum);
    }
    path
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
    let unit = libm::pow(10.0, libm::log10(scale).floor() - 3.0);
    (scale / unit).round() * unit
}
