//! Drift over temperature, from samples of units at rest.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use tumble_lab::thermal::block::RestBlock;
use tumble_lab::thermal::hysteresis::Hysteresis;
use tumble_lab::thermal::lag::Lagging;
use tumble_lab::thermal::procedure::{
    AxisDrift, LEAST_RANGE, ThermalDrift, ThermalError, ThermalSettings, thermal,
};
use tumble_lab::thermal::recorder::ThermalRecorder;
use tumble_lab::thermal::whitening::Wander;

use crate::convert::rows;
use crate::turntable::CoreError;

/// Takes in logs of a unit whose temperature changes, in memory that does not grow.
#[pyclass(module = "tumble._core", name = "ThermalRecorder")]
struct PyThermalRecorder {
    recorder: ThermalRecorder,
}

#[pymethods]
impl PyThermalRecorder {
    #[new]
    fn new() -> Self {
        Self {
            recorder: ThermalRecorder::default(),
        }
    }

    /// Begins another log.
    fn begin_session(&mut self) {
        self.recorder.begin_session();
    }

    /// Takes in samples: time and temperature (n,), accelerometer and gyroscope (n, 3); those not finite are left out.
    fn push(
        &mut self,
        py: Python<'_>,
        time: PyReadonlyArray1<'_, f64>,
        accelerometer: PyReadonlyArray2<'_, f64>,
        gyroscope: PyReadonlyArray2<'_, f64>,
        temperature: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<()> {
        let (time, temperature) = (time.as_slice()?, temperature.as_slice()?);
        let (force, rate) = (
            rows(&accelerometer, "accelerometer")?,
            rows(&gyroscope, "gyroscope")?,
        );
        if [temperature.len(), force.len(), rate.len()] != [time.len(); 3] {
            return Err(PyValueError::new_err(
                "time, accelerometer, gyroscope and temperature must have the same length",
            ));
        }
        let recorder = &mut self.recorder;
        py.detach(|| {
            for (place, time) in time.iter().enumerate() {
                let ([fx, fy, fz], [wx, wy, wz]) = (force[place], rate[place]);
                recorder.push(*time, temperature[place], &[fx, fy, fz, wx, wy, wz]);
            }
        });
        Ok(())
    }

    /// Estimates the drift of the recorded `channels` from all logs; temperatures in degC.
    #[pyo3(signature = (channels, *, fixture=false, reference=None))]
    fn conclude<'py>(
        &self,
        py: Python<'py>,
        channels: Vec<usize>,
        fixture: bool,
        reference: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let settings = ThermalSettings {
            fixture,
            reference,
            channels,
            resolution: self.recorder.resolution(),
        };
        let (spans, step) = (self.recorder.spans(), self.recorder.step());
        let found = py.detach(|| thermal(&spans, step, &settings));
        figures(py, &found.map_err(|error| refusal(py, &error))?, step)
    }
}

fn figures<'py>(py: Python<'py>, found: &ThermalDrift, step: f64) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("reference", found.reference)?;
    figures.set_item("range", (found.range[0], found.range[1]))?;
    figures.set_item("step", step)?;
    let (lag, or_hysteresis) = match found.lag {
        Lagging::None => (None, None),
        Lagging::Shown(lag) => (Some((lag.value, lag.sigma)), None),
        Lagging::OrHysteresis(lag) => (None, Some((lag.value, lag.sigma))),
    };
    figures.set_item("lag", lag)?;
    figures.set_item("lag_or_hysteresis", or_hysteresis)?;
    figures.set_item("still", found.data.still)?;
    figures.set_item("moved", found.data.moved)?;
    let blocks = &found.data.blocks;
    let times = blocks
        .iter()
        .flat_map(|block| [block.interval.start, block.interval.end]);
    figures.set_item("time", PyArray1::from_iter(py, times).reshape([blocks.len(), 2])?)?;
    let places = |of: fn(&RestBlock) -> f64| PyArray1::from_iter(py, blocks.iter().map(of));
    figures.set_item("session", places(|block| block.session as f64))?;
    figures.set_item("pose", places(|block| block.pose as f64))?;
    figures.set_item("temperature", places(|block| block.temperature))?;
    figures.set_item("leg", places(|block| block.leg))?;
    let axes = PyList::empty(py);
    for axis in &found.axes {
        axes.append(axis_figures(py, axis, found)?)?;
    }
    figures.set_item("axes", axes)?;
    Ok(figures)
}

fn axis_figures<'py>(
    py: Python<'py>,
    axis: &AxisDrift,
    found: &ThermalDrift,
) -> PyResult<Bound<'py, PyDict>> {
    let (fit, figures) = (&axis.fit, PyDict::new(py));
    figures.set_item("channel", axis.channel)?;
    figures.set_item("bias", PyArray1::from_slice(py, fit.bias()))?;
    figures.set_item("scale", PyArray1::from_slice(py, fit.scale()))?;
    let covariance = PyArray1::from_slice(py, fit.covariance.as_slice());
    figures.set_item(
        "covariance",
        covariance.reshape([fit.covariance.nrows(), fit.covariance.ncols()])?,
    )?;
    let hysteresis = axis
        .hysteresis
        .as_ref()
        .map(|found| hysteresis_figures(py, found));
    figures.set_item("hysteresis", hysteresis.transpose()?)?;
    figures.set_item("slope", (axis.slope[0], axis.slope[1]))?;
    figures.set_item("scale_change", axis.scale.map(|[value, sigma]| (value, sigma)))?;
    figures.set_item("constants", PyArray1::from_slice(py, &fit.constants))?;
    figures.set_item("noise_density", fit.white.sqrt())?;
    figures.set_item("bias_instability", fit.strength(Wander::Flicker).sqrt())?;
    figures.set_item("random_walk", fit.strength(Wander::RandomWalk).sqrt())?;
    let scores: Vec<(usize, usize, f64)> = axis
        .candidates
        .iter()
        .zip(&axis.choice.weights)
        .map(|(terms, weight)| (terms.bias, terms.scale, *weight))
        .collect();
    figures.set_item("scores", scores)?;
    figures.set_item("chosen", axis.choice.chosen)?;
    let change: Bound<'py, PyArray1<f64>> =
        PyArray1::from_vec(py, axis.changes(&found.data, found.reference));
    figures.set_item("change", change)?;
    Ok(figures)
}

fn hysteresis_figures<'py>(py: Python<'py>, found: &Hysteresis) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("largest", (found.largest[0], found.largest[1]))?;
    figures.set_item("mean", (found.mean[0], found.mean[1]))?;
    let knots = PyArray1::from_iter(py, found.knots.iter().flatten().copied());
    figures.set_item("knots", knots.reshape([found.knots.len(), 3])?)?;
    figures.set_item("is_clear", found.is_clear)?;
    Ok(figures)
}

fn refusal(py: Python<'_>, error: &ThermalError) -> PyErr {
    let figures = PyDict::new(py);
    let entered = match error {
        ThermalError::RangeTooSmall {
            low,
            high,
            within,
            needed,
        } => [
            ("low", *low),
            ("high", *high),
            ("within", *within),
            ("needed", *needed),
        ]
        .iter()
        .try_for_each(|(name, value)| figures.set_item(name, value)),
        ThermalError::TooLittleAtRest { still, moved } => [("still", *still), ("moved", *moved)]
            .iter()
            .try_for_each(|(name, value)| figures.set_item(name, value)),
    };
    match entered {
        Ok(()) => CoreError::new_err((error.name(), figures.unbind())),
        Err(error) => error,
    }
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("LEAST_TEMPERATURE_RANGE", LEAST_RANGE)?;
    module.add_class::<PyThermalRecorder>()
}
