//! Leaky means over the scales of time: one number a scale, in the place of a ring of windows.

use super::table::{COUNT, SCALES, WHOLE};
use crate::real::{Real, count, real};

/// Means of K channels over all scales, of what was whole; their weight is the share of the past that was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeakyMeans<T: Real, const K: usize> {
    scales: [LeakyMean<T, K>; COUNT],
}

/// Mean of K channels over one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeakyMean<T: Real, const K: usize> {
    weight: T,
    total: [T; K],
}

impl<T: Real, const K: usize> LeakyMean<T, K> {
    /// Creates a mean without weight.
    pub fn new() -> Self {
        Self {
            weight: T::zero(),
            total: [T::zero(); K],
        }
    }

    /// Takes values, or nothing where they are not whole, over a scale of so many windows (docs/theory/set.md, eq. 4).
    pub fn take(&mut self, values: Option<&[T; K]>, windows: u16) {
        let share = real::<T>(2.0) / count(u32::from(windows) + 1);
        match values {
            Some(values) => {
                self.weight += share * (T::one() - self.weight);
                for (total, value) in self.total.iter_mut().zip(values) {
                    *total += share * (*value - *total);
                }
            }
            None => {
                self.weight -= share * self.weight;
                for total in &mut self.total {
                    *total -= share * *total;
                }
            }
        }
    }

    /// Mean, zero without weight.
    pub fn mean(&self) -> [T; K] {
        let weight = self.weight.max(real(1e-12));
        self.total.map(|total| total / weight)
    }

    /// Share of the past that was whole.
    pub fn weight(&self) -> T {
        self.weight
    }

    /// Tests whether enough of the past was whole.
    pub fn is_usable(&self) -> bool {
        self.weight >= real(WHOLE)
    }
}

impl<T: Real, const K: usize> Default for LeakyMean<T, K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real, const K: usize> LeakyMeans<T, K> {
    /// Creates means without weight.
    pub fn new() -> Self {
        Self {
            scales: [LeakyMean::new(); COUNT],
        }
    }

    /// Takes values, or nothing where they are not whole.
    pub fn take(&mut self, values: Option<&[T; K]>) {
        for (mean, windows) in self.scales.iter_mut().zip(SCALES) {
            mean.take(values, windows);
        }
    }

    /// Moves the mean of a scale.
    pub fn shift(&mut self, scale: usize, change: &[T; K]) {
        if let Some(mean) = self.scales.get_mut(scale) {
            for (total, change) in mean.total.iter_mut().zip(change) {
                *total += mean.weight * *change;
            }
        }
    }

    /// Begins anew.
    pub fn forget(&mut self) {
        *self = Self::new();
    }

    /// Means by scale.
    pub fn scales(&self) -> &[LeakyMean<T, K>; COUNT] {
        &self.scales
    }
}

impl<T: Real, const K: usize> Default for LeakyMeans<T, K> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_of_a_constant_is_that_constant_whatever_is_missing() {
        let mut means = LeakyMeans::<f64, 1>::new();
        for step in 0..50 {
            means.take((step % 3 != 1).then_some(&[2.5]));
            for mean in means.scales().iter().filter(|mean| mean.weight() > 0.0) {
                assert!((mean.mean()[0] - 2.5).abs() < 1e-12, "step {step}");
            }
        }
    }

    #[test]
    fn a_scale_has_the_white_noise_of_a_boxcar_as_long() {
        // The sum of the squared weights of a boxcar of n windows is 1 / n.
        for (scale, windows) in SCALES.into_iter().enumerate() {
            let (mut means, mut squares) = (LeakyMeans::<f64, 1>::new(), 0.0);
            means.take(Some(&[1.0]));
            for _ in 0..5000 {
                let share = means.scales()[scale].total[0];
                squares += share * share;
                means.take(Some(&[0.0]));
            }
            assert!((squares * f64::from(windows) - 1.0).abs() < 1e-9, "{windows}");
        }
    }
}
