//! Recordings in, rests and turns out.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tumble_core::real::seconds;
use tumble_core::segmenter::SegmenterSettings;
use tumble_lab::acquisition::{Acquired, Acquisition, CHANNEL_NAMES, RateGate};
use tumble_lab::multipose::{BY_HAND, rest_settings};
use tumble_lab::turntable::{force_sigma, rate_sigma};

use crate::convert::{rows, stacked};

/// Takes in one recording chunk by chunk; keeps sums over rests and turns only.
#[pyclass(module = "tumble._core", name = "Segmenter")]
pub struct PyAcquisition {
    acquisition: Option<Acquisition>,
    pace_sigma: f64,
    stamp_sigma: f64,
}

#[pymethods]
impl PyAcquisition {
    /// Nothing seen yet. `shortest_rest` in s; what is `by_hand` need not be as still as what lies. `rates`: whether
    /// constant rates are looked for, as of a `reference` or of a `target`. `pace_sigma` and `stamp_sigma` are those of the times to come,
    /// relative.
    #[new]
    #[pyo3(signature = (shortest_rest=1.0, by_hand=false, rates=None, pace_sigma=0.0, stamp_sigma=0.0))]
    fn new(
        shortest_rest: f64,
        by_hand: bool,
        rates: Option<&str>,
        pace_sigma: f64,
        stamp_sigma: f64,
    ) -> PyResult<Self> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let shortest = (shortest_rest * 1e6) as u64;
        let acquisition = Acquisition::new(SegmenterSettings {
            slow_noise: !by_hand,
            ..rest_settings(shortest, if by_hand { BY_HAND } else { 1.0 })
        });
        Ok(Self {
            acquisition: Some(match rates {
                None => acquisition,
                Some("reference") => acquisition.with_rates(RateGate::Reference),
                Some("target") => acquisition.with_rates(RateGate::Target),
                Some(other) => return Err(PyValueError::new_err(format!("unknown rates {other:?}"))),
            }),
            pace_sigma,
            stamp_sigma,
        })
    }

    /// Takes in successive samples: time (n,) s, accelerometer (n, 3) m/s^2, gyroscope (n, 3) rad/s.
    #[pyo3(signature = (time, accelerometer, gyroscope, temperature=None))]
    fn push(
        &mut self,
        py: Python<'_>,
        time: PyReadonlyArray1<'_, f64>,
        accelerometer: PyReadonlyArray2<'_, f64>,
        gyroscope: PyReadonlyArray2<'_, f64>,
        temperature: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<()> {
        let (force, rate) = (
            rows(&accelerometer, "accelerometer")?,
            rows(&gyroscope, "gyroscope")?,
        );
        let time = time.as_slice()?;
        let temperature = temperature.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
        if time.len() != force.len() || time.len() != rate.len() {
            return Err(PyValueError::new_err(
                "time, accelerometer and gyroscope must have the same length",
            ));
        }
        let acquisition = self.running()?;
        py.detach(|| acquisition.push(time, force, rate, temperature));
        Ok(())
    }

    /// Starts a file of a recording that comes as one file a pose.
    fn begin_part(&mut self, name: &str) -> PyResult<()> {
        self.running()?.begin_part(name);
        Ok(())
    }

    /// Ends the recording.
    fn finish(&mut self) -> PyResult<PyAcquired> {
        let acquisition = self.acquisition.take().ok_or_else(finished)?;
        let mut inner = acquisition.finish();
        inner.pace_sigma = self.pace_sigma;
        inner.stamp_sigma = self.stamp_sigma;
        Ok(PyAcquired { inner })
    }
}

impl PyAcquisition {
    fn running(&mut self) -> PyResult<&mut Acquisition> {
        self.acquisition.as_mut().ok_or_else(finished)
    }
}

fn finished() -> PyErr {
    PyValueError::new_err("the recording was finished before")
}

/// Time, specific force and angular rate of the points to draw.
type Fault = (&'static str, &'static str, f64, f64, f64, u32, Vec<(f64, f64)>);

type Traced = (Py<PyArray1<f64>>, Py<PyArray2<f64>>, Py<PyArray2<f64>>);

/// A segment of constant rate: start s, end s, kind, rate (3,) rad/s, specific force (3,) m/s^2.
type ConstantRate = (f64, f64, &'static str, [f64; 3], [f64; 3]);

/// Acquired rests and turns of one unit.
#[pyclass(module = "tumble._core", name = "Acquired", frozen)]
pub struct PyAcquired {
    /// The thing itself.
    pub inner: Acquired,
}

#[pymethods]
impl PyAcquired {
    /// Finite samples taken in.
    #[getter]
    fn samples(&self) -> u64 {
        self.inner.samples
    }

    /// Samples passed over because a channel was not a number.
    #[getter]
    fn not_finite(&self) -> u64 {
        self.inner.not_finite
    }

    /// Samples that are missing, as the pauses between the others show.
    #[getter]
    fn missing(&self) -> u64 {
        self.inner.missing
    }

    /// Time of the first sample not later than the one before, s.
    #[getter]
    fn first_backwards(&self) -> Option<f64> {
        self.inner.first_backwards
    }

    /// Lowest, mean and highest temperature, degC.
    #[getter]
    fn temperature(&self) -> Option<(f64, f64, f64)> {
        self.inner.temperature.map(|[low, mean, high]| (low, mean, high))
    }

    /// (k, 2) start and end of each rest, s of the recording's own clock.
    #[getter]
    fn rest_times(&self, py: Python<'_>) -> PyResult<Py<PyArray2<f64>>> {
        let times: Vec<Vec<f64>> = self
            .inner
            .rests
            .iter()
            .map(|rest| {
                vec![
                    self.inner.origin + seconds::<f64>(rest.start),
                    self.inner.origin + seconds::<f64>(rest.end),
                ]
            })
            .collect();
        Ok(if times.is_empty() {
            PyArray2::zeros(py, [0, 2], false)
        } else {
            PyArray2::from_vec2(py, &times)?
        }
        .unbind())
    }

    /// Part of the recording (file of a folder) each rest belongs to.
    #[getter]
    fn rest_parts(&self) -> Vec<usize> {
        let part = |start: f64| {
            self.inner
                .parts
                .partition_point(|part| part.start <= start)
                .saturating_sub(1)
        };
        self.inner
            .rests
            .iter()
            .map(|rest| part(seconds(rest.start)))
            .collect()
    }

    /// (k,) samples in each rest.
    #[getter]
    fn rest_samples(&self) -> Vec<u32> {
        self.inner
            .rests
            .iter()
            .map(|rest| rest.moments.samples())
            .collect()
    }

    /// (k, 3) mean specific force at each rest, m/s^2.
    #[getter]
    fn rest_specific_force(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        stacked(py, self.inner.rests.iter().map(|rest| rest.specific_force()))
    }

    /// (k, 3) mean angular rate at each rest, rad/s.
    #[getter]
    fn rest_angular_rate(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        stacked(py, self.inner.rests.iter().map(|rest| rest.angular_rate()))
    }

    /// (k, 3) 1-sigma of the mean specific force, m/s^2.
    #[getter]
    fn rest_specific_force_sigma(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        stacked(
            py,
            (0..self.inner.rests.len()).map(|k| force_sigma(&self.inner, k)),
        )
    }

    /// (k, 3) 1-sigma of the mean angular rate, rad/s.
    #[getter]
    fn rest_angular_rate_sigma(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        stacked(
            py,
            (0..self.inner.rests.len()).map(|k| rate_sigma(&self.inner, k)),
        )
    }

    /// (k - 1, 3) integral of the angular rate between rests, rad, bias included.
    #[getter]
    fn turn_angles(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        stacked(py, self.inner.turns.iter().map(|turn| turn.angle()))
    }

    /// (k - 1,) whether every sample of each turn is known.
    #[getter]
    fn turn_complete(&self) -> Vec<bool> {
        self.inner.turns.iter().map(|turn| turn.complete).collect()
    }

    /// Segments that looked like rests: (start s, end s, code why not).
    #[getter]
    fn rejected_rests(&self) -> Vec<(f64, f64, &'static str)> {
        let at = |microseconds: u64| self.inner.origin + seconds::<f64>(microseconds);
        self.inner
            .rejected
            .iter()
            .map(|(rest, reason)| (at(rest.start), at(rest.end), reason.name()))
            .collect()
    }

    /// Segments of constant rate that are no rests: (start s, end s, `constant` or `unclear`, rate (3,) rad/s, specific
    /// force (3,) m/s^2).
    #[getter]
    fn constant_rates(&self) -> Vec<ConstantRate> {
        let at = |time: f64| self.inner.origin + time;
        self.inner
            .constant_rates()
            .map(|plateau| {
                let span = plateau.interval;
                (
                    at(span.start),
                    at(span.end),
                    plateau.kind.name(),
                    plateau.rate.into(),
                    plateau.force.into(),
                )
            })
            .collect()
    }

    /// (6,) white noise density, unit / sqrt(Hz).
    #[getter]
    fn noise_density(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        PyArray1::from_iter(py, self.inner.noise.iter().map(|noise| noise.white.sqrt())).unbind()
    }

    /// (6,) bias instability, unit; zero where the record does not show it by two sigma.
    #[getter]
    fn bias_instability(&self, py: Python<'_>) -> Py<PyArray1<f64>> {
        let shown = self.inner.noise.iter().map(|noise| {
            if noise.flicker > 2.0 * noise.flicker_sigma {
                noise.flicker.sqrt()
            } else {
                0.0
            }
        });
        PyArray1::from_iter(py, shown).unbind()
    }

    /// Channels of which rounding, or a dead band, leaves more on the mean of a rest than noise does: (name, step, half the
    /// width of the dead band, share of exact zeros at rest, 1-sigma of a mean), SI; zero where one of both does not matter.
    #[getter]
    fn coarse_channels(&self) -> Vec<(&'static str, f64, f64, f64, f64)> {
        let found = self.inner.coarse_channels().into_iter();
        found
            .map(|each| {
                let name = CHANNEL_NAMES[each.channel];
                (name, each.step, each.dead_band, each.zeros, each.sigma)
            })
            .collect()
    }

    /// Faulty channels: (name, `stuck`, `saturated at rest` or `saturated in motion`, value SI, first s, last s, samples at
    /// the end of the range, first and last s of each run of them).
    #[getter]
    fn faults(&self) -> Vec<Fault> {
        let at = |time: f64| self.inner.origin + time;
        self.inner
            .faults
            .iter()
            .map(|fault| {
                let (first, last) = fault.span;
                (
                    CHANNEL_NAMES[fault.channel],
                    fault.kind.name(),
                    fault.value,
                    at(first),
                    at(last),
                    fault.samples,
                    fault
                        .runs
                        .iter()
                        .map(|(first, last)| (at(*first), at(*last)))
                        .collect(),
                )
            })
            .collect()
    }

    /// The recording at a glance: time (n,) s, specific force (n, 3), angular rate (n, 3).
    fn trace(&self, py: Python<'_>) -> Traced {
        let points = self.inner.trace.points();
        (
            PyArray1::from_iter(py, points.iter().map(|(t, _)| self.inner.origin + t)).unbind(),
            stacked(py, points.iter().map(|(_, y)| Vector3::new(y[0], y[1], y[2]))),
            stacked(py, points.iter().map(|(_, y)| Vector3::new(y[3], y[4], y[5]))),
        )
    }

    fn __repr__(&self) -> String {
        format!(
            "Acquired({} samples, {} rests)",
            self.inner.samples,
            self.inner.rests.len()
        )
    }
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyAcquisition>()?;
    module.add_class::<PyAcquired>()?;
    module.add("GAP_INTERVALS", tumble_core::segmenter::GAP_INTERVALS)
}
