//! Eigenvalues and eigenvectors of symmetric matrices.

use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use tumble_core::eigen::symmetric;
use tumble_core::real::Real;

use crate::common::{assert_close, cast, double, rounding};

type Six<T> = SMatrix<T, 6, 6>;

fn sorted(mut values: SVector<f64, 6>) -> SVector<f64, 6> {
    values.as_mut_slice().sort_by(f64::total_cmp);
    values
}

/// Sixteen sweeps of fifteen rotations, each orthogonal to one rounding; where eigenvalues vanish, what turns in the
/// last sweeps is noise, but it turns.
const ROUNDINGS: f64 = 240.0;

fn takes_apart<T: Real>(a: &Six<f64>) -> Result<(), TestCaseError> {
    let a = cast::<T, 6, 6>(a);
    let (values, vectors) = symmetric(a);
    let tolerance = rounding::<T>(ROUNDINGS) * double(a.norm());
    let expected = sorted(a.map(double).symmetric_eigenvalues());
    assert_close!(sorted(values.map(double)), expected, tolerance);
    assert_close!(
        vectors.transpose() * vectors,
        Six::<T>::identity(),
        rounding::<T>(ROUNDINGS)
    );
    assert_close!(a * vectors, vectors * Six::from_diagonal(&values), tolerance);
    Ok(())
}

proptest! {
    #[test]
    fn eigenvalues_and_eigenvectors_agree_with_a_general_solver(
        entries in prop::collection::vec(-10.0..10.0_f64, 36), scale in -8..8_i32
    ) {
        let half = Six::<f64>::from_column_slice(&entries) * 10_f64.powi(scale);
        takes_apart::<f64>(&(half + half.transpose()))?;
        takes_apart::<f32>(&(half + half.transpose()))?;
    }

    #[test]
    fn directions_that_are_missing_have_eigenvalue_zero(entries in prop::collection::vec(-10.0..10.0_f64, 36), rank in 0..6_usize) {
        let half = Six::<f64>::from_fn(|i, j| if j < rank { entries[6 * i + j] } else { 0.0 });
        let a = half * half.transpose();
        takes_apart::<f64>(&a)?;
        takes_apart::<f32>(&a)?;
        let (values, _) = symmetric(a);
        let zeros = values.iter().filter(|value| value.abs() <= rounding::<f64>(ROUNDINGS) * a.norm()).count();
        prop_assert!(zeros >= 6 - rank);
    }

    #[test]
    fn nearly_diagonal_matrices_keep_their_small_eigenvalues(values in prop::array::uniform6(-8..8_i32), off in -1e-9..1e-9_f64) {
        let a = Six::<f64>::from_fn(|i, j| if i == j { 10_f64.powi(values[i]) } else { off * 10_f64.powi((values[i] + values[j]) / 2) });
        takes_apart::<f64>(&((a + a.transpose()) * 0.5))?;
    }

    #[test]
    fn eigenvalues_of_a_diagonal_matrix_are_its_diagonal(values in prop::array::uniform6(-1e6..1e6_f64)) {
        let values = SVector::from(values);
        prop_assert_eq!(symmetric(Six::<f64>::from_diagonal(&values)), (values, Six::identity()));
    }
}

#[test]
fn a_matrix_that_is_not_finite_ends_and_gives_no_number() {
    let (values, _) = symmetric(Six::<f64>::from_element(f64::NAN));
    assert!(values.iter().all(|value| value.is_nan()));
}
