//! Times of samples whose stamps come late.

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use tumble_lab::stamps::{self, LatenessEvidence, SampleTimes, StampJudgement, are_late, fit_times};

use crate::convert::rows;

/// Tests whether (n,) stamps, s, scatter so much that even times differ from them.
#[pyfunction]
fn stamps_are_late(py: Python<'_>, stamps: PyReadonlyArray1<'_, f64>) -> PyResult<bool> {
    let stamps = stamps.as_slice()?;
    Ok(py.detach(|| are_late(stamps)))
}

/// Scatter, s, of the steps between (n,) stamps, s, that no times fit.
#[pyfunction]
fn scatter_of_steps(py: Python<'_>, stamps: PyReadonlyArray1<'_, f64>) -> PyResult<f64> {
    let stamps = stamps.as_slice()?;
    Ok(py.detach(|| stamps::scatter_of_steps(stamps)))
}

/// Even times fitted to late stamps.
#[pyclass(module = "tumble._core", name = "SampleTimes")]
struct PySampleTimes {
    times: SampleTimes,
    evidence: LatenessEvidence,
}

#[pymethods]
impl PySampleTimes {
    /// Fits (n,) stamps, s; `None` where nobody knows which sample is which.
    #[staticmethod]
    fn fit(py: Python<'_>, stamps: PyReadonlyArray1<'_, f64>) -> PyResult<Option<Self>> {
        let stamps = stamps.as_slice()?;
        let found = py.detach(|| fit_times(stamps));
        Ok(found.map(|times| Self {
            times,
            evidence: LatenessEvidence::default(),
        }))
    }

    /// Takes in successive samples as evidence of when they were taken.
    fn push(
        &mut self,
        py: Python<'_>,
        stamps: PyReadonlyArray1<'_, f64>,
        accelerometer: PyReadonlyArray2<'_, f64>,
        gyroscope: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<()> {
        let stamps = stamps.as_slice()?;
        let (force, rate) = (
            rows(&accelerometer, "accelerometer")?,
            rows(&gyroscope, "gyroscope")?,
        );
        if stamps.len() != force.len() || stamps.len() != rate.len() {
            return Err(PyValueError::new_err(
                "stamps, accelerometer and gyroscope must have the same length",
            ));
        }
        let Self { times, evidence } = self;
        py.detach(|| evidence.push(times, stamps, force, rate));
        Ok(())
    }

    /// (count,) s of successive samples, from a row on.
    fn times(&self, py: Python<'_>, first_row: usize, count: usize) -> Py<PyArray1<f64>> {
        PyArray1::from_iter(py, (first_row..first_row + count).map(|row| self.times.at(row))).unbind()
    }

    /// 1-sigma, s, of the (n,) stamps, s, of the whole recording, which stay; `None` where fitted times replace them.
    fn kept_sigma(&self, py: Python<'_>, stamps: PyReadonlyArray1<'_, f64>) -> PyResult<Option<f64>> {
        let stamps = stamps.as_slice()?;
        let Self { times, evidence } = self;
        Ok(match py.detach(|| stamps::judge(times, evidence, stamps)) {
            StampJudgement::Fitted => None,
            StampJudgement::Kept(sigma) => Some(sigma),
        })
    }

    /// A word of `Sampling`.
    #[getter]
    fn sampling(&self) -> &'static str {
        self.evidence.sampling().name()
    }

    /// Share of the scatter by which samples were taken late, and its sigma.
    #[getter]
    fn share(&self) -> Option<(f64, f64)> {
        self.evidence.share()
    }

    /// Mean s from one sample to the next.
    #[getter]
    fn interval(&self) -> f64 {
        self.times.interval()
    }

    /// s by which the latest stamps are behind.
    #[getter]
    fn latest(&self) -> f64 {
        self.times.latest
    }

    /// 1-sigma of the step between stamps, s.
    #[getter]
    fn scatter(&self) -> f64 {
        self.times.period.scatter
    }

    /// Mean number of samples that were stamped together.
    #[getter]
    fn burst(&self) -> f64 {
        self.times.period.burst
    }

    /// Samples lost.
    #[getter]
    fn lost(&self) -> u64 {
        self.times.lost
    }

    /// 1-sigma of times beside each other, s.
    #[getter]
    fn sigma(&self) -> f64 {
        self.times.sigma()
    }

    /// 1-sigma of a span of time, relative.
    #[getter]
    fn rate_sigma(&self) -> f64 {
        self.times.rate_sigma()
    }
}

/// Adds all of this to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySampleTimes>()?;
    module.add_function(wrap_pyfunction!(scatter_of_steps, module)?)?;
    module.add_function(wrap_pyfunction!(stamps_are_late, module)?)
}
