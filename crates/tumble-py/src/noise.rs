//! Noise of a record, and records whose noise is known.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use tumble_lab::noise::disturbance::{ChannelDisturbance, disturbances};
use tumble_lab::noise::fit::{NoiseFit, TermEstimate};
use tumble_lab::noise::record::{ChannelNoise, DeviationEstimate, NoiseRecord};
use tumble_lab::noise::term::{NoiseTerm, TERMS};
use tumble_lab::noise::variance_kind::VarianceKind;
use tumble_lab::noise::watch::Watched;
use tumble_lab::simulate::still::StillChannel;

/// Deviations and terms of channels that are sampled together.
#[pyclass(module = "tumble._core", name = "NoiseRecord")]
struct PyNoiseRecord {
    record: NoiseRecord,
    kinds: Vec<VarianceKind>,
}

#[pymethods]
impl PyNoiseRecord {
    #[new]
    #[pyo3(signature = (channels, allan_only=false))]
    fn new(channels: usize, allan_only: bool) -> Self {
        let kinds = if allan_only {
            vec![VarianceKind::Allan]
        } else {
            VarianceKind::ALL.to_vec()
        };
        Self {
            record: NoiseRecord::new(channels, &kinds),
            kinds,
        }
    }

    /// Takes in successive samples, (n, channels).
    fn push(&mut self, py: Python<'_>, samples: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        let array = samples.as_array();
        if array.ncols() != self.record.width() || !array.is_standard_layout() {
            return Err(PyValueError::new_err(
                "samples must be C-contiguous, (n, channels)",
            ));
        }
        let rows = samples.as_slice()?;
        py.detach(|| self.record.push(rows));
        Ok(())
    }

    /// Ends a stretch without gaps.
    fn end_stretch(&mut self) {
        self.record.end_stretch();
    }

    /// Returns a record of the same samples, to conclude from while this one goes on.
    fn copy(&self) -> Self {
        Self {
            record: self.record.clone(),
            kinds: self.kinds.clone(),
        }
    }

    /// Estimates the terms of all stretches, a mapping for each channel; `interval` between samples in s.
    fn conclude<'py>(&self, py: Python<'py>, interval: f64) -> PyResult<Bound<'py, PyList>> {
        let found = py.detach(|| self.record.conclude(interval));
        let list = PyList::empty(py);
        for channel in &found {
            list.append(self.figures(py, channel, interval)?)?;
        }
        Ok(list)
    }
}

impl PyNoiseRecord {
    fn figures<'py>(
        &self,
        py: Python<'py>,
        channel: &ChannelNoise,
        interval: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let result = PyDict::new(py);
        for (kind, name) in VarianceKind::ALL.iter().zip(["allan", "modified", "hadamard"]) {
            if self.kinds.contains(kind) {
                result.set_item(
                    name,
                    deviations(py, &channel.deviations[*kind as usize], interval)?,
                )?;
            }
        }
        result.set_item(
            "fit",
            channel
                .fit
                .as_ref()
                .map(|fit| figures(py, fit, interval))
                .transpose()?,
        )?;
        Ok(result)
    }
}

/// (n, 5): averaging time s, deviation, low, high, degrees of freedom.
fn deviations<'py>(
    py: Python<'py>,
    found: &[DeviationEstimate],
    interval: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let row = |each: &DeviationEstimate| {
        [
            each.samples as f64 * interval,
            each.deviation,
            each.low,
            each.high,
            each.freedom,
        ]
    };
    PyArray1::from_iter(py, found.iter().flat_map(row)).reshape([found.len(), 5])
}

fn figures<'py>(py: Python<'py>, fit: &NoiseFit, interval: f64) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    let terms = PyList::empty(py);
    for term in &fit.terms {
        terms.append(estimate(py, term)?)?;
    }
    result.set_item("terms", terms)?;
    result.set_item("chi_square", fit.chi_square)?;
    result.set_item("degrees_of_freedom", fit.freedom)?;
    result.set_item("misfit", fit.misfit)?;
    result.set_item("filter", fit.filtered.constant * interval)?;
    let coefficients = NoiseTerm::ALL
        .iter()
        .zip(fit.strengths)
        .map(|(term, strength)| term.coefficient(strength, interval));
    result.set_item("coefficients", PyArray1::from_iter(py, coefficients))?;
    Ok(result)
}

fn estimate<'py>(py: Python<'py>, found: &TermEstimate) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("term", found.term.name())?;
    result.set_item("value", found.value)?;
    result.set_item("low", found.low)?;
    result.set_item("high", found.high)?;
    result.set_item("identifiable", found.identifiable)?;
    result.set_item("needed", found.needed)?;
    Ok(result)
}

/// Looks for steps, ramps and knocks in channels that are sampled together.
#[pyclass(module = "tumble._core", name = "NoiseWatch")]
struct PyNoiseWatch {
    watched: Watched,
}

#[pymethods]
impl PyNoiseWatch {
    #[new]
    fn new(channels: usize) -> Self {
        Self {
            watched: Watched::new(channels),
        }
    }

    /// Takes in successive samples, time (n,), s, and (n, channels), at rest or not.
    fn push(
        &mut self,
        py: Python<'_>,
        time: PyReadonlyArray1<'_, f64>,
        samples: PyReadonlyArray2<'_, f64>,
        at_rest: bool,
    ) -> PyResult<()> {
        let array = samples.as_array();
        let time = time.as_slice()?;
        if array.dim() != (time.len(), self.watched.width()) || !array.is_standard_layout() {
            return Err(PyValueError::new_err(
                "samples must be C-contiguous, (n, channels), and as many as times",
            ));
        }
        let rows = samples.as_slice()?.chunks_exact(self.watched.width());
        let watched = &mut self.watched;
        py.detach(|| {
            time.iter()
                .zip(rows)
                .for_each(|(time, row)| watched.push(*time, row, at_rest));
        });
        Ok(())
    }

    /// Begins another log.
    fn end_log(&mut self) {
        self.watched.end_log();
    }

    /// Finds the disturbances of each channel, and whether there are more than are listed.
    fn conclude<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let found = py.detach(|| {
            let channels = 0..self.watched.width();
            channels
                .map(|channel| disturbances(&self.watched, channel))
                .collect::<Vec<_>>()
        });
        let list = PyList::empty(py);
        for (each, more) in &found {
            let figures = PyList::empty(py);
            for disturbance in each {
                figures.append(disturbance_figures(py, disturbance)?)?;
            }
            list.append((figures, *more))?;
        }
        Ok(list)
    }
}

fn disturbance_figures<'py>(py: Python<'py>, found: &ChannelDisturbance) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("kind", found.kind.name())?;
    result.set_item("log", found.log)?;
    result.set_item("time", (found.time[0], found.time[1]))?;
    result.set_item("size", found.size)?;
    result.set_item("sigma", found.sigma)?;
    Ok(result)
}

/// Channels that stand still, with noise of known terms.
#[pyclass(module = "tumble._core", name = "StillNoise")]
struct PyStillNoise {
    channels: Vec<StillChannel>,
}

#[pymethods]
impl PyStillNoise {
    /// `coefficients` (channels, terms) in the units of the field; `rate` in Hz; `samples` that will be drawn in all.
    #[new]
    fn new(seed: u64, coefficients: PyReadonlyArray2<'_, f64>, rate: f64, samples: usize) -> PyResult<Self> {
        let rows = coefficients.as_array();
        let channels = rows.rows().into_iter().enumerate().map(|(number, row)| {
            let row: [f64; TERMS] = row
                .iter()
                .copied()
                .collect::<Vec<_>>()
                .try_into()
                .map_err(|_| PyValueError::new_err("coefficients must be (channels, terms)"))?;
            Ok(StillChannel::new(seed, number as u64, row, rate, samples))
        });
        Ok(Self {
            channels: channels.collect::<PyResult<_>>()?,
        })
    }

    /// The next `samples`, (n, channels).
    fn draw<'py>(&mut self, py: Python<'py>, samples: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let width = self.channels.len();
        let channels = &mut self.channels;
        let flat = py.detach(|| {
            let mut flat = Vec::with_capacity(samples * width);
            for _ in 0..samples {
                flat.extend(channels.iter_mut().map(StillChannel::step));
            }
            flat
        });
        PyArray1::from_vec(py, flat).reshape([samples, width])
    }
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyNoiseRecord>()?;
    module.add_class::<PyNoiseWatch>()?;
    module.add_class::<PyStillNoise>()
}
