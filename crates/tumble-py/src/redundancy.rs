//! The redundancy monitor, driven from Python.

use nalgebra::{Matrix3, Vector3};
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::redundancy::monitor::Monitor;
use tumble_core::redundancy::platform::{MountedUnit, Range};
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::{Axes, Sensor};
use tumble_core::redundancy::settings::thresholds::Threshold;
use tumble_lab::redundancy::dyn_monitor::{DynMonitor, EventLog, MOST_UNITS, Model, build};
use tumble_lab::redundancy::replay::{Replay, ReplayOptions, ReplayUnit, earliest, replay};
use tumble_lab::setting::{Value, in_seconds, threshold};
use tumble_lab::setting_table;

use crate::convert::{matrix, rows};
use crate::redundancy_values::{
    PySaid, aiding, command, figures, model, offset, output, platform_error, read_record, rejection, traces,
    vector, write_record,
};
use crate::settings::{settings_of, values};
use crate::spin::is_single;

/// Description of a unit for the monitor.
#[pyclass(module = "tumble._core", name = "RedundancyUnit", frozen)]
pub struct PyUnit {
    unit: MountedUnit<f64>,
    calibration: [Model; 2],
}

#[pymethods]
impl PyUnit {
    #[new]
    #[pyo3(signature = (identity, *, sensor_from_primary=None, lever_arm=None, time_offset=0.0,
        axes=[true; 6], specific_force_range=None, angular_rate_range=None, accelerometer_threshold=None,
        gyroscope_threshold=None, calibration=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        identity: u64,
        sensor_from_primary: Option<PyReadonlyArray2<'_, f64>>,
        lever_arm: Option<PyReadonlyArray1<'_, f64>>,
        time_offset: f64,
        axes: [bool; 6],
        specific_force_range: Option<f64>,
        angular_rate_range: Option<f64>,
        accelerometer_threshold: Option<String>,
        gyroscope_threshold: Option<String>,
        calibration: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let turn = sensor_from_primary.map(|turn| matrix(&turn, "sensor_from_primary"));
        let model = |sensor| calibration.map_or(Ok(None), |found| model(found, sensor));
        let none = (Matrix3::identity(), Vector3::zeros(), 0.0);
        let own = |text: Option<String>| text.map(own_threshold).transpose();
        Ok(Self {
            unit: MountedUnit {
                identity,
                axes: Axes(axes),
                range: Range {
                    specific_force: specific_force_range,
                    angular_rate: angular_rate_range,
                },
                time_offset: offset(time_offset),
                sensor_from_primary: turn.transpose()?.unwrap_or(Matrix3::identity()),
                lever_arm: lever_arm.map(|arm| vector(&arm, "lever_arm")).transpose()?,
                thresholds: [own(accelerometer_threshold)?, own(gyroscope_threshold)?],
            },
            calibration: [
                model(Sensor::Accelerometer)?.unwrap_or(none),
                model(Sensor::Gyroscope)?.unwrap_or(none),
            ],
        })
    }
}

fn own_threshold(text: String) -> PyResult<Threshold<f64>> {
    let unfit = || PyValueError::new_err(format!("'{text}' is no threshold"));
    threshold(&Value::Text(text.clone())).ok_or_else(unfit)
}

/// A primary and its secondaries.
#[pyclass(module = "tumble._core", name = "RedundancyMonitor")]
pub struct PyMonitor {
    monitor: Box<dyn DynMonitor>,
    units: usize,
    time_offsets: Vec<f64>,
    origin: Option<f64>,
    restored: EventLog,
    records: Vec<(Record<f64>, Option<f64>)>,
}

/// When the first sample that is handed over was taken, s of the common clock; infinite where there is none.
fn first_of(unit_samples: &[ReplayUnit<'_>]) -> f64 {
    let first = earliest(unit_samples, &vec![0; unit_samples.len()]);
    let samples = first.and_then(|unit| unit_samples.get(unit));
    samples
        .and_then(|samples| samples.common_time(0))
        .unwrap_or(f64::INFINITY)
}

/// Time 0 of the monitor, s: before all samples, on the common clock and on that of each unit, since a monitor knows no
/// time before 0.
fn origin(first: f64, time_offsets: &[f64]) -> f64 {
    let farthest_behind = time_offsets.iter().copied().fold(0.0, f64::max);
    (first - farthest_behind).floor() - 1.0
}

#[pymethods]
impl PyMonitor {
    #[new]
    #[pyo3(signature = (units, settings, precision="f64"))]
    fn new(units: Vec<PyRef<'_, PyUnit>>, settings: &Bound<'_, PyDict>, precision: &str) -> PyResult<Self> {
        let built: Vec<MountedUnit<f64>> = units.iter().map(|unit| unit.unit).collect();
        let values = values(settings)?;
        let primary = units.first().map(|unit| unit.calibration);
        let calibration = primary.ok_or_else(|| PyValueError::new_err("a set has a primary"))?;
        let wide = settings_of(&setting_table::redundancy::<f64>(), &values)?;
        let set = if is_single(precision)? {
            let narrow = settings_of(&setting_table::redundancy::<f32>(), &values)?;
            build(&built, &calibration, narrow)
        } else {
            build(&built, &calibration, wide)
        };
        let set = set.ok_or_else(|| PyValueError::new_err(format!("a set has 2 to {MOST_UNITS} units")))?;
        Ok(Self {
            monitor: set.map_err(|error| platform_error(settings.py(), &error))?,
            units: built.len(),
            time_offsets: built.iter().map(|unit| unit.time_offset as f64 * 1e-6).collect(),
            origin: None,
            restored: EventLog::default(),
            records: Vec::new(),
        })
    }

    /// Restores a stored error of a secondary; returns the reason if it was rejected.
    fn restore(&mut self, record: &Bound<'_, PyDict>) -> PyResult<Option<&'static str>> {
        let record = read_record(record)?;
        self.monitor.restore(&record, &mut self.restored);
        let why = self.restored.events.last().and_then(rejection);
        if why.is_none() {
            self.keep(record, None);
        }
        Ok(why)
    }

    /// Takes the error that a secondary had from the factory, from which thresholds may be counted.
    fn restore_factory(&mut self, record: &Bound<'_, PyDict>) -> PyResult<()> {
        self.monitor.restore_factory(&read_record(record)?);
        Ok(())
    }

    /// Everything stored.
    fn records<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let record = |(record, adopted): &(Record<f64>, Option<f64>)| write_record(py, record, *adopted);
        self.records.iter().map(record).collect()
    }

    /// Pushes the samples of all units, in order of time, or of arrival where that is given.
    #[pyo3(signature = (times, specific_forces, angular_rates, commands=Vec::new(), measurements=Vec::new(), keep_output=false, progress=None, arrivals=None, temperatures=None))]
    #[allow(clippy::too_many_arguments)]
    fn replay<'py>(
        &mut self,
        py: Python<'py>,
        times: Vec<PyReadonlyArray1<'py, f64>>,
        specific_forces: Vec<PyReadonlyArray2<'py, f64>>,
        angular_rates: Vec<PyReadonlyArray2<'py, f64>>,
        commands: Vec<(f64, String)>,
        measurements: Vec<PySaid<'py>>,
        keep_output: bool,
        progress: Option<Py<PyAny>>,
        arrivals: Option<Vec<PyReadonlyArray1<'py, f64>>>,
        temperatures: Option<Vec<Option<PyReadonlyArray1<'py, f64>>>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let arrived = arrivals.as_ref().map_or(self.units, Vec::len);
        let warm = temperatures.as_ref().map_or(self.units, Vec::len);
        if [
            times.len(),
            specific_forces.len(),
            angular_rates.len(),
            arrived,
            warm,
        ] != [self.units; 5]
        {
            return Err(PyValueError::new_err(format!(
                "arrays of {} units are wanted",
                self.units
            )));
        }
        let mut unit_samples = Vec::new();
        for (i, time) in times.iter().enumerate() {
            let arrival = arrivals.as_ref().and_then(|arrivals| arrivals.get(i));
            let arrival = arrival.map(PyReadonlyArray1::as_slice).transpose()?;
            if arrival.is_some_and(|arrival| arrival.len() != time.as_array().len()) {
                return Err(unequal());
            }
            let (force, rate) = (&specific_forces[i], &angular_rates[i]);
            let temperature = temperatures.as_ref().and_then(|told| told.get(i)?.as_ref());
            unit_samples.push(ReplayUnit {
                time_offset: self.time_offsets[i],
                arrival,
                ..unit_rows(time, force, rate, temperature)?
            });
        }
        let (done, seconds) = self.run(
            py,
            &unit_samples,
            &commands,
            &measurements,
            keep_output,
            progress.as_ref(),
        )?;
        let dict = self.said(py, &done, first_of(&unit_samples))?;
        traces(py, &dict, &done, self.units, self.origin.unwrap_or(0.0))?;
        dict.set_item("seconds", seconds)?;
        Ok(dict)
    }

    /// Pushes samples of one unit as they come.
    #[pyo3(signature = (unit, time, specific_force, angular_rate, commands=Vec::new(), measurements=Vec::new(), temperature=None))]
    #[allow(clippy::too_many_arguments)]
    fn push<'py>(
        &mut self,
        py: Python<'py>,
        unit: usize,
        time: PyReadonlyArray1<'py, f64>,
        specific_force: PyReadonlyArray2<'py, f64>,
        angular_rate: PyReadonlyArray2<'py, f64>,
        commands: Vec<(f64, String)>,
        measurements: Vec<PySaid<'py>>,
        temperature: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut unit_samples = vec![ReplayUnit::silent(); self.units];
        let (Some(place), Some(offset)) = (unit_samples.get_mut(unit), self.time_offsets.get(unit)) else {
            return Err(PyValueError::new_err(format!("there is no unit {unit}")));
        };
        *place = ReplayUnit {
            time_offset: *offset,
            ..unit_rows(&time, &specific_force, &angular_rate, temperature.as_ref())?
        };
        let (done, _) = self.run(py, &unit_samples, &commands, &measurements, true, None)?;
        self.said(py, &done, first_of(&unit_samples))
    }

    /// Memory of a monitor, bytes, that calibrates one secondary at a time and takes no aiding measurement.
    #[staticmethod]
    #[pyo3(signature = (secondaries, precision="f32"))]
    fn state_bytes(secondaries: usize, precision: &str) -> PyResult<usize> {
        let single = is_single(precision)?;
        macro_rules! bytes {
            ($units:literal) => {
                if single {
                    size_of::<Monitor<f32, $units, 1>>()
                } else {
                    size_of::<Monitor<f64, $units, 1>>()
                }
            };
        }
        match secondaries {
            1 => Ok(bytes!(2)),
            2 => Ok(bytes!(3)),
            3 => Ok(bytes!(4)),
            4 => Ok(bytes!(5)),
            5 => Ok(bytes!(6)),
            6 => Ok(bytes!(7)),
            7 => Ok(bytes!(8)),
            _ => Err(PyValueError::new_err("a set has 1 to 7 secondaries")),
        }
    }
}

/// Rows of the samples of one unit; arrays of one length.
pub(crate) fn unit_rows<'a>(
    time: &'a PyReadonlyArray1<'_, f64>,
    specific_force: &'a PyReadonlyArray2<'_, f64>,
    angular_rate: &'a PyReadonlyArray2<'_, f64>,
    temperature: Option<&'a PyReadonlyArray1<'_, f64>>,
) -> PyResult<ReplayUnit<'a>> {
    let samples = ReplayUnit {
        time: time.as_slice()?,
        specific_force: rows(specific_force, "specific force")?,
        angular_rate: rows(angular_rate, "angular rate")?,
        temperature: temperature.map(PyReadonlyArray1::as_slice).transpose()?,
        ..ReplayUnit::silent()
    };
    let count = samples.time.len();
    let told = samples.temperature.map_or(count, <[f64]>::len);
    if [samples.specific_force.len(), samples.angular_rate.len(), told] != [count; 3] {
        return Err(unequal());
    }
    Ok(samples)
}

fn unequal() -> PyErr {
    PyValueError::new_err("arrays of a unit must have the same length")
}

impl PyMonitor {
    /// Pushes samples without holding Python up; gives what came of them, and the seconds it took.
    fn run(
        &mut self,
        py: Python<'_>,
        unit_samples: &[ReplayUnit<'_>],
        commands: &[(f64, String)],
        measurements: &[PySaid<'_>],
        keep_output: bool,
        progress: Option<&Py<PyAny>>,
    ) -> PyResult<(Replay, f64)> {
        let commands: Vec<_> = commands.iter().map(command).collect::<PyResult<_>>()?;
        let measurements: Vec<_> = measurements.iter().map(aiding).collect::<PyResult<_>>()?;
        let first = first_of(unit_samples);
        if first.is_finite() {
            self.origin
                .get_or_insert_with(|| origin(first, &self.time_offsets));
        }
        let origin = self.origin.unwrap_or(0.0);
        let begun = std::time::Instant::now();
        let mut failed = None;
        let monitor = &mut self.monitor;
        let done = py.detach(|| {
            let mut tell = |share: f64| {
                let Some(progress) = progress else { return true };
                match Python::attach(|py| progress.call1(py, (share,)).map(|_| py.check_signals())) {
                    Ok(Ok(())) => true,
                    Ok(Err(error)) | Err(error) => {
                        failed = Some(error);
                        false
                    }
                }
            };
            let mut options = ReplayOptions {
                commands: &commands,
                measurements: &measurements,
                keep_output,
                origin,
                progress: &mut tell,
            };
            replay(monitor.as_mut(), unit_samples, &mut options)
        });
        if let Some(error) = failed {
            return Err(error);
        }
        for (_, time, record) in &done.log.adopted {
            self.keep(*record, Some(in_seconds(*time) + origin));
        }
        Ok((done, begun.elapsed().as_secs_f64()))
    }

    /// Events and output, s of the common clock; `first` is the time of events before any sample.
    fn said<'py>(&mut self, py: Python<'py>, done: &Replay, first: f64) -> PyResult<Bound<'py, PyDict>> {
        let origin = self.origin.unwrap_or(0.0);
        let restored = core::mem::take(&mut self.restored.events);
        let mut events = Vec::new();
        for event in &restored {
            events.push((first, event.unit, event.event, figures(py, event)?));
        }
        for event in &done.log.events {
            let time = in_seconds(event.time) + origin;
            events.push((time, event.unit, event.event, figures(py, event)?));
        }
        let dict = output(py, done, origin)?;
        dict.set_item("events", events)?;
        Ok(dict)
    }

    fn keep(&mut self, record: Record<f64>, adopted: Option<f64>) {
        let same = |(other, _): &(Record<f64>, _)| {
            other.identity == record.identity && other.sensor == record.sensor
        };
        match self.records.iter_mut().find(|kept| same(kept)) {
            Some(kept) => *kept = (record, adopted),
            None => self.records.push((record, adopted)),
        }
    }
}

/// Adds this part to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyUnit>()?;
    module.add_class::<PyMonitor>()
}
