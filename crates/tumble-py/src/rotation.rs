//! Rotations of three axes.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::convert::{array1, array2, matrix};

/// Rotation vector of a rotation matrix (3, 3), rad.
#[pyfunction]
fn rotation_vector(py: Python<'_>, rotation: PyReadonlyArray2<'_, f64>) -> PyResult<Py<PyArray1<f64>>> {
    let rotation = Rotation3::from_matrix_unchecked(matrix(&rotation, "rotation")?);
    Ok(array1(
        py,
        &UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis(),
    ))
}

/// Rotation matrix (3, 3) of a rotation vector in rad.
#[pyfunction]
fn rotation_matrix(py: Python<'_>, vector: [f64; 3]) -> Py<PyArray2<f64>> {
    array2(py, Rotation3::new(Vector3::from(vector)).matrix())
}

/// Matrix (3, 3) that leads from a small turn on the left of a rotation to the change of its vector.
#[pyfunction]
fn inverse_left_jacobian(py: Python<'_>, vector: [f64; 3]) -> Py<PyArray2<f64>> {
    array2(
        py,
        &tumble_core::rotation::inverse_left_jacobian(&Vector3::from(vector)),
    )
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(rotation_vector, module)?)?;
    module.add_function(wrap_pyfunction!(rotation_matrix, module)?)?;
    module.add_function(wrap_pyfunction!(inverse_left_jacobian, module)?)
}
