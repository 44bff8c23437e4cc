//! One pair of units over all scales, against what health explains.

use super::means::{LeakyMean, LeakyMeans};
use super::motion::{MOTION, MotionOfSet};
use super::table::{
    BETWEEN, BLOCK, BLOCK_SECONDS, CLIPPED, COUNT, DELAYED, DIFFERENCED, FIRST_NOISE, FLOOR, HOP_SECONDS,
    LEARNT_SECONDS, LEAST_NOISE, LIMITS, NONLINEAR, SCALES, WANDERS,
};
use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::sensor::Sensor;
use crate::sample::CHANNELS;

/// Means of the motion of the set over all scales: its channels, and the squares of second derivatives of its readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionMeans<T: Real> {
    means: LeakyMeans<T, { MOTION + CHANNELS }>,
    changed: Option<[T; CHANNELS]>,
}

impl<T: Real> MotionMeans<T> {
    /// No motion yet.
    pub fn new() -> Self {
        Self {
            means: LeakyMeans::new(),
            changed: None,
        }
    }

    /// Takes the motion of a window, in which some unit was whole or none.
    pub fn take(&mut self, motion: &MotionOfSet<T>, some: bool) {
        let mut channels = [T::zero(); MOTION + CHANNELS];
        for (to, from) in channels.iter_mut().zip(motion.channels()) {
            *to = from;
        }
        let [force, rate] = motion.changes();
        let mut change = [T::zero(); CHANNELS];
        change
            .iter_mut()
            .zip(force.iter().chain(&rate))
            .for_each(|(to, from)| *to = *from);
        if let Some(changed) = self.changed {
            let bends = channels.iter_mut().skip(MOTION);
            for (bend, (now, before)) in bends.zip(change.iter().zip(&changed)) {
                let second = (*now - *before) / real(HOP_SECONDS);
                *bend = second * second;
            }
        }
        self.means.take(some.then_some(&channels));
        if some || self.changed.is_none() {
            self.changed = Some(change);
        }
    }

    /// Mean motion over a scale, and the mean squares of second derivatives, of both sensors.
    pub fn over(&self, scale: usize) -> (MotionOfSet<T>, [[T; 3]; 2]) {
        let all = self.means.scales().get(scale).map(LeakyMean::mean);
        let all = all.unwrap_or([T::zero(); MOTION + CHANNELS]);
        let mut motion = [T::zero(); MOTION];
        motion.iter_mut().zip(all).for_each(|(to, from)| *to = from);
        let [.., a, b, c, d, e, f] = all;
        (MotionOfSet::of_channels(&motion), [[a, b, c], [d, e, f]])
    }
}

impl<T: Real> Default for MotionMeans<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Conditions of all pairs over one scale.
pub struct TestConditions<T: Real> {
    /// Number of the scale.
    pub scale: usize,
    /// Mean motion of the set.
    pub motion: MotionOfSet<T>,
    /// Its mean squares of second derivatives.
    pub bends: [[T; 3]; 2],
    /// Specific force over the longest scale, m/s^2: a model linear in the motion is learnt about it.
    pub slow_force: [T; 3],
    /// Factor by which vibration raises variances, by sensor.
    pub shaking: [T; 2],
}

/// Timing of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing<T: Real> {
    /// s from sample to sample.
    pub interval: T,
    /// s, 1 sigma of the delay of its clock.
    pub delay_sigma: T,
}

/// Deviation of a pair over one scale, of both sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairComparison<T: Real> {
    /// m/s^2 and rad/s: without what errors and delays explain.
    pub deviation: [[T; 3]; 2],
    /// Sigmas of it over the limit; 0 where the means are not usable.
    pub ratio: [T; 2],
}

/// A deviation beyond its limit, and the sensor and the time that show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exceedance<T: Real> {
    /// Deviation over its limit; 0 where nothing was compared.
    pub ratio: T,
    /// The deviation, m/s^2 or rad/s.
    pub apart: T,
    /// Sensor that shows it.
    pub sensor: Sensor,
    /// s over which the mean shows it.
    pub seconds: T,
}

impl<T: Real> Exceedance<T> {
    /// Nothing was compared.
    pub fn none() -> Self {
        Self {
            ratio: T::zero(),
            apart: T::zero(),
            sensor: Sensor::Accelerometer,
            seconds: T::zero(),
        }
    }

    /// Largest deviation that is accepted, m/s^2 or rad/s.
    pub fn limit(&self) -> T {
        self.apart / self.ratio
    }

    /// The finding of one sensor over one scale.
    pub fn of(ratio: T, deviation: &[T; 3], sensor: Sensor, scale: usize) -> Self {
        let windows = count::<T>(SCALES.get(scale).copied().unwrap_or(1).into());
        Self {
            ratio,
            apart: norm(deviation),
            sensor,
            seconds: windows * real(HOP_SECONDS),
        }
    }
}

/// Sums over a block, from which the usual noise is learnt.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BlockSums<T: Real> {
    /// Clipped squares of deviations, of long scales less the variance of errors.
    squares: [[[T; 3]; 2]; COUNT],
    /// Deviations of the short scales, of which the mean over a block is no noise.
    deviations: [[[T; 3]; 2]; DIFFERENCED],
    windows: [u8; COUNT],
}

/// One pair of units: its mean differences, and the noise that these usually have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairTest<T: Real> {
    /// Differences of readings, then derivatives of the set: a delay shows along these, over the same windows and no others.
    difference: LeakyMeans<T, { 2 * CHANNELS }>,
    noise: [[[T; 3]; 2]; COUNT],
    blocks: [u8; COUNT],
    sums: BlockSums<T>,
    /// Noise of the block before, and the windows of it.
    waiting: ([[[T; 3]; 2]; COUNT], [u8; COUNT]),
}

impl<T: Real> PairTest<T> {
    /// Begins with the noise of a pair of which nothing is known.
    pub fn new() -> Self {
        let mut noise = [[[T::zero(); 3]; 2]; COUNT];
        let (sigmas, _) = FIRST_NOISE;
        for (noise, windows) in noise.iter_mut().zip(SCALES) {
            *noise = sigmas.map(|sigma| [real::<T>(sigma * sigma) / count(windows.into()); 3]);
        }
        Self {
            difference: LeakyMeans::new(),
            noise,
            blocks: [0; COUNT],
            sums: BlockSums::none(),
            waiting: (noise, [0; COUNT]),
        }
    }

    /// Takes what two units differ by, their errors subtracted along this very window, or nothing where one is not whole
    /// (docs/theory/set.md, eq. 13).
    pub fn take(&mut self, readings: Option<[&[T; CHANNELS]; 2]>, motion: &MotionOfSet<T>) {
        let Some([first, second]) = readings else {
            self.difference.take(None);
            return;
        };
        let mut values = [T::zero(); 2 * CHANNELS];
        let differences = first.iter().zip(second).map(|(one, other)| *one - *other);
        let [force, rate] = motion.changes();
        for (to, from) in values.iter_mut().zip(differences.chain(force).chain(rate)) {
            *to = from;
        }
        self.difference.take(Some(&values));
    }

    /// Forgets what the pair differed by before its clocks were one, and learns its noise anew: a delay that is known is no
    /// deviation.
    pub fn forget(&mut self) {
        self.difference.forget();
        self.blocks = [0; COUNT];
    }

    /// Moves the mean of a scale by what a change of the errors of both units explains, so that nothing steps.
    pub fn shift(&mut self, scale: usize, [first, second]: [&[[T; 3]; 2]; 2]) {
        let mut change = [T::zero(); 2 * CHANNELS];
        let changes = first.as_flattened().iter().zip(second.as_flattened());
        for (to, (one, other)) in change.iter_mut().zip(changes) {
            *to = *other - *one;
        }
        self.difference.shift(scale, &change);
    }

    /// Compares the pair over one scale, and notes what it shows for the block (docs/theory/set.md, eq. 13 to 16).
    #[inline(never)]
    pub fn compare(
        &mut self,
        at: &TestConditions<T>,
        uncertainty: [&[[T; 3]; 2]; 2],
        timing: [&Timing<T>; 2],
    ) -> PairComparison<T> {
        let mut found = PairComparison {
            deviation: [[T::zero(); 3]; 2],
            ratio: [T::zero(); 2],
        };
        let (Some(mean), Some(noise)) = (self.difference.scales().get(at.scale), self.usual_noise(at.scale))
        else {
            return found;
        };
        let is_usable = mean.is_usable();
        let [a, b, c, d, e, f, u, v, w, x, y, z] = mean.mean();
        let (differences, changes) = ([[a, b, c], [d, e, f]], [[u, v, w], [x, y, z]]);
        let [first, second] = uncertainty;
        let largest = largest_delay(timing);
        let limit = LIMITS.get(at.scale).map_or(T::one(), |limit| tabulated(*limit));
        let curved = curvature(at, timing);
        let nonlinear = at.nonlinear();
        let mut variances = [[T::zero(); 3]; 2];
        let mut usuals = [[T::zero(); 3]; 2];
        for sensor in 0..2 {
            for axis in 0..3 {
                variances[sensor][axis] = first[sensor][axis] + second[sensor][axis];
            }
            let deviation = without_delay(&differences[sensor], &changes[sensor], largest); // eq. 14
            let floor = real::<T>(FLOOR[sensor]) / limit;
            let mut squares = T::zero();
            for axis in 0..3 {
                let usual = noise[sensor][axis] * at.shaking[sensor];
                usuals[sensor][axis] = usual;
                let variance = usual
                    + floor * floor
                    + variances[sensor][axis]
                    + nonlinear[sensor]
                    + curved[sensor][axis];
                squares += deviation[axis] * deviation[axis] / variance; // eq. 15
            }
            found.deviation[sensor] = deviation;
            if is_usable {
                found.ratio[sensor] = squares.square_root() / limit; // eq. 16
            }
        }
        if is_usable {
            self.sums.note(at.scale, &found.deviation, &variances, &usuals);
        }
        found
    }

    /// Ends a block: its noise waits until the next one has ended in agreement. Before that, what waits is learnt, if the
    /// pair was calm.
    pub fn end_block(&mut self, was_calm: bool) {
        let (targets, windows) = self.waiting;
        let (_, blocks) = FIRST_NOISE;
        if was_calm {
            for scale in 0..COUNT {
                if windows[scale] > BLOCK / 2 {
                    self.blocks[scale] = self.blocks[scale].saturating_add(1);
                    let first = T::one() / (count::<T>(self.blocks[scale].into()) + real(blocks));
                    let noise = self.noise[scale].as_flattened_mut();
                    for (noise, target) in noise.iter_mut().zip(targets[scale].as_flattened()) {
                        let [rise, fall, _] = LEARNT_SECONDS;
                        let seconds = if *target > *noise { rise } else { fall };
                        let share = larger(real(BLOCK_SECONDS / seconds), first);
                        *noise += share * (*target - *noise); // eq. 18
                    }
                }
            }
        }
        self.waiting = (self.sums.targets(), self.sums.windows);
        self.sums = BlockSums::none();
    }

    /// Usual variances over a scale, and no less than a part of those of white noise with the shortest mean: a line of which the
    /// alias wanders was quicker before (docs/theory/set.md, eq. 18a).
    fn usual_noise(&self, scale: usize) -> Option<[[T; 3]; 2]> {
        let (mut usual, windows) = (*self.noise.get(scale)?, SCALES.get(scale)?);
        let [shortest, ..] = &self.noise;
        let share = real::<T>(WANDERS) / count((*windows).into());
        for (usual, shortest) in usual.as_flattened_mut().iter_mut().zip(shortest.as_flattened()) {
            *usual = larger(*usual, *shortest * share);
        }
        Some(usual)
    }
}

impl<T: Real> Default for PairTest<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> BlockSums<T> {
    fn none() -> Self {
        Self {
            squares: [[[T::zero(); 3]; 2]; COUNT],
            deviations: [[[T::zero(); 3]; 2]; DIFFERENCED],
            windows: [0; COUNT],
        }
    }

    fn note(&mut self, scale: usize, deviation: &[[T; 3]; 2], variance: &[[T; 3]; 2], noise: &[[T; 3]; 2]) {
        let (Some(squares), Some(windows)) = (self.squares.get_mut(scale), self.windows.get_mut(scale))
        else {
            return;
        };
        *windows += 1;
        let deviations = self.deviations.get_mut(scale);
        let is_short = deviations.is_some();
        let values = deviation.as_flattened().iter().zip(variance.as_flattened());
        let sums = squares.as_flattened_mut().iter_mut().zip(noise.as_flattened());
        for ((square, noise), (deviation, variance)) in sums.zip(values) {
            let most = real::<T>(CLIPPED) * (*noise + *variance);
            *square += smaller(*deviation * *deviation, most);
            if !is_short {
                *square -= *variance;
            }
        }
        if let Some(deviations) = deviations {
            let sums = deviations.as_flattened_mut().iter_mut();
            sums.zip(deviation.as_flattened())
                .for_each(|(sum, deviation)| *sum += *deviation);
        }
    }

    /// Noise of the block (eq. 17).
    fn targets(&self) -> [[[T; 3]; 2]; COUNT] {
        let mut targets = self.squares;
        for scale in 0..COUNT {
            let share = T::one() / count(u32::from(self.windows[scale]).max(1));
            for sensor in 0..2 {
                let least =
                    real::<T>(LEAST_NOISE[sensor] * LEAST_NOISE[sensor]) / count(SCALES[scale].into());
                for axis in 0..3 {
                    let mean = self
                        .deviations
                        .get(scale)
                        .map_or(T::zero(), |sums| sums[sensor][axis] * share);
                    let target = targets[scale][sensor][axis] * share - mean * mean;
                    targets[scale][sensor][axis] = larger(target, least);
                }
            }
        }
        targets
    }
}

impl<T: Real> TestConditions<T> {
    /// Variance that a model linear in the motion leaves, by sensor.
    fn nonlinear(&self) -> [T; 2] {
        let [x, y, z] = *self.motion.force();
        let [sx, sy, sz] = self.slow_force;
        let force = [x - sx, y - sy, z - sz];
        let [of_force, of_rate] = NONLINEAR.map(|share| real::<T>(share * share));
        [of_force * squared(&force), of_rate * squared(self.motion.rate())]
    }
}

/// Variance of motion between samples, which no straight line follows.
fn curvature<T: Real>(at: &TestConditions<T>, [first, second]: [&Timing<T>; 2]) -> [[T; 3]; 2] {
    let squares = first.interval * first.interval + second.interval * second.interval;
    let missed = real::<T>(BETWEEN) * squares;
    let windows = count::<T>(SCALES.get(at.scale).copied().unwrap_or(1).into());
    let share = missed * missed / windows;
    at.bends.map(|bends| bends.map(|bend| bend * share))
}

/// s that the delays of two units may explain.
fn largest_delay<T: Real>(timing: [&Timing<T>; 2]) -> T {
    let (least, [intervals, sigmas]) = DELAYED;
    timing.iter().fold(real(least), |largest, unit| {
        let of_interval = unit.interval * real(intervals);
        larger(larger(largest, of_interval), unit.delay_sigma * real(sigmas))
    })
}

/// Subtracts what a delay, s, of either sign explains: along the derivative of the set.
fn without_delay<T: Real>(deviation: &[T; 3], change: &[T; 3], largest: T) -> [T; 3] {
    let size = norm(change);
    let inverse = T::one() / larger(size, real(1e-12));
    let [x, y, z] = change.map(|value| value * inverse);
    let [a, b, c] = *deviation;
    let most = largest * size;
    let along = smaller(larger(x * a + y * b + z * c, -most), most);
    [a - along * x, b - along * y, c - along * z]
}

/// Euclidean length.
pub(super) fn norm<T: Real>(vector: &[T; 3]) -> T {
    squared(vector).square_root()
}

fn squared<T: Real>([x, y, z]: &[T; 3]) -> T {
    *x * *x + *y * *y + *z * *z
}
