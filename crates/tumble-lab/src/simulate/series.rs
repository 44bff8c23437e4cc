//! A function of time about one instant: its value and its first derivatives, exact, carried through arithmetic.
//!
//! Truncated Taylor series with their usual recurrences (Griewank, Walther, "Evaluating Derivatives", 2nd ed., 2008,
//! table 13.2). A motion written with them has velocity, acceleration, angular rate and angular acceleration that
//! belong together, whatever its formula.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// The first `N` coefficients of a Taylor series: `coefficient[k] = k-th derivative / k!`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Series<const N: usize>([f64; N]);

impl<const N: usize> Series<N> {
    /// Series of a constant.
    pub fn constant(value: f64) -> Self {
        let mut coefficients = [0.0; N];
        coefficients[0] = value;
        Self(coefficients)
    }

    /// Time itself, s.
    pub fn time(t: f64) -> Self {
        let mut time = Self::constant(t);
        time.0[1] = 1.0;
        time
    }

    /// A function of these derivatives, its value first.
    pub fn of(derivatives: [f64; N]) -> Self {
        Self(core::array::from_fn(|k| derivatives[k] / factorial(k)))
    }

    /// Value.
    pub fn value(&self) -> f64 {
        self.0[0]
    }

    /// Derivative of that order, below `N`.
    pub fn derivative(&self, order: usize) -> f64 {
        self.0[order] * factorial(order)
    }

    /// The derivative of that order as a function; `M + order` is at most `N`.
    pub fn derived<const M: usize>(&self, order: usize) -> Series<M> {
        Series::of(core::array::from_fn(|k| self.derivative(k + order)))
    }

    /// Sine and cosine.
    pub fn sincos(&self) -> (Self, Self) {
        let (mut sine, mut cosine) = (Self([0.0; N]), Self([0.0; N]));
        (sine.0[0], cosine.0[0]) = libm::sincos(self.0[0]);
        for k in 1..N {
            for j in 1..=k {
                let slope = j as f64 * self.0[j] / k as f64;
                sine.0[k] += slope * cosine.0[k - j];
                cosine.0[k] -= slope * sine.0[k - j];
            }
        }
        (sine, cosine)
    }

    /// Square root; the value is positive.
    pub fn sqrt(&self) -> Self {
        let mut root = Self::constant(self.0[0].sqrt());
        for k in 1..N {
            let crossed: f64 = (1..k).map(|j| root.0[j] * root.0[k - j]).sum();
            root.0[k] = (self.0[k] - crossed) / (2.0 * root.0[0]);
        }
        root
    }

    /// Angle of the point (`x`, `self`), not the origin: `d(angle) = (x dy - y dx) / (x^2 + y^2)`.
    pub fn atan2(&self, x: &Self) -> Self {
        let y = self;
        let mut angle = Self::constant(libm::atan2(y.0[0], x.0[0]));
        let square = *x * *x + *y * *y;
        for k in 1..N {
            let swept: f64 = (1..=k)
                .map(|j| j as f64 * (x.0[k - j] * y.0[j] - y.0[k - j] * x.0[j]))
                .sum();
            let before: f64 = (1..k).map(|j| j as f64 * angle.0[j] * square.0[k - j]).sum();
            angle.0[k] = (swept - before) / (k as f64 * square.0[0]);
        }
        angle
    }
}

impl<const N: usize> Add for Series<N> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(core::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl<const N: usize> Sub for Series<N> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(core::array::from_fn(|k| self.0[k] - other.0[k]))
    }
}

impl<const N: usize> Neg for Series<N> {
    type Output = Self;

    fn neg(self) -> Self {
        self * -1.0
    }
}

impl<const N: usize> Mul for Series<N> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self(core::array::from_fn(|k| {
            (0..=k).map(|j| self.0[j] * other.0[k - j]).sum()
        }))
    }
}

impl<const N: usize> Mul<f64> for Series<N> {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|coefficient| coefficient * factor))
    }
}

impl<const N: usize> Div<f64> for Series<N> {
    type Output = Self;

    fn div(self, divisor: f64) -> Self {
        Self(self.0.map(|coefficient| coefficient / divisor))
    }
}

impl<const N: usize> Add<f64> for Series<N> {
    type Output = Self;

    fn add(mut self, constant: f64) -> Self {
        self.0[0] += constant;
        self
    }
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Some function of time that uses every operation.
    fn tangled<const N: usize>(t: f64) -> Series<N> {
        let time = Series::<N>::time(t);
        let (sine, cosine) = (time * 1.3 + 0.2).sincos();
        let height = (sine * sine + cosine * 0.5 + 2.0).sqrt();
        (sine * height - time / 3.0).atan2(&(-cosine + 1.7)) * time
    }

    proptest! {
        #[test]
        fn each_derivative_is_the_slope_of_the_one_before(t in -3.0..3.0f64) {
            let h = 1e-4;
            let (before, now, after) = (tangled::<5>(t - h), tangled::<5>(t), tangled::<5>(t + h));
            for order in 1..5 {
                let slope = (after.derivative(order - 1) - before.derivative(order - 1)) / (2.0 * h);
                let scale = 1.0 + now.derivative(order).abs();
                prop_assert!((slope - now.derivative(order)).abs() < 1e-4 * scale, "order {order}");
            }
        }

        #[test]
        fn fewer_terms_are_the_first_of_more(t in -3.0..3.0f64) {
            prop_assert_eq!(tangled::<5>(t).derived::<3>(0), tangled::<3>(t));
        }

        #[test]
        fn the_derivative_as_a_function_has_the_later_derivatives(t in -3.0..3.0f64) {
            let (whole, second) = (tangled::<5>(t), tangled::<5>(t).derived::<3>(2));
            for order in 0..3 {
                let expected = whole.derivative(order + 2);
                prop_assert!((second.derivative(order) - expected).abs() < 1e-9 * (1.0 + expected.abs()));
            }
        }
    }
}
