//! Samples become short blocks: means of the six channels, of the heading's cosine and sine, of the squared rate.
//!
//! Heading is the integral of the angular rate about the turning axis. Its cosine and sine are averaged sample by
//! sample, so that a block may be long enough for quiet means and yet lose nothing of the harmonics (docs/theory/spin.md,
//! eq. 8, 9).

use nalgebra::{Vector2, Vector3};

use crate::moments::RunningSums;
use crate::real::{Real, real, seconds};
use crate::sample::{CHANNELS, Sample};
use crate::stillness::UnitMoments;

/// Means over a few successive samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block<T: Real> {
    /// Time of the sample before its first, microseconds.
    pub start: u64,
    /// Time of its last sample, microseconds.
    pub end: u64,
    /// Mean time of its samples, s after the origin of the spin.
    pub time: T,
    /// Mean and scatter of the six channels.
    pub moments: UnitMoments<T>,
    /// Mean heading, rad, counter-clockwise, never folded.
    pub heading: T,
    /// Correction that was added to the heading before its cosine and sine were taken, rad.
    pub correction: T,
    /// Mean cosine of the corrected heading.
    pub cosine: T,
    /// Mean sine of the corrected heading.
    pub sine: T,
    /// Mean rate about the turning axis, rad/s.
    pub rate: T,
    /// Mean squared rate about the turning axis, (rad/s)^2.
    pub rate_squared: T,
    /// Heading gained over the block, rad.
    pub gained: T,
    /// Variance, rad^2, of the heading that a pause within leaves open: a clock that was set forward looks as lost samples do.
    pub skipped: T,
    /// Levers of the specific force, cosine, sine and squared rate: mean of the quantity times the time since the
    /// middle of the block, s.
    pub levers: [T; LEVERS],
}

/// Quantities whose course within a block is kept to first order.
pub const LEVERS: usize = 6;

impl<T: Real> Block<T> {
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

    /// Mean cosine and sine of the corrected heading.
    pub fn direction(&self) -> Vector2<T> {
        Vector2::new(self.cosine, self.sine)
    }

    /// Length, s.
    pub fn duration(&self) -> T {
        seconds(self.end.saturating_sub(self.start))
    }
}

/// Reference for gathering samples and counting heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadingReference<T: Real> {
    /// Origin of time, microseconds.
    pub origin: u64,
    /// Angular rate at rest, rad/s.
    pub bias: Vector3<T>,
    /// Turning axis, unit length, upwards.
    pub up: Vector3<T>,
    /// Correction of the heading, rad a rad turned.
    pub by_heading: T,
    /// Correction of the heading, rad a second.
    pub by_time: T,
}

/// Heading, compensated for the rounding of a sum of many small steps (Kahan 1965): hours in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadingSum<T: Real> {
    angle: T,
    lost: T,
}

impl<T: Real> HeadingSum<T> {
    fn advance(&mut self, step: T) {
        let wanted = step - self.lost;
        let next = self.angle + wanted;
        self.lost = (next - self.angle) - wanted;
        self.angle = next;
    }
}

/// Cosine and sine of an angle that moves on in small steps.
///
/// A sine costs sixty instructions in single precision and hundreds in double; a small rotation, by the powers below of its
/// angle, costs thirty. Steps are differences of the angle itself, so their rounding does
/// not add up; each block begins with a whole sine, so that of the products does not either.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeadingPhasor<T: Real> {
    angle: T,
    cosine: T,
    sine: T,
}

/// Largest step, rad: what its powers beyond the tenth add is below the rounding of double precision.
const SMALL_STEP: f64 = 0.125;

impl<T: Real> HeadingPhasor<T> {
    #[inline(never)]
    fn at(angle: T) -> Self {
        let (sine, cosine) = angle.sine_cosine();
        Self { angle, cosine, sine }
    }

    fn advance(&mut self, angle: T) {
        let step = angle - self.angle;
        if step.abs() > real(SMALL_STEP) {
            *self = Self::at(angle);
            return;
        }
        let square = step * step;
        let term = |last: T, over: f64| T::one() - square * real(1.0 / over) * last;
        let along = term(term(term(term(term(T::one(), 90.0), 56.0), 30.0), 12.0), 2.0);
        let across = step * term(term(term(term(T::one(), 72.0), 42.0), 20.0), 6.0);
        *self = Self {
            angle,
            cosine: self.cosine * along - self.sine * across,
            sine: self.sine * along + self.cosine * across,
        };
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct OpenBlock<T: Real> {
    sums: RunningSums<T, CHANNELS>,
    phase: HeadingPhasor<T>,
    start: u64,
    first: u64,
    /// Longest time from one sample to the next, microseconds.
    longest: u64,
    began: T,
    /// Cosine, sine, squared rate, rate, heading: sums about the first, so that single precision holds many.
    course: RunningSums<T, 5>,
}

/// Gathers samples into blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockBuilder<T: Real> {
    length: u64,
    reference: Option<HeadingReference<T>>,
    heading: HeadingSum<T>,
    last: Option<(u64, T)>,
    open: Option<OpenBlock<T>>,
}

/// Fewest samples in a block.
const FEWEST: u32 = 4;

impl<T: Real> BlockBuilder<T> {
    /// Blocks of at least `length` microseconds.
    pub fn new(length: u64) -> Self {
        Self {
            length,
            reference: None,
            heading: HeadingSum {
                angle: T::zero(),
                lost: T::zero(),
            },
            last: None,
            open: None,
        }
    }

    /// Counts heading by this reference from here on, with `lost` rad added that were not counted so far.
    pub fn refer_heading(&mut self, reference: HeadingReference<T>, lost: T) {
        self.reference = Some(reference);
        self.heading.advance(lost);
    }

    /// Time of the sample before, microseconds.
    pub fn last_time(&self) -> Option<u64> {
        self.last.map(|(time, _)| time)
    }

    /// Takes in a finite sample later than the one before; gives back the block it completes.
    pub fn push(&mut self, sample: &Sample<T>) -> Option<Block<T>> {
        let rate = self.rate(sample);
        let (time, last_rate) = self
            .last
            .replace((sample.time, rate))
            .unwrap_or((sample.time, rate));
        let finished = self.is_full(sample.time).then(|| self.finish(time)).flatten();
        let began = self.heading.angle;
        if self.reference.is_some() {
            let interval = seconds::<T>(sample.time.saturating_sub(time));
            self.heading.advance((rate + last_rate) * interval * real(0.5)); // eq. 8: h
        }
        self.accumulate(sample, rate, time, began);
        finished
    }

    fn is_full(&self, time: u64) -> bool {
        self.open.as_ref().is_some_and(|open| {
            time.saturating_sub(open.first) >= self.length && open.sums.samples() >= FEWEST
        })
    }

    /// Ends the block at hand early, at the last sample taken in.
    pub fn close(&mut self) -> Option<Block<T>> {
        let (time, _) = self.last?;
        self.finish(time)
    }

    fn rate(&self, sample: &Sample<T>) -> T {
        self.reference.as_ref().map_or(T::zero(), |reference| {
            (sample.angular_rate - reference.bias).dot(&reference.up) // eq. 8
        })
    }

    fn correction(&self, time: u64, heading: T) -> T {
        self.reference.as_ref().map_or(T::zero(), |reference| {
            let elapsed = since::<T>(reference.origin, time);
            reference.by_heading * heading + reference.by_time * elapsed // eq. 9: kappa
        })
    }

    fn accumulate(&mut self, sample: &Sample<T>, rate: T, start: u64, began: T) {
        let heading = self.heading.angle;
        let interval = sample.time.saturating_sub(start);
        let angle = heading + self.correction(sample.time, heading);
        let course = |phase: &HeadingPhasor<T>| [phase.cosine, phase.sine, rate * rate, rate, heading];
        let y = sample.channels();
        match self.open.as_mut() {
            Some(open) => {
                let age = seconds::<T>(sample.time.saturating_sub(open.first));
                open.longest = open.longest.max(interval);
                open.phase.advance(angle);
                open.sums.push(&y, age);
                open.course.push(&course(&open.phase), age);
            }
            None => {
                let phase = HeadingPhasor::at(angle);
                self.open = Some(OpenBlock {
                    sums: RunningSums::start(&y),
                    phase,
                    start,
                    first: sample.time,
                    longest: interval,
                    began,
                    course: RunningSums::start(&course(&phase)),
                });
            }
        }
    }

    fn finish(&mut self, end: u64) -> Option<Block<T>> {
        let open = self.open.take()?;
        let middle = open.first + (end.saturating_sub(open.first)) / 2;
        let [cosine, sine, rate_squared, rate, heading] = *open.course.moments().mean();
        let [fx, fy, fz, ..] = open.sums.mean_lever();
        let [of_cosine, of_sine, of_square, ..] = open.course.mean_lever();
        Some(Block {
            start: open.start,
            end,
            time: self
                .reference
                .as_ref()
                .map_or(T::zero(), |reference| since(reference.origin, middle)),
            moments: open.sums.moments(),
            heading,
            correction: self.correction(middle, heading),
            cosine,
            sine,
            rate,
            rate_squared,
            skipped: skipped(&open, end) * rate_squared,
            levers: [fx, fy, fz, of_cosine, of_sine, of_square],
            gained: self.heading.angle - open.began,
        })
    }
}

/// Square of the time, s^2, by which the longest step of a block is longer than the others; zero where none is a pause.
fn skipped<T: Real>(open: &OpenBlock<T>, end: u64) -> T {
    const PAUSE: u64 = 5; // halves of a usual step
    let others = u64::from(open.sums.samples().saturating_sub(1).max(1));
    let usual = end.saturating_sub(open.start).saturating_sub(open.longest) / others;
    if 2 * open.longest > PAUSE * usual {
        let longer = seconds::<T>(open.longest - usual);
        longer * longer
    } else {
        T::zero()
    }
}

/// Signed seconds from one time to another.
fn since<T: Real>(origin: u64, time: u64) -> T {
    if time >= origin {
        seconds(time - origin)
    } else {
        -seconds::<T>(origin - time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::real::count;

    /// Largest distance from the sine and cosine of the angle itself, over two hundred steps of a size.
    fn farthest<T: Real>(step: f64) -> f64 {
        let mut phase = HeadingPhasor::<T>::at(real(-3.0));
        let mut farthest = T::zero();
        for number in 1..=200 {
            phase.advance(real::<T>(-3.0) + real::<T>(step) * count(number));
            let (sine, cosine) = phase.angle.sin_cos();
            farthest = farthest
                .max((phase.sine - sine).abs())
                .max((phase.cosine - cosine).abs());
        }
        farthest.to_subset().unwrap_or(f64::NAN)
    }

    #[test]
    fn steps_of_any_size_lead_to_the_sine_of_the_angle() {
        for step in [1e-4, -0.01, 0.1, 0.1249, -0.1249, 0.126, 2.0] {
            let (single, double) = (farthest::<f32>(step), farthest::<f64>(step));
            assert!(
                single < 3e-6,
                "steps of {step} rad: {single:e} in single precision"
            );
            assert!(
                double < 1e-14,
                "steps of {step} rad: {double:e} in double precision"
            );
        }
    }
}
