//! Between numpy arrays and nalgebra.

use nalgebra::{Matrix3, SMatrix, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tumble_lab::simulate::time_span::TimeSpan;

/// Rows of three, borrowed from a contiguous (n, 3) array.
pub fn rows<'a>(array: &'a PyReadonlyArray2<'_, f64>, name: &str) -> PyResult<&'a [[f64; 3]]> {
    // Columns in a row are a slice as well, but not of rows.
    if !array.as_array().is_standard_layout() {
        return Err(PyValueError::new_err(format!("{name} must be C-contiguous")));
    }
    let flat = array.as_slice()?;
    let (rows, rest) = flat.as_chunks::<3>();
    if !rest.is_empty() || array.as_array().ncols() != 3 {
        return Err(PyValueError::new_err(format!("{name} must have shape (n, 3)")));
    }
    Ok(rows)
}

/// A (3, 3) array.
pub fn matrix(array: &PyReadonlyArray2<'_, f64>, name: &str) -> PyResult<Matrix3<f64>> {
    let rows = rows(array, name)?;
    match rows {
        [a, b, c] => Ok(Matrix3::from_rows(
            &[(*a).into(), (*b).into(), (*c).into()].map(|v: Vector3<f64>| v.transpose()),
        )),
        _ => Err(PyValueError::new_err(format!("{name} must have shape (3, 3)"))),
    }
}

/// A matrix as a numpy array.
pub fn array2<const R: usize, const C: usize>(py: Python<'_>, m: &SMatrix<f64, R, C>) -> Py<PyArray2<f64>> {
    let array = numpy::ndarray::Array2::from_shape_fn((R, C), |(i, j)| m[(i, j)]);
    PyArray2::from_owned_array(py, array).unbind()
}

/// A vector as a numpy array.
pub fn array1(py: Python<'_>, v: &Vector3<f64>) -> Py<PyArray1<f64>> {
    PyArray1::from_slice(py, v.as_slice()).unbind()
}

/// Vectors as an (n, 3) numpy array.
pub fn stacked(py: Python<'_>, vectors: impl Iterator<Item = Vector3<f64>>) -> Py<PyArray2<f64>> {
    let flat: Vec<f64> = vectors.flat_map(|v| [v.x, v.y, v.z]).collect();
    let array = PyArray1::from_vec(py, flat);
    let n = array.len().unwrap_or(0) / 3;
    array
        .reshape([n, 3])
        .map_or_else(|_| PyArray2::zeros(py, [0, 3], false).unbind(), Bound::unbind)
}

/// Spans as an (k, 2) numpy array of start and end, s.
pub fn spans<'py>(py: Python<'py>, spans: &[TimeSpan]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat: Vec<f64> = spans.iter().flat_map(|span| [span.start, span.end]).collect();
    PyArray1::from_vec(py, flat).reshape([spans.len(), 2])
}
