//! Shared parts of the laws: inputs at random, comparison in units of rounding, Monte Carlo.

use core::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Dxsm;
use tumble_core::real::Real;

/// Fails the law at hand unless two matrices agree within `tolerance`, element by element.
macro_rules! assert_close {
    ($left:expr, $right:expr, $tolerance:expr) => {{
        let (left, right, tolerance) = (&$left, &$right, $tolerance);
        let apart = super::common::apart(left, right);
        proptest::prop_assert!(
            apart <= tolerance,
            "{} differs from {} by {apart:e}, more than {tolerance:e}: {left:?} {right:?}",
            stringify!($left),
            stringify!($right)
        );
    }};
}
pub(crate) use assert_close;

/// Largest difference of two elements; infinite where one is not a number.
pub fn apart<T: Real, const R: usize, const C: usize>(a: &SMatrix<T, R, C>, b: &SMatrix<T, R, C>) -> f64 {
    a.iter()
        .zip(b.iter())
        .map(|(a, b)| (double(*a) - double(*b)).abs())
        .fold(
            0.0,
            |most, x| if x.is_nan() { f64::INFINITY } else { most.max(x) },
        )
}

/// A number of either kind as f64, exactly.
pub fn double<T: Real>(x: T) -> f64 {
    nalgebra::try_convert(x).unwrap_or(f64::NAN)
}

/// `roundings` times the spacing of numbers about one in the type at hand.
pub fn rounding<T: Real>(roundings: f64) -> f64 {
    roundings * double(T::default_epsilon())
}

/// A matrix of either kind from one of f64.
pub fn cast<T: Real, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> SMatrix<T, R, C> {
    m.map(nalgebra::convert)
}

/// Number of cases for a slow law; PROPTEST_CASES asks for another.
pub fn cases(few: u32) -> ProptestConfig {
    let mut config = ProptestConfig::default();
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = few;
    }
    // Laws that hold for part of what is drawn only are none the worse for it.
    config.max_global_rejects = 20 * config.cases;
    config
}

/// Vectors with components up to `size`.
pub fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    let part = -size..size;
    (part.clone(), part.clone(), part).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

/// Rotation vectors: none, tiny, ordinary, and close to half a turn.
pub fn rotation_vector() -> impl Strategy<Value = Vector3<f64>> {
    let angle = prop_oneof![
        1 => Just(0.0),
        2 => 1e-12..1e-6_f64,
        2 => 1e-6..0.02_f64,
        4 => 0.02..3.0_f64,
        2 => 3.0..0.9998 * PI,
    ];
    (direction(), angle).prop_map(|(axis, angle)| axis * angle)
}

/// Unit vectors, the axes among them.
pub fn direction() -> impl Strategy<Value = Vector3<f64>> {
    prop_oneof![
        1 => Just(Vector3::x()),
        1 => Just(-Vector3::y()),
        1 => Just(Vector3::z()),
        5 => vector(1.0)
            .prop_filter("too short to have a direction", |v| v.norm() > 0.1)
            .prop_map(|v| v.normalize()),
    ]
}

/// Directions of the six faces of a cube.
pub fn faces() -> Vec<Vector3<f64>> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    axes.into_iter().flat_map(|axis| [axis, -axis]).collect()
}

/// Rotations.
pub fn rotation() -> impl Strategy<Value = Rotation3<f64>> {
    rotation_vector().prop_map(Rotation3::new)
}

/// Non-orthogonality as sensors have it: rows of unit length, lower triangular.
pub fn non_orthogonality(largest: f64) -> impl Strategy<Value = Matrix3<f64>> {
    let sine = prop_oneof![1 => Just(0.0), 1 => -1e-9..1e-9_f64, 4 => -largest..largest];
    (sine.clone(), sine.clone(), sine).prop_map(|(xy, zx, zy)| {
        let y: f64 = 1.0 - xy * xy;
        let z: f64 = 1.0 - zx * zx - zy * zy;
        Matrix3::new(1.0, 0.0, 0.0, xy, y.sqrt(), 0.0, zx, zy, z.sqrt())
    })
}

/// Numbers of one seed, which a failing test names.
pub struct Draws {
    /// Where the numbers come from.
    pub seed: u64,
    generator: Pcg64Dxsm,
}

impl Draws {
    /// The numbers of a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            generator: Pcg64Dxsm::seed_from_u64(seed),
        }
    }

    /// A standard normal number.
    pub fn normal(&mut self) -> f64 {
        self.generator.sample(StandardNormal)
    }

    /// A number from zero to one.
    pub fn uniform(&mut self) -> f64 {
        self.generator.random()
    }

    /// N independent standard normal numbers.
    pub fn normals<const N: usize>(&mut self) -> SVector<f64, N> {
        SVector::from_fn(|_, _| self.normal())
    }

    /// A direction, uniform over the sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        self.normals::<3>().normalize()
    }
}

/// Errors of an estimate over many runs, held against the covariance it claimed in each.
pub struct Calibration<const N: usize> {
    errors: Vec<SVector<f64, N>>,
    claimed: SMatrix<f64, N, N>,
    distances: f64,
    within: usize,
}

impl<const N: usize> Calibration<N> {
    /// No runs yet.
    pub fn new() -> Self {
        Self {
            errors: Vec::new(),
            claimed: SMatrix::zeros(),
            distances: 0.0,
            within: 0,
        }
    }

    /// Adds one run: the error of the estimate, and the covariance it came with.
    pub fn push(&mut self, error: SVector<f64, N>, covariance: &SMatrix<f64, N, N>) {
        let root = covariance.cholesky().expect("a covariance is positive definite");
        self.distances += error.dot(&root.solve(&error));
        self.within += (0..N)
            .filter(|&i| error[i].abs() <= 1.959_964 * covariance[(i, i)].sqrt())
            .count();
        self.claimed += covariance;
        self.errors.push(error);
    }

    fn runs(&self) -> f64 {
        self.errors.len() as f64
    }

    /// Mean error of each unknown, in units of the standard error of that mean.
    pub fn bias(&self) -> SVector<f64, N> {
        let sum: SVector<f64, N> = self.errors.iter().sum();
        SVector::from_fn(|i, _| sum[i] / (self.claimed[(i, i)]).sqrt())
    }

    /// Root mean square error of each unknown over the sigma claimed.
    pub fn ratio(&self) -> SVector<f64, N> {
        let squares = self
            .errors
            .iter()
            .fold(SVector::<f64, N>::zeros(), |sum, e| sum + e.component_mul(e));
        SVector::from_fn(|i, _| (squares[i] / self.claimed[(i, i)]).sqrt())
    }

    /// Mean squared Mahalanobis distance over the number of unknowns: one where the whole covariance is right.
    pub fn distance(&self) -> f64 {
        self.distances / self.runs() / N as f64
    }

    /// Share of 95 % intervals that hold the truth.
    pub fn coverage(&self) -> f64 {
        self.within as f64 / self.runs() / N as f64
    }

    /// Fails unless bias, error and covariance are what was claimed, to what chance allows in this many runs: five
    /// sigma, so that a test of fifty figures fails by chance once in thirty thousand seeds.
    pub fn check(&self, what: &str, seed: u64) {
        self.check_errors(what, seed);
        let spread = 5.0 * (2.0 / (self.runs() * N as f64)).sqrt();
        assert!(
            (self.distance() - 1.0).abs() < spread,
            "{what}, seed {seed}: squared distance {} expected 1 within {spread}",
            self.distance()
        );
    }

    /// The same as [`Self::check`], without the correlations; for a covariance that is itself estimated.
    pub fn check_errors(&self, what: &str, seed: u64) {
        let (bias, ratio) = (self.bias(), self.ratio());
        println!(
            "{what}, seed {seed}: {} runs, bias {:.2} sigma at most, RMSE / sigma {:.3} to {:.3}, \
             squared distance {:.3}, coverage {:.3}",
            self.errors.len(),
            bias.amax(),
            ratio.min(),
            ratio.max(),
            self.distance(),
            self.coverage()
        );
        assert!(bias.amax() < 5.0, "{what}, seed {seed}: biased by {bias:?} sigma");
        let scatter = 5.0 / (2.0 * self.runs()).sqrt();
        assert!(
            ratio.iter().all(|r| (r - 1.0).abs() < scatter),
            "{what}, seed {seed}: RMSE over sigma {ratio:?}, expected 1 within {scatter}"
        );
    }
}

/// Samples of bias instability B = 1: white noise through the filter `(1 - z^-1)^(-1/2)`, whose spectrum over one
/// sample is `1 / (2 pi f)` below a tenth of the rate, whatever the rate.
///
/// Kasdin, "Discrete simulation of colored noise and stochastic processes and 1/f^alpha power law noise generation"
/// (1995), eq. 104. The first samples remember nothing: callers leave them out.
pub fn flicker(draws: &mut Draws, count: usize) -> Vec<f64> {
    let mut response = vec![1.0; count];
    for k in 1..count {
        response[k] = response[k - 1] * (k as f64 - 0.5) / k as f64;
    }
    response.reverse();
    let white: Vec<f64> = (0..count).map(|_| draws.normal()).collect();
    (0..count)
        .map(|n| {
            white[..=n]
                .iter()
                .zip(&response[count - 1 - n..])
                .map(|(w, h)| w * h)
                .sum()
        })
        .collect()
}

/// Draws from a normal distribution of any covariance, given as a function of two indices.
pub struct Correlated {
    root: Vec<Vec<f64>>,
}

impl Correlated {
    /// Cholesky, row by row. A direction without any variance, such as the mean of flicker over a whole session, stays
    /// without.
    pub fn new(count: usize, covariance: impl Fn(usize, usize) -> f64) -> Self {
        let mut root: Vec<Vec<f64>> = Vec::with_capacity(count);
        for i in 0..count {
            let mut row = vec![0.0; i + 1];
            for j in 0..=i {
                let before: f64 = (0..j)
                    .map(|k| row[k] * if j == i { row[k] } else { root[j][k] })
                    .sum();
                let left = covariance(i, j) - before;
                row[j] = if i == j {
                    left.max(0.0).sqrt()
                } else if root[j][j] > 1e-7 * covariance(i, i).sqrt() {
                    left / root[j][j]
                } else {
                    0.0
                };
            }
            root.push(row);
        }
        Self { root }
    }

    /// One draw.
    pub fn draw(&self, draws: &mut Draws) -> Vec<f64> {
        let white: Vec<f64> = self.root.iter().map(|_| draws.normal()).collect();
        self.root
            .iter()
            .map(|row| row.iter().zip(&white).map(|(a, b)| a * b).sum())
            .collect()
    }
}
