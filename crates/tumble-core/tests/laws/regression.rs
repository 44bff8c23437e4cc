//! Weighted least squares with a prior.

use nalgebra::{SMatrix, SVector, Vector3};
use proptest::prelude::*;
use tumble_core::real::Real;
use tumble_core::regression::{LeastSquares, Prior, Solution, Unsolvable, degrees_of_freedom, reduced};

use crate::common::{Calibration, Draws, assert_close, cast, double, rounding};

const N: usize = 4;

type Row = (SVector<f64, N>, f64, f64);
type Rows = Vec<Row>;

/// Rows `(a, y, variance)`.
fn rows(count: core::ops::Range<usize>) -> impl Strategy<Value = Rows> {
    rows_of(count, 0.01)
}

fn rows_of(count: core::ops::Range<usize>, least_variance: f64) -> impl Strategy<Value = Rows> {
    let row = (
        prop::array::uniform4(-3.0..3.0_f64),
        -5.0..5.0_f64,
        least_variance..4.0_f64,
    );
    prop::collection::vec(
        row.prop_map(|(a, y, variance)| (SVector::from(a), y, variance)),
        count,
    )
}

fn prior<T: Real>(sigma: f64) -> Prior<T, N> {
    // Not diagonal: what is known of the shared errors of a reference is not, either.
    let mixed = SMatrix::<f64, N, N>::from_fn(|i, j| if i == j { 1.0 } else { 0.2 });
    Prior {
        mean: cast(&SVector::from([0.5, -0.5, 1.0, 0.0])),
        covariance: cast(&(mixed * sigma * sigma)),
    }
}

fn equations<T: Real>(prior: &Prior<T, N>, rows: &Rows) -> LeastSquares<T, N> {
    let mut equations = LeastSquares::new(prior);
    for (a, y, variance) in rows {
        equations.push(&cast(a), nalgebra::convert(*y), nalgebra::convert(*variance));
    }
    equations
}

fn solved<T: Real>(prior: &Prior<T, N>, rows: &Rows) -> Result<Solution<T, N>, Unsolvable> {
    equations(prior, rows).solve()
}

/// `x = (P^-1 + A^T W A)^-1 (P^-1 mean + A^T W y)`, as the textbooks have it, and the chi-square of the data at x.
fn textbook(prior: &Prior<f64, N>, rows: &Rows) -> (SVector<f64, N>, SMatrix<f64, N, N>, f64) {
    let inverse = |m: SMatrix<f64, N, N>| m.lu().try_inverse().expect("regular");
    let belief = inverse(prior.covariance);
    let (mut information, mut vector) = (belief, belief * prior.mean);
    for (a, y, variance) in rows {
        information += a * a.transpose() / *variance;
        vector += a * (y / variance);
    }
    let covariance = inverse(information);
    let x = covariance * vector;
    let chi_square = rows
        .iter()
        .map(|(a, y, variance)| (y - a.dot(&x)).powi(2) / variance)
        .sum();
    (x, covariance, chi_square)
}

fn agrees<T: Real>(sigma: f64, rows: &Rows) -> Result<(), TestCaseError> {
    let (x, covariance, chi_square) = textbook(&prior(sigma), rows);
    let found = solved::<T>(&prior(sigma), rows).map_err(|_| TestCaseError::fail("unsolvable"))?;
    // Rounding of the rows themselves moves the solution by the condition of the information (Golub and Van Loan,
    // section 5.3.7), which is that of the data over that of the prior, one in its own units.
    let weight: f64 = rows
        .iter()
        .map(|(a, _, variance)| a.norm_squared() / variance)
        .sum();
    let condition = 1.0 + 2.0 * sigma * sigma * weight;
    let tolerance = rounding::<T>(20.0) * condition;
    let size = x.amax() + 5.0;
    assert_close!(found.x, cast::<T, N, 1>(&x), tolerance * size);
    assert_close!(
        found.covariance,
        cast::<T, N, N>(&covariance),
        tolerance * 2.0 * sigma * sigma
    );
    // A difference of two sums of squares: it cannot be better than rounding of the larger.
    let squares: f64 = rows
        .iter()
        .map(|(a, y, variance)| (y - a.dot(&prior::<f64>(sigma).mean)).powi(2) / variance)
        .sum();
    prop_assert!(
        (double(found.chi_square) - chi_square).abs()
            <= tolerance * size * size + rounding::<T>(20.0) * squares
    );
    prop_assert_eq!(found.rows as usize, rows.len());
    Ok(())
}

proptest! {
    #[test]
    fn the_solution_is_that_of_the_textbook(sigma in 0.1..30.0_f64, rows in rows(0..30)) {
        agrees::<f64>(sigma, &rows)?;
    }

    #[test]
    fn the_solution_in_single_precision_is_that_of_the_textbook(sigma in 0.1..1.0_f64, rows in rows_of(0..30, 1.0)) {
        agrees::<f32>(sigma, &rows)?;
    }

    #[test]
    fn single_precision_resolves_an_unknown_ten_million_times_finer(
        x in -20.0..20.0_f64, known in 0..N
    ) {
        let prior = Prior { covariance: SMatrix::identity() * 400.0, ..prior::<f32>(1.0) };
        let rows: Rows = vec![(SVector::ith(known, 1.0), x, 1e-12); 4];
        let found = solved(&prior, &rows).map_err(|_| TestCaseError::fail("unsolvable"))?;
        prop_assert!((double(found.x[known]) - x).abs() <= rounding::<f32>(4.0) * 20.0);
        prop_assert!((double(found.covariance[(known, known)]) / 2.5e-13 - 1.0).abs() < rounding::<f32>(20.0));
        prop_assert_eq!(equations(&prior, &rows).rank(), Ok(1));
        for i in (0..N).filter(|i| *i != known) {
            prop_assert_eq!(found.x[i], prior.mean[i]);
            prop_assert_eq!(found.ignorance[i], 1.0);
        }
    }

    #[test]
    fn exact_rows_under_a_weak_prior_give_back_the_unknowns(x in prop::array::uniform4(-2.0..2.0_f64), rows in rows(12..30)) {
        let x = SVector::from(x);
        let exact: Rows = rows.iter().map(|(a, _, _)| (*a, a.dot(&x), 1e-10)).collect();
        let data: SMatrix<f64, N, N> = rows.iter().map(|(a, _, _)| a * a.transpose()).sum();
        prop_assume!(data.symmetric_eigenvalues().min() > 1.0);
        let found = solved(&prior::<f64>(10.0), &exact).expect("solvable");
        // The prior pulls by its information over that of the data, 1e-10 / 100.
        assert_close!(found.x, x, 1e-10);
        prop_assert_eq!(equations(&prior::<f64>(10.0), &exact).rank(), Ok(N));
        prop_assert!((0..N).all(|i| found.observed(i)));
    }

    #[test]
    fn a_direction_without_rows_keeps_its_prior_and_is_unobserved(rows in rows(0..30), silent in 0..N) {
        let mut rows = rows;
        rows.iter_mut().for_each(|(a, _, _)| a[silent] = 0.0);
        let diagonal = Prior { covariance: SMatrix::identity() * 9.0, ..prior::<f64>(1.0) };
        let found = solved(&diagonal, &rows).expect("solvable");
        prop_assert_eq!(found.x[silent], diagonal.mean[silent]);
        prop_assert!((found.covariance[(silent, silent)] - 9.0).abs() < 1e-12);
        prop_assert!((found.ignorance[silent] - 1.0).abs() < 1e-12);
        prop_assert!(!found.observed(silent));
        prop_assert!(equations(&diagonal, &rows).rank().expect("solvable") < N);
    }

    #[test]
    fn rank_counts_the_directions_that_strong_rows_span(strong in 0..=N, repeats in 1..4_u32, seed in any::<u64>()) {
        let mut draws = Draws::new(seed);
        let span: Vec<SVector<f64, N>> = (0..strong).map(|_| draws.normals()).collect();
        let basis = SMatrix::<f64, N, N>::from_fn(|i, j| span.get(j).map_or(0.0, |a| a[i]));
        let smallest = (basis.transpose() * basis).fixed_view::<N, N>(0, 0).symmetric_eigenvalues();
        prop_assume!(smallest.iter().filter(|value| **value > 1e-3).count() == strong);
        let rows: Rows = (0..repeats).flat_map(|_| span.iter().map(|a| (*a, 1.0, 1e-6))).collect();
        prop_assert_eq!(equations(&prior::<f64>(1.0), &rows).rank(), Ok(strong));
        prop_assert_eq!(equations(&prior::<f32>(1.0), &rows).rank(), Ok(strong));
    }

    #[test]
    fn a_row_not_finite_or_a_weight_not_positive_is_unsolvable(rows in rows(1..10), place in 0..N) {
        let broken = |change: &dyn Fn(&mut Row)| {
            let mut rows = rows.clone();
            change(&mut rows[0]);
            solved(&prior::<f64>(1.0), &rows)
        };
        prop_assert_eq!(broken(&|row| row.0[place] = f64::NAN), Err(Unsolvable));
        prop_assert_eq!(broken(&|row| row.1 = f64::NAN), Err(Unsolvable));
        prop_assert_eq!(broken(&|row| row.1 = f64::INFINITY), Err(Unsolvable));
        prop_assert_eq!(broken(&|row| row.2 = f64::NAN), Err(Unsolvable));
        prop_assert_eq!(broken(&|row| row.2 = 0.0), Err(Unsolvable));
        prop_assert_eq!(broken(&|row| row.2 = -0.1), Err(Unsolvable));
    }
}

#[test]
fn the_prior_alone_is_its_own_solution() {
    let prior = prior::<f64>(2.0);
    let believed = LeastSquares::new(&prior);
    let found = believed.solve().expect("a prior");
    assert_eq!(found.x, prior.mean);
    assert!((found.covariance - prior.covariance).amax() < 1e-14);
    assert_eq!((believed.rank(), found.rows, found.chi_square), (Ok(0), 0, 0.0));
    assert!((0..N).all(|i| !found.observed(i)));
}

#[test]
fn an_unknown_that_does_not_exist_is_not_observed() {
    let found = LeastSquares::new(&prior::<f64>(2.0)).solve().expect("a prior");
    assert!(!found.observed(N));
}

#[test]
fn chi_square_of_rows_has_the_moments_of_its_distribution() {
    let mut draws = Draws::new(41);
    let truth = Vector3::new(0.3, -0.2, 1.5);
    let (count, runs) = (20_u32, 4000_u32);
    let weak = Prior {
        mean: Vector3::zeros(),
        covariance: SMatrix::<f64, 3, 3>::identity() * 1e4,
    };
    let mut calibration = Calibration::<3>::new();
    let chi_squares: Vec<f64> = (0..runs)
        .map(|_| {
            let mut equations = LeastSquares::new(&weak);
            for k in 0..count {
                let variance = 0.01 * f64::from(1 + k % 5);
                let a = draws.normals::<3>();
                equations.push(&a, a.dot(&truth) + variance.sqrt() * draws.normal(), variance);
            }
            let found = equations.solve().expect("solvable");
            calibration.push(found.x - truth, &found.covariance);
            found.chi_square
        })
        .collect();
    calibration.check("regression", draws.seed);
    let freedom = f64::from(degrees_of_freedom(count, 3));
    let n = f64::from(runs);
    let mean = chi_squares.iter().sum::<f64>() / n;
    let variance = chi_squares.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    // The variance of chi-square is 2 f; that of a sample variance of it (2 + 12 / f) (2 f)^2 / n.
    let seed = draws.seed;
    assert!(
        (mean - freedom).abs() < 5.0 * (2.0 * freedom / n).sqrt(),
        "seed {seed}: mean {mean}"
    );
    let bound = 5.0 * 2.0 * freedom * ((2.0 + 12.0 / freedom) / n).sqrt();
    assert!(
        (variance - 2.0 * freedom).abs() < bound,
        "seed {seed}: variance {variance}"
    );
}

#[test]
fn degrees_of_freedom_are_never_negative_and_reach_one() {
    assert_eq!(degrees_of_freedom(10, 4), 6);
    assert_eq!(degrees_of_freedom(3, 4), 0);
    assert_eq!(reduced(12.0_f64, 6), 2.0);
    assert_eq!(reduced(12.0_f64, 0), 1.0);
}
