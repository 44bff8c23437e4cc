//! Blocks at rest and turning are gathered, in constant memory, until they can be solved (docs/theory/spin.md).

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::moments::Moments;
use crate::products::{
    Length, across, identity, total, transposed_matrix_product, transposed_product, unit, zeros,
};
use crate::real::{Real, count, real};
use crate::resolution::{DeadBand, Resolution, variance_of_rounding};
use crate::sample::{CHANNELS, Sample};
use crate::spin::axis::{AxisFit, RateMoments, floor_frame};
use crate::spin::block::{Block, HeadingReference};
use crate::spin::even_readings::EvenReadings;
use crate::spin::failure::SpinFailure;
use crate::spin::harmonics::{HarmonicRow, Harmonics, RowWhitener};
use crate::spin::rests::{SpinRests, Stop};
use crate::spin::settings::SpinSettings;

/// One direction of turning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction<T: Real> {
    /// Angle as the gyroscope has it, rad, positive.
    pub angle: T,
    /// Duration, s.
    pub duration: T,
}

/// Angles through which the robot turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnTotals<T: Real> {
    /// Clockwise, seen from above.
    pub clockwise: Direction<T>,
    /// Counter-clockwise.
    pub counter_clockwise: Direction<T>,
    /// Smallest heading, rad.
    pub least: T,
    /// Largest heading, rad.
    pub most: T,
    /// Integral of the squared rate, rad^2/s.
    pub squared: T,
    /// Variance of the heading that pauses in the samples leave open, rad^2.
    pub skipped: T,
    /// Rotation vector less bias, clockwise parts with their sign turned, rad, case frame.
    pub vector: Vector3<T>,
    /// Integral over time of cosine and sine of the heading, clockwise parts with their sign turned, s.
    pub swept: Vector2<T>,
}

impl<T: Real> TurnTotals<T> {
    fn none() -> Self {
        let none = Direction {
            angle: T::zero(),
            duration: T::zero(),
        };
        Self {
            clockwise: none,
            counter_clockwise: none,
            least: T::zero(),
            most: T::zero(),
            squared: T::zero(),
            skipped: T::zero(),
            vector: zeros(),
            swept: zeros(),
        }
    }

    /// Both directions together, rad.
    pub fn angle(&self) -> T {
        self.clockwise.angle + self.counter_clockwise.angle
    }

    /// Time spent turning, s.
    pub fn duration(&self) -> T {
        self.clockwise.duration + self.counter_clockwise.duration
    }

    /// Between the outermost headings, rad.
    pub fn span(&self) -> T {
        self.most - self.least
    }

    fn push(&mut self, block: &Block<T>, rate: &Vector3<T>) {
        let duration = block.duration();
        let sign = if block.gained < T::zero() {
            -T::one()
        } else {
            T::one()
        };
        let direction = if block.gained < T::zero() {
            &mut self.clockwise
        } else {
            &mut self.counter_clockwise
        };
        direction.angle += block.gained.abs();
        direction.duration += duration;
        self.vector += rate * (sign * duration); // eq. 2
        self.swept += block.direction() * (sign * duration);
        self.squared += block.rate_squared * duration;
        self.skipped += block.skipped;
        self.least = self.least.min(block.heading);
        self.most = self.most.max(block.heading);
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct PendingBlock<T: Real> {
    block: Block<T>,
    resting: bool,
}

/// Everything kept of a spin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinEstimator<T: Real> {
    settings: SpinSettings<T>,
    reference: Option<HeadingReference<T>>,
    rests: Option<SpinRests<T>>,
    stop: Option<Stop<T>>,
    turning: Harmonics<T>,
    whitener: RowWhitener<T>,
    frame: Matrix3<T>,
    rates: RateMoments<T>,
    noise: Moments<T, CHANNELS>,
    turning_samples: u32,
    turned: TurnTotals<T>,
    force_resolution: Resolution<T, 3>,
    resolution: Resolution<T, 3>,
    dead_band: DeadBand<T, 3>,
    even: EvenReadings<T>,
    even_force: EvenReadings<T>,
    lost: T,
    row_factor: T,
    first: Option<PendingBlock<T>>,
    middle: Option<PendingBlock<T>>,
}

/// Turned angle without which there is no axis, rad.
pub(super) const LEAST_TURN: f64 = 0.2;

/// Turned angle from which on the axis is taken from the gyroscope rather than from gravity, rad.
const AXIS_SHOWN: f64 = 0.05;

/// Cosine of the angle to gravity beyond which a small turned angle is that of a garbled sample, not of a robot on a floor.
const UPRIGHT: f64 = 0.85;

/// Turning blocks from which on their mean scatter is known.
const BLOCKS_TO_KNOW_SHAKING: u32 = 5;

/// Largest share across the axis while that is only guessed from gravity: the floor tilts.
const SHARE_WHILE_GUESSED: f64 = 0.3;

impl<T: Real> SpinEstimator<T> {
    /// Nothing seen yet.
    pub fn new(settings: &SpinSettings<T>) -> Self {
        Self {
            settings: *settings,
            reference: None,
            rests: None,
            stop: None,
            turning: Harmonics::default(),
            whitener: RowWhitener::new(),
            frame: identity(),
            rates: RateMoments::default(),
            noise: Moments::new(),
            turning_samples: 0,
            turned: TurnTotals::none(),
            force_resolution: Resolution::new(),
            resolution: Resolution::new(),
            dead_band: DeadBand::new(),
            even: EvenReadings::new(),
            even_force: EvenReadings::new(),
            lost: T::zero(),
            row_factor: T::one(),
            first: None,
            middle: None,
        }
    }

    /// Forgets everything but the settings.
    pub fn restart(&mut self) {
        self.reference = None;
        self.rests = None;
        self.stop = None;
        self.turning.clear();
        self.whitener = RowWhitener::new();
        self.frame = identity();
        self.rates = RateMoments::default();
        self.noise = Moments::new();
        self.turning_samples = 0;
        self.turned = TurnTotals::none();
        self.even = EvenReadings::new();
        self.even_force = EvenReadings::new();
        self.dead_band = DeadBand::new();
        self.lost = T::zero();
        self.row_factor = T::one();
        self.first = None;
        self.middle = None;
    }

    /// Reference for counting heading from now on; `None` before the first rest has ended.
    pub fn heading_reference(&self) -> Option<&HeadingReference<T>> {
        self.reference.as_ref()
    }

    /// Corrects the heading that is counted from now on, rad a rad and rad a second.
    pub fn correct_heading(&mut self, by_heading: T, by_time: T) {
        if let Some(reference) = self.reference.as_mut() {
            (reference.by_heading, reference.by_time) = (by_heading, by_time);
        }
    }

    /// The stops so far.
    pub fn rests(&self) -> Option<&SpinRests<T>> {
        self.rests.as_ref()
    }

    /// The stop that goes on, if the robot stands still.
    pub fn stop(&self) -> Option<&Stop<T>> {
        self.stop.as_ref()
    }

    /// The accelerometer while turning, less the specific force of the first rest.
    pub fn turning(&self) -> &Harmonics<T> {
        &self.turning
    }

    /// The gyroscope while turning: rates from the bias that heading is counted with, in [`Self::frame`].
    pub fn rate_moments(&self) -> &RateMoments<T> {
        &self.rates
    }

    /// Forward, left, up as they were known when the robot began to turn: columns in the case frame.
    pub fn frame(&self) -> &Matrix3<T> {
        &self.frame
    }

    /// Mean over turning blocks of the variance of one sample within, the six channels.
    pub fn turning_noise(&self) -> &[T; CHANNELS] {
        self.noise.mean()
    }

    /// Samples taken in, at rest and turning.
    pub fn samples(&self) -> u32 {
        let resting = self.rests.as_ref().map_or(0, SpinRests::samples);
        resting.saturating_add(self.turning_samples)
    }

    /// Angles through which the robot turned.
    pub fn turned(&self) -> &TurnTotals<T> {
        &self.turned
    }

    /// Random walk of the heading, rad^2/s, with what pauses add to it.
    pub(super) fn heading_walk(&self, axis: &AxisFit<T>) -> T {
        let duration = self.turned.duration();
        axis.block_variance * duration / count(self.rates.points().max(1)) // eq. 13: N^2
            + self.turned.skipped / duration // eq. 12a
    }

    /// Takes in a sample as the sensors give it: what their readings have in common is their resolution.
    pub fn watch_reading(&mut self, sample: &Sample<T>) {
        self.force_resolution.push(sample.specific_force.into());
        self.resolution.push(sample.angular_rate.into());
        self.dead_band.push(sample.angular_rate.into());
    }

    /// Variance of each axis, (rad/s)^2, that rounding, and a dead band, leave on a mean over readings that repeat.
    pub(super) fn rounding(&self, rests: &SpinRests<T>) -> Vector3<T> {
        let step = self.resolution.step();
        let hidden = Vector3::from(self.dead_band.variance([step; 3], rests.samples()));
        rests
            .sample_variance(3)
            .map(|scatter| variance_of_rounding(step, scatter))
            + hidden
    }

    /// Variance of each axis of the accelerometer, (m/s^2)^2, that rounding leaves on a mean over readings that repeat.
    pub(super) fn force_rounding(&self, rests: &SpinRests<T>) -> Vector3<T> {
        let step = self.force_resolution.step();
        rests
            .sample_variance(0)
            .map(|scatter| variance_of_rounding(step, scatter))
    }

    /// The same of the mean over the turn.
    pub(super) fn turning_force_rounding(&self, rests: &SpinRests<T>) -> Vector3<T> {
        self.force_rounding(rests)
            .component_mul(&Vector3::from(self.even_force.share()))
    }

    /// Half the width of the band about zero, rad/s, in which each axis of the gyroscope reads nothing; zero where there is none.
    pub fn dead_band(&self) -> [T; 3] {
        self.dead_band.half_width([self.resolution.step(); 3])
    }

    /// Variance of the mean rate over the turn that rounding leaves, (rad/s)^2.
    pub(super) fn turning_rounding(&self, rests: &SpinRests<T>) -> T {
        self.even.variance_of_mean(self.rounding(rests).into())
    }

    /// The same as a share of the rate: a scale error that only this turn has.
    pub(super) fn rounding_as_scale(&self) -> T {
        let of_mean = self
            .rests
            .as_ref()
            .map_or(T::zero(), |rests| self.turning_rounding(rests));
        let squared = self.turned.squared;
        if squared > T::zero() {
            of_mean * self.turned.duration() / squared
        } else {
            T::zero()
        }
    }

    /// Bias instability, m/s^2 and rad/s, from here on: it counts when all is solved, not before.
    pub fn know_bias_instability(&mut self, specific_force: T, angular_rate: T) {
        self.settings.specific_force_instability = specific_force;
        self.settings.angular_rate_instability = angular_rate;
    }

    /// Factor on the variances of the rows of the turning robot, from here on: rows that go on from one to the next
    /// show less than independent ones.
    pub fn know_row_factor(&mut self, factor: T) {
        self.row_factor = factor;
    }

    /// The factor of [`Self::know_row_factor`].
    pub(super) fn row_factor(&self) -> T {
        self.row_factor
    }

    /// Settings of the spin.
    pub fn settings(&self) -> &SpinSettings<T> {
        &self.settings
    }

    /// Takes in a block, and whether the robot stood still over it.
    ///
    /// # Errors
    /// [`SpinFailure::NoRest`] where the robot turns before it has stood still; [`SpinFailure::NotOneAxis`] and
    /// [`SpinFailure::Lifted`] where it left the floor.
    pub fn push(&mut self, block: &Block<T>, resting: bool) -> Result<(), SpinFailure<T>> {
        if resting {
            match self.stop.as_mut() {
                Some(stop) => stop.push(block),
                None => self.stop = Some(Stop::new(block)),
            }
        } else {
            self.end_stop();
            let reference = self.reference.ok_or(SpinFailure::NoRest)?;
            self.check(block, &reference)?;
            self.turn(block, &reference);
        }
        if self.reference.is_some() {
            self.accumulate(PendingBlock {
                block: *block,
                resting,
            });
        }
        Ok(())
    }

    /// Counts the stop at hand among the rests, if it is one; the first one sets the reference of heading.
    pub fn end_stop(&mut self) {
        let Some(stop) = self.stop.take() else { return };
        let rounding = self.rests.as_ref().map_or(zeros(), |rests| self.rounding(rests));
        match self.rests.as_mut() {
            None => {
                let up = unit(&stop.specific_force());
                self.frame = floor_frame(&up);
                self.reference = Some(HeadingReference {
                    origin: stop.start + stop.duration() / 2,
                    bias: stop.angular_rate(),
                    up,
                    by_heading: T::zero(),
                    by_time: T::zero(),
                });
                self.rests = Some(SpinRests::new(&stop));
            }
            Some(rests) => {
                if stop.duration() >= self.settings.shortest_stop && rests.agrees(&stop, &rounding) {
                    rests.push(&stop);
                }
            }
        }
    }

    fn turn(&mut self, block: &Block<T>, reference: &HeadingReference<T>) {
        if !self.rests.as_ref().is_some_and(|rests| rests.is_short(block)) {
            // About the rest, and with most of the rate on one axis: so single precision keeps what is seen across it.
            self.rates.push(
                &transposed_product(&self.frame, &(block.angular_rate() - reference.bias)),
                &block.direction(),
            );
            self.noise.push(&block.moments.variance());
        }
        self.even
            .push(&block.angular_rate(), self.resolution.smallest_change());
        self.even_force
            .push(&block.specific_force(), self.force_resolution.smallest_change());
        self.turning_samples = self.turning_samples.saturating_add(block.moments.samples());
        let guessed = !self.axis_shown();
        self.turned.push(block, &(block.angular_rate() - reference.bias));
        if !self.axis_shown() {
            return;
        }
        let vector = self.turned.vector;
        if guessed {
            // So far the angle was counted about the specific force at rest, which on a slope is another axis.
            let lost = vector.length() - vector.dot(&reference.up);
            self.lost = if block.gained < T::zero() { -lost } else { lost };
            let frame = floor_frame(&unit(&vector));
            self.rates = self
                .rates
                .in_frame(&transposed_matrix_product(&frame, &self.frame));
            self.frame = frame;
        }
        if let Some(reference) = self.reference.as_mut() {
            reference.up = unit(&vector);
        }
    }

    /// Heading that was not counted while the axis was only guessed, rad; once.
    pub fn take_lost_heading(&mut self) -> T {
        core::mem::replace(&mut self.lost, T::zero())
    }

    fn axis_shown(&self) -> bool {
        let (vector, up) = (
            &self.turned.vector,
            unit(&self.rests.as_ref().map_or(zeros(), SpinRests::first_force)),
        );
        vector.length() > real(AXIS_SHOWN) && vector.dot(&up) > vector.length() * real(UPRIGHT)
    }

    /// Rows of three blocks, every second of them in two.
    fn accumulate(&mut self, last: PendingBlock<T>) {
        match (self.first, self.middle) {
            (Some(first), Some(middle)) => {
                if first.resting && middle.resting && last.resting {
                    self.whitener.end_run();
                } else {
                    self.push_row(HarmonicRow::of_three([&first.block, &middle.block, &last.block]));
                }
                (self.first, self.middle) = (Some(last), None);
            }
            (Some(_), None) => self.middle = Some(last),
            (None, _) => self.first = Some(last),
        }
    }

    /// Specific force from that of the first rest: in single precision gravity would cost three digits.
    fn push_row(&mut self, row: HarmonicRow<T>) {
        let origin = self.rests.as_ref().map_or(zeros(), SpinRests::first_force);
        let own = self.whitener.push(&HarmonicRow {
            specific_force: row.specific_force - origin,
            ..row
        });
        self.turning.push(&own);
    }

    /// Checks that the robot has stayed on its wheels.
    fn check(&self, block: &Block<T>, reference: &HeadingReference<T>) -> Result<(), SpinFailure<T>> {
        let rests = self.rests.as_ref().ok_or(SpinFailure::NoRest)?;
        let within = self.scatter_within(block);
        let rate = block.angular_rate() - reference.bias;
        let across = across(&rate, &reference.up).length();
        let allowed = if self.axis_shown() {
            self.settings.largest_share_across
        } else {
            real(SHARE_WHILE_GUESSED)
        };
        let shaking = shaking(block, reference, within.iter().skip(3), [T::zero(), T::one()]);
        let limit = self.settings.largest_rate_across
            + allowed * block.rate.abs()
            + sigmas(rests.block_variance(3), shaking);
        let time = block.end;
        if across > limit {
            return Err(SpinFailure::NotOneAxis { time, across, limit });
        }
        let change = (block.specific_force() - rests.first_force())
            .dot(&reference.up)
            .abs();
        let shaking = self::shaking(block, reference, within.iter(), [T::one(), T::zero()]);
        let limit = self.settings.largest_lift + sigmas(rests.block_variance(0), shaking);
        if change > limit {
            return Err(SpinFailure::Lifted { time, change, limit });
        }
        Ok(())
    }

    /// A robot that turns vibrates more than one that stands: the scatter within its blocks shows by how much. The
    /// block at hand contributes only at first, since the fault in question scatters too.
    fn scatter_within(&self, block: &Block<T>) -> [T; CHANNELS] {
        if self.noise.samples() < BLOCKS_TO_KNOW_SHAKING {
            block.moments.variance()
        } else {
            *self.noise.mean()
        }
    }
}

/// Variance that the scatter of its samples leaves on the mean over a block, of the parts along and across the axis.
fn shaking<'a, T: Real>(
    block: &Block<T>,
    reference: &HeadingReference<T>,
    scatter: impl Iterator<Item = &'a T>,
    [along, across]: [T; 2],
) -> T {
    let share = T::one() / count(block.moments.samples().max(1));
    reference
        .up
        .iter()
        .zip(scatter)
        .fold(T::zero(), |sum, (cosine, variance)| {
            let square = *cosine * *cosine;
            sum + *variance * share * (along * square + across * (T::one() - square))
        })
}

/// Six sigmas of the mean over a block, given its variance at rest and what turning adds.
fn sigmas<T: Real>(at_rest: Vector3<T>, shaking: T) -> T {
    const SIGMAS: f64 = 6.0;
    (total(&at_rest) + shaking).square_root() * real(SIGMAS)
}
