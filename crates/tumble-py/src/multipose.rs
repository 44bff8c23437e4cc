//! Calibration without equipment: samples of one unit in, both triads out.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::multipose::accelerometer::PLACES;
use tumble_lab::multipose::{
    Gyroscope, Multipose, MultiposeError, MultiposeSettings, Pose, UnitSamples, multipose,
};

use crate::acquisition::PyAcquired;
use crate::convert::{array1, rows, stacked};
use crate::turntable::{CoreError, triad};

/// Calibrates a unit from finite samples in order of time: time (n,) s, accelerometer (n, 3) m/s^2, gyroscope (n, 3) rad/s,
/// or both in counts where `raw`. Latitude in rad.
#[pyfunction]
#[pyo3(signature = (time, force, rate, gravity, *, gyroscope=true, g_sensitivity=false, latitude=None, raw=false,
    shortest_rest=1.0))]
#[allow(clippy::too_many_arguments)]
fn multipose_of<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    force: PyReadonlyArray2<'py, f64>,
    rate: PyReadonlyArray2<'py, f64>,
    gravity: f64,
    gyroscope: bool,
    g_sensitivity: bool,
    latitude: Option<f64>,
    raw: bool,
    shortest_rest: f64,
) -> PyResult<Bound<'py, PyDict>> {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let settings = MultiposeSettings {
        gravity,
        latitude,
        g_sensitivity,
        gyroscope,
        raw,
        shortest_rest: (shortest_rest * 1e6) as u64,
    };
    let samples = UnitSamples {
        time: time.as_slice()?,
        force: rows(&force, "accelerometer")?,
        rate: rows(&rate, "gyroscope")?,
    };
    if samples.time.len() != samples.force.len() || samples.time.len() != samples.rate.len() {
        return Err(PyValueError::new_err(
            "time, accelerometer and gyroscope must have the same length",
        ));
    }
    let found = py.detach(|| multipose(&samples, &settings));
    let found = found.map_err(|error| refusal(py, &error))?;
    figures(py, found)
}

fn figures(py: Python<'_>, found: Multipose) -> PyResult<Bound<'_, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("tolerance", found.tolerance)?;
    let nominal = found.nominal.map(|scale| (scale.force, scale.rate));
    figures.set_item("nominal_scale", nominal)?;
    figures.set_item("accelerometer", triad(py, &found.accelerometer)?)?;
    figures.set_item("poses", poses(py, &found.poses)?)?;
    match &found.next {
        Some(next) => {
            let figures_of_next = PyDict::new(py);
            figures_of_next.set_item("up", array1(py, &next.up))?;
            figures_of_next.set_item("before", next.before)?;
            figures_of_next.set_item("after", next.after)?;
            figures_of_next.set_item("unknown", PLACES[next.unknown])?;
            figures.set_item("next", figures_of_next)?;
        }
        None => figures.set_item("next", py.None())?,
    }
    match &found.gyroscope {
        Ok(gyroscope) => {
            figures.set_item("gyroscope", gyroscope_figures(py, gyroscope)?)?;
            figures.set_item("gyroscope_refusal", py.None())?;
        }
        Err(error) => {
            figures.set_item("gyroscope", py.None())?;
            figures.set_item("gyroscope_refusal", (error.name(), refusal_figures(py, error)?))?;
        }
    }
    figures.set_item(
        "acquired",
        Py::new(
            py,
            PyAcquired {
                inner: found.acquired,
            },
        )?,
    )?;
    Ok(figures)
}

fn poses<'py>(py: Python<'py>, poses: &[Pose]) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    let each = |value: fn(&Pose) -> f64| poses.iter().map(value).collect::<Vec<f64>>();
    figures.set_item("force", stacked(py, poses.iter().map(|pose| pose.force)))?;
    figures.set_item("before", each(|pose| pose.before))?;
    figures.set_item("after", each(|pose| pose.after))?;
    figures.set_item("sigma", each(|pose| pose.sigma))?;
    figures.set_item("weight", each(|pose| pose.weight))?;
    figures.set_item("leverage", each(|pose| pose.influence.leverage))?;
    figures.set_item("influence", each(|pose| pose.influence.change))?;
    figures.set_item("held_out", each(|pose| pose.held_out.unwrap_or(f64::NAN)))?;
    let directions: Vec<usize> = poses.iter().map(|pose| pose.direction).collect();
    figures.set_item("direction", directions)?;
    Ok(figures)
}

fn gyroscope_figures<'py>(py: Python<'py>, gyroscope: &Gyroscope) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("calibration", triad(py, &gyroscope.calibration)?)?;
    figures.set_item("turns", &gyroscope.turns)?;
    let (before, after): (Vec<f64>, Vec<f64>) = gyroscope.angles.iter().copied().unzip();
    figures.set_item("angles_before", before)?;
    figures.set_item("angles_after", after)?;
    figures.set_item("with_g_sensitivity", gyroscope.with_g_sensitivity)?;
    figures.set_item("turn_excess", gyroscope.excess.turn.sqrt())?;
    figures.set_item("bias_excess", gyroscope.excess.rest.sqrt())?;
    Ok(figures)
}

fn refusal(py: Python<'_>, error: &MultiposeError) -> PyErr {
    match refusal_figures(py, error) {
        Ok(figures) => CoreError::new_err((error.name(), figures.unbind())),
        Err(failure) => failure,
    }
}

fn refusal_figures<'py>(py: Python<'py>, error: &MultiposeError) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    match *error {
        MultiposeError::TooFewDirections { found, needed, rests } => {
            figures.set_item("found", found)?;
            figures.set_item("needed", needed)?;
            figures.set_item("rests", rests)?;
        }
        MultiposeError::PosesLeaveOpen { shares } | MultiposeError::TurnsLeaveOpen { shares } => {
            figures.set_item("shares", shares.to_vec())?;
        }
        MultiposeError::GyroscopeContradicts { angle } => figures.set_item("angle", angle)?,
        MultiposeError::NoRests
        | MultiposeError::NoTurns
        | MultiposeError::LeftHandedGyroscope
        | MultiposeError::AxesCoincide
        | MultiposeError::Unsolvable => {}
    }
    Ok(figures)
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(multipose_of, module)?)
}
