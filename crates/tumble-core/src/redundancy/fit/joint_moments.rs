//! Streaming joint mean and covariance of N channels, which suffice for any linear fit between them.

use crate::real::{Real, count};

/// Number of different products of two of N channels.
pub const fn packed(channels: usize) -> usize {
    channels * (channels + 1) / 2
}

/// Joint mean and centred sums of products of N channels, of which `PACKED` = [`packed`]`(N)` are stored.
///
/// Welford (1962) for products, [merged](Merged) by Chan, Golub and LeVeque (1979), eq. 2.1: centred, so that `f32` holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMoments<T: Real, const N: usize, const PACKED: usize> {
    samples: u32,
    mean: [T; N],
    products: [T; PACKED],
}

impl<T: Real, const N: usize, const PACKED: usize> Default for JointMoments<T, N, PACKED> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const N: usize, const PACKED: usize> JointMoments<T, N, PACKED> {
    const PACKS: () = assert!(PACKED == packed(N));

    /// Creates moments without samples.
    pub fn new() -> Self {
        let () = Self::PACKS;
        Self {
            samples: 0,
            mean: [T::zero(); N],
            products: [T::zero(); PACKED],
        }
    }

    /// Adds one sample.
    pub fn push(&mut self, sample: &[T; N]) {
        self.samples = self.samples.saturating_add(1);
        let share = T::one() / count(self.samples);
        let before: [T; N] = core::array::from_fn(|i| sample[i] - self.mean[i]);
        for (mean, before) in self.mean.iter_mut().zip(&before) {
            *mean += *before * share;
        }
        let after: [T; N] = core::array::from_fn(|i| sample[i] - self.mean[i]);
        let (mut packed, mut later) = (self.products.as_mut_slice(), after.as_slice());
        for before in before {
            let Some((row, rows)) = packed.split_at_mut_checked(later.len()) else {
                return;
            };
            for (product, after) in row.iter_mut().zip(later) {
                *product += before * *after;
            }
            (packed, later) = (rows, later.get(1..).unwrap_or(&[]));
        }
    }

    /// Number of samples.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean of each channel.
    pub fn mean(&self) -> &[T; N] {
        &self.mean
    }

    /// Covariance of two channels (divisor n); zero for an unknown channel.
    pub fn covariance(&self, i: usize, j: usize) -> T {
        let product = self.products.get(place::<N>(i, j)).filter(|_| i.max(j) < N);
        product.map_or(T::zero(), |product| *product / count(self.samples.max(1)))
    }

    /// Covariances (divisor n) of a channel with successive ones, the first of which is `from`, not before it. Those
    /// of unknown channels are left as they are.
    pub fn covariances(&self, channel: usize, from: usize, covariances: &mut [T]) {
        let samples = count::<T>(self.samples.max(1));
        let products = self.products.get(place::<N>(channel, from)..).unwrap_or(&[]);
        let row = products.iter().take(N.saturating_sub(from));
        for (covariance, product) in covariances.iter_mut().zip(row) {
            *covariance = *product / samples;
        }
    }
}

/// Joint moments of the samples of two.
pub struct Merged<'a, T: Real, const N: usize, const PACKED: usize> {
    parts: [&'a JointMoments<T, N, PACKED>; 2],
    /// Difference of the means of the second and the first.
    apart: [T; N],
    /// Share of the second in the mean.
    share: T,
    /// Weight of the squared difference of the means in a sum of squares.
    pull: T,
    /// Number of samples.
    samples: T,
}

impl<'a, T: Real, const N: usize, const PACKED: usize> Merged<'a, T, N, PACKED> {
    /// Merges the moments of two.
    pub fn of(first: &'a JointMoments<T, N, PACKED>, second: &'a JointMoments<T, N, PACKED>) -> Self {
        let samples = count::<T>(first.samples.saturating_add(second.samples).max(1));
        let share = count::<T>(second.samples) / samples;
        let mut apart = second.mean;
        for (apart, mean) in apart.iter_mut().zip(&first.mean) {
            *apart -= *mean;
        }
        Self {
            parts: [first, second],
            apart,
            share,
            pull: count::<T>(first.samples) * share,
            samples,
        }
    }

    /// Number of samples.
    pub fn samples(&self) -> u32 {
        let [first, second] = self.parts;
        first.samples.saturating_add(second.samples)
    }

    /// Mean of a channel; zero for an unknown channel.
    pub fn mean(&self, i: usize) -> T {
        let [first, _] = self.parts;
        let means = first.mean.get(i).zip(self.apart.get(i));
        means.map_or(T::zero(), |(mean, apart)| *mean + *apart * self.share)
    }

    /// Covariances (divisor n) of a channel with successive ones, the first of which is `from`, not before it. Those
    /// of unknown channels are left as they are.
    pub fn covariances(&self, channel: usize, from: usize, covariances: &mut [T]) {
        let at = place::<N>(channel, from);
        let [first, second] = self.parts.map(|part| part.products.get(at..).unwrap_or(&[]));
        let apart = self.apart.get(channel).zip(self.apart.get(from..));
        let Some((a, others)) = apart else { return };
        let row = first.iter().zip(second).zip(others);
        for (covariance, ((first, second), b)) in covariances.iter_mut().zip(row) {
            *covariance = (*first + (*second + *a * *b * self.pull)) / self.samples;
        }
    }
}

/// Index of the product of two of N channels.
fn place<const N: usize>(i: usize, j: usize) -> usize {
    let (i, j) = if i <= j { (i, j) } else { (j, i) };
    (2 * N - 1).wrapping_sub(i).wrapping_mul(i) / 2 + j
}

#[cfg(test)]
mod tests {
    use super::*;
    extern crate std;

    use proptest::prelude::*;
    use std::vec::Vec;

    type Joint = JointMoments<f64, 3, 6>;

    fn of(samples: &[[f64; 3]]) -> Joint {
        let mut joint = Joint::new();
        samples.iter().for_each(|sample| joint.push(sample));
        joint
    }

    /// Covariance by its definition.
    fn covariance(samples: &[[f64; 3]], i: usize, j: usize) -> f64 {
        let n = samples.len() as f64;
        let mean = |k: usize| samples.iter().map(|x| x[k]).sum::<f64>() / n;
        samples
            .iter()
            .map(|x| (x[i] - mean(i)) * (x[j] - mean(j)))
            .sum::<f64>()
            / n
    }

    fn samples() -> impl Strategy<Value = Vec<[f64; 3]>> {
        prop::collection::vec([-50.0..50.0_f64, -1.0..1.0_f64, 5.0..9.0_f64], 2..100)
    }

    proptest! {
        #[test]
        fn covariances_are_those_of_the_definition(samples in samples()) {
            let joint = of(&samples);
            for i in 0..3 {
                for j in 0..3 {
                    prop_assert!((joint.covariance(i, j) - covariance(&samples, i, j)).abs() < 1e-8);
                }
                let mut row = [0.0; 3];
                joint.covariances(i, i, &mut row);
                for (j, covariance) in (i..3).zip(row) {
                    prop_assert_eq!(covariance, joint.covariance(i, j));
                }
            }
        }

        #[test]
        fn merging_parts_in_any_split_is_the_same_as_one_pass(samples in samples(), cut in 0_usize..100) {
            let cut = cut.min(samples.len());
            let (first, second) = (of(&samples[..cut]), of(&samples[cut..]));
            let merged = Merged::of(&first, &second);
            let whole = of(&samples);
            prop_assert_eq!(merged.samples(), whole.samples());
            for i in 0..3 {
                prop_assert!((merged.mean(i) - whole.mean()[i]).abs() < 1e-9);
                for j in 0..3 {
                    let mut covariance = [0.0];
                    merged.covariances(i.min(j), i.max(j), &mut covariance);
                    prop_assert!((covariance[0] - whole.covariance(i, j)).abs() < 1e-8);
                }
            }
        }
    }
}
