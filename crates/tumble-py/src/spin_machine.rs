//! The device's state machine, driven from Python.

use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::real::Real;
use tumble_core::spin::machine::{SpinEvent, SpinMachine, SpinState, Wheels};
use tumble_core::spin::settings::SpinSettings;
use tumble_lab::spin::read_bias_instability;

use crate::spin::{PySpinSettings, SampleArrays, is_single, microseconds, true_angle};
use crate::spin_figures::{error, failure_figures, figures, wide};

/// The state machine in one of the two precisions.
enum Machine {
    Single(Box<SpinMachine<f32>>),
    Double(Box<SpinMachine<f64>>),
}

/// The device's state machine.
#[pyclass(module = "tumble._core", name = "SpinMachine")]
pub struct PySpinMachine {
    machine: Machine,
    settings: SpinSettings<f64>,
    origin: Option<f64>,
}

#[pymethods]
impl PySpinMachine {
    #[new]
    #[pyo3(signature = (settings, precision="f64"))]
    fn new(settings: &PySpinSettings, precision: &str) -> PyResult<Self> {
        let machine = if is_single(precision)? {
            Machine::Single(Box::new(SpinMachine::new(&settings.narrow)))
        } else {
            Machine::Double(Box::new(SpinMachine::new(&settings.wide)))
        };
        Ok(Self {
            machine,
            settings: settings.wide,
            origin: None,
        })
    }

    /// Idle -> still.
    fn start(&mut self) {
        match &mut self.machine {
            Machine::Single(machine) => machine.start(),
            Machine::Double(machine) => machine.start(),
        }
    }

    /// Takes in successive samples.
    #[pyo3(signature = (time, accelerometer, gyroscope, moving=None))]
    fn push(
        &mut self,
        time: PyReadonlyArray1<'_, f64>,
        accelerometer: PyReadonlyArray2<'_, f64>,
        gyroscope: PyReadonlyArray2<'_, f64>,
        moving: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Vec<(f64, &'static str)>> {
        let samples = SampleArrays::new(&time, &accelerometer, &gyroscope)?;
        let moving = moving.as_ref().map(PyReadonlyArray1::as_slice).transpose()?;
        let Some(first) = samples.time.first() else {
            return Ok(Vec::new());
        };
        let origin = *self.origin.get_or_insert(*first);
        let wheels = |i: usize| wheels(moving.and_then(|moving| moving.get(i)).copied());
        Ok(match &mut self.machine {
            Machine::Single(machine) => samples.drive(machine, origin, wheels),
            Machine::Double(machine) => samples.drive(machine, origin, wheels),
        })
    }

    /// Advances the time.
    fn tick(&mut self, time: f64) -> Option<&'static str> {
        let now = microseconds(time - self.origin?);
        let event = match &mut self.machine {
            Machine::Single(machine) => machine.tick(now),
            Machine::Double(machine) => machine.tick(now),
        };
        event.map(|event| event.name())
    }

    /// Reads bias instability off the samples of the spin that was made.
    fn read_bias_instability(
        &mut self,
        time: PyReadonlyArray1<'_, f64>,
        accelerometer: PyReadonlyArray2<'_, f64>,
        gyroscope: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<()> {
        let samples = SampleArrays::new(&time, &accelerometer, &gyroscope)?;
        let origin = self.origin.unwrap_or(0.0);
        match &mut self.machine {
            Machine::Single(machine) => read_bias_instability(machine, samples.iter(origin)),
            Machine::Double(machine) => read_bias_instability(machine, samples.iter(origin)),
        }
        Ok(())
    }

    /// Where the procedure is.
    #[getter]
    fn state(&self) -> &'static str {
        match &self.machine {
            Machine::Single(machine) => machine.state().name(),
            Machine::Double(machine) => machine.state().name(),
        }
    }

    /// Kind and figures of what went wrong.
    #[getter]
    fn failure<'py>(&self, py: Python<'py>) -> PyResult<Option<(&'static str, Bound<'py, PyDict>)>> {
        let origin = self.origin.unwrap_or(0.0);
        match &self.machine {
            Machine::Single(machine) => failure_of(py, machine.state(), origin),
            Machine::Double(machine) => failure_of(py, machine.state(), origin),
        }
    }

    /// Progress of the spin.
    #[getter]
    fn progress<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (still, turned, rate, at_rest) = match &self.machine {
            Machine::Single(machine) => progress_of(machine),
            Machine::Double(machine) => progress_of(machine),
        };
        let dict = PyDict::new(py);
        dict.set_item("still", still)?;
        dict.set_item("still_wanted", self.settings.still as f64 * 1e-6)?;
        dict.set_item("turned", turned)?;
        dict.set_item("turned_wanted", self.settings.turn)?;
        dict.set_item("rate", rate)?;
        dict.set_item("at_rest", at_rest)?;
        Ok(dict)
    }

    /// Estimates so far.
    #[pyo3(signature = (true_angle=None))]
    fn figures<'py>(
        &self,
        py: Python<'py>,
        true_angle: Option<(f64, f64, f64)>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let origin = self.origin.unwrap_or(0.0);
        match &self.machine {
            Machine::Single(machine) => solved(py, machine, true_angle, origin),
            Machine::Double(machine) => solved(py, machine, true_angle, origin),
        }
    }

    /// Memory of the machine, bytes.
    #[staticmethod]
    #[pyo3(signature = (precision="f32"))]
    fn state_bytes(precision: &str) -> PyResult<usize> {
        Ok(if is_single(precision)? {
            size_of::<SpinMachine<f32>>()
        } else {
            size_of::<SpinMachine<f64>>()
        })
    }
}

impl SampleArrays<'_> {
    fn drive<T: Real>(
        &self,
        machine: &mut SpinMachine<T>,
        origin: f64,
        wheels: impl Fn(usize) -> Wheels,
    ) -> Vec<(f64, &'static str)> {
        self.iter(origin)
            .enumerate()
            .filter_map(|(i, sample)| {
                let event = machine
                    .push(&sample, wheels(i))
                    .or_else(|| solved_at_once(machine));
                event.map(|event| (self.time[i], event.name()))
            })
            .collect()
    }
}

/// All slices of a spin that is to be solved: there is no next sample to wait for.
fn solved_at_once<T: Real>(machine: &mut SpinMachine<T>) -> Option<SpinEvent> {
    while matches!(machine.state(), SpinState::Solving) {
        if let Some(event) = machine.work() {
            return Some(event);
        }
    }
    None
}

fn wheels(moving: Option<f64>) -> Wheels {
    match moving {
        Some(moving) if moving > 0.0 => Wheels::Turning,
        Some(0.0) => Wheels::Stopped,
        _ => Wheels::Unknown,
    }
}

fn progress_of<T: Real>(machine: &SpinMachine<T>) -> (f64, f64, f64, bool) {
    let progress = machine.progress();
    (
        wide(progress.still),
        wide(progress.turned),
        wide(progress.rate),
        progress.at_rest,
    )
}

fn failure_of<'py, T: Real>(
    py: Python<'py>,
    state: &SpinState<T>,
    origin: f64,
) -> PyResult<Option<(&'static str, Bound<'py, PyDict>)>> {
    match state {
        SpinState::Failed(failure) => Ok(Some(failure_figures(py, failure, origin)?)),
        _ => Ok(None),
    }
}

fn solved<'py, T: Real>(
    py: Python<'py>,
    machine: &SpinMachine<T>,
    angle: Option<(f64, f64, f64)>,
    origin: f64,
) -> PyResult<Bound<'py, PyDict>> {
    match machine.solve(true_angle(angle).as_ref()) {
        Ok(estimate) => figures(py, &estimate),
        Err(failure) => Err(error(py, &failure, origin)),
    }
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySpinMachine>()
}
