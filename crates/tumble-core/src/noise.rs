//! White noise and bias instability, and what they do to the mean over an interval.
//!
//! White noise of density N (unit / sqrt(Hz)) leaves a mean over T seconds with variance `N^2 / T`. Bias instability
//! B (unit) is flicker noise, `S(f) = B^2 / (2 pi f)` two-sided over positive f (IEEE Std 952-1997, annex C.1.3),
//! whose Allan deviation levels off at `sqrt(2 ln 2 / pi) B = 0.664 B`. It has no finite variance, but the bias is
//! defined here as the mean over a session, and deviations from that have: with the generalised covariance
//! `k(t) = -(B^2 / pi) ln |t|` (docs/theory/noise.md).

use crate::real::{Real, count, real};
use crate::sample::CHANNELS;

/// Allan deviation of flicker noise of B = 1: `sqrt(2 ln 2 / pi)`.
pub const ALLAN_FLOOR: f64 = 0.6642824702679601; // eq. 5

/// `2 ln 2 / pi`: Allan variance of flicker noise of B = 1.
const FLICKER_FLOOR: f64 = 2.0 * core::f64::consts::LN_2 / core::f64::consts::PI; // eq. 5

/// Noise of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise<T: Real> {
    /// N^2, unit^2 / Hz.
    pub white: T,
    /// B^2, unit^2; never below zero.
    pub flicker: T,
    /// B^2 as the record shows it, unit^2, which chance may put below zero.
    pub flicker_shown: T,
    /// 1-sigma of `flicker_shown`, unit^2; the largest number there is where the record is too short.
    pub flicker_sigma: T,
}

/// A span of time, s, counted from any one origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<T: Real> {
    /// First instant.
    pub start: T,
    /// Last instant.
    pub end: T,
}

impl<T: Real> Interval<T> {
    /// Length, s.
    pub fn duration(&self) -> T {
        self.end - self.start
    }
}

impl<T: Real> Noise<T> {
    /// No noise at all.
    pub fn none() -> Self {
        Self {
            white: T::zero(),
            flicker: T::zero(),
            flicker_shown: T::zero(),
            flicker_sigma: T::zero(),
        }
    }

    /// Covariance of the means over two intervals that are the same or do not overlap, each taken against the
    /// mean bias of the session (docs/theory/noise.md, eq. 4).
    pub fn covariance(&self, a: &Interval<T>, b: &Interval<T>, session: &Interval<T>) -> T {
        let white = if a == b {
            self.white / a.duration() // eq. 1
        } else {
            T::zero()
        };
        let flicker = Flicker::over(session);
        white + flicker.covariance(&flicker.placed(a), &flicker.placed(b)) * self.flicker // eq. 4
    }
}

/// Flicker of B = 1 over a session, with what all its intervals share worked out once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flicker<T: Real> {
    session: Interval<T>,
    within: T,
}

/// An interval in its session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed<T: Real> {
    /// The interval.
    pub interval: Interval<T>,
    with_session: T,
}

/// Several intervals of a session as one, each weighted by its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pool<T: Real> {
    /// Sum of the lengths, s.
    pub length: T,
    with_session: T,
}

impl<T: Real> Flicker<T> {
    /// Against the mean bias of this session.
    pub fn over(session: &Interval<T>) -> Self {
        Self {
            session: *session,
            within: mean_log(session, session),
        }
    }

    /// Places an interval in the session.
    pub fn placed(&self, interval: &Interval<T>) -> Placed<T> {
        Placed {
            interval: *interval,
            with_session: mean_log(interval, &self.session),
        }
    }

    /// Covariance of the means over two intervals (docs/theory/noise.md, eq. 4).
    pub fn covariance(&self, a: &Placed<T>, b: &Placed<T>) -> T {
        let k = mean_log(&a.interval, &b.interval);
        -(k - a.with_session - b.with_session + self.within) * real(core::f64::consts::FRAC_1_PI) // eq. 4
    }

    /// Sum of the lengths of the intervals of a pool, each times its covariance with another.
    pub fn covariance_with_pool<'a>(
        &self,
        pool: &Pool<T>,
        intervals: impl Iterator<Item = &'a Interval<T>>,
        other: &Placed<T>,
    ) -> T {
        let k = intervals.fold(T::zero(), |sum, each| {
            sum + each.duration() * mean_log(each, &other.interval)
        });
        let alone = (other.with_session - self.within) * pool.length;
        (alone + pool.with_session - k) * real(core::f64::consts::FRAC_1_PI)
    }
}

impl<T: Real> Pool<T> {
    /// Without any interval.
    pub fn empty() -> Self {
        Self {
            length: T::zero(),
            with_session: T::zero(),
        }
    }

    /// Takes in an interval.
    pub fn add(&mut self, one: &Placed<T>) {
        let length = one.interval.duration();
        self.length += length;
        self.with_session += length * one.with_session;
    }
}

/// Intervals farther apart than this many times their length are so to speak points.
const FAR: f64 = 16.0;

/// Mean of `ln |s - t|` for s in a and t in b: the second difference of `F(x) = x^2/2 ln|x| - 3/4 x^2`
/// (docs/theory/noise.md, eq. 3).
///
/// Far apart, where the difference would be lost in the rounding of F, the first moments of `s - t` about the distance
/// of the centres do as well: what they leave out is below 1e-9.
fn mean_log<T: Real>(a: &Interval<T>, b: &Interval<T>) -> T {
    let (la, lb) = (a.duration(), b.duration());
    let longer = la.max(lb);
    let apart = ((b.start + b.end) - (a.start + a.end)).abs() * real(0.5);
    if apart > longer * real(FAR) {
        let (la, lb) = (la * la / (apart * apart), lb * lb / (apart * apart));
        let second = (la + lb) * real(1.0 / 12.0);
        let fourth = (la * la + lb * lb) * real(1.0 / 80.0) + la * lb * real(1.0 / 24.0);
        return apart.ln() - second * real(0.5) - fourth * real(0.25);
    }
    let f = |x: T| {
        let x = (x / longer).abs();
        if x > T::zero() {
            x * x * (x.ln() * real(0.5) - real(0.75))
        } else {
            T::zero()
        }
    };
    let sum = f(b.end - a.start) - f(b.end - a.end) - f(b.start - a.start) + f(b.start - a.end); // eq. 3
    longer.ln() + sum * (longer / la) * (longer / lb) // eq. 3
}

/// Octaves of the ladder: from a block of 0.05 s to half an hour.
const OCTAVES: usize = 16;

#[derive(Clone, Copy, Debug, PartialEq)]
struct AllanOctave<T: Real> {
    pending: Option<[T; CHANNELS]>,
    differences: [T; CHANNELS],
    pairs: u32,
}

/// Allan variance of the six channels at averaging times of one block, two, four ..., in constant memory.
///
/// Each level pairs successive means: half the mean squared difference is the Allan variance (IEEE Std 952-1997, annex
/// C), the mean of the two goes one level up. Rests are pooled by merging their ladders.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AllanLadder<T: Real> {
    octaves: [AllanOctave<T>; OCTAVES],
    blocks: u32,
    time: T,
    /// Share of the variance of white noise that the overlap of neighbouring blocks takes.
    overlap: T,
}

impl<T: Real> Default for AllanLadder<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> AllanLadder<T> {
    /// No blocks yet.
    pub fn new() -> Self {
        Self::overlapping(T::zero())
    }

    /// No blocks yet, of which each overlaps the next.
    pub(crate) fn overlapping(overlap: T) -> Self {
        let empty = AllanOctave {
            pending: None,
            differences: [T::zero(); CHANNELS],
            pairs: 0,
        };
        Self {
            octaves: [empty; OCTAVES],
            blocks: 0,
            time: T::zero(),
            overlap,
        }
    }

    /// Takes in the mean over the next block, and the length of the block, s.
    pub fn push(&mut self, mean: &[T; CHANNELS], duration: T) {
        self.blocks += 1;
        self.time += duration;
        let mut rising = *mean;
        for octave in &mut self.octaves {
            let Some(before) = octave.pending.take() else {
                octave.pending = Some(rising);
                return;
            };
            octave.pairs += 1;
            for i in 0..CHANNELS {
                let apart = rising[i] - before[i];
                octave.differences[i] += apart * apart * real(0.5);
                rising[i] = (rising[i] + before[i]) * real(0.5);
            }
        }
    }

    /// The same without its lowest levels.
    #[must_use]
    pub fn from_octave(mut self, first: usize) -> Self {
        for octave in self.octaves.iter_mut().take(first) {
            octave.pairs = 0;
        }
        self
    }

    /// Adds what another record of the same unit showed.
    pub fn merge(&mut self, other: &Self) {
        self.blocks += other.blocks;
        self.time += other.time;
        for (octave, more) in self.octaves.iter_mut().zip(&other.octaves) {
            octave.pairs += more.pairs;
            for i in 0..CHANNELS {
                octave.differences[i] += more.differences[i];
            }
        }
    }

    /// Difference of the ladder to an earlier state of itself.
    #[must_use]
    pub fn since(mut self, earlier: &Self) -> Self {
        self.blocks -= earlier.blocks.min(self.blocks);
        self.time -= earlier.time;
        for (octave, less) in self.octaves.iter_mut().zip(&earlier.octaves) {
            octave.pairs -= less.pairs.min(octave.pairs);
            for (sum, less) in octave.differences.iter_mut().zip(less.differences) {
                *sum -= less;
            }
        }
        self
    }

    /// Averaging time, Allan variance and number of pairs of each level that has any.
    pub fn variances(&self, channel: usize) -> impl Iterator<Item = (T, T, u32)> + '_ {
        let block = if self.blocks > 0 {
            self.time / count(self.blocks)
        } else {
            T::zero()
        };
        let mut averaging = block * real(0.5);
        let mut overlap = self.overlap * real(2.0);
        self.octaves.iter().filter_map(move |octave| {
            averaging *= real(2.0);
            overlap *= real(0.5);
            let sum = *octave.differences.get(channel)? / (T::one() - overlap); // eq. 16
            (octave.pairs > 0).then(|| (averaging, sum / count(octave.pairs), octave.pairs))
        })
    }

    /// White noise and flicker of one channel; see [`Self::fit_jointly`].
    pub fn fit(&self, channel: usize) -> Noise<T> {
        let [noise] = self.fit_jointly([channel]);
        noise
    }

    /// White noise of each channel, and the flicker they share: weighted least squares of `N^2 / tau + 0.441 B^2` on
    /// their ladders, neither below zero (docs/theory/noise.md, eq. 7). An Allan variance from n pairs errs by
    /// `sqrt(2 / n)` of what it ought to be. The axes of a triad are made alike, and a record of minutes shows too
    /// little of B to take each by itself.
    pub fn fit_jointly<const K: usize>(&self, channels: [usize; K]) -> [Noise<T>; K] {
        let mut noise = channels.map(|channel| Noise {
            white: self
                .variances(channel)
                .next()
                .map_or(T::zero(), |(averaging, variance, _)| variance * averaging),
            flicker: T::zero(),
            flicker_shown: T::zero(),
            flicker_sigma: T::zero(),
        });
        let least = noise.map(|noise| noise.white * real(LEAST_WHITE));
        for _ in 0..ROUNDS {
            let sums = core::array::from_fn::<_, K, _>(|i| self.sums(channels[i], &noise[i]));
            noise = solve(&sums, &noise);
            for (noise, least) in noise.iter_mut().zip(least) {
                noise.white = noise.white.max(least);
            }
        }
        noise
    }

    /// Normal equations of one channel, weighted by the variance expected of each level.
    fn sums(&self, channel: usize, expected: &Noise<T>) -> NoiseEquations<T> {
        let floor = real::<T>(FLICKER_FLOOR);
        let mut sums = NoiseEquations::default();
        for (averaging, variance, pairs) in self.variances(channel) {
            let expected = expected.white / averaging + floor * expected.flicker; // eq. 7
            if expected > T::zero() {
                let weight = count::<T>(pairs) / (expected * expected * real(2.0)); // eq. 6
                let a = T::one() / averaging;
                sums.aa += weight * a * a;
                sums.ab += weight * a * floor;
                sums.bb += weight * floor * floor;
                sums.ay += weight * a * variance;
                sums.by += weight * floor * variance;
            }
        }
        sums
    }
}

/// Share of the Allan variance of single blocks that is white at least: drift seen by longer averages must not leave a
/// sensor without any noise from one interval to the next.
const LEAST_WHITE: f64 = 0.1;

/// Rounds in which the weights settle.
const ROUNDS: u32 = 8;

/// Normal equations in N^2 (a) and B^2 (b).
#[derive(Clone, Copy)]
struct NoiseEquations<T: Real> {
    aa: T,
    ab: T,
    bb: T,
    ay: T,
    by: T,
}

impl<T: Real> Default for NoiseEquations<T> {
    fn default() -> Self {
        let zero = T::zero();
        Self {
            aa: zero,
            ab: zero,
            bb: zero,
            ay: zero,
            by: zero,
        }
    }
}

/// Solves for the shared B^2 with each N^2 eliminated, then for each N^2.
fn solve<T: Real, const K: usize>(sums: &[NoiseEquations<T>; K], before: &[Noise<T>; K]) -> [Noise<T>; K] {
    let seen = || sums.iter().filter(|sums| sums.aa > T::zero());
    let all = seen().fold(T::zero(), |sum, s| sum + s.bb);
    let information = seen().fold(T::zero(), |sum, s| sum + s.bb - s.ab * s.ab / s.aa);
    let vector = seen().fold(T::zero(), |sum, s| sum + s.by - s.ab * s.ay / s.aa);
    // One level alone cannot distinguish flicker from white noise.
    let distinct = information > all * real(1e-6);
    let (flicker_shown, flicker_sigma) = if distinct {
        (vector / information, T::one() / information.square_root()) // eq. 7
    } else {
        (T::zero(), T::max_value().unwrap_or(T::zero()))
    };
    let flicker = flicker_shown.max(T::zero());
    core::array::from_fn(|i| {
        let s = &sums[i];
        let white = if s.aa > T::zero() {
            ((s.ay - s.ab * flicker) / s.aa).max(T::zero()) // eq. 7
        } else {
            before[i].white
        };
        Noise {
            white,
            flicker,
            flicker_shown,
            flicker_sigma,
        }
    })
}
