//! Sums at rest: bias, noise, and specific force at each heading.

use nalgebra::{SVector, Vector2, Vector3};

use crate::moments::Moments;
use crate::products::{Length, total, zeros};
use crate::real::{Real, count, real, seconds};
use crate::sample::CHANNELS;
use crate::spin::axis::{HeadingMoments, RestingRate};
use crate::spin::block::Block;
use crate::spin::harmonics::{FUNCTIONS, HarmonicRow, Harmonics};
use crate::stillness::UnitMoments;

/// Successive blocks at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop<T: Real> {
    /// First instant, microseconds.
    pub start: u64,
    /// Last instant, microseconds.
    pub end: u64,
    /// All samples.
    pub samples: UnitMoments<T>,
    blocks: Moments<T, CHANNELS>,
    functions: SVector<T, FUNCTIONS>,
    /// Sums over its blocks of cosine and sine of the heading.
    heading: Vector2<T>,
}

impl<T: Real> Stop<T> {
    /// Begins with a block.
    pub fn new(block: &Block<T>) -> Self {
        let mut stop = Self {
            start: block.start,
            end: block.start,
            samples: UnitMoments::new(),
            blocks: Moments::new(),
            functions: zeros(),
            heading: zeros(),
        };
        stop.push(block);
        stop
    }

    /// Goes on with the next block. One that was cut off short is left out: among whole ones it would pass for noise.
    pub fn push(&mut self, block: &Block<T>) {
        self.end = block.end;
        if is_short(block, self.samples.samples(), self.blocks.samples()) {
            return;
        }
        self.samples.merge(&block.moments);
        self.blocks.push(block.moments.mean());
        self.functions += HarmonicRow::of_block(block).functions;
        self.heading += block.direction();
    }

    /// Duration, microseconds.
    pub fn duration(&self) -> u64 {
        self.end.saturating_sub(self.start)
    }

    fn channels(&self, first: usize) -> Vector3<T> {
        let mean = self.samples.mean();
        Vector3::from_fn(|i, _| mean.get(first + i).copied().unwrap_or(T::zero()))
    }

    /// Mean specific force, m/s^2.
    pub fn specific_force(&self) -> Vector3<T> {
        self.channels(0)
    }

    /// Mean angular rate, rad/s.
    pub fn angular_rate(&self) -> Vector3<T> {
        self.channels(3)
    }

    /// Mean over its blocks, so weighted that its variance is that of one block; specific force from `origin`.
    fn row(&self, origin: &Vector3<T>) -> HarmonicRow<T> {
        let blocks = count::<T>(self.blocks.samples());
        let weight = blocks.square_root();
        let mut functions = self.functions / blocks;
        // At rest nothing pulls: what is left in these two is noise.
        functions[FUNCTIONS - 2] = T::zero();
        functions[FUNCTIONS - 1] = T::zero();
        HarmonicRow {
            functions: functions * weight,
            specific_force: (self.specific_force() - origin) * weight,
        }
    }
}

/// Tests whether a block has less than half the mean number of samples of `blocks` with `samples` in all.
fn is_short<T: Real>(block: &Block<T>, samples: u32, blocks: u32) -> bool {
    u64::from(block.moments.samples()) * u64::from(blocks) * 2 < u64::from(samples)
}

/// All stops of one spin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinRests<T: Real> {
    rate: Vector3<T>,
    blocks: u32,
    samples: u32,
    time: u64,
    first_force: Vector3<T>,
    first_blocks: u32,
    stops: u32,
    freedom: u32,
    block_squares: [T; CHANNELS],
    sample_squares: [T; CHANNELS],
    sample_freedom: u32,
    harmonics: Harmonics<T>,
    headings: HeadingMoments<T>,
}

/// Degrees of freedom below which blocks add nothing to the noise of samples.
const FEWEST: u32 = 6;

impl<T: Real> SpinRests<T> {
    /// Begins with the first stop.
    pub fn new(stop: &Stop<T>) -> Self {
        let mut rests = Self {
            rate: zeros(),
            blocks: 0,
            samples: 0,
            time: 0,
            first_force: stop.specific_force(),
            first_blocks: stop.blocks.samples(),
            stops: 0,
            freedom: 0,
            block_squares: [T::zero(); CHANNELS],
            sample_squares: [T::zero(); CHANNELS],
            sample_freedom: 0,
            harmonics: Harmonics::default(),
            headings: HeadingMoments::none(),
        };
        rests.push(stop);
        rests
    }

    /// Tests whether a block is shorter than half of those at rest.
    pub fn is_short(&self, block: &Block<T>) -> bool {
        is_short(block, self.samples, self.blocks)
    }

    /// Takes in another stop.
    pub fn push(&mut self, stop: &Stop<T>) {
        let blocks = stop.blocks.samples();
        self.blocks += blocks;
        self.stops += 1;
        self.samples += stop.samples.samples();
        self.time += stop.duration();
        self.rate += (stop.angular_rate() - self.rate) * (count::<T>(blocks) / count(self.blocks));
        let heading = stop.heading / count::<T>(blocks.max(1));
        self.headings
            .push(&heading, &(stop.angular_rate() - self.rate), blocks, self.blocks);
        let (block_freedom, sample_freedom) =
            (blocks.saturating_sub(1), stop.samples.samples().saturating_sub(1));
        let (of_blocks, of_samples) = (stop.blocks.variance(), stop.samples.variance());
        for i in 0..CHANNELS {
            self.block_squares[i] += of_blocks[i] * count(block_freedom);
            self.sample_squares[i] += of_samples[i] * count(sample_freedom);
        }
        self.freedom += block_freedom;
        self.sample_freedom += sample_freedom;
        self.harmonics.push(&stop.row(&self.first_force));
    }

    /// Tests whether a stop shows the same rate as the stops before, to five sigma and the drift of a bias within
    /// minutes, given the variance that rounding leaves on each of both.
    pub fn agrees(&self, stop: &Stop<T>, rounding: &Vector3<T>) -> bool {
        const DRIFT: f64 = 5e-4;
        let variance = total(&self.block_variance(3));
        let shares = T::one() / count(self.blocks.max(1)) + T::one() / count(stop.blocks.samples().max(1));
        (stop.angular_rate() - self.rate).length()
            <= real::<T>(DRIFT) + (variance * shares + total(rounding) * real(2.0)).square_root() * real(5.0)
    }

    /// Time stood still, s.
    pub fn time(&self) -> T {
        seconds(self.time)
    }

    /// Samples at rest.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean angular rate over all stops, and the variance of that mean, given the bias instability, rad/s, and the variance
    /// that rounding leaves: readings at rest repeat from stop to stop, and so does its error.
    ///
    /// The mean over a stop of some seconds differs from that over the spin by about B (docs/theory/spin.md, eq. 16).
    pub fn rate(&self, instability: T, rounding: &Vector3<T>) -> RestingRate<T> {
        let (blocks, stops) = (count::<T>(self.blocks.max(1)), count::<T>(self.stops.max(1)));
        let wandering = instability * instability / stops; // eq. 16
        let of_block = self.block_variance(3);
        RestingRate {
            mean: self.rate,
            variance: (of_block / blocks).add_scalar(wandering) + rounding,
            headings: self.headings,
            block_variance: of_block.max() + wandering * blocks,
        }
    }

    /// Mean specific force of the first stop, m/s^2.
    pub fn first_force(&self) -> Vector3<T> {
        self.first_force
    }

    /// Variance of that mean, given the bias instability, m/s^2, and the variance that rounding leaves.
    pub fn first_force_variance(&self, instability: T, rounding: &Vector3<T>) -> Vector3<T> {
        let white = self.block_variance(0) / count::<T>(self.first_blocks.max(1));
        white.add_scalar(instability * instability) + rounding // eq. 16
    }

    /// Variance of the lines of [`Self::harmonics`], given the same: all stops share the error of rounding.
    pub fn line_variance(&self, instability: T, rounding: &Vector3<T>) -> Vector3<T> {
        let blocks_a_stop = count::<T>(self.blocks) / count(self.stops.max(1));
        let own = self
            .block_variance(0)
            .add_scalar(instability * instability * blocks_a_stop); // eq. 16
        own + rounding * count::<T>(self.blocks) // eq. 27
    }

    /// Variance of the mean over a block, for the three channels from `first` on.
    ///
    /// Each axis has the scatter of its own samples; the ratio by which means over blocks scatter more or less than
    /// white noise comes from the three axes together.
    pub fn block_variance(&self, first: usize) -> Vector3<T> {
        let samples_a_block = count::<T>(self.samples.max(1)) / count(self.blocks.max(1));
        let white = self.sample_variance(first) / samples_a_block;
        let sum = |values: &[T; CHANNELS]| values.iter().skip(first).take(3).fold(T::zero(), |s, v| s + *v);
        let shown = sum(&self.block_squares) / count(self.freedom.max(1));
        let expected = total(&white);
        let excess = if self.freedom < FEWEST || expected <= T::zero() {
            T::one()
        } else {
            shown / expected
        };
        white * excess
    }

    /// Variance of one sample, for the three channels from `first` on.
    #[inline(never)]
    pub fn sample_variance(&self, first: usize) -> Vector3<T> {
        let share = T::one() / count(self.sample_freedom.max(1));
        Vector3::from_fn(|i, _| {
            self.sample_squares
                .get(first + i)
                .map_or(T::zero(), |squares| *squares * share)
        })
    }

    /// Specific force, less that of the first stop, at each heading the robot stood at.
    pub fn harmonics(&self) -> &Harmonics<T> {
        &self.harmonics
    }
}
