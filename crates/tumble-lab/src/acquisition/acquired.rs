//! Acquired data of one unit: its rests, the turns between them, and data that belong to both.

use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::noise::{Interval, Noise};
use tumble_core::sample::CHANNELS;
use tumble_core::segmenter::Segment;

use super::channels::ChannelFault;
use super::interval::{interval, microseconds};
use super::motion::Motion;
use super::plateaus::{Plateau, PlateauKind};
use super::rest_ladders::RestLadders;
use super::rounding::{CoarseChannel, Rounding};
use super::soft_edge::{SoftEdge, SoftTurn};
use super::trace::Trace;

tumble_core::vocabulary! {
    /// Why a segment that looked like a rest is not one.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RestRejection {
        /// The scatter was above the sensor's own noise: vibration.
        Vibrating = "vibrating",
        /// The specific force drifted: a slow turn.
        Drifting = "drifting",
        /// The angular rate differed from that of the rests beside it: a slow turn about the vertical.
        Turning = "turning",
    }
}

/// A recording, or one of its files.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// When it began, s since the origin.
    pub start: f64,
    /// Name of the file where there is one a pose; empty for a continuous recording.
    pub name: String,
}

/// Trembling of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tremor {
    /// Amplitude of the angular rate about an axis, rad/s.
    pub amplitude: f64,
    /// Hz.
    pub frequency: f64,
}

/// A rest in which the unit kept its mean orientation and trembled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restlessness {
    /// Trembling of the unit.
    pub tremor: Tremor,
    /// Variance of the means of the six channels beyond that of noise.
    pub variance: [f64; CHANNELS],
    /// Case at its first sample from the case as it stood in the mean.
    pub start_from_mean: UnitQuaternion<f64>,
    /// Case at the first sample after it from the case as it stood in the mean.
    pub end_from_mean: UnitQuaternion<f64>,
}

/// Acquired data of one unit.
#[derive(Clone, Debug)]
pub struct Acquired {
    /// Time of the first sample, s of the recording's own clock; all other times count from it.
    pub origin: f64,
    /// One for a continuous recording, one a file otherwise.
    pub parts: Vec<Part>,
    /// Stretches at rest.
    pub rests: Vec<Segment<f64>>,
    /// Trembling of each rest in which the unit trembled; empty where nobody looked.
    pub restlessness: Vec<Option<Restlessness>>,
    /// `turns[i]` lies between `rests[i]` and `rests[i + 1]`.
    pub turns: Vec<Segment<f64>>,
    /// Stretches that looked like rests, with the reason why they are none.
    pub rejected: Vec<(Segment<f64>, RestRejection)>,
    /// Segments of constant rate, rests among them, where they were looked for.
    pub plateaus: Vec<Plateau>,
    /// Motion from which any span is integrated, where constant rates were looked for.
    pub motion: Motion,
    /// Noise that each rest showed, where constant rates were looked for.
    pub(crate) rest_noise: Vec<RestLadders>,
    /// Noise of the six channels.
    pub noise: [Noise<f64>; CHANNELS],
    /// Noise of the angular rate over intervals with abrupt edges.
    pub abrupt_rate_noise: [Noise<f64>; 3],
    /// Rounding of its readings.
    pub rounding: Rounding,
    /// Edges of the rests, towards the turns beside them.
    pub edges: Vec<SoftEdge>,
    /// True where vibration has to be averaged out of the turns by soft edges.
    pub soft_turns: bool,
    /// The recording at a glance.
    pub trace: Trace,
    /// Faults of its channels.
    pub faults: Vec<ChannelFault>,
    /// Finite samples taken in.
    pub samples: u64,
    /// Samples passed over because a channel was not a number.
    pub not_finite: u64,
    /// Samples that are missing, as the pauses between the others show.
    pub missing: u64,
    /// Time of the first sample that was not later than the one before, s of the recording's own clock.
    pub first_backwards: Option<f64>,
    /// 1-sigma of the pace of its times, relative; zero where they are stamps as they came.
    pub pace_sigma: f64,
    /// 1-sigma of the time of a sample that a turn begins or ends with, s.
    pub stamp_sigma: f64,
    /// Lowest, mean and highest temperature, degC.
    pub temperature: Option<[f64; 3]>,
}

impl Acquired {
    /// Noise of the accelerometer.
    pub fn force_noise(&self) -> [Noise<f64>; 3] {
        [self.noise[0], self.noise[1], self.noise[2]]
    }

    /// Noise of the gyroscope.
    pub fn rate_noise(&self) -> [Noise<f64>; 3] {
        [self.noise[3], self.noise[4], self.noise[5]]
    }

    /// Trembling of rest `k`; `None` where it lay still.
    pub fn restlessness(&self, k: usize) -> Option<&Restlessness> {
        self.restlessness.get(k)?.as_ref()
    }

    /// Variance of the means of the three channels from `first` at rest `k` beyond that of noise: trembling and rounding.
    pub fn excess_variance(&self, k: usize, first: usize) -> Vector3<f64> {
        let trembling = self.restlessness(k).map_or_else(Vector3::zeros, |found| {
            Vector3::from_fn(|i, _| found.variance[first + i])
        });
        trembling + self.rounding.of_rest(&self.rests, k, first)
    }

    /// Channels of which rounding, or a dead band, leaves more on the mean of a rest than noise does.
    pub fn coarse_channels(&self) -> Vec<CoarseChannel> {
        let total: f64 = self.rests.iter().map(Segment::duration).sum();
        #[allow(clippy::cast_precision_loss)]
        let usual = total / self.rests.len().max(1) as f64;
        self.rounding
            .coarse_channels(&self.noise.map(|noise| noise.white / usual))
    }

    /// Segments of constant rate that are no rests.
    pub fn constant_rates(&self) -> impl Iterator<Item = &Plateau> {
        let turned = |plateau: &&Plateau| plateau.kind != PlateauKind::Rest;
        self.plateaus.iter().filter(turned)
    }

    /// True where it is known of every constant rate whether it is a rest.
    pub fn knows_rests(&self) -> bool {
        self.plateaus
            .iter()
            .all(|plateau| plateau.kind != PlateauKind::Unclear)
    }

    /// Angle and interval of a turn, with soft edges where the unit was shaken.
    pub fn turned(&self, turn: &Segment<f64>) -> SoftTurn {
        if self.soft_turns {
            SoftTurn::with_edges(turn, &self.edges)
        } else {
            SoftTurn::abrupt(turn)
        }
    }

    /// Variance of the angle of a turn about any axis, rad^2, because stamps are uncertain: by one time as it gets up to its
    /// rate, and by another as it slows down (docs/theory/multipose.md, eq. 38).
    pub fn variance_by_stamps(&self, turn: &Segment<f64>) -> f64 {
        let (mean, variance) = (turn.moments.mean(), turn.moments.variance());
        let mean_square: f64 = (CHANNELS / 2..CHANNELS)
            .map(|i| mean[i] * mean[i] + variance[i])
            .sum();
        2.0 * self.stamp_sigma.powi(2) * mean_square // eq. 38
    }

    /// Samples missing at rest over those taken.
    pub fn share_missing_at_rest(&self) -> f64 {
        let of = |count: fn(&Segment<f64>) -> u32| self.rests.iter().map(count).map(f64::from).sum::<f64>();
        of(|rest| rest.interpolation.missing) / of(|rest| rest.moments.samples()).max(1.0)
    }

    /// From the start of the first rest, or constant rate, to the end of the last, s since the origin.
    pub fn session(&self) -> Interval<f64> {
        let rests = self.rests.iter().map(interval);
        let rates = self.constant_rates().map(|plateau| plateau.interval);
        let whole = rests.chain(rates).reduce(|a, b| Interval {
            start: a.start.min(b.start),
            end: a.end.max(b.end),
        });
        whole.unwrap_or(Interval { start: 0.0, end: 0.0 })
    }

    /// All that happened after rest `i` and before rest `j`.
    pub fn between(&self, i: usize, j: usize) -> Option<Segment<f64>> {
        let mut span = *self.turns.get(i)?;
        for k in i + 1..j {
            span.append(self.rests.get(k)?);
            span.append(self.turns.get(k)?);
        }
        Some(span)
    }

    /// Rests `first ..= last` as one, without what lies between them.
    pub fn joined(&self, first: usize, last: usize) -> Option<Segment<f64>> {
        let mut rest = *self.rests.get(first)?;
        for next in self.rests.get(first + 1..=last)? {
            rest.moments.merge(&next.moments);
            rest.end = next.end;
        }
        Some(rest)
    }

    /// Rest `i` within a span of time, s since the origin, as if it had begun and ended with it; `None` where the span is no
    /// part of it, or samples are missing that nothing stands for.
    pub fn cut(&self, i: usize, span: &Interval<f64>) -> Option<Segment<f64>> {
        let mut rest = *self.rests.get(i)?;
        let whole = interval(&rest);
        let inside = Interval {
            start: span.start.max(whole.start),
            end: span.end.min(whole.end),
        };
        if inside.start >= inside.end {
            return None;
        }
        let passage = self.motion.over(&inside)?;
        (rest.start, rest.end) = (microseconds(inside.start), microseconds(inside.end));
        rest.integral[..3].copy_from_slice(passage.velocity.as_slice());
        rest.integral[3..].copy_from_slice(passage.angle.as_slice());
        let duration = inside.duration();
        rest.moments = rest
            .moments
            .about(&rest.integral.map(|integral| integral / duration));
        Some(rest)
    }
}
