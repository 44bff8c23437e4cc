//! A robot that turns on the spot.

use nalgebra::Vector3;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::gravity::vertical_earth_rate;
use tumble_core::real::{Real, real};
use tumble_core::sample::Sample;
use tumble_core::spin::estimate::{Bias, SpinEstimate, TrueAngle, Value};
use tumble_core::spin::failure::Failure;
use tumble_core::spin::machine::{Event, SpinMachine, State, Wheels};
use tumble_core::spin::settings::SpinSettings;
use tumble_lab::spin::{Drawn, Fitted, fit};

use crate::convert::{array1, array2, rows, stacked};
use crate::turntable::CoreError;

/// How to spin and how to judge it.
#[pyclass(module = "tumble._core", name = "SpinSettings", frozen)]
pub struct PySpinSettings {
    inner: SpinSettings<f64>,
    bias_instability: Option<(f64, f64)>,
}

#[pymethods]
impl PySpinSettings {
    #[new]
    #[pyo3(signature = (gravity=9.80665, *, still=5.0, turns=2.0, rate=1.0, level_floor=false,
        largest_floor_tilt=0.1745, gyroscope_scale_sigma=0.01, accelerometer_range=None, gyroscope_range=None,
        still_timeout=60.0, spin_timeout=120.0, longest_gap=0.25, latitude=None, bias_instability=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        gravity: f64,
        still: f64,
        turns: f64,
        rate: f64,
        level_floor: bool,
        largest_floor_tilt: f64,
        gyroscope_scale_sigma: f64,
        accelerometer_range: Option<f64>,
        gyroscope_range: Option<f64>,
        still_timeout: f64,
        spin_timeout: f64,
        longest_gap: f64,
        latitude: Option<f64>,
        bias_instability: Option<(f64, f64)>,
    ) -> Self {
        Self {
            bias_instability,
            inner: SpinSettings {
                gravity,
                still: microseconds(still),
                turn: turns * core::f64::consts::TAU,
                rate,
                level_floor,
                largest_floor_tilt,
                scale_sigma: gyroscope_scale_sigma,
                specific_force_range: accelerometer_range,
                angular_rate_range: gyroscope_range,
                still_timeout: microseconds(still_timeout),
                spin_timeout: microseconds(spin_timeout),
                longest_gap: microseconds(longest_gap),
                earth_rate_up: latitude.map_or(0.0, vertical_earth_rate),
                bias_instability: bias_instability.unwrap_or_default(),
                ..SpinSettings::default()
            },
        }
    }
}

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
            Machine::Single(Box::new(SpinMachine::new(&converted(&settings.inner))))
        } else {
            Machine::Double(Box::new(SpinMachine::new(&settings.inner)))
        };
        Ok(Self {
            machine,
            settings: settings.inner,
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
        let samples = Samples::new(&time, &accelerometer, &gyroscope)?;
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

    /// Says that time has passed.
    fn tick(&mut self, time: f64) -> Option<&'static str> {
        let now = microseconds(time - self.origin?);
        let event = match &mut self.machine {
            Machine::Single(machine) => machine.tick(now),
            Machine::Double(machine) => machine.tick(now),
        };
        event.map(event_name)
    }

    /// Where the procedure is.
    #[getter]
    fn state(&self) -> &'static str {
        match &self.machine {
            Machine::Single(machine) => state_name(machine.state()),
            Machine::Double(machine) => state_name(machine.state()),
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

    /// How far it is.
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

    /// What was found so far.
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

/// Estimates from the samples of one spin.
#[pyfunction]
#[pyo3(signature = (time, accelerometer, gyroscope, rests, settings, precision="f64", true_angle=None))]
#[allow(clippy::too_many_arguments)]
fn fit_spin<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    accelerometer: PyReadonlyArray2<'py, f64>,
    gyroscope: PyReadonlyArray2<'py, f64>,
    rests: PyReadonlyArray2<'py, f64>,
    settings: &PySpinSettings,
    precision: &str,
    true_angle: Option<(f64, f64, f64)>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let samples = Samples::new(&time, &accelerometer, &gyroscope)?;
    let origin = samples.time.first().copied().unwrap_or(0.0);
    let rests: Vec<(u64, u64)> = rests
        .as_array()
        .rows()
        .into_iter()
        .map(|row| (microseconds(row[0] - origin), microseconds(row[1] - origin)))
        .collect();
    let (settings, instability) = (&settings.inner, settings.bias_instability);
    if is_single(precision)? {
        let narrow = instability.map(|(a, g)| (real(a), real(g)));
        let fitted =
            py.detach(|| samples.fit::<f32>(origin, &rests, &converted(settings), narrow, true_angle));
        both(py, fitted, origin)
    } else {
        let fitted = py.detach(|| samples.fit::<f64>(origin, &rests, settings, instability, true_angle));
        both(py, fitted, origin)
    }
}

/// Arrays of samples.
struct Samples<'a> {
    time: &'a [f64],
    force: &'a [[f64; 3]],
    rate: &'a [[f64; 3]],
}

impl<'a> Samples<'a> {
    fn new(
        time: &'a PyReadonlyArray1<'_, f64>,
        accelerometer: &'a PyReadonlyArray2<'_, f64>,
        gyroscope: &'a PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let (time, force, rate) = (
            time.as_slice()?,
            rows(accelerometer, "accelerometer")?,
            rows(gyroscope, "gyroscope")?,
        );
        if time.len() != force.len() || time.len() != rate.len() {
            return Err(PyValueError::new_err(
                "time, accelerometer and gyroscope must have the same length",
            ));
        }
        Ok(Self { time, force, rate })
    }

    fn iter<T: Real>(&self, origin: f64) -> impl Iterator<Item = Sample<T>> + Clone {
        self.time
            .iter()
            .zip(self.force.iter().zip(self.rate))
            .map(move |(time, (force, rate))| Sample {
                time: microseconds(time - origin),
                specific_force: Vector3::from(*force).map(real),
                angular_rate: Vector3::from(*rate).map(real),
            })
    }

    fn drive<T: Real>(
        &self,
        machine: &mut SpinMachine<T>,
        origin: f64,
        wheels: impl Fn(usize) -> Wheels,
    ) -> Vec<(f64, &'static str)> {
        self.iter(origin)
            .enumerate()
            .filter_map(|(i, sample)| {
                machine
                    .push(&sample, wheels(i))
                    .map(|event| (self.time[i], event_name(event)))
            })
            .collect()
    }

    fn fit<T: Real>(
        &self,
        origin: f64,
        rests: &[(u64, u64)],
        settings: &SpinSettings<T>,
        instability: Option<(T, T)>,
        angle: Option<(f64, f64, f64)>,
    ) -> Result<Fitted<T>, Failure<T>> {
        fit(
            self.iter(origin),
            rests,
            settings,
            instability,
            true_angle(angle).as_ref(),
        )
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn microseconds(seconds: f64) -> u64 {
    (seconds * 1e6).round().max(0.0) as u64
}

fn is_single(precision: &str) -> PyResult<bool> {
    match precision {
        "f32" => Ok(true),
        "f64" => Ok(false),
        _ => Err(PyValueError::new_err("precision is f32 or f64")),
    }
}

fn converted(settings: &SpinSettings<f64>) -> SpinSettings<f32> {
    let narrow = real::<f32>;
    SpinSettings {
        gravity: narrow(settings.gravity),
        still: settings.still,
        turn: narrow(settings.turn),
        rate: narrow(settings.rate),
        level_floor: settings.level_floor,
        largest_floor_tilt: narrow(settings.largest_floor_tilt),
        scale_sigma: narrow(settings.scale_sigma),
        specific_force_range: settings.specific_force_range.map(narrow),
        angular_rate_range: settings.angular_rate_range.map(narrow),
        still_timeout: settings.still_timeout,
        spin_timeout: settings.spin_timeout,
        longest_gap: settings.longest_gap,
        earth_rate_up: narrow(settings.earth_rate_up),
        bias_instability: (
            narrow(settings.bias_instability.0),
            narrow(settings.bias_instability.1),
        ),
        ..SpinSettings::default()
    }
}

fn wheels(moving: Option<f64>) -> Wheels {
    match moving {
        Some(moving) if moving > 0.0 => Wheels::Turning,
        Some(0.0) => Wheels::Stopped,
        _ => Wheels::Unknown,
    }
}

fn true_angle<T: Real>(angle: Option<(f64, f64, f64)>) -> Option<TrueAngle<T>> {
    let known = |value: f64| value.is_finite().then(|| real(value));
    angle.map(|(clockwise, counter_clockwise, sigma)| TrueAngle {
        clockwise: known(clockwise),
        counter_clockwise: known(counter_clockwise),
        sigma: real(sigma),
    })
}

fn event_name(event: Event) -> &'static str {
    match event {
        Event::StillBegan => "still began",
        Event::StillBroken => "still broken",
        Event::StillDone => "still done",
        Event::SpinBegan => "spin began",
        Event::Done => "done",
        Event::Failed => "failed",
    }
}

fn state_name<T: Real>(state: &State<T>) -> &'static str {
    match state {
        State::Idle => "idle",
        State::Still => "still",
        State::Spin => "spin",
        State::Done => "done",
        State::Failed(_) => "failed",
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

/// A number of either precision for Python.
fn wide<T: Real>(value: T) -> f64 {
    nalgebra::try_convert(value).unwrap_or(f64::NAN)
}

fn failure_of<'py, T: Real>(
    py: Python<'py>,
    state: &State<T>,
    origin: f64,
) -> PyResult<Option<(&'static str, Bound<'py, PyDict>)>> {
    match state {
        State::Failed(failure) => Ok(Some(failure_figures(py, failure, origin)?)),
        _ => Ok(None),
    }
}

#[allow(clippy::cast_precision_loss)]
fn failure_figures<'py, T: Real>(
    py: Python<'py>,
    failure: &Failure<T>,
    origin: f64,
) -> PyResult<(&'static str, Bound<'py, PyDict>)> {
    let at = |time: u64| origin + time as f64 * 1e-6;
    let (kind, figures): (_, Vec<(&str, f64)>) = match *failure {
        Failure::NeverStill { waited } => ("never still", vec![("waited", wide(waited))]),
        Failure::NoRest => ("no rest", vec![]),
        Failure::NoTurn { turned } => ("no turn", vec![("turned", wide(turned))]),
        Failure::TurnedTooLittle { turned, wanted } => (
            "turned too little",
            vec![("turned", wide(turned)), ("wanted", wide(wanted))],
        ),
        Failure::NotOneAxis { time, across, limit } => (
            "not one axis",
            vec![
                ("time", at(time)),
                ("across", wide(across)),
                ("limit", wide(limit)),
            ],
        ),
        Failure::Lifted { time, change, limit } => (
            "lifted",
            vec![
                ("time", at(time)),
                ("change", wide(change)),
                ("limit", wide(limit)),
            ],
        ),
        Failure::Saturated { time, channel, value } => (
            "saturated",
            vec![
                ("time", at(time)),
                ("channel", channel as f64),
                ("value", wide(value)),
            ],
        ),
        Failure::FloorTooSteep { tilt, limit } => (
            "floor too steep",
            vec![("tilt", wide(tilt)), ("limit", wide(limit))],
        ),
        Failure::SampleRateTooLow { rate, needed } => (
            "sample rate too low",
            vec![("rate", wide(rate)), ("needed", wide(needed))],
        ),
        Failure::SamplesMissing { time, gap } => {
            ("samples missing", vec![("time", at(time)), ("gap", wide(gap))])
        }
        Failure::StreamStopped { time, gap } => {
            ("stream stopped", vec![("time", at(time)), ("gap", wide(gap))])
        }
        Failure::Unsolvable => ("unsolvable", vec![]),
    };
    let dict = PyDict::new(py);
    for (name, value) in figures {
        dict.set_item(name, value)?;
    }
    Ok((kind, dict))
}

fn error<T: Real>(py: Python<'_>, failure: &Failure<T>, origin: f64) -> PyErr {
    match failure_figures(py, failure, origin) {
        Ok((kind, figures)) => CoreError::new_err((kind, figures.unbind())),
        Err(error) => error,
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

fn both<'py, T: Real>(
    py: Python<'py>,
    fitted: Result<Fitted<T>, Failure<T>>,
    origin: f64,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let fitted = fitted.map_err(|failure| error(py, &failure, origin))?;
    Ok((
        figures(py, &fitted.estimate)?,
        block_figures(py, &fitted.drawn, origin)?,
    ))
}

fn vector<T: Real>(py: Python<'_>, v: &Vector3<T>) -> Py<PyArray1<f64>> {
    array1(py, &v.map(wide))
}

fn value<T: Real>(value: &Value<T>) -> (f64, f64) {
    if value.is_known() {
        (wide(value.value), wide(value.sigma))
    } else {
        (f64::NAN, f64::INFINITY)
    }
}

fn bias<'py, T: Real>(py: Python<'py>, bias: &Bias<T>) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("value", vector(py, &bias.value))?;
    dict.set_item("sigma", vector(py, &bias.sigma))?;
    dict.set_item("observed", bias.observed)?;
    Ok(dict)
}

fn figures<'py, T: Real>(py: Python<'py>, estimate: &SpinEstimate<T>) -> PyResult<Bound<'py, PyDict>> {
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
    dict.set_item("published", bias(py, &estimate.published)?)?;
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
    dict.set_item("chi_square", wide(estimate.chi_square))?;
    dict.set_item("degrees_of_freedom", estimate.degrees_of_freedom)?;
    let noise = estimate.noise.iter().map(|row| row.map(wide));
    dict.set_item("noise", stacked(py, noise))?;
    Ok(dict)
}

#[allow(clippy::cast_precision_loss)]
fn block_figures<'py, T: Real>(
    py: Python<'py>,
    drawn: &[Drawn<T>],
    origin: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let column = |f: &dyn Fn(&Drawn<T>) -> f64| PyArray1::from_iter(py, drawn.iter().map(f));
    let dict = PyDict::new(py);
    dict.set_item("time", column(&|block| origin + block.time as f64 * 1e-6))?;
    dict.set_item("resting", column(&|block| f64::from(u8::from(block.resting))))?;
    dict.set_item("heading", column(&|block| wide(block.heading)))?;
    dict.set_item("rate", column(&|block| wide(block.rate)))?;
    let across: Vec<Vec<f64>> = drawn
        .iter()
        .map(|block| vec![wide(block.across.x), wide(block.across.y)])
        .collect();
    dict.set_item("across", numpy::PyArray2::from_vec2(py, &across)?)?;
    dict.set_item(
        "force",
        stacked(py, drawn.iter().map(|block| block.force.map(wide))),
    )?;
    dict.set_item("fit", stacked(py, drawn.iter().map(|block| block.fit.map(wide))))?;
    Ok(dict)
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySpinSettings>()?;
    module.add_class::<PySpinMachine>()?;
    module.add_function(wrap_pyfunction!(fit_spin, module)?)
}
