//! The redundant set by one model, driven from Python.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::redundancy::model::monitor::{SetEvent, SetEventKind};
use tumble_core::redundancy::model::test::Exceedance;
use tumble_lab::redundancy::dyn_monitor::MOST_UNITS;
use tumble_lab::redundancy::dyn_set::{DynSet, build, fly};
use tumble_lab::setting::in_seconds;

use crate::redundancy::unit_rows;
use crate::spin::is_single;

/// An event as Python has it: time s, unit or -1, name, figures.
type Told<'py> = (f64, i64, &'static str, Bound<'py, PyDict>);

/// s between time 0 of a monitor and the first sample: clocks of secondaries may be behind by less.
const BEFORE: f64 = 1.0;

/// A set of units.
#[pyclass(module = "tumble._core", name = "SetMonitor")]
pub struct PySetMonitor {
    monitor: Box<dyn DynSet>,
    units: usize,
}

#[pymethods]
impl PySetMonitor {
    #[new]
    #[pyo3(signature = (units, finds_delays=true, precision="f64"))]
    fn new(units: usize, finds_delays: bool, precision: &str) -> PyResult<Self> {
        let built = if is_single(precision)? {
            build::<f32>(units, finds_delays)
        } else {
            build::<f64>(units, finds_delays)
        };
        let monitor =
            built.ok_or_else(|| PyValueError::new_err(format!("a set has 2 to {MOST_UNITS} units")))?;
        Ok(Self { monitor, units })
    }

    /// Pushes the samples of all units in the order of their arrivals, or of their stamps.
    #[pyo3(signature = (times, specific_forces, angular_rates, arrivals=None))]
    fn replay<'py>(
        &mut self,
        py: Python<'py>,
        times: Vec<PyReadonlyArray1<'py, f64>>,
        specific_forces: Vec<PyReadonlyArray2<'py, f64>>,
        angular_rates: Vec<PyReadonlyArray2<'py, f64>>,
        arrivals: Option<Vec<PyReadonlyArray1<'py, f64>>>,
    ) -> PyResult<Vec<Told<'py>>> {
        if [times.len(), specific_forces.len(), angular_rates.len()] != [self.units; 3] {
            let wanted = format!("arrays of {} units are wanted", self.units);
            return Err(PyValueError::new_err(wanted));
        }
        let arrays = times.iter().zip(&specific_forces).zip(&angular_rates);
        let logs = arrays.map(|((time, force), rate)| unit_rows(time, force, rate, None));
        let mut logs = logs.collect::<PyResult<Vec<_>>>()?;
        for (log, arrival) in logs.iter_mut().zip(arrivals.iter().flatten()) {
            let arrival = arrival.as_slice()?;
            if arrival.len() != log.time.len() {
                return Err(PyValueError::new_err("each sample arrives once"));
            }
            log.arrival = Some(arrival);
        }
        let first = logs.iter().filter_map(|log| log.time.first()).copied();
        let origin = first.fold(f64::INFINITY, f64::min).floor() - BEFORE;
        let monitor = &mut self.monitor;
        let events = py.detach(|| fly(monitor.as_mut(), &logs, origin));
        events.iter().map(|event| told(py, event, origin)).collect()
    }

    /// States what is known of a secondary.
    fn set_errors(&mut self, unit: usize, rate: [f64; 22], force: [f64; 135]) {
        self.monitor.set_errors(unit, &(rate, force));
    }

    /// Known errors of a secondary.
    fn errors(&self, unit: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let (rate, force) = self.monitor.errors(unit)?;
        Some((rate.to_vec(), force.to_vec()))
    }

    /// Memory of the monitor, bytes.
    fn state_bytes(&self) -> usize {
        self.monitor.state_bytes()
    }
}

fn told<'py>(py: Python<'py>, event: &SetEvent<f64>, origin: f64) -> PyResult<Told<'py>> {
    let figures = PyDict::new(py);
    match event.kind {
        SetEventKind::Unhealthy { reason, finding, .. } => {
            figures.set_item("reason", reason.name())?;
            if let Some(finding) = finding {
                tell(&figures, &finding)?;
            }
        }
        SetEventKind::Disagree { other, finding } => {
            figures.set_item("other", other)?;
            tell(&figures, &finding)?;
        }
        SetEventKind::Selected { why } => figures.set_item("reason", why.name())?,
        SetEventKind::Healthy | SetEventKind::Agree { .. } => {}
    }
    let unit = event.unit.map_or(-1, |unit| unit as i64);
    Ok((in_seconds(event.time) + origin, unit, event.kind.name(), figures))
}

fn tell(figures: &Bound<'_, PyDict>, finding: &Exceedance<f64>) -> PyResult<()> {
    figures.set_item("sensor", finding.sensor.name())?;
    figures.set_item("seconds", finding.seconds)?;
    figures.set_item("ratio", finding.ratio)
}

/// Adds this part to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySetMonitor>()
}
