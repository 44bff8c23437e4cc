//! The angular rate of a whole recording in short pieces: constant rates are found in them, and any span is integrated over
//! them.
//!
//! A piece is a block of the segmenter. A block holds 0.05 s or more, so that an hour takes 10 MB.

use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::noise::Interval;
use tumble_core::pauses::Interpolation;
use tumble_core::real::seconds;
use tumble_core::rotation::rotation_of;
use tumble_core::segmenter::Segment;
use tumble_core::stillness::Scatter;

use super::interval::interval;

/// Sums over successive samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPiece {
    /// When, s since the origin.
    pub interval: Interval<f64>,
    /// Integral of the angular rate, rad.
    pub angle: Vector3<f64>,
    /// Integral of the specific force, m/s.
    pub velocity: Vector3<f64>,
    /// Variance of one sample of the angular rate about its mean, mean over the axes, (rad/s)^2.
    pub scatter: f64,
    /// The same from second differences, in which ramps vanish, (rad/s)^2.
    pub noise: f64,
    /// Samples taken in.
    pub samples: u32,
    /// Samples that are missing.
    pub interpolation: Interpolation<f64>,
    /// False where the samples pause for too long.
    pub complete: bool,
    /// True where it is part of a rest of the segmenter.
    pub resting: bool,
}

impl MotionPiece {
    /// Mean angular rate, rad/s.
    pub fn rate(&self) -> Vector3<f64> {
        self.angle / self.interval.duration()
    }
}

/// Integrals over a span of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// When, s since the origin.
    pub interval: Interval<f64>,
    /// Integral of the angular rate, rad.
    pub angle: Vector3<f64>,
    /// Integral of the specific force, m/s.
    pub velocity: Vector3<f64>,
    /// The white noise of the integrals is that of a time longer by this, s.
    pub longer: f64,
    /// Variance of the angle because the angular rate did not run straight over pauses, rad^2.
    pub variance: Vector3<f64>,
}

/// All pieces in order of time.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    pieces: Vec<MotionPiece>,
}

impl Motion {
    /// Takes in the next block, with the variance of a sample that its second differences show.
    pub fn push(&mut self, block: &Segment<f64>, noise: f64) {
        let interpolation = block.interpolation;
        self.pieces.push(MotionPiece {
            interval: interval(block),
            angle: block.angle(),
            velocity: block.velocity(),
            scatter: Scatter::of(&block.moments).angular_rate,
            noise,
            samples: block.moments.samples(),
            interpolation,
            complete: block.complete,
            resting: false,
        });
    }

    /// Marks the blocks of a finished rest.
    pub fn mark_rest(&mut self, rest: &Segment<f64>) {
        let (first, after) = (self.place(seconds(rest.start)), self.place(seconds(rest.end)));
        for piece in self.pieces.iter_mut().take(after).skip(first) {
            piece.resting = true;
        }
    }

    /// Changes the integrals of all pieces, given their length, s, velocity, m/s, and angle, rad.
    pub fn change(&mut self, to: impl Fn(f64, &Vector3<f64>, &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>)) {
        for piece in &mut self.pieces {
            (piece.velocity, piece.angle) = to(piece.interval.duration(), &piece.velocity, &piece.angle);
        }
    }

    /// All pieces.
    pub fn pieces(&self) -> &[MotionPiece] {
        &self.pieces
    }

    /// Index of the first piece that begins at this time or later.
    fn place(&self, time: f64) -> usize {
        self.pieces.partition_point(|piece| piece.interval.start < time)
    }

    /// The pieces that share time with a span.
    pub fn within(&self, span: &Interval<f64>) -> &[MotionPiece] {
        let first = self
            .pieces
            .partition_point(|piece| piece.interval.end <= span.start);
        let after = self.place(span.end);
        self.pieces.get(first..after).unwrap_or_default()
    }

    /// Variance of a sample of the angular rate that is noise: the median of the second differences, (rad/s)^2.
    pub fn noise(&self) -> f64 {
        let mut noises: Vec<_> = self
            .pieces
            .iter()
            .map(|piece| (piece.noise, piece.samples))
            .collect();
        noises.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = noises.iter().map(|(_, samples)| u64::from(*samples)).sum::<u64>() / 2;
        let mut counted = 0;
        let median = noises.iter().find(|(_, samples)| {
            counted += u64::from(*samples);
            counted > half
        });
        median.map_or(0.0, |(noise, _)| *noise)
    }

    /// Integrals over a span; a piece that is cut counts by its share. `None` where samples are missing that nothing
    /// stands for, or the recording does not reach.
    pub fn over(&self, span: &Interval<f64>) -> Option<Passage> {
        let pieces = self.within(span);
        let (first, last) = (pieces.first()?, pieces.last()?);
        let joined = pieces
            .windows(2)
            .all(|pair| pair[0].interval.end == pair[1].interval.start);
        let reached = first.interval.start <= span.start && span.end <= last.interval.end;
        if !(joined && reached && pieces.iter().all(|piece| piece.complete)) {
            return None;
        }
        let mut passage = Passage {
            interval: *span,
            angle: Vector3::zeros(),
            velocity: Vector3::zeros(),
            longer: 0.0,
            variance: Vector3::zeros(),
        };
        for piece in pieces {
            let common = piece.interval.end.min(span.end) - piece.interval.start.max(span.start);
            let share = common / piece.interval.duration();
            passage.angle += piece.angle * share;
            passage.velocity += piece.velocity * share;
            passage.longer += piece.interpolation.longer * share;
            passage.variance += Vector3::from(piece.interpolation.variance) * share;
        }
        Some(passage)
    }

    /// Attitude at the start of a span from attitude at its end, given the bias of the angular rate, rad/s.
    pub fn start_from_end(&self, span: &Interval<f64>, bias: &Vector3<f64>) -> UnitQuaternion<f64> {
        let turned = |piece: &MotionPiece| rotation_of(&(piece.angle - bias * piece.interval.duration()));
        self.within(span)
            .iter()
            .fold(UnitQuaternion::identity(), |attitude, piece| {
                attitude * turned(piece)
            })
    }
}

/// Variance of a sample from second differences, block by block.
#[derive(Clone, Copy, Debug, Default)]
pub struct SecondDifferences {
    before: [Option<[f64; 3]>; 2],
    squares: f64,
    number: f64,
}

impl SecondDifferences {
    /// Takes in the angular rate of the next sample, rad/s.
    #[inline]
    pub fn push(&mut self, rate: [f64; 3]) {
        if let [Some(newest), Some(older)] = self.before {
            for axis in 0..3 {
                let difference = rate[axis] - 2.0 * newest[axis] + older[axis];
                self.squares += difference * difference;
            }
            // White noise of variance v leaves 6 v of a second difference.
            self.number += 18.0;
        }
        self.before = [Some(rate), self.before[0]];
    }

    /// The variance that the block showed, (rad/s)^2, and begins the next.
    pub fn take(&mut self) -> f64 {
        let variance = self.squares / self.number.max(1.0);
        (self.squares, self.number) = (0.0, 0.0);
        variance
    }
}
