//! Estimates of a spin, or the reason for their lack, as Python mappings.

use nalgebra::Vector3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::real::Real;
use tumble_core::spin::estimate::{ScalarEstimate, SpinEstimate, VectorEstimate};
use tumble_core::spin::failure::SpinFailure;
use tumble_lab::spin::FittedBlock;

use crate::convert::{array1, array2, stacked};
use crate::turntable::CoreError;

/// A number of either precision for Python.
pub(crate) fn wide<T: Real>(value: T) -> f64 {
    nalgebra::try_convert(value).unwrap_or(f64::NAN)
}

#[allow(clippy::cast_precision_loss)]
pub(crate) fn failure_figures<'py, T: Real>(
    py: Python<'py>,
    failure: &SpinFailure<T>,
    origin: f64,
) -> PyResult<(&'static str, Bound<'py, PyDict>)> {
    let at = |time: u64| origin + time as f64 * 1e-6;
    let figures: Vec<(&str, f64)> = match *failure {
        SpinFailure::NeverStill { waited } => vec![("waited", wide(waited))],
        SpinFailure::NoRest => vec![],
        SpinFailure::NoTurn { turned } => vec![("turned", wide(turned))],
        SpinFailure::TurnedTooLittle { turned, wanted } => {
            vec![("turned", wide(turned)), ("wanted", wide(wanted))]
        }
        SpinFailure::NotOneAxis { time, across, limit } => vec![
            ("time", at(time)),
            ("across", wide(across)),
            ("limit", wide(limit)),
        ],
        SpinFailure::Lifted { time, change, limit } => vec![
            ("time", at(time)),
            ("change", wide(change)),
            ("limit", wide(limit)),
        ],
        SpinFailure::Saturated { time, channel, value } => vec![
            ("time", at(time)),
            ("channel", channel as f64),
            ("value", wide(value)),
        ],
        SpinFailure::FloorTooSteep { tilt, limit } => vec![("tilt", wide(tilt)), ("limit", wide(limit))],
        SpinFailure::SampleRateTooLow { rate, needed } => {
            vec![("rate", wide(rate)), ("needed", wide(needed))]
        }
        SpinFailure::SamplesMissing { time, gap } => {
            vec![("time", at(time)), ("gap", wide(gap))]
        }
        SpinFailure::StreamStopped { time, gap } => {
            vec![("time", at(time)), ("gap", wide(gap))]
        }
        SpinFailure::Unsolvable => vec![],
    };
    let dict = PyDict::new(py);
    for (name, value) in figures {
        dict.set_item(name, value)?;
    }
    Ok((failure.name(), dict))
}

pub(crate) fn error<T: Real>(py: Python<'_>, failure: &SpinFailure<T>, origin: f64) -> PyErr {
    match failure_figures(py, failure, origin) {
        Ok((kind, figures)) => CoreError::new_err((kind, figures.unbind())),
        Err(error) => error,
    }
}

pub(crate) fn vector<T: Real>(py: Python<'_>, v: &Vector3<T>) -> Py<PyArray1<f64>> {
    array1(py, &v.map(wide))
}

pub(crate) fn value<T: Real>(value: &ScalarEstimate<T>) -> (f64, f64) {
    if value.is_known() {
        (wide(value.value), wide(value.sigma))
    } else {
        (f64::NAN, f64::INFINITY)
    }
}

pub(crate) fn bias<'py, T: Real>(py: Python<'py>, bias: &VectorEstimate<T>) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("value", vector(py, &bias.value))?;
    dict.set_item("sigma", vector(py, &bias.sigma))?;
    dict.set_item("observed", bias.observed)?;
    Ok(dict)
}

pub(crate) fn figures<'py, T: Real>(
    py: Python<'py>,
    estimate: &SpinEstimate<T>,
) -> PyResult<Bound<'py, PyDict>> {
    let turned = &estimate.turned;
    let duration = wide(turned.duration());
    let dict = PyDict::new(py);
    dict.set_item("turned_clockwise", wide(turned.clockwise.angle))?;
    dict.set_item("turned_counter_clockwise", wide(turned.counter_clockwise.angle))?;
    dict.set_item("heading_span", wide(turned.span()))?;
    dict.set_item("rate", (wide(turned.squared) / duration).sqrt())?;
    dict.set_item("turning_time", duration)?;
    dict.set_item("resting_time", wide(estimate.resting_time))?;
    dict.set_item("samples", estimate.samples)?;
    dict.set_item("gyroscope_bias", bias(py, &estimate.gyroscope_bias)?)?;
    dict.set_item("level_free", bias(py, &estimate.level_free)?)?;
    dict.set_item("published", bias(py, &estimate.level_floor)?)?;
    dict.set_item("level_free_is_default", estimate.level_free_is_default)?;
    dict.set_item("up", vector(py, &estimate.up))?;
    dict.set_item("roll", value(&estimate.roll))?;
    dict.set_item("pitch", value(&estimate.pitch))?;
    dict.set_item("floor_tilt", value(&estimate.floor_tilt))?;
    dict.set_item("uphill_bearing", value(&estimate.uphill_bearing))?;
    let arm = &estimate.lever_arm;
    let unknown = Vector3::repeat(f64::INFINITY);
    dict.set_item("lever_arm", vector(py, &arm.value))?;
    let sigma = if arm.observed {
        arm.sigma.map(wide)
    } else {
        unknown
    };
    dict.set_item("lever_arm_sigma", array1(py, &sigma))?;
    dict.set_item("heading_scale", value(&estimate.scale))?;
    dict.set_item("scale_clockwise", value(&estimate.scale_clockwise))?;
    dict.set_item(
        "scale_counter_clockwise",
        value(&estimate.scale_counter_clockwise),
    )?;
    dict.set_item("slow_turn", value(&estimate.slow_turn))?;
    dict.set_item("turned_while_still", estimate.turned_while_still)?;
    dict.set_item("covariance", array2(py, &estimate.covariance.map(wide)))?;
    dict.set_item("by_earth", array2(py, &estimate.by_earth.map(wide)))?;
    dict.set_item("chi_square", wide(estimate.chi_square))?;
    dict.set_item("degrees_of_freedom", estimate.degrees_of_freedom)?;
    dict.set_item("widening", wide(estimate.widening))?;
    let noise = estimate.noise.iter().map(|row| row.map(wide));
    dict.set_item("noise", stacked(py, noise))?;
    Ok(dict)
}

#[allow(clippy::cast_precision_loss)]
pub(crate) fn block_figures<'py, T: Real>(
    py: Python<'py>,
    blocks: &[FittedBlock<T>],
    origin: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let column = |f: &dyn Fn(&FittedBlock<T>) -> f64| PyArray1::from_iter(py, blocks.iter().map(f));
    let dict = PyDict::new(py);
    dict.set_item("time", column(&|block| origin + block.time as f64 * 1e-6))?;
    dict.set_item("resting", column(&|block| f64::from(u8::from(block.resting))))?;
    dict.set_item("heading", column(&|block| wide(block.heading)))?;
    dict.set_item("rate", column(&|block| wide(block.rate)))?;
    let across: Vec<Vec<f64>> = blocks
        .iter()
        .map(|block| vec![wide(block.across.x), wide(block.across.y)])
        .collect();
    dict.set_item("across", numpy::PyArray2::from_vec2(py, &across)?)?;
    dict.set_item(
        "force",
        stacked(py, blocks.iter().map(|block| block.force.map(wide))),
    )?;
    dict.set_item("fit", stacked(py, blocks.iter().map(|block| block.fit.map(wide))))?;
    Ok(dict)
}
