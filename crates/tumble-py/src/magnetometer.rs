//! Calibration of a magnetometer: samples in, hard iron, soft iron, mounting and the field out.

use nalgebra::{SMatrix, Vector3};
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::model::ModelCovariance;
use tumble_lab::magnetometer::{
    CalibratedAccelerometer, FieldPoint, FieldSamples, FieldSettings, MOST_LEFT_OUT, Magnetometer,
    MagnetometerError, NextField, RestUp, calibrate_at_rests, calibrate_turned, range_ends,
};
use tumble_lab::turntable::magnetometer::{
    FieldDisturbance, FieldSpan, ReferenceMagnetometer, TargetMagnetometer, calibrate_magnetometer,
};

use crate::convert::{array1, matrix, rows, stacked};
use crate::turntable::{CoreError, core_error, covariance, triad};

/// Calibrates a magnetometer by rests. Samples: time (m,) s, field (m, 3) uT, current (m,) A or throttle. Rests: spans (k, 2) s,
/// corrected specific force (k, 3) m/s^2, variance (k, 3) of the mean readings. The accelerometer: M (3, 3) and the covariance
/// (12, 12) of its [M row by row, b]. The strength of the field in uT is None where only ratios are to be found.
#[pyfunction]
#[pyo3(signature = (time, field, spans, force, force_variance, accelerometer, covariance, *, current=None, strength=None,
    strength_sigma=0.0))]
#[allow(clippy::too_many_arguments)]
fn magnetometer_at_rests<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    field: PyReadonlyArray2<'py, f64>,
    spans: Vec<(f64, f64)>,
    force: PyReadonlyArray2<'py, f64>,
    force_variance: PyReadonlyArray2<'py, f64>,
    accelerometer: PyReadonlyArray2<'py, f64>,
    covariance: PyReadonlyArray2<'py, f64>,
    current: Option<PyReadonlyArray1<'py, f64>>,
    strength: Option<f64>,
    strength_sigma: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let samples = field_samples(&time, &field, current.as_ref())?;
    let (force, variance) = (rows(&force, "force")?, rows(&force_variance, "force_variance")?);
    if force.len() != spans.len() || variance.len() != spans.len() {
        return Err(PyValueError::new_err(
            "spans, force and force_variance must have the same length",
        ));
    }
    let rests: Vec<RestUp> = spans
        .iter()
        .zip(force.iter().zip(variance))
        .map(|(span, (force, variance))| RestUp {
            span: *span,
            force: Vector3::from(*force),
            variance: Vector3::from(*variance),
        })
        .collect();
    let covariance = covariance.as_array();
    if covariance.shape() != [12, 12] {
        return Err(PyValueError::new_err("covariance must have shape (12, 12)"));
    }
    let inverse = matrix(&accelerometer, "accelerometer")?.try_inverse();
    let accelerometer = CalibratedAccelerometer {
        inverse: inverse.ok_or_else(|| PyValueError::new_err("accelerometer has no inverse"))?,
        covariance: SMatrix::from_fn(|i, j| covariance[(i, j)]),
    };
    let settings = FieldSettings {
        strength,
        current: current.is_some(),
    };
    let found = py.detach(|| calibrate_at_rests(&samples, &rests, &accelerometer, &settings, strength_sigma));
    figures(py, &found.map_err(|error| refusal(py, &error))?)
}

/// Calibrates a magnetometer that was turned through all directions; arguments as those of `magnetometer_at_rests`.
#[pyfunction]
#[pyo3(signature = (time, field, *, current=None, strength=None, strength_sigma=0.0))]
fn magnetometer_turned<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    field: PyReadonlyArray2<'py, f64>,
    current: Option<PyReadonlyArray1<'py, f64>>,
    strength: Option<f64>,
    strength_sigma: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let samples = field_samples(&time, &field, current.as_ref())?;
    let settings = FieldSettings {
        strength,
        current: current.is_some(),
    };
    let found = py.detach(|| calibrate_turned(&samples, &settings, strength_sigma));
    figures(py, &found.map_err(|error| refusal(py, &error))?)
}

/// Lowest and highest reading (3, 2) of each axis of readings (m, 3), uT, where the range of the magnetometer ends there; NaN
/// where it does not.
#[pyfunction]
fn magnetometer_range_ends<'py>(
    py: Python<'py>,
    field: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let ends = range_ends(rows(&field, "field")?);
    let ends: Vec<Vec<f64>> = ends
        .iter()
        .map(|axis| axis.iter().map(|end| end.unwrap_or(f64::NAN)).collect())
        .collect();
    Ok(PyArray2::from_vec2(py, &ends)?)
}

/// Rest of the reference, and its span on the clocks of reference and target, s.
type RestOfBoth = (usize, (f64, f64), (f64, f64));

/// Calibrates the magnetometer of a target of a turntable by that of the reference. Samples of both: time (m,) s, field (m, 3) uT,
/// those of the reference corrected. Rests both saw: (rest of the reference, span on its clock, span on that of the target), s,
/// and the specific force (k, 3) m/s^2 of the reference there. `uncertainty` (12, 12), where it is stated, is the covariance of
/// `[E row by row, e]` of the reference.
#[pyfunction]
#[pyo3(signature = (reference_time, reference_field, time, field, rests, force, uncertainty=None))]
#[allow(clippy::too_many_arguments)]
fn magnetometer_of_target<'py>(
    py: Python<'py>,
    reference_time: PyReadonlyArray1<'py, f64>,
    reference_field: PyReadonlyArray2<'py, f64>,
    time: PyReadonlyArray1<'py, f64>,
    field: PyReadonlyArray2<'py, f64>,
    rests: Vec<RestOfBoth>,
    force: PyReadonlyArray2<'py, f64>,
    uncertainty: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    let force = rows(&force, "force")?;
    if force.len() != rests.len() {
        return Err(PyValueError::new_err("rests and force must have the same length"));
    }
    let spans: Vec<_> = rests
        .iter()
        .zip(force)
        .map(|((rest, reference, target), force)| FieldSpan {
            rest: *rest,
            reference: *reference,
            target: *target,
            force: Vector3::from(*force),
        })
        .collect();
    let stated: Option<ModelCovariance<f64>> = uncertainty.map(|array| covariance(&array)).transpose()?;
    let reference = ReferenceMagnetometer {
        samples: field_samples(&reference_time, &reference_field, None)?,
        uncertainty: stated,
    };
    let samples = field_samples(&time, &field, None)?;
    let found = py.detach(|| calibrate_magnetometer(&reference, &samples, &spans));
    figures_of_target(py, &found.map_err(|error| core_error(py, &error))?)
}

fn figures_of_target<'py>(py: Python<'py>, found: &TargetMagnetometer) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("calibration", triad(py, &found.calibration)?)?;
    figures.set_item("strength", found.strength)?;
    figures.set_item("reference_bias", array1(py, &found.reference_bias.0))?;
    figures.set_item("reference_bias_sigma", array1(py, &found.reference_bias.1))?;
    let difference = found.difference.as_ref();
    figures.set_item("difference", difference.map(|vector| array1(py, vector)))?;
    let rests = found.rests.iter().map(|rest| {
        let disturbance = rest.disturbance.map_or("", |why| match why {
            FieldDisturbance::Strength => "strength",
            FieldDisturbance::Target => "target",
        });
        (rest.rest, rest.deviation.0, rest.deviation.1, disturbance)
    });
    figures.set_item("rests", rests.collect::<Vec<_>>())?;
    figures.set_item("field", stacked(py, found.rests.iter().map(|rest| rest.field)))?;
    Ok(figures)
}

fn field_samples<'a>(
    time: &'a PyReadonlyArray1<'_, f64>,
    field: &'a PyReadonlyArray2<'_, f64>,
    current: Option<&'a PyReadonlyArray1<'_, f64>>,
) -> PyResult<FieldSamples<'a>> {
    let samples = FieldSamples {
        time: time.as_slice()?,
        field: rows(field, "field")?,
        current: current.map_or(Ok(&[][..]), |current| current.as_slice())?,
    };
    let short = !samples.current.is_empty() && samples.current.len() != samples.time.len();
    if samples.time.len() != samples.field.len() || short {
        return Err(PyValueError::new_err(
            "time, field and current must have the same length",
        ));
    }
    Ok(samples)
}

fn figures<'py>(py: Python<'py>, found: &Magnetometer) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("calibration", triad(py, &found.calibration)?)?;
    let current = found.current.as_ref();
    figures.set_item("current", current.map(|(response, _)| array1(py, response)))?;
    figures.set_item("current_sigma", current.map(|(_, sigma)| array1(py, sigma)))?;
    figures.set_item("strength", found.strength)?;
    figures.set_item("dip", found.dip)?;
    figures.set_item("coverage", found.coverage)?;
    figures.set_item("scatter", found.scatter)?;
    figures.set_item("points", points(py, &found.points)?)?;
    let next = found.next.as_ref().map(|next| to_add(py, next));
    figures.set_item("next", next.transpose()?)?;
    Ok(figures)
}

fn points<'py>(py: Python<'py>, points: &[FieldPoint]) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    let each = |value: fn(&FieldPoint) -> f64| points.iter().map(value).collect::<Vec<f64>>();
    let nothing = (f64::NAN, f64::NAN);
    figures.set_item("span", points.iter().map(|point| point.span).collect::<Vec<_>>())?;
    figures.set_item("field", stacked(py, points.iter().map(|point| point.field)))?;
    figures.set_item("before", each(|point| point.before))?;
    figures.set_item("after", each(|point| point.after))?;
    figures.set_item("sigma", each(|point| point.sigma))?;
    figures.set_item(
        "dip",
        points
            .iter()
            .map(|point| point.dip.unwrap_or(nothing))
            .collect::<Vec<_>>(),
    )?;
    figures.set_item("weight", each(|point| point.weight))?;
    figures.set_item("chance", each(|point| point.chance))?;
    figures.set_item(
        "disturbed",
        points.iter().map(|point| point.disturbed).collect::<Vec<_>>(),
    )?;
    figures.set_item(
        "direction",
        points.iter().map(|point| point.direction).collect::<Vec<_>>(),
    )?;
    figures.set_item("leverage", each(|point| point.influence.leverage))?;
    figures.set_item("influence", each(|point| point.influence.change))?;
    figures.set_item("held_out", each(|point| point.held_out.unwrap_or(f64::NAN)))?;
    Ok(figures)
}

fn to_add<'py>(py: Python<'py>, next: &NextField) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("field", array1(py, &next.field))?;
    figures.set_item("up", next.up.map(|up| array1(py, &up)))?;
    figures.set_item("before", next.before)?;
    figures.set_item("after", next.after)?;
    figures.set_item("unknown", next.unknown)?;
    Ok(figures)
}

fn refusal(py: Python<'_>, error: &MagnetometerError) -> PyErr {
    match refusal_figures(py, error) {
        Ok(figures) => CoreError::new_err((error.name(), figures.unbind())),
        Err(failure) => failure,
    }
}

fn refusal_figures<'py>(py: Python<'py>, error: &MagnetometerError) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    match error {
        MagnetometerError::TooFewReadings { found, needed }
        | MagnetometerError::TooFewFieldDirections { found, needed } => {
            figures.set_item("found", found)?;
            figures.set_item("needed", needed)?;
        }
        MagnetometerError::ReadingsLeaveOpen { shares } => figures.set_item("shares", shares.to_vec())?,
        MagnetometerError::Disturbed { found, readings } => {
            figures.set_item("found", found)?;
            figures.set_item("readings", readings)?;
        }
        MagnetometerError::Flat | MagnetometerError::FieldUnsolvable => {}
    }
    Ok(figures)
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("MOST_LEFT_OUT", MOST_LEFT_OUT)?;
    module.add_function(wrap_pyfunction!(magnetometer_at_rests, module)?)?;
    module.add_function(wrap_pyfunction!(magnetometer_turned, module)?)?;
    module.add_function(wrap_pyfunction!(magnetometer_range_ends, module)?)?;
    module.add_function(wrap_pyfunction!(magnetometer_of_target, module)?)
}
