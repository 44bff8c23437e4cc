//! Streaming joint mean and covariance of N channels: all that a linear fit between any of them needs.

use crate::real::{Real, count};

/// Different products of two of N channels.
pub const fn packed(channels: usize) -> usize {
    channels * (channels + 1) / 2
}

/// Joint mean and centred sums of products of N channels, of which `PACKED` = [`packed`]`(N)` are kept.
///
/// Welford (1962) for products, merged by Chan, Golub and LeVeque (1979), eq. 2.1: centred, so that `f32` holds.
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

    /// No samples yet.
    pub fn new() -> Self {
        let () = Self::PACKS;
        Self {
            samples: 0,
            mean: [T::zero(); N],
            products: [T::zero(); PACKED],
        }
    }

    /// Takes in one sample.
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

    /// Takes in all that another has seen.
    pub fn merge(&mut self, other: &Self) {
        if other.samples == 0 {
            return;
        }
        let total = self.samples.saturating_add(other.samples);
        let share = count::<T>(other.samples) / count(total);
        let pull = count::<T>(self.samples) * share;
        let apart: [T; N] = core::array::from_fn(|i| other.mean[i] - self.mean[i]);
        for (mean, apart) in self.mean.iter_mut().zip(&apart) {
            *mean += *apart * share;
        }
        let mut packed = self.products.iter_mut().zip(&other.products);
        for (i, a) in apart.iter().enumerate() {
            for (b, (product, more)) in apart.iter().skip(i).zip(&mut packed) {
                *product += *more + *a * *b * pull;
            }
        }
        self.samples = total;
    }

    /// How many samples were taken in.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean of each channel.
    pub fn mean(&self) -> &[T; N] {
        &self.mean
    }

    /// Covariance of two channels (divisor n); zero for a channel there is not.
    pub fn covariance(&self, i: usize, j: usize) -> T {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        if j >= N {
            return T::zero();
        }
        let packed = (2 * N + 1).saturating_sub(i) * i / 2 + (j - i);
        let product = self.products.get(packed).copied().unwrap_or(T::zero());
        product / count(self.samples.max(1))
    }
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
            }
        }

        #[test]
        fn merging_parts_in_any_split_is_the_same_as_one_pass(samples in samples(), cut in 0_usize..100) {
            let cut = cut.min(samples.len());
            let mut merged = of(&samples[..cut]);
            merged.merge(&of(&samples[cut..]));
            let whole = of(&samples);
            prop_assert_eq!(merged.samples(), whole.samples());
            for i in 0..3 {
                prop_assert!((merged.mean()[i] - whole.mean()[i]).abs() < 1e-9);
                for j in 0..3 {
                    prop_assert!((merged.covariance(i, j) - whole.covariance(i, j)).abs() < 1e-8);
                }
            }
        }
    }
}
