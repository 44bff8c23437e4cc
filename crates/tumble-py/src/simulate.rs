//! Recordings with known truth: a scenario as text in, arrays out.
//!
//! A scenario of `tumble-lab` describes itself to serde and comes as one text in JSON. `pythonize` would spare the text, but
//! is not made for this version of PyO3; `serde-pyobject`, which is, panics on what it does not know and takes no seed
//! above 2^63.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::de::DeserializeOwned;
use tumble_core::grade::Grade as CoreGrade;
use tumble_lab::simulate::fault::RecordedSamples;
use tumble_lab::simulate::grade::SensorGrade;
use tumble_lab::simulate::sensor::TriadErrors;
use tumble_lab::simulate::turntable::{SimulatedTurntable, simulate};
use tumble_lab::simulate::unit::UnitRecord;

use crate::convert::{array1, array2, stacked};

/// A scenario from its text; a `ValueError` in one line names what is wrong and where.
pub(crate) fn scenario<T: DeserializeOwned>(text: &str) -> PyResult<T> {
    let refused = |error: &dyn core::fmt::Display| PyValueError::new_err(error.to_string());
    // Read to a tree first: where in a text that nobody sees something stands, is of no use.
    let tree: serde_json::Value = serde_json::from_str(text).map_err(|error| refused(&error))?;
    serde_path_to_error::deserialize(tree).map_err(|error| refused(&error))
}

/// Plays a `TurntableScenario` in JSON, SI units and rad. With `fields`, (3,) of the level frame for each unit, each has that
/// field as its case sees it at its samples.
#[pyfunction]
#[pyo3(signature = (text, fields=None))]
fn simulate_turntable(py: Python<'_>, text: &str, fields: Option<Vec<[f64; 3]>>) -> PyResult<Py<PyDict>> {
    let scenario = scenario(text)?;
    let session = py
        .detach(|| simulate(&scenario))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let result = PyDict::new(py);
    result.set_item("case_from_table", array2(py, session.case_from_table.matrix()))?;
    result.set_item("mounting", array1(py, &session.mounting()))?;
    result.set_item("earth_rate", array1(py, &session.motion.earth_rate()))?;
    result.set_item("duration", session.motion.duration())?;
    result.set_item("rests", rests(py, &session)?)?;
    if let Some(fields) = fields {
        let records = core::iter::once(&session.reference).chain(&session.targets);
        let seen = records.zip(&fields).map(|(record, field)| {
            let (clock, field) = (record.truth.clock, Vector3::from(*field));
            let own = |time: &f64| (time - clock.offset) / (1.0 + clock.skew);
            let times = record.samples.time.iter().map(own);
            stacked(py, times.map(|time| session.motion.in_case(time, &field)))
        });
        result.set_item("fields", seen.collect::<Vec<_>>())?;
    }
    result.set_item("reference", unit(py, session.reference)?)?;
    let targets: PyResult<Vec<_>> = session
        .targets
        .into_iter()
        .map(|record| unit(py, record))
        .collect();
    result.set_item("targets", targets?)?;
    Ok(result.unbind())
}

fn rests<'py>(py: Python<'py>, session: &SimulatedTurntable) -> PyResult<Bound<'py, PyDict>> {
    let rests = session.motion.rests();
    let truths: Vec<_> = rests
        .iter()
        .map(|rest| session.motion.at_rest(&rest.level_from_table))
        .collect();
    let figures = PyDict::new(py);
    let poses: Vec<usize> = rests.iter().map(|rest| rest.pose).collect();
    figures.set_item("pose", poses)?;
    figures.set_item(
        "start",
        PyArray1::from_iter(py, rests.iter().map(|rest| rest.start)),
    )?;
    figures.set_item("end", PyArray1::from_iter(py, rests.iter().map(|rest| rest.end)))?;
    let errors = rests.iter().map(|rest| rest.table_error_vector());
    figures.set_item("table_error", stacked(py, errors))?;
    let forces = truths.iter().map(|truth| truth.specific_force);
    figures.set_item("specific_force", stacked(py, forces))?;
    let rates = truths.iter().map(|truth| truth.angular_rate);
    figures.set_item("angular_rate", stacked(py, rates))?;
    Ok(figures)
}

pub(crate) fn unit(py: Python<'_>, record: UnitRecord) -> PyResult<Bound<'_, PyDict>> {
    let UnitRecord { samples, truth } = record;
    let figures = PyDict::new(py);
    let RecordedSamples {
        time,
        arrival,
        accelerometer,
        gyroscope,
        temperature,
    } = samples;
    figures.set_item("time", PyArray1::from_vec(py, time))?;
    figures.set_item("arrival", PyArray1::from_vec(py, arrival))?;
    figures.set_item("accelerometer", table(py, accelerometer)?)?;
    figures.set_item("gyroscope", table(py, gyroscope)?)?;
    figures.set_item("temperature", PyArray1::from_vec(py, temperature))?;
    let drift = &truth.accelerometer_drift;
    figures.set_item("accelerometer_truth", triad(py, &truth.accelerometer, drift)?)?;
    let drift = &truth.gyroscope_drift;
    figures.set_item("gyroscope_truth", triad(py, &truth.gyroscope, drift)?)?;
    let [accelerometer, gyroscope] = truth.ageing.map(|bias| array1(py, &bias));
    figures.set_item("ageing", (accelerometer, gyroscope))?;
    let package = array2(py, truth.package_from_case.matrix());
    figures.set_item("package_from_case", package)?;
    let clock = truth.clock;
    figures.set_item("clock", (clock.offset, clock.skew, clock.phase))?;
    Ok(figures)
}

fn table(py: Python<'_>, rows: Vec<[f64; 3]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, 3])
}

fn triad<'py>(py: Python<'py>, triad: &TriadErrors, drift: &Vector3<f64>) -> PyResult<Bound<'py, PyDict>> {
    let parts = triad
        .model
        .decompose()
        .map_err(|error| PyValueError::new_err(format!("the axes drawn do not make a triad: {error:?}")))?;
    let figures = PyDict::new(py);
    figures.set_item("M", array2(py, &triad.model.matrix))?;
    figures.set_item("b", array1(py, &triad.model.bias))?;
    figures.set_item("scale", array1(py, &parts.scale))?;
    figures.set_item("L", array2(py, &parts.non_orthogonality))?;
    figures.set_item("Q", array2(py, parts.mounting.matrix()))?;
    let angles = parts.parameters(&triad.model.bias);
    figures.set_item("non_orthogonality", array1(py, &angles.non_orthogonality))?;
    figures.set_item("mounting", array1(py, &angles.mounting))?;
    figures.set_item("g_sensitivity", array2(py, &triad.g_sensitivity))?;
    figures.set_item("drift", array1(py, drift))?;
    let coefficient = array1(py, &triad.temperature_coefficient);
    figures.set_item("temperature_coefficient", coefficient)?;
    figures.set_item("noise_density", triad.noise_density)?;
    figures.set_item("bias_instability", triad.bias_instability)?;
    figures.set_item("quantisation", triad.quantisation)?;
    Ok(figures)
}

/// Names of the grades there are.
#[pyfunction]
fn sensor_grades() -> Vec<&'static str> {
    CoreGrade::NAMES.to_vec()
}

/// Figures of a grade by its name, in JSON, SI units and rad.
#[pyfunction]
fn sensor_grade(name: &str) -> PyResult<String> {
    let grade =
        SensorGrade::named(name).ok_or_else(|| PyValueError::new_err(format!("unknown grade {name:?}")))?;
    serde_json::to_string(&grade).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(simulate_turntable, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_grades, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_grade, module)?)
}
