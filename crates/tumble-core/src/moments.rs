//! Streaming mean and scatter of N channels: centred sums, mergeable, so that chunks can be reduced in parallel.

use crate::real::{Real, count, real};

/// Mean and centred sum of squares of N channels.
///
/// Welford (1962); merged by Chan, Golub and LeVeque (1979), eq. 2.1. Centred sums hold in `f32` over hours
/// (docs/theory/noise.md, eq. 12, 13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<T: Real, const N: usize> {
    samples: u32,
    mean: [T; N],
    squares: [T; N],
}

impl<T: Real, const N: usize> Default for Moments<T, N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const N: usize> Moments<T, N> {
    /// No samples yet.
    pub fn new() -> Self {
        Self {
            samples: 0,
            mean: [T::zero(); N],
            squares: [T::zero(); N],
        }
    }

    /// Takes in one sample.
    pub fn push(&mut self, sample: &[T; N]) {
        self.samples = self.samples.saturating_add(1);
        let share = T::one() / count(self.samples);
        for ((mean, squares), &x) in self.mean.iter_mut().zip(&mut self.squares).zip(sample) {
            let before = x - *mean;
            *mean += before * share; // eq. 12
            *squares += before * (x - *mean); // eq. 12
        }
    }

    /// Takes in all that another has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.samples == 0 {
            return;
        }
        let total = self.samples.saturating_add(other.samples);
        let share = count::<T>(other.samples) / count(total);
        let pull = count::<T>(self.samples) * share;
        for i in 0..N {
            let apart = other.mean[i] - self.mean[i];
            self.mean[i] += apart * share; // eq. 13
            self.squares[i] += other.squares[i] + apart * apart * pull; // eq. 13
        }
        self.samples = total;
    }

    /// Number of samples taken in.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// The same scatter about other means of the first channels.
    #[must_use]
    pub fn about(mut self, means: &[T]) -> Self {
        for (mean, &other) in self.mean.iter_mut().zip(means) {
            *mean = other;
        }
        self
    }

    /// Mean of each channel; zero before the first sample.
    pub fn mean(&self) -> &[T; N] {
        &self.mean
    }

    /// Variance of the samples of each channel (divisor n - 1); zero for fewer than two samples.
    #[inline(never)]
    pub fn variance(&self) -> [T; N] {
        let share = T::one() / count(self.samples.saturating_sub(1).max(1));
        self.squares.map(|squares| squares * share)
    }
}

/// Sums over a short run of samples about its first, so that they cost no division and lose no digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningSums<T: Real, const N: usize> {
    origin: [T; N],
    samples: u32,
    sum: [T; N],
    squares: [T; N],
    levers: [T; N],
    lever: T,
}

impl<T: Real, const N: usize> RunningSums<T, N> {
    /// Starts at its first sample.
    pub fn start(first: &[T; N]) -> Self {
        let zero = [T::zero(); N];
        Self {
            origin: *first,
            samples: 1,
            sum: zero,
            squares: zero,
            levers: zero,
            lever: T::zero(),
        }
    }

    /// Takes in one sample, `age` seconds after the first.
    #[inline]
    pub fn push(&mut self, sample: &[T; N], age: T) {
        self.samples += 1;
        self.lever += age;
        for i in 0..N {
            let x = sample[i] - self.origin[i];
            self.sum[i] += x;
            self.squares[i] += x * x;
            self.levers[i] += x * age;
        }
    }

    /// About the same sample, with nothing taken in.
    pub(crate) fn emptied(&self) -> Self {
        Self {
            samples: 0,
            ..Self::start(&self.origin)
        }
    }

    /// Takes in so many samples, evenly spaced on the straight line between two, given with their ages.
    pub(crate) fn push_line(&mut self, samples: u32, from: (T, &[T; N]), to: (T, &[T; N])) {
        let m = count::<T>(samples);
        let half = real::<T>(0.5);
        let age = (from.0 + to.0) * half;
        // Mean of the squared distance from the middle, over the square of the length.
        let spread = (m - T::one()) / ((m + T::one()) * real(12.0));
        self.samples = self.samples.saturating_add(samples);
        self.lever += m * age;
        for i in 0..N {
            let x = (from.1[i] + to.1[i]) * half - self.origin[i];
            let slope = (to.1[i] - from.1[i]) * (to.0 - from.0);
            self.sum[i] += m * x;
            self.levers[i] += m * (x * age + slope * spread);
        }
    }

    /// The first moments of both; the scatter is that of the samples of the first.
    pub(crate) fn with(&self, other: &Self) -> Self {
        let mut both = *self;
        both.samples = self.samples.saturating_add(other.samples);
        both.lever += other.lever;
        for i in 0..N {
            both.sum[i] += other.sum[i];
            both.levers[i] += other.levers[i];
        }
        both
    }

    /// Number of samples taken in.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean of each channel.
    pub fn mean(&self) -> [T; N] {
        let share = T::one() / count(self.samples);
        core::array::from_fn(|i| self.origin[i] + self.sum[i] * share)
    }

    /// Mean and scatter.
    pub fn moments(&self) -> Moments<T, N> {
        let share = T::one() / count(self.samples);
        let mut moments = Moments::new();
        moments.samples = self.samples;
        for i in 0..N {
            let shift = self.sum[i] * share;
            moments.mean[i] = self.origin[i] + shift;
            moments.squares[i] = (self.squares[i] - self.sum[i] * shift).max(T::zero());
        }
        moments
    }

    /// Mean of `(age - mean age) * sample` of each channel: the first moment in time, about the middle of the samples.
    pub fn mean_lever(&self) -> [T; N] {
        let share = T::one() / count(self.samples);
        let age = self.lever * share;
        core::array::from_fn(|i| (self.levers[i] - self.sum[i] * age) * share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(samples: &[[f64; 2]]) -> Moments<f64, 2> {
        let mut moments = Moments::new();
        samples.iter().for_each(|sample| moments.push(sample));
        moments
    }

    fn close(a: &Moments<f64, 2>, b: &Moments<f64, 2>) -> bool {
        let near = |x: &[f64; 2], y: &[f64; 2]| {
            x.iter()
                .zip(y)
                .all(|(x, y)| (x - y).abs() <= 1e-9 * (1.0 + x.abs()))
        };
        a.samples() == b.samples() && near(a.mean(), b.mean()) && near(&a.variance(), &b.variance())
    }

    proptest! {
        #[test]
        fn merging_parts_in_any_split_is_the_same_as_one_pass(
            samples in prop::collection::vec([-50.0..50.0_f64, -1.0..1.0_f64], 0..200), cut in 0.0..1.0_f64
        ) {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
            let cut = (cut * samples.len() as f64) as usize;
            let mut merged = of(&samples[..cut]);
            merged.merge(&of(&samples[cut..]));
            prop_assert!(close(&merged, &of(&samples)));
        }

        #[test]
        fn running_sums_agree_with_welford(samples in prop::collection::vec([-50.0..50.0_f64, -1.0..1.0_f64], 1..200)) {
            let mut sums = RunningSums::start(&samples[0]);
            samples[1..].iter().for_each(|sample| sums.push(sample, 0.0));
            prop_assert!(close(&sums.moments(), &of(&samples)));
        }
    }

    #[test]
    fn single_precision_survives_an_hour_at_a_kilohertz() {
        let mut moments = Moments::<f32, 1>::new();
        for i in 0..3_600_000_u32 {
            let wiggle = if i % 2 == 0 { 0.01 } else { -0.01 };
            moments.push(&[9.806_65 + wiggle]);
        }
        assert!(
            (moments.mean()[0] - 9.806_65).abs() < 1e-4,
            "{:?}",
            moments.mean()
        );
        assert!((moments.variance()[0].sqrt() - 0.01).abs() < 1e-4);
    }
}
