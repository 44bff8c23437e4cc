//! Means of samples over windows of a common grid of time.
//!
//! The readings of a unit are interpolated linearly between samples and integrated over each window of the
//! grid; triangles of angular rates make up for what straight lines miss of a curve. Units of any rate, with samples
//! at any time, thus have means over the same spans, and a pair of means is synchronous by construction
//! (docs/theory/redundancy.md, eq. 1 to 2).

use crate::real::{Real, count, real, whole_spans};
use crate::redundancy::samples::steps::{Step, UnitSteps};

/// Channels of angular rates, which a triangle takes for curves. Specific force is compared with derivatives of the
/// rates, whose straight lines nothing makes up for: one unit's must stay so in all.
const RATES: core::ops::Range<usize> = 3..6;

/// Number of stored windows of a unit, which lets other units be one and a half windows late.
pub(super) const KEPT: u8 = 3;

/// Means of K channels over one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Means<T: Real, const K: usize> {
    /// Number of the window in the grid, its lower half: windows that share it lie years apart.
    pub index: u32,
    /// Mean of each channel.
    pub mean: [T; K],
    /// Integral of each channel times the position in the window, 0 to 1, and what straight lines miss: the rising half
    /// of a triangle.
    pub rising: [T; K],
    /// Half the mean squared step from sample to sample, mean over three channels, of the first and of the
    /// second three: the variance of white noise, and almost zero for smooth motion (von Neumann 1941).
    pub scatter: [T; 2],
    /// True if all samples were usable, for the first three channels and for the second three.
    pub usable: [bool; 2],
}

impl<T: Real, const K: usize> Means<T, K> {
    /// Triangle-weighted means over this window, rising, and the next one, falling (docs/theory/redundancy.md, eq. 2).
    pub fn triangle(&self, next: &Self) -> [T; K] {
        let mut means = self.rising;
        for (up, (mean, rising)) in means.iter_mut().zip(next.mean.iter().zip(&next.rising)) {
            *up += *mean - *rising; // eq. 2
        }
        means
    }
}

/// Share of the squared interval, times the second derivative, by which straight lines between samples exceed a curve:
/// the error of the trapezoidal rule (docs/theory/redundancy.md, eq. 1a). Twice that would enlarge a motion as much as
/// none reduces it.
const CURVE: f64 = 1.0 / 12.0;

/// Windows over which intervals are averaged: with half of them a lost sample of 50 Hz shifts means by 0.2 ms, a tenth
/// of what clocks are known to, with twice of them by half as much.
const USUAL: f64 = 8.0;

/// Sample of a unit, as channels.
struct Latest<T: Real, const K: usize> {
    time: u64,
    channels: [T; K],
    usable: [bool; 2],
}

/// Sums over the current window, of differences from its first reading so that no digits are lost.
#[derive(Clone, Copy, Debug, PartialEq)]
struct WindowSums<T: Real, const K: usize> {
    origin: [T; K],
    integral: [T; K],
    rising: [T; K],
    squares: [T; 2],
    steps: u16,
    /// True if all samples were usable so far; `None` in a window of which samples are missing.
    usable: Option<[bool; 2]>,
}

/// Integrator of the K channels of one unit, of which the first six are those of a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Windows<T: Real, const K: usize> {
    /// Time of the latest sample, microseconds, and its channels.
    time: u64,
    channels: [T; K],
    /// Mean squared interval, windows squared; zero before the first.
    square: T,
    /// True if the channels are those of a sample, not products of rates.
    of_samples: bool,
    /// Usability of the latest sample; `None` before the first.
    usable: Option<[bool; 2]>,
    /// Completed windows, counted modulo [`KEPT`].
    completed: u8,
    /// Number of the current window in the grid.
    index: u64,
    sums: WindowSums<T, K>,
}

/// Piece of a straight line within a window, from position `s[0]` to `s[1]`, 0 to 1.
struct Piece<'a, T: Real, const K: usize> {
    s: [T; 2],
    from: &'a [T; K],
    to: &'a [T; K],
}

impl<T: Real, const K: usize> Default for Windows<T, K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const K: usize> Windows<T, K> {
    /// Creates an integrator without samples.
    pub fn new() -> Self {
        Self {
            time: 0,
            channels: [T::zero(); K],
            square: T::zero(),
            of_samples: true,
            usable: None,
            completed: 0,
            index: 0,
            sums: WindowSums::starting(&[T::zero(); K], false),
        }
    }

    /// Creates an integrator of products of rates, which takes none for a curve.
    pub fn of_products() -> Self {
        Self {
            of_samples: false,
            ..Self::new()
        }
    }

    /// Completed windows, counted modulo the number that is kept.
    pub fn completed(&self) -> usize {
        self.completed.into()
    }

    /// Number of a window of which the lower half is given: the nearest one to the current window.
    pub fn number(&self, index: u32) -> u64 {
        let ahead = index.wrapping_sub(low(self.index)).cast_signed();
        self.index.wrapping_add_signed(ahead.into())
    }

    /// Latest reading.
    #[inline]
    pub fn latest(&self) -> Option<&[T; K]> {
        self.usable.map(|_| &self.channels)
    }

    /// Adds the next reading and returns the window that it completes: at most one, because a pause longer than
    /// a window makes the windows that it touches incomplete. `length` is that of a window, microseconds, less
    /// than half an hour. Changes from sample to sample are added to `steps`.
    pub fn push(
        &mut self,
        time: u64,
        channels: &[T; K],
        usable: [bool; 2],
        length: u64,
        steps: Option<&mut UnitSteps<T>>,
    ) -> Option<Means<T, K>> {
        let now = Latest {
            time,
            channels: *channels,
            usable,
        };
        let closed = match self.usable {
            Some(was_usable) if time > self.time && time - self.time <= length => {
                let before = Latest {
                    time: self.time,
                    channels: self.channels,
                    usable: was_usable,
                };
                let samples = self.sums.steps;
                let closed = self.advance(&before, &now, length);
                let taken = self.sums.step(&before.channels, channels);
                if let Some((steps, taken)) = steps.zip(taken) {
                    if closed.is_some() {
                        steps.complete(samples);
                    }
                    steps.take(&taken);
                }
                closed
            }
            _ => {
                self.start(&now, length);
                None
            }
        };
        (self.time, self.channels, self.usable) = (time, *channels, Some(usable));
        if closed.is_some() {
            self.completed = (self.completed + 1) % KEPT;
        }
        closed
    }

    /// Starts in the middle of the window of a sample.
    #[inline(never)]
    fn start(&mut self, now: &Latest<T, K>, length: u64) {
        self.square = T::zero();
        self.index = whole_spans(now.time, length).0;
        self.sums = WindowSums::starting(&now.channels, false);
    }

    /// Adds the line from one sample to the next; returns the window that it completes.
    #[allow(clippy::cast_possible_truncation)]
    fn advance(&mut self, before: &Latest<T, K>, now: &Latest<T, K>, length: u64) -> Option<Means<T, K>> {
        let start = self.index.wrapping_mul(length);
        let (from, to) = (before.time.wrapping_sub(start), now.time.wrapping_sub(start));
        if from >= length {
            // The length of windows has changed.
            self.start(now, length);
            return None;
        }
        // Times from the start of a window fit 32 bits.
        let (from, to) = (from as u32, to as u32);
        let length = length as u32;
        let position = |time: u32| count::<T>(time) / count(length);
        let step = position(to - from);
        self.take_interval(step);
        let sums = &mut self.sums;
        sums.restrict(before.usable, now.usable);
        if to < length {
            let s = [position(from), position(to)];
            sums.add(&Piece {
                s,
                from: &before.channels,
                to: &now.channels,
            });
            return None;
        }
        let share = position(length - from) / step;
        let crossing = between(&before.channels, &now.channels, share);
        sums.add(&Piece {
            s: [position(from), T::one()],
            from: &before.channels,
            to: &crossing,
        });
        if self.of_samples {
            sums.bend(self.square * real(CURVE), &crossing);
        }
        let closed = sums.usable.map(|usable| sums.means(low(self.index), usable));
        self.index = self.index.saturating_add(1);
        *sums = WindowSums::starting(&crossing, true);
        sums.restrict(before.usable, now.usable);
        sums.add(&Piece {
            s: [T::zero(), position(to - length)],
            from: &crossing,
            to: &now.channels,
        });
        closed
    }

    /// Averages the squares of intervals, windows, each with the time that it lasts.
    fn take_interval(&mut self, step: T) {
        let square = step * step;
        if self.square > T::zero() {
            self.square += (square - self.square) * step * real(1.0 / USUAL);
        } else {
            self.square = square;
        }
    }
}

impl<T: Real, const K: usize> WindowSums<T, K> {
    fn starting(origin: &[T; K], whole: bool) -> Self {
        Self {
            origin: *origin,
            integral: [T::zero(); K],
            rising: [T::zero(); K],
            squares: [T::zero(); 2],
            steps: 0,
            usable: whole.then_some([true; 2]),
        }
    }

    fn restrict(&mut self, before: [bool; 2], now: [bool; 2]) {
        let ([before_first, before_second], [now_first, now_second]) = (before, now);
        if let Some([first, second]) = &mut self.usable {
            *first &= before_first & now_first;
            *second &= before_second & now_second;
        }
    }

    /// Adds the integrals of `x` and of `x s` along a straight piece.
    fn add(&mut self, piece: &Piece<'_, T, K>) {
        let [s0, s1] = piece.s;
        let half = (s1 - s0) * real(0.5);
        let sixth = (s1 - s0) * real(1.0 / 6.0);
        let (from_weight, to_weight) = (sixth * (s0 + s0 + s1), sixth * (s0 + s1 + s1));
        let sums = self.integral.iter_mut().zip(&mut self.rising).zip(&self.origin);
        for (((integral, rising), origin), (from, to)) in sums.zip(piece.from.iter().zip(piece.to)) {
            let (a, b) = (*from - *origin, *to - *origin);
            *integral += half * (a + b);
            *rising += from_weight * a + to_weight * b;
        }
    }

    /// Adds to the rising half of rates what straight lines miss, from the readings at both ends of the window. The slopes there
    /// cancel in a triangle.
    fn bend(&mut self, curve: T, end: &[T; K]) {
        let channels = self.rising.iter_mut().zip(self.origin.iter().zip(end));
        for (rising, (start, end)) in channels.take(RATES.end).skip(RATES.start) {
            *rising += curve * (*end - *start); // eq. 1a
        }
    }

    /// Adds the change from one sample to the next, and returns it.
    fn step(&mut self, from: &[T; K], to: &[T; K]) -> Option<[Step<T>; 2]> {
        self.steps = self.steps.saturating_add(1);
        let ((f, w), (next_f, next_w)) = (triads(from)?, triads(to)?);
        let taken = [step(f, next_f), step(w, next_w)];
        for (sum, (_, square)) in self.squares.iter_mut().zip(&taken) {
            *sum += *square;
        }
        Some(taken)
    }

    fn means(&self, index: u32, usable: [bool; 2]) -> Means<T, K> {
        let mut means = Means {
            index,
            mean: self.origin,
            rising: self.integral,
            scatter: self
                .squares
                .map(|squares| squares / (count::<T>(self.steps.max(1).into()) * real(6.0))),
            usable,
        };
        let half = real::<T>(0.5);
        for (mean, integral) in means.mean.iter_mut().zip(&self.integral) {
            *mean += *integral;
        }
        for ((risen, rising), origin) in means.rising.iter_mut().zip(&self.rising).zip(&self.origin) {
            *risen = *rising + half * *origin;
        }
        means
    }
}

/// Lower half of the number of a window.
#[allow(clippy::cast_possible_truncation)]
pub(super) fn low(index: u64) -> u32 {
    index as u32
}

/// Reading at a share of the way from one to the next.
fn between<T: Real, const K: usize>(from: &[T; K], to: &[T; K], share: T) -> [T; K] {
    let mut at = *from;
    for (at, to) in at.iter_mut().zip(to) {
        *at += (*to - *at) * share;
    }
    at
}

/// Splits six channels into two triads.
fn triads<T>(channels: &[T]) -> Option<(&[T; 3], &[T; 3])> {
    let (first, rest) = channels.split_first_chunk()?;
    Some((first, rest.first_chunk()?))
}

/// Change of three channels, and its square.
fn step<T: Real>(from: &[T; 3], to: &[T; 3]) -> Step<T> {
    let ([x, y, z], [next_x, next_y, next_z]) = (from, to);
    let step = [*next_x - *x, *next_y - *y, *next_z - *z];
    let [x, y, z] = step;
    (step, x * x + y * y + z * z)
}

#[cfg(test)]
#[path = "window_tests.rs"]
mod tests;
