//! Flights and drives with known truth: a scenario as text in, arrays out.

use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::simulate::flight::{Flight, SimulatedFlight, simulate};
use tumble_lab::simulate::trajectory::Trajectory;

use crate::convert::{spans, stacked};
use crate::simulate::{scenario, unit};

/// The true motion of the primary's place, at any time.
#[pyclass(frozen, module = "tumble._core")]
struct FlightMotion(Flight);

#[pymethods]
impl FlightMotion {
    /// Specific force, angular rate and angular acceleration in the primary's case frame, vibration as its mean over
    /// `averaging` s.
    fn truth<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        averaging: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let times = time.as_slice()?;
        let truths = py.detach(|| self.0.truths(times, averaging));
        let result = PyDict::new(py);
        let forces = truths.iter().map(|truth| truth.specific_force);
        result.set_item("specific_force", stacked(py, forces))?;
        let rates = truths.iter().map(|truth| truth.angular_rate);
        result.set_item("angular_rate", stacked(py, rates))?;
        let accelerations = truths.iter().map(|truth| truth.turn_acceleration);
        result.set_item("angular_acceleration", stacked(py, accelerations))?;
        Ok(result)
    }

    /// Attitude (n, 3, 3) and velocity (n, 3) in the level frame, without vibration.
    fn path<'py>(&self, py: Python<'py>, time: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyDict>> {
        let times = time.as_slice()?;
        let result = PyDict::new(py);
        let attitudes = times.iter().flat_map(|t| {
            let rows = self.0.level_from_case(*t).matrix().transpose();
            rows.as_slice().to_vec()
        });
        let attitudes: Bound<'py, PyArray3<f64>> =
            PyArray1::from_iter(py, attitudes).reshape([times.len(), 3, 3])?;
        result.set_item("level_from_case", attitudes)?;
        let velocities = times.iter().map(|t| self.0.velocity(*t));
        result.set_item("velocity", stacked(py, velocities))?;
        Ok(result)
    }
}

/// Plays a `FlightScenario` in JSON, SI units and rad.
#[pyfunction]
fn simulate_flight(py: Python<'_>, text: &str) -> PyResult<Py<PyDict>> {
    let scenario = scenario(text)?;
    let SimulatedFlight { flight, units } = py
        .detach(|| simulate(&scenario))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let result = PyDict::new(py);
    result.set_item("duration", flight.duration())?;
    result.set_item("rests", spans(py, flight.carrier_motion().rests())?)?;
    result.set_item("manoeuvres", spans(py, flight.carrier_motion().manoeuvres())?)?;
    let units: PyResult<Vec<_>> = units.into_iter().map(|record| unit(py, record)).collect();
    result.set_item("units", units?)?;
    result.set_item("motion", FlightMotion(flight))?;
    Ok(result.unbind())
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<FlightMotion>()?;
    module.add_function(wrap_pyfunction!(simulate_flight, module)?)
}
