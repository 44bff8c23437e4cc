//! Tails and quantiles that tests of fit and intervals need: of chi-square and of Student's t; the median of a sample.
//!
//! "DLMF" is the NIST Digital Library of Mathematical Functions, <https://dlmf.nist.gov>. Relative errors are below
//! 1e-12 from one degree of freedom to a million; for quantiles of Student's t beyond 3 they are
//! below 1e-16 times these degrees, where that is more.

use std::f64::consts::PI;

/// Sigmas to either end of a 95 % interval of a normal distribution: 97.5 % of it lie below.
pub const INTERVAL: f64 = 1.959_963_984_540_054;

/// Terms of a series or continued fraction: at most some ten times the root of the degrees of freedom are needed.
const MOST_TERMS: u32 = 1_000_000;
/// Steps to a quantile: bisection alone would need as many as a float has bits.
const MOST_STEPS: u32 = 200;
/// Below this t, and above these degrees of freedom, the tail of Student's distribution is one half less the rest.
const CENTRAL: f64 = 3.0;
const MANY_DEGREES: f64 = 1000.0;
/// From here on the series of Stirling is exact to rounding.
const STIRLING: f64 = 10.0;

/// Median, the upper of the two in the middle, by which `values` change their order; `None` of none.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Median, the mean of the two in the middle of an even number, by which `values` change their order; `None` of none.
pub fn balanced_median(values: &mut [f64]) -> Option<f64> {
    let upper = median(values)?;
    let below = &values[..values.len() / 2];
    let lower = below.iter().copied().max_by(f64::total_cmp);
    let is_even = values.len().is_multiple_of(2);
    Some(
        lower
            .filter(|_| is_even)
            .map_or(upper, |lower| 0.5 * (lower + upper)),
    )
}

/// Chance that a chi-square of `freedom` degrees of freedom is larger than `x`; NaN where `freedom` is not above zero.
pub fn chi_square_tail(x: f64, freedom: f64) -> f64 {
    upper_gamma(0.5 * freedom, 0.5 * x)
}

/// Quantile of chi-square with `freedom` degrees of freedom that is exceeded with probability `tail`.
///
/// NaN where `freedom` is not above zero or `tail` not within 0 and 1.
pub fn chi_square_quantile(tail: f64, freedom: f64) -> f64 {
    let a = 0.5 * freedom;
    if !(a > 0.0 && a.is_finite() && (0.0..=1.0).contains(&tail)) {
        return f64::NAN;
    }
    2.0 * where_tail(tail, a, |x| (upper_gamma(a, x), gamma_front(a, x) / x))
}

/// The `t` below which a share `p` of Student's distribution of `freedom` degrees of freedom lies.
///
/// NaN where `freedom` is not above zero or `p` not within 0 and 1.
pub fn student_quantile(p: f64, freedom: f64) -> f64 {
    if !(freedom > 0.0 && freedom.is_finite() && (0.0..=1.0).contains(&p)) {
        return f64::NAN;
    }
    let above = where_tail(p.min(1.0 - p), 1.0, |t| {
        (student_tail(t, freedom), student_density(t, freedom))
    });
    if p < 0.5 { -above } else { above }
}

/// Chance that an F of `first` and `second` degrees of freedom, those of its numerator first, is larger than `x`.
///
/// NaN where a number of degrees of freedom is not above zero.
pub fn f_tail(x: f64, first: f64, second: f64) -> f64 {
    if !(first > 0.0 && second > 0.0 && first.is_finite() && second.is_finite()) || x.is_nan() {
        return f64::NAN;
    }
    let x = x.max(0.0);
    let (outer, inner) = (second / (second + first * x), first * x / (second + first * x));
    let (a, b) = (0.5 * second, 0.5 * first);
    let front = libm::exp(a * libm::log(outer) + b * libm::log(inner) - log_beta(a, b));
    if outer < (a + 1.0) / (a + b + 2.0) {
        front / (a * beta_fraction(a, b, outer))
    } else {
        1.0 - front / (b * beta_fraction(b, a, inner))
    }
}

/// Where on x >= 0 a falling tail has a value: Newton's method, held within what is known to enclose the place.
///
/// `of` gives tail and density at x; `scale` is of the size of x.
fn where_tail(value: f64, scale: f64, of: impl Fn(f64) -> (f64, f64)) -> f64 {
    if value >= of(0.0).0 {
        return 0.0;
    }
    if value <= 0.0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, scale);
    while of(high).0 > value {
        (low, high) = (high, 2.0 * high);
    }
    let mut x = 0.5 * (low + high);
    for _ in 0..MOST_STEPS {
        let (tail, density) = of(x);
        if tail > value {
            low = x;
        } else {
            high = x;
        }
        let newton = x + (tail - value) / density;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - x).abs() <= f64::EPSILON * x {
            return next;
        }
        x = next;
    }
    x
}

/// Q(a, x), the upper incomplete gamma function over the complete one.
fn upper_gamma(a: f64, x: f64) -> f64 {
    if !(a > 0.0 && a.is_finite()) || x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 1.0;
    }
    if x == f64::INFINITY {
        return 0.0;
    }
    let front = gamma_front(a, x);
    if x < a + 1.0 {
        return 1.0 - front * lower_series(a, x);
    }
    front * upper_fraction(a, x)
}

/// Sum of x^n / (a (a + 1) ... (a + n)), DLMF 8.7.1: P(a, x) over [`gamma_front`].
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    for n in 1..MOST_TERMS {
        term *= x / (a + f64::from(n));
        sum += term;
        if term <= f64::EPSILON * sum {
            break;
        }
    }
    sum
}

/// DLMF 8.9.2 in its even form, 1 / (x + 1 - a - 1 (1 - a) / (x + 3 - a - ...)): Q(a, x) over [`gamma_front`].
fn upper_fraction(a: f64, x: f64) -> f64 {
    let mut fraction = Lentz::new(x + 1.0 - a);
    for n in 1..MOST_TERMS {
        let n = f64::from(n);
        if fraction.settles(n * (a - n), x + 2.0 * n + 1.0 - a) {
            break;
        }
    }
    1.0 / fraction.value
}

/// x^a e^-x / Gamma(a).
fn gamma_front(a: f64, x: f64) -> f64 {
    if a < STIRLING {
        return libm::exp(a * libm::log(x) - x - libm::lgamma(a));
    }
    // Written about x = a, where the terms all but cancel.
    let off = (x - a) / a;
    libm::exp(a * (libm::log1p(off) - off) - stirling(a)) * (a / (2.0 * PI)).sqrt()
}

/// Remainder of ln Gamma(a) above (a - 1/2) ln a - a + ln(2 pi) / 2, DLMF 5.11.1.
fn stirling(a: f64) -> f64 {
    let square = 1.0 / (a * a);
    let inner = 1.0 / 1260.0 - square * (1.0 / 1680.0 - square * (1.0 / 1188.0 - square * 691.0 / 360_360.0));
    (1.0 / 12.0 - square * (1.0 / 360.0 - square * inner)) / a
}

/// Chance that Student's t is larger than `t`, from 0 on: the incomplete beta function, DLMF 8.17.
fn student_tail(t: f64, freedom: f64) -> f64 {
    if t <= 0.0 {
        return 0.5;
    }
    let half = 0.5 * freedom;
    let (inner, outer) = (t * t / (freedom + t * t), freedom / (freedom + t * t));
    let front = t * student_density(t, freedom);
    // With many degrees of freedom `outer` is close to 1 and its rounding counts; with few, the difference from 1/2 does.
    if (t < CENTRAL && freedom > MANY_DEGREES) || inner < 1.5 / (half + 2.5) {
        0.5 - front / beta_fraction(0.5, half, inner)
    } else {
        0.5 * front / (half * beta_fraction(half, 0.5, outer))
    }
}

/// DLMF 8.17.22: x^a (1 - x)^b / (a B(a, b)) over I_x(a, b), which it gives quickly for x < (a + 1) / (a + b + 2).
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let mut fraction = Lentz::new(1.0);
    for m in 0..MOST_TERMS {
        let m = f64::from(m);
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let n = m + 1.0;
        let even = n * (b - n) * x / ((a + 2.0 * n - 1.0) * (a + 2.0 * n));
        let settled = fraction.settles(odd, 1.0);
        if fraction.settles(even, 1.0) && settled {
            break;
        }
    }
    fraction.value
}

/// Density of Student's t: (1 + t^2 / freedom)^(-(freedom + 1) / 2) / (sqrt(freedom) B(1/2, freedom / 2)).
fn student_density(t: f64, freedom: f64) -> f64 {
    let half = 0.5 * freedom;
    let log_power = -0.5 * (freedom + 1.0) * libm::log1p(t * t / freedom);
    libm::exp(log_power + log_gamma_step(half, 0.5)) / (PI * freedom).sqrt()
}

/// ln B(a, b).
fn log_beta(a: f64, b: f64) -> f64 {
    libm::lgamma(a.min(b)) - log_gamma_step(a.max(b), a.min(b))
}

/// ln Gamma(a + step) - ln Gamma(a).
fn log_gamma_step(a: f64, step: f64) -> f64 {
    if a < STIRLING {
        return libm::lgamma(a + step) - libm::lgamma(a);
    }
    (a - 0.5) * libm::log1p(step / a) - step + step * libm::log(a + step) + stirling(a + step) - stirling(a)
}

/// A continued fraction `b0 + a1 / (b1 + a2 / (b2 + ...))` from its head on, by the method of Lentz as modified by
/// Thompson and Barnett, "Coulomb and Bessel functions of complex arguments and order" (1986).
struct Lentz {
    value: f64,
    numerator: f64,
    denominator: f64,
}

impl Lentz {
    fn new(b0: f64) -> Self {
        let value = away_from_zero(b0);
        Self {
            value,
            numerator: value,
            denominator: 0.0,
        }
    }

    /// Takes in the next pair; true once it changes nothing any more.
    fn settles(&mut self, a: f64, b: f64) -> bool {
        self.denominator = 1.0 / away_from_zero(b + a * self.denominator);
        self.numerator = away_from_zero(b + a / self.numerator);
        let change = self.numerator * self.denominator;
        self.value *= change;
        (change - 1.0).abs() <= f64::EPSILON
    }
}

fn away_from_zero(value: f64) -> f64 {
    if value.abs() < 1e-300 { 1e-300 } else { value }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TOLERANCE: f64 = 1e-12;

    proptest! {
        #[test]
        fn medians_are_the_upper_and_the_mean_of_the_sorted_middle(mut values in prop::collection::vec(-1e9_f64..1e9, 0..40)) {
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            prop_assert_eq!(median(&mut values), sorted.get(sorted.len() / 2).copied());
            let middle = sorted.len().checked_sub(1).map(|last| 0.5 * (sorted[last / 2] + sorted[last.div_ceil(2)]));
            prop_assert_eq!(balanced_median(&mut values), middle);
        }
    }

    fn assert_near(found: f64, expected: f64) {
        let off = ((found - expected) / expected).abs();
        assert!(
            off < TOLERANCE,
            "found {found:e}, expected {expected:e}, off by {off:e}"
        );
    }

    proptest! {
        #[test]
        fn even_degrees_of_freedom_have_a_finite_sum(x in 1e-3f64..200.0) {
            let half = 0.5 * x;
            assert_near(chi_square_tail(x, 2.0), (-half).exp());
            assert_near(chi_square_tail(x, 4.0), (-half).exp() * (1.0 + half));
            assert_near(chi_square_tail(x, 6.0), (-half).exp() * (1.0 + half + 0.5 * half * half));
        }

        #[test]
        fn an_f_of_one_degree_of_freedom_is_a_square_of_t(t in 0.1f64..20.0, freedom in 1.0f64..200.0) {
            assert_near(f_tail(t * t, 1.0, freedom), 2.0 * student_tail(t, freedom));
        }

        #[test]
        fn an_f_of_two_degrees_of_freedom_has_a_power_for_tail(x in 1e-3f64..100.0, freedom in 1.0f64..100.0) {
            assert_near(f_tail(x, 2.0, freedom), (1.0 + 2.0 * x / freedom).powf(-0.5 * freedom));
        }

        #[test]
        fn one_degree_of_freedom_is_a_normal_number_squared(x in 1e-3f64..100.0) {
            assert_near(chi_square_tail(x, 1.0), libm::erfc((0.5 * x).sqrt()));
        }

        #[test]
        fn a_chi_square_quantile_is_exceeded_by_its_tail(tail in 1e-9f64..0.999_999, log_freedom in 0.0f64..14.0) {
            let freedom = log_freedom.exp().round();
            let found = chi_square_tail(chi_square_quantile(tail, freedom), freedom);
            // An x one rounding off is exceeded as much more or less often as the tail is steep there.
            let steep = 1.0 + freedom.sqrt() * (1.0 - tail.ln());
            prop_assert!((found / tail - 1.0).abs() < 1e-14 * steep, "found {found:e} for {tail:e}");
        }

        #[test]
        fn few_degrees_of_freedom_of_students_t_are_known(p in 0.6f64..0.999_9) {
            let product = 4.0 * p * (1.0 - p);
            assert_near(student_quantile(p, 1.0), (PI * (p - 0.5)).tan());
            assert_near(student_quantile(p, 2.0), (2.0 * p - 1.0) * (2.0 / product).sqrt());
            // Shaw, "Sampling Student's T distribution - use of the inverse cumulative distribution function" (2006).
            let q = (product.sqrt().acos() / 3.0).cos() / product.sqrt();
            assert_near(student_quantile(p, 4.0), 2.0 * (q - 1.0).sqrt());
        }

        #[test]
        fn students_t_is_even(parts in 1u32..1 << 20, freedom in 0.5f64..1e4) {
            // A share of which 1 - p is exact.
            let p = f64::from(parts) / f64::from(1u32 << 20);
            prop_assert_eq!(student_quantile(p, freedom), -student_quantile(1.0 - p, freedom));
        }
    }

    /// Worked out with 40 digits by mpmath 1.3, `gammainc(n / 2, x / 2, inf, regularized=True)`.
    #[test]
    fn tails_of_chi_square_are_those_of_long_arithmetic() {
        for (x, freedom, expected) in [
            (0.5, 1.0, 0.479_500_122_186_953_5),
            (1.0, 3.0, 0.801_251_956_901_200_8),
            (200.0, 10.0, 1.613_930_533_697_730_5e-37),
            (30.0, 7.0, 9.495_972_508_134_183e-5),
            (130.0, 99.0, 0.019_988_030_104_357_242),
            (400.0, 300.0, 9.678_621_994_933_577e-5),
            (1_050.0, 1_000.0, 0.132_474_056_821_477_1),
            (20_300.0, 20_000.0, 0.067_340_621_503_949_14),
            (1e6, 1e6, 0.499_811_936_803_394_5),
            (1.003e6, 1e6, 0.017_016_772_933_266_314),
        ] {
            assert_near(chi_square_tail(x, freedom), expected);
        }
    }

    /// By bisection of the same, 40 digits.
    #[test]
    fn quantiles_of_chi_square_are_those_of_long_arithmetic() {
        for (tail, freedom, expected) in [
            (0.975, 3.0, 0.215_795_282_623_897_88),
            (0.025, 3.0, 9.348_403_604_496_148),
            (0.001, 3.0, 16.266_236_196_238_13),
            (0.001, 12.0, 32.909_490_407_360_21),
            (0.025, 60.0, 83.297_674_877_173_2),
            (0.975, 60.0, 40.481_748_042_841_83),
            (0.001, 1_000.0, 1_143.917_092_619_679_1),
        ] {
            assert_near(chi_square_quantile(tail, freedom), expected);
        }
    }

    /// By bisection of `betainc(n / 2, 1 / 2, 0, n / (n + t^2), regularized=True) / 2`, 40 digits.
    #[test]
    fn quantiles_of_student_are_those_of_long_arithmetic() {
        for (freedom, expected) in [
            (0.5, 164.557_673_480_488_52),
            (3.0, 3.182_446_305_283_71),
            (5.5, 2.501_858_617_589_240_6),
            (10.0, 2.228_138_851_986_275),
            (29.0, 2.045_229_642_132_704),
            (100.0, 1.983_971_518_523_552_2),
            (1_234.5, 1.961_887_483_331_345_5),
        ] {
            assert_near(student_quantile(0.975, freedom), expected);
        }
    }

    /// Abramowitz and Stegun, "Handbook of Mathematical Functions" (1964), eq. 26.7.5.
    #[test]
    fn students_t_becomes_normal_as_its_expansion_says() {
        let z = INTERVAL;
        for freedom in [1e5, 1e6, 1e9] {
            let first = (z.powi(3) + z) / 4.0;
            let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
            assert_near(
                student_quantile(0.975, freedom),
                z + first / freedom + second / (freedom * freedom),
            );
        }
    }

    #[test]
    fn what_has_no_answer_is_no_number() {
        assert!(chi_square_tail(1.0, 0.0).is_nan());
        assert!(chi_square_quantile(1.5, 3.0).is_nan());
        assert!(student_quantile(0.975, 0.0).is_nan());
        assert!(student_quantile(f64::NAN, 3.0).is_nan());
        assert!(chi_square_tail(f64::NAN, 3.0).is_nan());
        assert_eq!(chi_square_quantile(0.0, 3.0), f64::INFINITY);
        assert_eq!(chi_square_quantile(1.0, 3.0), 0.0);
        assert_eq!(student_quantile(0.5, 3.0), 0.0);
        assert_eq!(chi_square_tail(f64::INFINITY, 3.0), 0.0);
    }
}
