//! Means of a magnetometer over the rests of a unit.

use nalgebra::{Matrix3, SMatrix, Vector3};
use tumble_core::model::ModelCovariance;
use tumble_core::resolution::{Resolution, variance_of_rounding};

use super::readings::{FieldReading, FieldReadings, Upward};

/// Blocks that a rest is cut into, by which the noise of its mean is judged.
const BLOCKS: usize = 8;

/// Samples that a mean needs.
const FEWEST: usize = 4;

/// Samples of a magnetometer, in order of time, all finite.
#[derive(Clone, Copy, Debug)]
pub struct FieldSamples<'a> {
    /// s.
    pub time: &'a [f64],
    /// uT.
    pub field: &'a [[f64; 3]],
    /// A, or throttle; empty where there is none.
    pub current: &'a [f64],
}

/// A rest, and up there by the accelerometer.
#[derive(Clone, Copy, Debug)]
pub struct RestUp {
    /// First and last time, s.
    pub span: (f64, f64),
    /// Corrected specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Variance of the mean reading of each axis of the accelerometer, (m/s^2)^2.
    pub variance: Vector3<f64>,
}

/// Accelerometer that shows up.
#[derive(Clone, Copy, Debug)]
pub struct CalibratedAccelerometer {
    /// Inverse of its M.
    pub inverse: Matrix3<f64>,
    /// Covariance of its `[M row by row, b]`.
    pub covariance: ModelCovariance<f64>,
}

/// Mean of each rest that holds enough samples, with its place among the rests.
pub(super) fn at_rests(
    samples: &FieldSamples<'_>,
    rests: &[RestUp],
    accelerometer: &CalibratedAccelerometer,
) -> (FieldReadings, Vec<usize>) {
    let spans: Vec<_> = rests.iter().map(|rest| rest.span).collect();
    let means = means_at(samples, &spans);
    let places: Vec<usize> = (0..rests.len()).filter(|k| means[*k].is_some()).collect();
    let readings = rests.iter().zip(&means).filter_map(|(rest, mean)| {
        let found = mean.as_ref()?;
        Some(FieldReading {
            mean: found.value,
            variance: found.variance,
            current: if samples.current.is_empty() {
                0.0
            } else {
                mean_of(&samples.current[found.first..found.end])
            },
            up: Some(upward(rest, &accelerometer.inverse)),
        })
    });
    (
        FieldReadings {
            readings: readings.collect(),
            accelerometer: accelerometer.covariance,
        },
        places,
    )
}

/// Mean of a magnetometer over a span of time.
pub(crate) struct FieldMean {
    /// uT.
    pub(crate) value: Vector3<f64>,
    /// Variance of each axis, uT^2.
    pub(crate) variance: Vector3<f64>,
    /// Its first sample, and the one after its last.
    first: usize,
    end: usize,
}

/// Mean over each span of first and last time; `None` where it holds too few samples.
pub(crate) fn means_at(samples: &FieldSamples<'_>, spans: &[(f64, f64)]) -> Vec<Option<FieldMean>> {
    let ends: Vec<_> = spans
        .iter()
        .map(|span| {
            let first = samples.time.partition_point(|t| *t < span.0);
            let end = samples.time.partition_point(|t| *t <= span.1);
            (end >= first + FEWEST).then_some((first, end))
        })
        .collect();
    let used: Vec<_> = ends.iter().copied().flatten().collect();
    let noise = [0, 1, 2].map(|axis| noise_of(samples, &used, axis));
    let mean_over = |(first, end): (usize, usize)| FieldMean {
        value: mean(&samples.field[first..end]),
        variance: Vector3::from_fn(|axis, _| noise[axis].variance_of_mean(end - first)),
        first,
        end,
    };
    ends.into_iter().map(|ends| ends.map(mean_over)).collect()
}

/// White noise of an axis as blocks of rests show it, and what single samples scatter.
struct AxisNoise {
    /// Variance of the mean of a block times its samples, uT^2.
    white: f64,
    /// Variance of a sample, uT^2.
    sample: f64,
    /// Step of the converter, uT; `None` where nothing shows one.
    step: Option<f64>,
}

impl AxisNoise {
    /// Variance of a mean, with what rounding leaves (docs/theory/rounding.md, eq. 1).
    fn variance_of_mean(&self, samples: usize) -> f64 {
        #[allow(clippy::cast_precision_loss)]
        let white = self.white / samples as f64;
        (white + variance_of_rounding(self.step, self.sample)).max(f64::MIN_POSITIVE) // eq. 1
    }
}

fn noise_of(samples: &FieldSamples<'_>, spans: &[(usize, usize)], axis: usize) -> AxisNoise {
    let (mut of_blocks, mut of_samples) = (Vec::new(), Vec::new());
    for (first, end) in spans {
        let within = &samples.field[*first..*end];
        let size = within.len().div_ceil(BLOCKS);
        let blocks: Vec<_> = within.chunks_exact(size).map(mean).collect();
        #[allow(clippy::cast_precision_loss)]
        let of_pair = |pair: &[Vector3<f64>]| 0.5 * size as f64 * (pair[1][axis] - pair[0][axis]).powi(2);
        of_blocks.extend(blocks.windows(2).map(of_pair));
        of_samples.extend(
            within
                .windows(2)
                .map(|pair| 0.5 * (pair[1][axis] - pair[0][axis]).powi(2)),
        );
    }
    AxisNoise {
        white: mean_of(&of_blocks),
        sample: mean_of(&of_samples),
        step: step_of(samples.field, axis),
    }
}

/// Step that the readings of an axis are multiples of.
fn step_of(field: &[[f64; 3]], axis: usize) -> Option<f64> {
    let mut resolution = Resolution::<f64, 1>::new();
    for reading in field {
        resolution.push([reading[axis]]);
    }
    resolution.step()
}

fn mean(readings: &[[f64; 3]]) -> Vector3<f64> {
    #[allow(clippy::cast_precision_loss)]
    let count = readings.len() as f64;
    readings.iter().map(|y| Vector3::from(*y)).sum::<Vector3<f64>>() / count
}

fn mean_of(values: &[f64]) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let count = values.len().max(1) as f64;
    values.iter().sum::<f64>() / count
}

/// Direction of up and how it errs with the accelerometer (docs/theory/multipose.md, eq. 10).
fn upward(rest: &RestUp, correction: &Matrix3<f64>) -> Upward {
    let direction = rest.force.normalize();
    let across = (Matrix3::identity() - direction * direction.transpose()) / rest.force.norm();
    let by_reading = across * correction;
    Upward {
        direction,
        covariance: by_reading * Matrix3::from_diagonal(&rest.variance) * by_reading.transpose(),
        by_accelerometer: SMatrix::from_fn(|i, place| match place {
            0..9 => -by_reading[(i, place / 3)] * rest.force[place % 3],
            place => -by_reading[(i, place - 9)],
        }),
    }
}
