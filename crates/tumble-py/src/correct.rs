//! Correction of arrays.

use nalgebra::Vector3;
use numpy::{
    PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tumble_core::model::ErrorModel;
use tumble_core::temperature::{Coefficients, HIGHEST_ORDER, TemperatureDrift};

use crate::convert::{matrix, rows};

/// `temperature_drift` of a triad, as its calibration file has it.
#[derive(FromPyObject)]
pub(crate) struct DriftSection {
    #[pyo3(item)]
    reference: f64,
    #[pyo3(item)]
    range: [f64; 2],
    #[pyo3(item)]
    bias: Vec<[f64; 3]>,
    #[pyo3(item)]
    scale: Vec<[f64; 3]>,
}

impl DriftSection {
    pub(crate) fn in_core(&self) -> PyResult<TemperatureDrift<f64>> {
        Ok(TemperatureDrift {
            reference: self.reference,
            range: self.range,
            bias: coefficients(&self.bias)?,
            scale: coefficients(&self.scale)?,
        })
    }
}

fn coefficients(rows: &[[f64; 3]]) -> PyResult<Coefficients<f64>> {
    if rows.len() > HIGHEST_ORDER {
        return Err(PyValueError::new_err(format!(
            "no more than {HIGHEST_ORDER} powers"
        )));
    }
    let mut powers = Coefficients::default();
    for (power, row) in powers.iter_mut().zip(rows) {
        *power = Vector3::from(*row);
    }
    Ok(powers)
}

/// Corrects readings (n, 3) of a triad of that bias, at temperatures (n,), degC, to the reference temperature of the
/// drift.
#[pyfunction]
fn at_reference<'py>(
    py: Python<'py>,
    y: PyReadonlyArray2<'py, f64>,
    bias: [f64; 3],
    temperature: PyReadonlyArray1<'py, f64>,
    drift: DriftSection,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (readings, temperature) = (rows(&y, "y")?, temperature.as_slice()?);
    if readings.len() != temperature.len() {
        return Err(PyValueError::new_err(
            "y and temperature must have the same length",
        ));
    }
    let (drift, bias) = (drift.in_core()?, Vector3::from(bias));
    let mut found = readings.to_vec();
    py.detach(|| tumble_lab::correct::at_reference(&drift, &bias, temperature, &mut found));
    numpy::PyArray1::from_vec(py, found.into_flattened()).reshape([readings.len(), 3])
}

/// `M^-1 (y - b)` for y of shape (n, 3), into `out` where given.
#[pyfunction]
#[pyo3(signature = (y, matrix_m, bias, out=None))]
fn correct<'py>(
    py: Python<'py>,
    y: PyReadonlyArray2<'py, f64>,
    matrix_m: PyReadonlyArray2<'py, f64>,
    bias: PyReadonlyArray1<'py, f64>,
    out: Option<Bound<'py, PyArray2<f64>>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let n = rows(&y, "y")?.len();
    let &[x, y_axis, z] = bias.as_slice()? else {
        return Err(PyValueError::new_err("bias must have shape (3,)"));
    };
    let model = ErrorModel {
        matrix: matrix(&matrix_m, "matrix")?,
        bias: Vector3::new(x, y_axis, z),
    };
    // Zeroed pages are mapped lazily, so a fresh array costs no more than the writing does.
    let out = out.unwrap_or_else(|| PyArray2::zeros(py, [n, 3], false));
    if out.shape() != [n, 3] {
        return Err(PyValueError::new_err("out must have the shape of y"));
    }
    {
        let mut target: PyReadwriteArray2<'_, f64> = out
            .try_readwrite()
            .map_err(|_| PyValueError::new_err("out is in use or read-only; it must not be y"))?;
        let (y, u) = (y.as_slice()?, target.as_slice_mut()?);
        py.detach(|| tumble_lab::correct::correct(&model, y, u))
            .map_err(|_| PyValueError::new_err("matrix M has no inverse"))?;
    }
    Ok(out)
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(at_reference, module)?)?;
    module.add_function(wrap_pyfunction!(correct, module)?)
}
