//! Streams of samples whose rests and turns are known.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use tumble_core::gravity::STANDARD;
use tumble_core::real::Real;
use tumble_core::sample::Sample;
use tumble_core::segmenter::{FinishedSegment, Segment, Segmenter, SegmenterSettings};

use super::common::{Draws, cast};

/// Microseconds between samples: 200 Hz.
pub const INTERVAL: u64 = 5_000;

/// Phases of a unit's motion.
#[derive(Clone, Copy, Debug)]
pub enum Phase {
    /// Nothing, for some seconds.
    Rest(f64),
    /// Turns by a rotation vector, case frame, for some seconds: slowly at first and last, as a table does.
    Turn(Vector3<f64>, f64),
    /// Turns at a constant rate, rad/s, case frame, for some seconds.
    Spin(Vector3<f64>, f64),
    /// Shakes along all axes with an amplitude in m/s^2, 37 Hz, for some seconds.
    Shake(f64, f64),
    /// No samples for some seconds.
    Gap(f64),
}

impl Phase {
    /// Length, s.
    pub fn duration(&self) -> f64 {
        match self {
            Phase::Rest(t) | Phase::Turn(_, t) | Phase::Spin(_, t) | Phase::Shake(_, t) | Phase::Gap(t) => *t,
        }
    }
}

/// Errors that the unit adds to the truth.
#[derive(Clone, Copy, Debug)]
pub struct Unit {
    /// 1-sigma of a sample, m/s^2 and rad/s.
    pub scatter: (f64, f64),
    /// m/s^2 and rad/s.
    pub bias: (Vector3<f64>, Vector3<f64>),
    /// sensor_from_case.
    pub mounting: Rotation3<f64>,
}

impl Unit {
    /// Adds nothing.
    pub fn perfect() -> Self {
        Self {
            scatter: (0.0, 0.0),
            bias: (Vector3::zeros(), Vector3::zeros()),
            mounting: Rotation3::identity(),
        }
    }

    /// Noise only.
    pub fn noisy(force: f64, rate: f64) -> Self {
        Self {
            scatter: (force, rate),
            ..Self::perfect()
        }
    }
}

/// All samples of a schedule. `up` is the vertical in the case at the beginning.
pub fn samples(schedule: &[Phase], up: &Vector3<f64>, unit: &Unit, draws: &mut Draws) -> Vec<Sample<f64>> {
    let mut samples = Vec::new();
    let mut case_from_start = UnitQuaternion::identity();
    let mut time = 0;
    for phase in schedule {
        let count = (phase.duration() * 1e6 / INTERVAL as f64).round() as u64;
        for k in 0..count {
            // A sample holds the truth of the middle of the span it stands for.
            let share = (k as f64 + 0.5) / count as f64;
            let step = INTERVAL as f64 * 1e-6;
            let (rate, shake) = match phase {
                Phase::Rest(_) | Phase::Gap(_) => (Vector3::zeros(), 0.0),
                Phase::Turn(angle, duration) => (
                    angle / *duration * (1.0 - (core::f64::consts::TAU * share).cos()),
                    0.0,
                ),
                Phase::Spin(rate, _) => (*rate, 0.0),
                Phase::Shake(amplitude, _) => {
                    let phase = core::f64::consts::TAU * 37.0 * k as f64 * step;
                    (Vector3::zeros(), amplitude * phase.sin())
                }
            };
            let half = UnitQuaternion::from_scaled_axis(-rate * (0.5 * step));
            let force = half * case_from_start * up * STANDARD + Vector3::repeat(shake);
            case_from_start = half * half * case_from_start;
            if !matches!(phase, Phase::Gap(_)) {
                samples.push(Sample {
                    time,
                    specific_force: unit.mounting * force
                        + unit.bias.0
                        + draws.normals::<3>() * unit.scatter.0,
                    angular_rate: unit.mounting * rate + unit.bias.1 + draws.normals::<3>() * unit.scatter.1,
                });
            }
            time += INTERVAL;
        }
    }
    samples
}

/// Spans of the true rests, s.
pub fn true_rests(schedule: &[Phase]) -> Vec<(f64, f64)> {
    let mut time = 0.0;
    let mut rests = Vec::new();
    for phase in schedule {
        let end = time + phase.duration();
        if matches!(phase, Phase::Rest(_)) {
            rests.push((time, end));
        }
        time = end;
    }
    rests
}

/// All segments that a segmenter finds in a stream.
pub fn segments<T: Real>(samples: &[Sample<f64>]) -> Vec<FinishedSegment<T>> {
    let mut segmenter = Segmenter::new(SegmenterSettings::default());
    let mut found: Vec<FinishedSegment<T>> = samples
        .iter()
        .filter_map(|sample| segmenter.push(&of(sample)))
        .collect();
    while let Some(segment) = segmenter.finish() {
        found.push(segment);
    }
    found
}

/// A sample in the precision asked for.
pub fn of<T: Real>(sample: &Sample<f64>) -> Sample<T> {
    Sample {
        time: sample.time,
        specific_force: cast(&sample.specific_force),
        angular_rate: cast(&sample.angular_rate),
    }
}

/// The stretch of a segment.
pub fn stretch<T: Real>(segment: &FinishedSegment<T>) -> &Segment<T> {
    match segment {
        FinishedSegment::Turn(stretch) | FinishedSegment::Rest(stretch) => stretch,
    }
}

/// The rests among segments.
pub fn rests<T: Real>(segments: &[FinishedSegment<T>]) -> Vec<Segment<T>> {
    of_kind(segments, true)
}

/// The turns among segments.
pub fn turns<T: Real>(segments: &[FinishedSegment<T>]) -> Vec<Segment<T>> {
    of_kind(segments, false)
}

fn of_kind<T: Real>(segments: &[FinishedSegment<T>], rest: bool) -> Vec<Segment<T>> {
    let wanted = segments
        .iter()
        .filter(|segment| matches!(segment, FinishedSegment::Rest(_)) == rest);
    wanted.map(|segment| *stretch(segment)).collect()
}
