//! Spins with known truth: a scenario as text in, arrays out.

use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::simulate::spin::simulate;
use tumble_lab::simulate::time_span::TimeSpan;
use tumble_lab::simulate::trajectory::Trajectory;

use crate::convert::{array1, spans};
use crate::simulate::{scenario, unit};

/// Plays a `SpinScenario` in JSON, SI units and rad.
#[pyfunction]
fn simulate_spin(py: Python<'_>, text: &str) -> PyResult<Py<PyDict>> {
    let scenario = scenario(text)?;
    let spin = py
        .detach(|| simulate(&scenario))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let (motion, time) = (&spin.motion, spin.unit.samples.time.clone());
    let result = PyDict::new(py);
    result.set_item("unit", unit(py, spin.unit)?)?;
    result.set_item("duration", motion.duration())?;
    result.set_item("up", array1(py, &spin.up))?;
    let (roll, pitch) = spin.roll_pitch;
    result.set_item("roll", roll)?;
    result.set_item("pitch", pitch)?;
    result.set_item("uphill_bearing", spin.uphill_bearing)?;
    result.set_item("lever_arm", array1(py, &spin.lever_arm))?;
    let heading = time.iter().map(|t| motion.turning(*t).heading);
    result.set_item("heading", PyArray1::from_iter(py, heading))?;
    let moving = time.iter().map(|t| f64::from(u8::from(motion.wheels_turn(*t))));
    result.set_item("moving", PyArray1::from_iter(py, moving))?;
    result.set_item("rests", spans(py, &motion.rests())?)?;
    let (turning, angles): (Vec<TimeSpan>, Vec<f64>) = motion.turns().into_iter().unzip();
    result.set_item("turns", spans(py, &turning)?)?;
    result.set_item("turned", PyArray1::from_vec(py, angles))?;
    Ok(result.unbind())
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(simulate_spin, module)?)
}
