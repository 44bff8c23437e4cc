//! Turntable sessions with known truth: plain mappings in, arrays out.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::simulate::fault::{Channels, Fault, Samples};
use tumble_lab::simulate::grade::{Grade, TriadGrade};
use tumble_lab::simulate::motion::{Pose, Table};
use tumble_lab::simulate::sensor::{Geometry, Triad};
use tumble_lab::simulate::turn::{Limits, Profile};
use tumble_lab::simulate::turntable::{Scenario, Session, simulate};
use tumble_lab::simulate::unit::{
    Ageing, Clock, ClockSetup, Conditions, Mounting, Unit, UnitRecord, Warming,
};

use crate::convert::{array1, array2, stacked};

/// A rotation vector in rad, or an angle in rad about an axis to be drawn.
#[derive(FromPyObject)]
enum RotationInput {
    Angle(f64),
    Vector([f64; 3]),
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct PoseInput {
    up: [f64; 3],
    tip: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct TriadInput {
    noise_density: f64,
    bias_instability: f64,
    turn_on_bias: f64,
    scale_error: f64,
    non_orthogonality: f64,
    alignment: f64,
    temperature_coefficient: f64,
    quantisation: f64,
    range: f64,
    g_sensitivity: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct GradeInput {
    accelerometer: TriadInput,
    gyroscope: TriadInput,
    temperature_step: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ClockInput {
    drawn: bool,
    offset: f64,
    skew: f64,
    phase: Option<f64>,
}

/// What a bias has moved by, or a multiple of the turn-on bias that it has moved by, drawn.
#[derive(FromPyObject)]
enum AgeingInput {
    Multiple(f64),
    Vector([f64; 3]),
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct FaultInput {
    kind: String,
    channels: String,
    axis: usize,
    other_axis: usize,
    start: f64,
    end: f64,
    size: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct UnitInput {
    grade: GradeInput,
    perfect: bool,
    rate: f64,
    mounting: RotationInput,
    ageing: [AgeingInput; 2],
    lever_arm: [f64; 3],
    clock: ClockInput,
    latency: f64,
    faults: Vec<FaultInput>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct TableInput {
    poses: Vec<PoseInput>,
    rest_duration: f64,
    profile: String,
    turn_rate: f64,
    turn_acceleration: f64,
    heading_turn: f64,
    error: f64,
    gravity: f64,
    latitude: Option<f64>,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ConditionsInput {
    seed: u64,
    temperature_start: f64,
    temperature_rise: f64,
    warming_time: f64,
    bias_instability: bool,
    quantisation: bool,
    g_sensitivity: bool,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ScenarioInput {
    conditions: ConditionsInput,
    table: TableInput,
    mounting: RotationInput,
    reference: UnitInput,
    targets: Vec<UnitInput>,
}

impl From<RotationInput> for Mounting {
    fn from(input: RotationInput) -> Self {
        match input {
            RotationInput::Angle(angle) => Mounting::Angle(angle),
            RotationInput::Vector(vector) => Mounting::Given(vector.into()),
        }
    }
}

impl From<TriadInput> for TriadGrade {
    fn from(input: TriadInput) -> Self {
        TriadGrade {
            noise_density: input.noise_density,
            bias_instability: input.bias_instability,
            turn_on_bias: input.turn_on_bias,
            scale_error: input.scale_error,
            non_orthogonality: input.non_orthogonality,
            alignment: input.alignment,
            temperature_coefficient: input.temperature_coefficient,
            quantisation: input.quantisation,
            range: input.range,
            g_sensitivity: input.g_sensitivity,
        }
    }
}

impl From<GradeInput> for Grade {
    fn from(input: GradeInput) -> Self {
        Grade {
            accelerometer: input.accelerometer.into(),
            gyroscope: input.gyroscope.into(),
            temperature_step: input.temperature_step,
        }
    }
}

impl From<ClockInput> for ClockSetup {
    fn from(input: ClockInput) -> Self {
        let ClockInput {
            drawn,
            offset,
            skew,
            phase,
        } = input;
        match phase {
            _ if drawn => ClockSetup::Drawn { offset, skew },
            None => ClockSetup::Unphased { offset, skew },
            Some(phase) => ClockSetup::Given(Clock { offset, skew, phase }),
        }
    }
}

impl From<AgeingInput> for Ageing {
    fn from(input: AgeingInput) -> Self {
        match input {
            AgeingInput::Multiple(multiple) => Ageing::Drawn(multiple),
            AgeingInput::Vector(bias) => Ageing::Given(bias.into()),
        }
    }
}

impl TryFrom<FaultInput> for Fault {
    type Error = PyErr;

    fn try_from(input: FaultInput) -> PyResult<Self> {
        let channels = match input.channels.as_str() {
            "accelerometer" => Channels::Accelerometer,
            "gyroscope" => Channels::Gyroscope,
            name => return Err(unknown("triad", name)),
        };
        let (axis, size) = (input.axis, input.size);
        let (from, to) = (input.start, input.end);
        Ok(match input.kind.as_str() {
            "scale" => Fault::Scale {
                channels,
                axis,
                factor: size,
            },
            "stuck" => Fault::Stuck { channels, axis, from },
            "moved" => Fault::Moved {
                at: from,
                axis,
                angle: size,
            },
            "saturated" => Fault::Saturated {
                channels,
                limit: size,
                from,
                to,
            },
            "frozen" => Fault::Frozen { from, to },
            "spikes" => Fault::Spikes {
                channels,
                axis,
                from,
                to,
                size,
            },
            "bias" => Fault::BiasMoves {
                channels,
                axis,
                from,
                to,
                by: size,
            },
            "noise" => Fault::Noise {
                channels,
                from,
                to,
                sigma: size,
            },
            "nan" => Fault::NotANumber {
                channels,
                axis,
                from,
                to,
            },
            "swapped-axes" => Fault::SwappedAxes {
                first: axis,
                second: input.other_axis,
            },
            "left-handed" => Fault::LeftHanded { axis },
            "wrong-unit" => Fault::WrongUnit {
                channels,
                factor: size,
            },
            "gap" => Fault::Gap { from, to },
            "doubled" => Fault::Doubled { from, to },
            "late" => Fault::Late { from, to, by: size },
            "clock-jump" => Fault::ClockJump { at: from, by: size },
            name => return Err(unknown("fault", name)),
        })
    }
}

impl TryFrom<UnitInput> for Unit {
    type Error = PyErr;

    fn try_from(input: UnitInput) -> PyResult<Self> {
        Ok(Unit {
            grade: input.grade.into(),
            geometry: if input.perfect {
                Geometry::Perfect
            } else {
                Geometry::Drawn
            },
            rate: input.rate,
            package_from_case: input.mounting.into(),
            biases: [None; 2],
            ageing: input.ageing.map(Ageing::from),
            lever_arm: input.lever_arm.into(),
            clock: input.clock.into(),
            latency: input.latency,
            faults: input
                .faults
                .into_iter()
                .map(Fault::try_from)
                .collect::<PyResult<_>>()?,
        })
    }
}

impl TryFrom<TableInput> for Table {
    type Error = PyErr;

    fn try_from(input: TableInput) -> PyResult<Self> {
        let profile = match input.profile.as_str() {
            "smooth" => Profile::Smooth,
            "trapezoid" => Profile::Trapezoid,
            name => return Err(unknown("profile", name)),
        };
        let pose = |pose: PoseInput| Pose {
            up: pose.up.into(),
            tip: pose.tip,
        };
        Ok(Table {
            poses: input.poses.into_iter().map(pose).collect(),
            rest_duration: input.rest_duration,
            profile,
            limits: Limits {
                rate: input.turn_rate,
                acceleration: input.turn_acceleration,
            },
            heading_turn: input.heading_turn,
            error: input.error,
            gravity: input.gravity,
            latitude: input.latitude,
        })
    }
}

impl From<ConditionsInput> for Conditions {
    fn from(input: ConditionsInput) -> Self {
        Conditions {
            seed: input.seed,
            warming: Warming {
                start: input.temperature_start,
                rise: input.temperature_rise,
                time_constant: input.warming_time,
            },
            bias_instability: input.bias_instability,
            quantisation: input.quantisation,
            g_sensitivity: input.g_sensitivity,
        }
    }
}

impl TryFrom<ScenarioInput> for Scenario {
    type Error = PyErr;

    fn try_from(input: ScenarioInput) -> PyResult<Self> {
        Ok(Scenario {
            conditions: input.conditions.into(),
            table: input.table.try_into()?,
            mounting: input.mounting.into(),
            reference: input.reference.try_into()?,
            targets: input
                .targets
                .into_iter()
                .map(Unit::try_from)
                .collect::<PyResult<_>>()?,
        })
    }
}

pub(crate) fn unknown(what: &str, name: &str) -> PyErr {
    PyValueError::new_err(format!("unknown {what} {name:?}"))
}

/// Plays a scenario: a mapping as `tumble.simulate` builds it, in SI units and rad.
#[pyfunction]
fn simulate_turntable(py: Python<'_>, scenario: ScenarioInput) -> PyResult<Py<PyDict>> {
    let scenario = Scenario::try_from(scenario)?;
    let session = py
        .detach(|| simulate(&scenario))
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let result = PyDict::new(py);
    result.set_item("case_from_table", array2(py, session.case_from_table.matrix()))?;
    result.set_item("mounting", array1(py, &session.mounting()))?;
    result.set_item("earth_rate", array1(py, &session.motion.earth_rate()))?;
    result.set_item("duration", session.motion.duration())?;
    result.set_item("rests", rests(py, &session)?)?;
    result.set_item("reference", unit(py, session.reference)?)?;
    let targets: PyResult<Vec<_>> = session
        .targets
        .into_iter()
        .map(|record| unit(py, record))
        .collect();
    result.set_item("targets", targets?)?;
    Ok(result.unbind())
}

fn rests<'py>(py: Python<'py>, session: &Session) -> PyResult<Bound<'py, PyDict>> {
    let rests = session.motion.rests();
    let truths: Vec<_> = rests
        .iter()
        .map(|rest| session.motion.at_rest(&rest.level_from_table))
        .collect();
    let figures = PyDict::new(py);
    let poses: Vec<usize> = rests.iter().map(|rest| rest.pose).collect();
    figures.set_item("pose", poses)?;
    figures.set_item(
        "start",
        PyArray1::from_iter(py, rests.iter().map(|rest| rest.start)),
    )?;
    figures.set_item("end", PyArray1::from_iter(py, rests.iter().map(|rest| rest.end)))?;
    let errors = rests.iter().map(|rest| rest.table_error_vector());
    figures.set_item("table_error", stacked(py, errors))?;
    let forces = truths.iter().map(|truth| truth.specific_force);
    figures.set_item("specific_force", stacked(py, forces))?;
    let rates = truths.iter().map(|truth| truth.angular_rate);
    figures.set_item("angular_rate", stacked(py, rates))?;
    Ok(figures)
}

pub(crate) fn unit(py: Python<'_>, record: UnitRecord) -> PyResult<Bound<'_, PyDict>> {
    let UnitRecord { samples, truth } = record;
    let figures = PyDict::new(py);
    let Samples {
        time,
        arrival,
        accelerometer,
        gyroscope,
        temperature,
    } = samples;
    figures.set_item("time", PyArray1::from_vec(py, time))?;
    figures.set_item("arrival", PyArray1::from_vec(py, arrival))?;
    figures.set_item("accelerometer", table(py, accelerometer)?)?;
    figures.set_item("gyroscope", table(py, gyroscope)?)?;
    figures.set_item("temperature", PyArray1::from_vec(py, temperature))?;
    let drift = &truth.accelerometer_drift;
    figures.set_item("accelerometer_truth", triad(py, &truth.accelerometer, drift)?)?;
    let drift = &truth.gyroscope_drift;
    figures.set_item("gyroscope_truth", triad(py, &truth.gyroscope, drift)?)?;
    let [accelerometer, gyroscope] = truth.ageing.map(|bias| array1(py, &bias));
    figures.set_item("ageing", (accelerometer, gyroscope))?;
    let package = array2(py, truth.package_from_case.matrix());
    figures.set_item("package_from_case", package)?;
    let clock = truth.clock;
    figures.set_item("clock", (clock.offset, clock.skew, clock.phase))?;
    Ok(figures)
}

fn table(py: Python<'_>, rows: Vec<[f64; 3]>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, 3])
}

fn triad<'py>(py: Python<'py>, triad: &Triad, drift: &Vector3<f64>) -> PyResult<Bound<'py, PyDict>> {
    let parts = triad
        .model
        .decompose()
        .map_err(|error| PyValueError::new_err(format!("the axes drawn do not make a triad: {error:?}")))?;
    let figures = PyDict::new(py);
    figures.set_item("M", array2(py, &triad.model.matrix))?;
    figures.set_item("b", array1(py, &triad.model.bias))?;
    figures.set_item("scale", array1(py, &parts.scale))?;
    figures.set_item("L", array2(py, &parts.non_orthogonality))?;
    figures.set_item("Q", array2(py, parts.mounting.matrix()))?;
    let angles = parts.parameters(&triad.model.bias);
    figures.set_item("non_orthogonality", array1(py, &angles.non_orthogonality))?;
    figures.set_item("mounting", array1(py, &angles.mounting))?;
    figures.set_item("g_sensitivity", array2(py, &triad.g_sensitivity))?;
    figures.set_item("drift", array1(py, drift))?;
    let coefficient = array1(py, &triad.temperature_coefficient);
    figures.set_item("temperature_coefficient", coefficient)?;
    figures.set_item("noise_density", triad.noise_density)?;
    figures.set_item("bias_instability", triad.bias_instability)?;
    figures.set_item("quantisation", triad.quantisation)?;
    Ok(figures)
}

/// Names of the grades there are.
#[pyfunction]
fn sensor_grades() -> Vec<&'static str> {
    Grade::NAMES.to_vec()
}

/// Figures of a grade by its name, in SI units and rad.
#[pyfunction]
fn sensor_grade<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyDict>> {
    let grade = Grade::named(name).ok_or_else(|| unknown("grade", name))?;
    let figures = PyDict::new(py);
    figures.set_item("accelerometer", triad_grade(py, &grade.accelerometer)?)?;
    figures.set_item("gyroscope", triad_grade(py, &grade.gyroscope)?)?;
    figures.set_item("temperature_step", grade.temperature_step)?;
    Ok(figures)
}

fn triad_grade<'py>(py: Python<'py>, grade: &TriadGrade) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("noise_density", grade.noise_density)?;
    figures.set_item("bias_instability", grade.bias_instability)?;
    figures.set_item("turn_on_bias", grade.turn_on_bias)?;
    figures.set_item("scale_error", grade.scale_error)?;
    figures.set_item("non_orthogonality", grade.non_orthogonality)?;
    figures.set_item("alignment", grade.alignment)?;
    figures.set_item("temperature_coefficient", grade.temperature_coefficient)?;
    figures.set_item("quantisation", grade.quantisation)?;
    figures.set_item("range", grade.range)?;
    figures.set_item("g_sensitivity", grade.g_sensitivity)?;
    Ok(figures)
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(simulate_turntable, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_grades, module)?)?;
    module.add_function(wrap_pyfunction!(sensor_grade, module)?)
}
