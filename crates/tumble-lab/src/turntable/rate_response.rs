//! Scale factor of a gyroscope rate by rate: linearity and asymmetry, as IEEE Std 952 and 1431 define them.
//!
//! Each constant rate is a point of a sensing axis: the true rate along it, and the reading. The scale factor of the axis is
//! the slope of the straight line through them by least squares, linearity what they deviate from it over full scale, and
//! asymmetry the difference of the slopes at positive and negative rates over the slope (docs/theory/turntable.md, eq. 35 to 38).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use tumble_core::turntable::truth::RateObservation;

use super::triad::{ResidualLabel, TriadCalibration};

/// One rate of one sensing axis, and what was found there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateLevel {
    /// Mean true rate along the sensing axis, rad/s.
    pub rate: f64,
    /// Constant rates that went into it.
    pub turns: usize,
    /// Reading less bias over true rate.
    pub scale: f64,
    /// 1-sigma.
    pub scale_sigma: f64,
    /// Deviation from the straight line over full scale.
    pub deviation: f64,
    /// 1-sigma.
    pub deviation_sigma: f64,
}

/// A sensing axis of a gyroscope on a rate table.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisResponse {
    /// Index of the axis.
    pub axis: usize,
    /// Largest rate that it was shown, rad/s.
    pub full_scale: f64,
    /// Slope of the straight line, and its 1-sigma.
    pub scale: (f64, f64),
    /// Largest deviation from the straight line over full scale, without sign, and its 1-sigma.
    pub linearity: (f64, f64),
    /// Slope at positive less slope at negative rates over the slope, and its 1-sigma; `None` where the rates do not show it.
    pub asymmetry: Option<(f64, f64)>,
    /// The rates, from the most negative up.
    pub levels: Vec<RateLevel>,
}

/// A reading of one axis.
#[derive(Clone, Copy)]
struct Point {
    rate: f64,
    reading: f64,
    variance: f64,
    turning: bool,
}

/// Cosine between a rate and the axis that it is to test.
const ALONG: f64 = 0.7;

/// Cosine of gravity at a rest with that at a constant rate: a gyroscope that responds to specific force has another bias
/// elsewhere.
const SAME_UP: f64 = 0.9;

/// Rates closer than this, relative and rad/s, are one.
const SAME_RATE: (f64, f64) = (0.02, 2e-3);

/// Response of each sensing axis that turned at constant rates; `forces` is the specific force of each observation.
pub(super) fn rate_response(
    triad: &TriadCalibration,
    observations: &[RateObservation<f64>],
    forces: &[Vector3<f64>],
) -> Vec<AxisResponse> {
    (0..3)
        .filter(|axis| triad.observed[9 + axis])
        .filter_map(|axis| response(axis, &points(axis, triad, observations, forces)))
        .collect()
}

/// The constant rates along a sensing axis, and the rests at which gravity was where it was then.
fn points(
    axis: usize,
    triad: &TriadCalibration,
    observations: &[RateObservation<f64>],
    forces: &[Vector3<f64>],
) -> Vec<Point> {
    let row = triad.model.matrix.row(axis).transpose();
    let sensing = row.normalize();
    let truth = |k: usize| observations[k].regressor.fixed_rows::<3>(0).into_owned();
    let along = |k: usize| sensing.dot(&truth(k)).abs() >= ALONG * truth(k).norm();
    let kind = |k: usize| triad.labels[k];
    let turning: Vec<usize> = (0..observations.len())
        .filter(|&k| matches!(kind(k), ResidualLabel::Rate(_)) && along(k))
        .collect();
    let same_up = |k: usize| turning.iter().any(|&j| cosine(&forces[k], &forces[j]) > SAME_UP);
    let resting =
        (0..observations.len()).filter(|&k| matches!(kind(k), ResidualLabel::Rest(_)) && same_up(k));
    let point = |k: usize, turning: bool| {
        let felt = triad
            .g_sensitivity
            .as_ref()
            .map_or(0.0, |(g, _)| (g * forces[k])[axis]);
        Point {
            rate: sensing.dot(&truth(k)),
            reading: observations[k].reading[axis] - felt,
            // A bend of the response is what is looked for, and no reason to widen its sigma.
            variance: triad.residuals[k].1[axis].powi(2),
            turning,
        }
    };
    let rests: Vec<_> = resting.map(|k| point(k, false)).collect();
    turning.iter().map(|&k| point(k, true)).chain(rests).collect()
}

fn cosine(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.dot(b) / (a.norm() * b.norm()).max(f64::MIN_POSITIVE)
}

/// Weighted least squares of readings on K regressors of the rate: the coefficients and their covariance.
fn line<const K: usize>(
    points: &[Point],
    regressors: impl Fn(f64) -> SVector<f64, K>,
) -> Option<(SVector<f64, K>, SMatrix<f64, K, K>)> {
    let (mut information, mut vector) = (SMatrix::<f64, K, K>::zeros(), SVector::<f64, K>::zeros());
    // Rates are of the order of the largest, so that the columns are alike.
    for point in points {
        let row = regressors(point.rate);
        information += row * row.transpose() / point.variance;
        vector += row * (point.reading / point.variance);
    }
    let scales = SVector::<f64, K>::from_fn(|i, _| information[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = SMatrix::<f64, K, K>::from_fn(|i, j| information[(i, j)] * scales[i] * scales[j]);
    let root = scaled.cholesky()?;
    let distinct = root.l_dirty().diagonal().min() > DISTINCT;
    let inverse = distinct.then(|| root.inverse())?;
    let covariance = SMatrix::<f64, K, K>::from_fn(|i, j| inverse[(i, j)] * scales[i] * scales[j]);
    Some((covariance * vector, covariance))
}

/// Relative remainder of a column without those before it, below which they are one.
const DISTINCT: f64 = 1e-3;

fn response(axis: usize, points: &[Point]) -> Option<AxisResponse> {
    let turning: Vec<Point> = points.iter().copied().filter(|point| point.turning).collect();
    let full_scale = turning.iter().map(|point| point.rate.abs()).fold(0.0, f64::max);
    let straight = |rate: f64| SVector::<f64, 2>::new(1.0, rate);
    let (found, covariance) = line(points, straight)?; // eq. 35
    let (intercept, slope) = (found[0], found[1]);
    let bias = at_rest(points).unwrap_or((intercept, covariance[(0, 0)]));
    let levels: Vec<_> = groups(&turning)
        .iter()
        .map(|group| {
            let weight: f64 = group.iter().map(|point| 1.0 / point.variance).sum();
            let mean = |f: fn(&Point) -> f64| {
                group.iter().map(|point| f(point) / point.variance).sum::<f64>() / weight
            };
            let (rate, reading) = (mean(|point| point.rate), mean(|point| point.reading));
            let row = straight(rate);
            let fitted = row.dot(&(covariance * row));
            RateLevel {
                rate,
                turns: group.len(),
                scale: (reading - bias.0) / rate, // eq. 36
                scale_sigma: (1.0 / weight + bias.1).sqrt() / rate.abs(),
                deviation: (reading - row.dot(&found)) / (slope * full_scale), // eq. 37
                deviation_sigma: (1.0 / weight - fitted).max(0.0).sqrt() / (slope.abs() * full_scale),
            }
        })
        .collect();
    let worst = levels
        .iter()
        .max_by(|a, b| a.deviation.abs().total_cmp(&b.deviation.abs()))?;
    let both = turning.iter().any(|point| point.rate > 0.0) && turning.iter().any(|point| point.rate < 0.0);
    let bent = |rate: f64| Vector3::new(1.0, rate, rate.abs());
    let asymmetry =
        line(points, bent)
            .filter(|_| both)
            .map(|(found, covariance): (Vector3<f64>, Matrix3<f64>)| {
                (
                    2.0 * found.z / found.y,
                    2.0 * covariance[(2, 2)].sqrt() / found.y.abs(),
                ) // eq. 38
            });
    Some(AxisResponse {
        axis,
        full_scale,
        scale: (slope, covariance[(1, 1)].sqrt()),
        linearity: (worst.deviation.abs(), worst.deviation_sigma),
        asymmetry,
        levels,
    })
}

/// Mean reading at rest and its variance; `None` where there is no rest.
fn at_rest(points: &[Point]) -> Option<(f64, f64)> {
    let rests = || points.iter().filter(|point| !point.turning);
    let weight: f64 = rests().map(|point| 1.0 / point.variance).sum();
    let sum: f64 = rests()
        .map(|point| (point.reading - point.rate) / point.variance)
        .sum();
    (weight > 0.0).then(|| (sum / weight, 1.0 / weight))
}

/// Constant rates that are one, from the most negative up.
fn groups(turning: &[Point]) -> Vec<Vec<Point>> {
    let mut sorted = turning.to_vec();
    sorted.sort_by(|a, b| a.rate.total_cmp(&b.rate));
    let mut groups: Vec<Vec<Point>> = Vec::new();
    for point in sorted {
        let near = |group: &Vec<Point>| {
            let last = group.last().map_or(f64::NAN, |last| last.rate);
            point.rate - last <= SAME_RATE.0 * point.rate.abs() + SAME_RATE.1
        };
        match groups.last_mut().filter(|group| near(group)) {
            Some(group) => group.push(point),
            None => groups.push(vec![point]),
        }
    }
    groups
}
