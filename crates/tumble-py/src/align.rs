//! Two units that move together: arrays in, clock, rotation and lever arm out.

use nalgebra::Vector3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::align::forces::ForcesFit;
use tumble_lab::align::rates::{Changed, RatesFit};
use tumble_lab::align::samples::UnitSamples;
use tumble_lab::align::{AlignError, AlignSettings, Aligned, align};

use crate::convert::{array1, array2, rows, stacked};
use crate::turntable::CoreError;

/// Samples of one unit, borrowed.
#[derive(FromPyObject)]
struct UnitArrays<'py>(
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
);

impl UnitArrays<'_> {
    fn track(&self) -> PyResult<UnitSamples<'_>> {
        let (time, force) = (self.0.as_slice()?, rows(&self.1, "accelerometer")?);
        let rate = rows(&self.2, "gyroscope")?;
        if time.len() != force.len() || time.len() != rate.len() {
            return Err(PyValueError::new_err(
                "time, accelerometer and gyroscope must have the same length",
            ));
        }
        Ok(UnitSamples::new(time, force, rate))
    }
}

/// Aligns a secondary with a primary; each is (time, accelerometer, gyroscope).
#[pyfunction]
#[pyo3(signature = (primary, secondary, *, search=5.0, around=0.0, one_clock=false, rate_bias=None,
    rate_bias_sigma=0.1))]
#[allow(clippy::too_many_arguments)]
fn align_units<'py>(
    py: Python<'py>,
    primary: UnitArrays<'py>,
    secondary: UnitArrays<'py>,
    search: f64,
    around: f64,
    one_clock: bool,
    rate_bias: Option<[f64; 3]>,
    rate_bias_sigma: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = AlignSettings {
        search,
        around,
        one_clock,
        rate_bias: (
            rate_bias.map_or_else(Vector3::zeros, Vector3::from),
            rate_bias_sigma,
        ),
        ..AlignSettings::default()
    };
    let (ours, theirs) = (primary.track()?, secondary.track()?);
    let found = py.detach(|| align(&ours, &theirs, &settings));
    let found = found.map_err(|refusal| error(py, &refusal))?;
    let figures = figures(py, &found)?;
    figures.set_item("one_clock", one_clock)?;
    for (name, track) in [("primary", &ours), ("secondary", &theirs)] {
        figures.set_item(format!("{name}_saturated"), track.saturated)?;
        figures.set_item(format!("{name}_not_finite"), track.not_finite)?;
    }
    Ok(figures)
}

fn figures<'py>(py: Python<'py>, found: &Aligned) -> PyResult<Bound<'py, PyDict>> {
    let rates = &found.rates;
    let figures = PyDict::new(py);
    figures.set_item("correlation", found.correlation)?;
    figures.set_item("motion", found.motion)?;
    figures.set_item("window", found.window)?;
    figures.set_item("pairs", rates.pairs.len())?;
    let (vector, covariance) = rates.rotation_vector();
    figures.set_item("rotation_vector", array1(py, &vector))?;
    figures.set_item("rotation_vector_covariance", array2(py, &covariance))?;
    figures.set_item("completed", found.completed)?;
    figures.set_item("widened", found.widened.sqrt())?;
    figures.set_item("sensor_from_primary", array2(py, rates.rotation.matrix()))?;
    figures.set_item("rotation_covariance", array2(py, &rates.rotation_covariance))?;
    figures.set_item("rotation_unseen", stacked(py, rates.unseen.iter().copied()))?;
    figures.set_item("gyroscope_bias", array1(py, &rates.bias))?;
    figures.set_item(
        "gyroscope_bias_sigma",
        array1(py, &rates.bias_covariance.diagonal().map(f64::sqrt)),
    )?;
    figures.set_item("gyroscope_stretch", array2(py, &rates.stretch))?;
    figures.set_item("time_offset", rates.clock.offset)?;
    figures.set_item("time_offset_sigma", rates.clock_sigma.0)?;
    figures.set_item("skew", rates.clock.skew)?;
    figures.set_item("skew_sigma", rates.clock_sigma.1)?;
    figures.set_item("reference_time", rates.clock.reference)?;
    figures.set_item("gyroscope_residual", rates.scale)?;
    figures.set_item("changed", changed(py, rates.changed.as_ref())?)?;
    figures.set_item("jumped", found.jumped)?;
    match &found.forces {
        Some(forces) => figures.set_item("forces", force_figures(py, rates, forces)?)?,
        None => figures.set_item("forces", py.None())?,
    }
    Ok(figures)
}

fn force_figures<'py>(py: Python<'py>, rates: &RatesFit, forces: &ForcesFit) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("lever_arm", array1(py, &forces.lever_arm))?;
    figures.set_item("lever_arm_covariance", array2(py, &forces.lever_arm_covariance))?;
    figures.set_item("lever_arm_unseen", stacked(py, forces.unseen.iter().copied()))?;
    figures.set_item("accelerometer_bias", array1(py, &forces.bias))?;
    figures.set_item("accelerometer_bias_sigma", array1(py, &forces.bias_sigma))?;
    figures.set_item("accelerometer_angle", array1(py, &forces.angle))?;
    let angle_variance = (forces.angle_covariance + rates.rotation_covariance).diagonal();
    figures.set_item(
        "accelerometer_angle_sigma",
        array1(py, &angle_variance.map(f64::sqrt)),
    )?;
    figures.set_item("accelerometer_delay", forces.delay)?;
    figures.set_item("accelerometer_delay_sigma", forces.delay_sigma)?;
    figures.set_item("accelerometer_stretch", array2(py, &forces.stretch))?;
    figures.set_item("accelerometer_residual", forces.scale)?;
    figures.set_item("changed", changed(py, forces.changed.as_ref())?)?;
    Ok(figures)
}

/// A step of unknowns as time and sizes.
fn changed<'py, const M: usize>(
    py: Python<'py>,
    step: Option<&Changed<M>>,
) -> PyResult<Option<Bound<'py, PyDict>>> {
    let Some(step) = step else { return Ok(None) };
    let figures = PyDict::new(py);
    figures.set_item("time", step.time)?;
    figures.set_item("size", <[f64; M]>::from(step.size))?;
    Ok(Some(figures))
}

fn error(py: Python<'_>, refusal: &AlignError) -> PyErr {
    let figures = PyDict::new(py);
    let values: Vec<(&str, f64)> = match refusal {
        AlignError::NothingInCommon => vec![],
        AlignError::Leaps { after, by } => vec![("after", *after), ("by", *by)],
        AlignError::NoMotion { found, needed } => vec![("found", *found), ("needed", *needed)],
        AlignError::NotAlike { correlation } => vec![("correlation", *correlation)],
        AlignError::Mirrored => vec![],
        AlignError::Scaled { ratio } => vec![("ratio", *ratio)],
        AlignError::AxisChanged {
            axis,
            gain,
            start,
            end,
        } => vec![("axis", *axis), ("gain", *gain), ("start", *start), ("end", *end)],
        AlignError::Ambiguous { offset, other } => {
            vec![("offset", *offset), ("other", *other)]
        }
        AlignError::ForcesDisagree { apart } => vec![("apart", *apart)],
        AlignError::Unsolvable => vec![],
    };
    for (name, value) in values {
        if let Err(failure) = figures.set_item(name, value) {
            return failure;
        }
    }
    CoreError::new_err((refusal.name(), figures.unbind()))
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(align_units, module)?)
}
