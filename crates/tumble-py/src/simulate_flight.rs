//! Missions of quadrotors and vehicles, with known truth: plain mappings in, arrays out.

use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::simulate::flight::{Carrier, Flight, Flown, Mission, OnBoard, simulate};
use tumble_lab::simulate::floor::Floor;
use tumble_lab::simulate::motion::Course;
use tumble_lab::simulate::ride::Manner;
use tumble_lab::simulate::spot::mounted;
use tumble_lab::simulate::vibration::Shaking;

use crate::convert::{spans, stacked};
use crate::simulate::{ConditionsInput, UnitInput, unit, unknown};

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ShakingInput {
    specific_force: f64,
    angular_rate: f64,
    tones: Vec<f64>,
    band: (f64, f64),
    at_rest: f64,
    flexing: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct MissionInput {
    conditions: ConditionsInput,
    carrier: String,
    flights: usize,
    rest: f64,
    moving: f64,
    stops: usize,
    stop: f64,
    intensity: f64,
    sway: [f64; 3],
    turning: f64,
    ground_tilt: f64,
    uphill: f64,
    gravity: f64,
    latitude: Option<f64>,
    mounting: [f64; 3],
    shaking: ShakingInput,
    units: Vec<UnitInput>,
    averaging: Vec<f64>,
}

impl TryFrom<MissionInput> for Mission {
    type Error = PyErr;

    fn try_from(input: MissionInput) -> PyResult<Self> {
        let carrier = match input.carrier.as_str() {
            "quadrotor" => Carrier::Quadrotor,
            "vehicle" => Carrier::Vehicle,
            name => return Err(unknown("motion", name)),
        };
        let [roll, pitch, yaw] = input.mounting;
        Ok(Mission {
            conditions: input.conditions.into(),
            carrier,
            manner: Manner {
                flights: input.flights,
                rest: input.rest,
                moving: input.moving,
                stops: input.stops,
                stop: input.stop,
                intensity: input.intensity,
                sway: input.sway,
                turning: input.turning,
                ground: Floor {
                    tilt: input.ground_tilt,
                    uphill: input.uphill,
                },
                gravity: input.gravity,
            },
            shaking: Shaking {
                specific_force: input.shaking.specific_force,
                angular_rate: input.shaking.angular_rate,
                tones: input.shaking.tones,
                band: input.shaking.band,
            },
            shaking_at_rest: input.shaking.at_rest,
            flexing: input.shaking.flexing,
            case_from_body: mounted(roll, pitch, yaw),
            latitude: input.latitude,
            units: input
                .units
                .into_iter()
                .zip(input.averaging)
                .map(|(unit, averaging)| {
                    Ok(OnBoard {
                        unit: unit.try_into()?,
                        averaging,
                    })
                })
                .collect::<PyResult<_>>()?,
        })
    }
}

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

/// Plays a mission: a mapping as `tumble.simulate` builds it, in SI units and rad.
#[pyfunction]
fn simulate_flight(py: Python<'_>, mission: MissionInput) -> PyResult<Py<PyDict>> {
    let mission = Mission::try_from(mission)?;
    let Flown { flight, units } = py
        .detach(|| simulate(&mission))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let result = PyDict::new(py);
    result.set_item("duration", flight.duration())?;
    result.set_item("rests", spans(py, flight.ride().rests())?)?;
    result.set_item("manoeuvres", spans(py, flight.ride().manoeuvres())?)?;
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
