//! A recording becomes rests and turns, one pass, constant memory.
//!
//! Samples are gathered into short blocks, blocks into segments. The first and the last block of a rest are
//! given to the turns beside it, where a table still settling does no harm. A segment keeps sums only, and sums
//! over neighbours add up: [`Segment::append`]. Where samples are missing, a block is integrated over the pauses
//! ([`crate::pauses`]).

use nalgebra::{UnitQuaternion, Vector3};

use crate::mean_scatter::MeanScatter;
use crate::moments::RunningSums;
use crate::noise::AllanLadder;
use crate::pauses::{Bends, Interpolation, Pauses, SampleInterval};
use crate::products::Length;
use crate::real::{Real, count, real, seconds};
use crate::rotation::rotation_of;
use crate::sample::{CHANNELS, Sample};
use crate::soft_mean::{SoftMeans, SoftSum};
use crate::stillness::{Scatter, Stillness, StillnessSettings, UnitMoments, shakes};

/// Sample intervals beyond which a pause in the samples is a gap; shorter ones are bridged. No unit is turned from one
/// rest to another so fast: with twice as many, a turn of 0.2 s at 100 Hz would be lost in one.
pub const GAP_INTERVALS: u64 = 10;

/// Settings of the segmentation of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmenterSettings<T: Real> {
    /// Length of a block, microseconds.
    pub block: u64,
    /// Fewest samples in a block.
    pub block_samples: u32,
    /// Shortest rest, microseconds.
    pub shortest_rest: u64,
    /// A pause in the samples longer than this many sample intervals is a gap.
    pub gap_intervals: u64,
    /// Settings of the detection of rest.
    pub stillness: StillnessSettings<T>,
    /// True if means of blocks may scatter by more than white noise makes them, as behind a low-pass; not where hands hold it.
    pub slow_noise: bool,
}

impl<T: Real> Default for SegmenterSettings<T> {
    fn default() -> Self {
        Self {
            block: 50_000,
            block_samples: 10,
            shortest_rest: 1_000_000,
            gap_intervals: GAP_INTERVALS,
            stillness: StillnessSettings::default(),
            slow_noise: false,
        }
    }
}

impl<T: Real> SegmenterSettings<T> {
    /// Tests whether so many samples, over so many microseconds, show mean and scatter of a block.
    fn are_enough(&self, samples: u32, age: u64) -> bool {
        samples >= self.block_samples || (age >= LONGEST_BLOCK && samples >= SLOW_BLOCK_SAMPLES)
    }
}

/// Length from which a block of fewer samples is a block, microseconds: a sensor that samples slower than 10 Hz would
/// otherwise give whole rests to the turns beside them.
const LONGEST_BLOCK: u64 = 1_000_000;

/// Fewest samples of such a block; the scatter of three axes then has nine degrees of freedom.
const SLOW_BLOCK_SAMPLES: u32 = 4;

/// Sums over successive samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment<T: Real> {
    /// Time of its first sample, microseconds.
    pub start: u64,
    /// Time of the first sample after it, microseconds.
    pub end: u64,
    /// Mean and scatter of the six channels.
    pub moments: UnitMoments<T>,
    /// Time integral of the six channels, m/s and rad.
    pub integral: [T; CHANNELS],
    /// Integral of `(t - start) y dt` of the six channels, m and rad s, each sample in the middle of its own span.
    pub lever: [T; CHANNELS],
    /// Attitude at the start from attitude at the end, from the angular rate less the bias of the rest before.
    pub start_from_end: UnitQuaternion<T>,
    /// Mean of a rest with soft edges.
    pub soft: SoftSum<T>,
    /// Interpolation of samples that are missing inside, and its uncertainty.
    pub interpolation: Interpolation<T>,
    /// False where the samples pause for too long.
    pub complete: bool,
}

impl<T: Real> Segment<T> {
    /// `whole` are the sums of a block with what stands for its missing samples; `sums` without.
    fn of_block(
        sums: &RunningSums<T, CHANNELS>,
        whole: &RunningSums<T, CHANNELS>,
        span: (u64, u64),
        bias: &Vector3<T>,
    ) -> Self {
        let (start, end) = span;
        let duration = seconds::<T>(end.saturating_sub(start));
        let (mean, levers) = (whole.mean(), whole.mean_lever());
        let middle = duration * real(0.5);
        let mut block = Self {
            start,
            end,
            moments: sums.moments(),
            integral: mean.map(|mean| mean * duration),
            // Pauses too long to interpolate: the mean stands for the middle of the block, wherever the samples lie.
            lever: core::array::from_fn(|i| (levers[i] + mean[i] * middle) * duration),
            start_from_end: UnitQuaternion::identity(),
            soft: SoftSum::none(),
            interpolation: Interpolation::none(),
            complete: true,
        };
        block.integrate(bias);
        block
    }

    /// Attitude over a segment short enough to be turned about one axis.
    fn integrate(&mut self, bias: &Vector3<T>) {
        self.start_from_end = rotation_of(&((self.angle() / self.duration() - bias) * self.duration()));
    }

    /// Length, s.
    pub fn duration(&self) -> T {
        seconds(self.end.saturating_sub(self.start))
    }

    /// Mean specific force, m/s^2.
    pub fn specific_force(&self) -> Vector3<T> {
        let mean = self.moments.mean();
        Vector3::new(mean[0], mean[1], mean[2])
    }

    /// Mean angular rate, rad/s.
    pub fn angular_rate(&self) -> Vector3<T> {
        let mean = self.moments.mean();
        Vector3::new(mean[3], mean[4], mean[5])
    }

    /// Mean angular rate of the whole segment, missing samples and all, rad/s.
    fn mean_rate(&self) -> [T; 3] {
        let rate = self.angle() / self.duration();
        [rate.x, rate.y, rate.z]
    }

    /// Integral of the specific force, m/s.
    pub fn velocity(&self) -> Vector3<T> {
        Vector3::new(self.integral[0], self.integral[1], self.integral[2])
    }

    /// Integral of the angular rate, rad.
    pub fn angle(&self) -> Vector3<T> {
        Vector3::new(self.integral[3], self.integral[4], self.integral[5])
    }

    /// Adds the segment that follows.
    pub fn append(&mut self, next: &Self) {
        let offset = seconds::<T>(next.start.saturating_sub(self.start));
        for i in 0..CHANNELS {
            self.lever[i] += next.lever[i] + offset * next.integral[i];
            self.integral[i] += next.integral[i];
        }
        self.moments.merge(&next.moments);
        self.start_from_end *= next.start_from_end;
        self.soft.append(&next.soft);
        self.interpolation.append(&next.interpolation);
        self.complete &= next.complete;
        self.end = next.end;
    }

    /// Time at which the turning was centred, s after the first sample, given the bias of the angular rate, rad/s:
    /// `int t (w - b) . n dt / int (w - b) . n dt` with `n` along the whole turn. It does not mind how the unit is
    /// mounted. `None` if the unit hardly turned.
    pub fn centre_of_turn(&self, bias: &Vector3<T>) -> Option<T> {
        let duration = self.duration();
        let angle = self.angle() - bias * duration;
        let lever = Vector3::new(self.lever[3], self.lever[4], self.lever[5])
            - bias * (duration * duration * real(0.5));
        let half = half_interval::<T>(duration, self.moments.samples());
        let centre = || lever.dot(&angle) / angle.norm_squared() - half; // turntable.md, eq. 16
        (angle.length() > real(0.1)).then(centre)
    }

    /// Rate at which the specific force drifted, m/s^3, by least squares over the segment.
    pub fn specific_force_slope(&self) -> Vector3<T> {
        let duration = self.duration();
        let about_centre = Vector3::new(self.lever[0], self.lever[1], self.lever[2])
            - self.velocity() * (duration * real(0.5));
        about_centre * real::<T>(12.0) / (duration * duration * duration)
    }
}

/// Half the time between samples, s: a sample stands for the span about it, which begins that much earlier.
fn half_interval<T: Real>(duration: T, samples: u32) -> T {
    duration / count::<T>(samples.max(1)) * real(0.5)
}

/// A finished part of the recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FinishedSegment<T: Real> {
    /// The unit moved, or may have moved.
    Turn(Segment<T>),
    /// The unit stood still.
    Rest(Segment<T>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum SegmenterState<T: Real> {
    /// Not at rest.
    Moving,
    /// One quiet block was seen.
    Settling,
    /// At rest. The block before the one at hand is held back: it may turn out to be the first of a turn.
    Resting(Resting<T>),
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Resting<T: Real> {
    /// All of the rest but its newest block.
    rest: Option<Segment<T>>,
    announced: bool,
}

/// Cuts a stream of samples into rests and turns.
#[derive(Clone, Debug)]
pub struct Segmenter<T: Real> {
    settings: SegmenterSettings<T>,
    stillness: Stillness<T>,
    means: MeanScatter<T>,
    /// Variance of the mean of a block beyond that of white noise.
    coloured: Scatter<T>,
    state: SegmenterState<T>,
    turn: Option<Segment<T>>,
    sums: Option<RunningSums<T, CHANNELS>>,
    first: u64,
    last: u64,
    newest: [T; CHANNELS],
    interval: SampleInterval,
    /// A time between two samples above this is a pause, microseconds.
    longest_step: u64,
    pauses: Pauses<T>,
    bends: Bends<T>,
    bias: Vector3<T>,
    allan: AllanLadder<T>,
    allan_of_rest: AllanLadder<T>,
    soft_allan: AllanLadder<T>,
    soft_of_rest: SoftMeans<T>,
    block: Option<Segment<T>>,
    block_is_new: bool,
}

impl<T: Real> Segmenter<T> {
    /// Nothing seen yet.
    pub fn new(settings: SegmenterSettings<T>) -> Self {
        Self {
            settings,
            stillness: Stillness::new(settings.stillness),
            means: MeanScatter::default(),
            coloured: Scatter::zero(),
            state: SegmenterState::Moving,
            turn: None,
            sums: None,
            first: 0,
            last: 0,
            newest: [T::zero(); CHANNELS],
            interval: SampleInterval::new(),
            longest_step: u64::MAX,
            pauses: Pauses::none(),
            bends: Bends::new(),
            bias: Vector3::zeros(),
            allan: AllanLadder::new(),
            allan_of_rest: AllanLadder::new(),
            soft_allan: SoftMeans::new().into_ladder(),
            soft_of_rest: SoftMeans::new(),
            block: None,
            block_is_new: false,
        }
    }

    /// Takes in a sample; one that is not finite, or not later than the last, is passed over.
    pub fn push(&mut self, sample: &Sample<T>) -> Option<FinishedSegment<T>> {
        if sample.is_finite() {
            self.push_channels(sample.time, &sample.channels())
        } else {
            None
        }
    }

    /// Takes in a sample known to be finite, given by its channels.
    #[inline]
    pub fn push_channels(&mut self, time: u64, y: &[T; CHANNELS]) -> Option<FinishedSegment<T>> {
        let Some(sums) = self.sums.as_mut() else {
            self.begin(time, y);
            return None;
        };
        if time <= self.last {
            return None;
        }
        let age = time - self.first;
        let full = age >= self.settings.block && self.settings.are_enough(sums.samples(), age);
        let pause = time - self.last;
        if full || pause > self.longest_step {
            let gap = self.is_gap(pause);
            if pause > self.longest_step {
                self.take_pause(time, y);
            }
            if full || gap {
                let segment = self.close(time);
                self.begin(time, y);
                return segment;
            }
        }
        if let Some(sums) = self.sums.as_mut() {
            sums.push(y, seconds(age));
        }
        self.last = time;
        self.newest = *y;
        None
    }

    /// Samples are missing between the newest and this one.
    #[cold]
    fn take_pause(&mut self, time: u64, y: &[T; CHANNELS]) {
        let Some(sums) = &self.sums else { return };
        let pause = time - self.last;
        if self.is_gap(pause) {
            return self.pauses.leave_open(pause, &self.interval);
        }
        let from = (seconds(self.last - self.first), &self.newest);
        let to = (seconds(time - self.first), y);
        self.pauses.bridge(pause, &self.interval, sums, (from, to));
    }

    /// Returns the segment that the end of the recording cut off, a turn without a rest behind it among them: call
    /// until there is none.
    pub fn finish(&mut self) -> Option<FinishedSegment<T>> {
        if let Some(segment) = self.close(self.last.saturating_add(self.interval.microseconds())) {
            return Some(segment);
        }
        match core::mem::replace(&mut self.state, SegmenterState::Moving) {
            SegmenterState::Resting(Resting {
                rest: Some(mut rest),
                announced: true,
            }) => {
                if let Some(held) = &self.block {
                    rest.append(held);
                }
                self.keep_noise(&mut rest);
                Some(FinishedSegment::Rest(rest))
            }
            SegmenterState::Resting(Resting { rest, .. }) => {
                for segment in [&rest, &self.block].into_iter().flatten() {
                    extend(&mut self.turn, segment);
                }
                self.turn.take().map(FinishedSegment::Turn)
            }
            SegmenterState::Moving | SegmenterState::Settling => self.turn.take().map(FinishedSegment::Turn),
        }
    }

    /// The noise of the six channels at rest, over averaging times from a block up.
    pub fn allan(&self) -> &AllanLadder<T> {
        &self.allan
    }

    /// The noise of the six channels at rest, as means with soft edges scatter.
    pub fn soft_allan(&self) -> &AllanLadder<T> {
        &self.soft_allan
    }

    /// The quietest the unit has been.
    pub fn floor(&self) -> Option<Scatter<T>> {
        self.stillness.floor()
    }

    /// Tests whether a block was closed and not taken.
    pub fn has_block(&self) -> bool {
        self.block_is_new
    }

    /// The block closed last, for those who draw the recording.
    pub fn take_block(&mut self) -> Option<&Segment<T>> {
        let is_new = core::mem::take(&mut self.block_is_new);
        self.block.as_ref().filter(|_| is_new)
    }

    fn is_gap(&self, pause: u64) -> bool {
        let interval = self.interval.microseconds();
        interval > 0 && pause > interval.saturating_mul(self.settings.gap_intervals)
    }

    fn begin(&mut self, time: u64, y: &[T; CHANNELS]) {
        self.sums = Some(RunningSums::start(y));
        self.first = time;
        self.last = time;
        self.newest = *y;
    }

    /// Ends the block at hand; `next` is the time of the sample after it.
    fn close(&mut self, next: u64) -> Option<FinishedSegment<T>> {
        let sums = self.sums.take()?;
        let gap = self.is_gap(next.saturating_sub(self.last));
        let pauses = core::mem::replace(&mut self.pauses, Pauses::none());
        let end = if gap {
            self.last + self.interval.microseconds()
        } else {
            next
        };
        let (whole, interpolation) = pauses.close(&sums, end - self.first, &mut self.interval);
        self.longest_step = self.interval.longest();
        let mut block = Segment::of_block(&sums, &whole, (self.first, next), &self.bias);
        block.interpolation = interpolation;
        block.interpolation.variance =
            self.bends
                .push(block.mean_rate(), block.duration(), pauses.fifth_powers());
        block.complete = !gap;
        let enough = self
            .settings
            .are_enough(sums.samples(), end.saturating_sub(self.first));
        if !enough || gap {
            self.means.pause();
        }
        let quiet = enough && !gap && self.is_quiet(&block.moments) && !shakes(&block.moments);
        let segment = self.advance(&block, quiet);
        self.block_is_new = true;
        self.block = Some(block);
        segment
    }

    /// Learns from a block what the noise is, and judges whether it is all there is of the block.
    fn is_quiet(&mut self, block: &UnitMoments<T>) -> bool {
        let quiet = self.stillness.push(block);
        if !self.settings.slow_noise {
            return quiet;
        }
        self.means.push(block.mean());
        if let Some(floor) = self.stillness.floor() {
            self.coloured = self.means.coloured(&floor, block.samples());
        }
        quiet
            || self
                .stillness
                .is_quiet_beside(&Scatter::of(block), &self.coloured)
    }

    /// One step of the machine: moving, settling, resting.
    fn advance(&mut self, block: &Segment<T>, quiet: bool) -> Option<FinishedSegment<T>> {
        let stays = quiet
            && self.level().is_some_and(|level| {
                self.stillness
                    .is_level_beside(level, &block.moments, &self.coloured)
            });
        match (&self.state, stays) {
            (SegmenterState::Resting(_), true) => self.rest_on(),
            (SegmenterState::Resting(resting), false) => {
                let resting = *resting;
                self.end_rest(&resting, block, quiet)
            }
            (SegmenterState::Settling, true) => {
                self.allan_of_rest = AllanLadder::new();
                self.soft_of_rest = SoftMeans::new();
                self.state = SegmenterState::Resting(Resting {
                    rest: None,
                    announced: false,
                });
                None
            }
            (SegmenterState::Moving | SegmenterState::Settling, _) => {
                extend(&mut self.turn, block);
                self.move_on(quiet);
                None
            }
        }
    }

    /// Level with which the next block is compared, to detect whether the unit is still at rest there.
    fn level(&self) -> Option<&UnitMoments<T>> {
        let compared = match &self.state {
            SegmenterState::Moving => None,
            SegmenterState::Settling => self.block.as_ref(),
            SegmenterState::Resting(resting) => resting.rest.as_ref().or(self.block.as_ref()),
        };
        compared.map(|segment| &segment.moments)
    }

    fn rest_on(&mut self) -> Option<FinishedSegment<T>> {
        let (SegmenterState::Resting(Resting { rest, announced }), Some(held)) =
            (&mut self.state, &self.block)
        else {
            return None;
        };
        self.allan_of_rest.push(held.moments.mean(), held.duration());
        self.soft_of_rest
            .push(held.moments.mean(), held.duration(), &held.lever);
        extend(rest, held);
        let long_enough = rest
            .as_ref()
            .is_some_and(|rest| rest.end - rest.start >= self.settings.shortest_rest);
        if *announced || !long_enough {
            return None;
        }
        *announced = true;
        self.turn.take().map(FinishedSegment::Turn)
    }

    fn end_rest(
        &mut self,
        resting: &Resting<T>,
        block: &Segment<T>,
        quiet: bool,
    ) -> Option<FinishedSegment<T>> {
        self.move_on(quiet);
        let (mut held, mut block) = (self.block, *block);
        let mut finished = resting.rest.filter(|_| resting.announced);
        if let Some(rest) = &mut finished {
            self.keep_noise(rest);
            self.bias = rest.angular_rate();
            // These two begin the turn, and were integrated before the rest had shown its bias.
            for begun in held.iter_mut().chain([&mut block]) {
                begun.integrate(&self.bias);
            }
        } else if let Some(rest) = &resting.rest {
            extend(&mut self.turn, rest);
        }
        for begun in held.iter().chain([&block]) {
            extend(&mut self.turn, begun);
        }
        finished.map(FinishedSegment::Rest)
    }

    /// Keeps the noise of the blocks of a rest that ended.
    fn keep_noise(&mut self, rest: &mut Segment<T>) {
        self.allan.merge(&self.allan_of_rest);
        self.soft_allan.merge(self.soft_of_rest.ladder());
        rest.soft = self.soft_of_rest.total();
    }

    fn move_on(&mut self, quiet: bool) {
        self.state = if quiet {
            SegmenterState::Settling
        } else {
            SegmenterState::Moving
        };
    }
}

fn extend<T: Real>(segment: &mut Option<Segment<T>>, next: &Segment<T>) {
    match segment {
        Some(segment) => segment.append(next),
        None => *segment = Some(*next),
    }
}
