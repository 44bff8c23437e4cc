//! Robots that turn on the spot, with known truth: plain mappings in, arrays out.

use nalgebra::Vector3;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_lab::simulate::fault::{Channels, Fault};
use tumble_lab::simulate::floor::Floor;
use tumble_lab::simulate::motion::Course;
use tumble_lab::simulate::sensor::Geometry;
use tumble_lab::simulate::span::Span;
use tumble_lab::simulate::spot::{Disturbance, Plan, SpotMotion, Step, mounted, reported_bearing};
use tumble_lab::simulate::stream::{Purpose, stream};
use tumble_lab::simulate::unit::{Ageing, Clock, ClockSetup, Conditions, Mounting, Unit, Warming, record};

use crate::convert::{array1, spans};
use crate::simulate::{FaultInput, GradeInput, unit, unknown};

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct StepInput {
    kind: String,
    duration: f64,
    angle: f64,
    rate: f64,
    floor_tilt: f64,
    uphill: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct DisturbanceInput {
    start: f64,
    duration: f64,
    tilt: f64,
    lift: f64,
}

#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct SpinInput {
    seed: u64,
    grade: GradeInput,
    perfect: bool,
    gyroscope_scale: f64,
    accelerometer_bias: Option<[f64; 3]>,
    gyroscope_bias: Option<[f64; 3]>,
    bias_instability: bool,
    quantisation: bool,
    rate: f64,
    mounting: [f64; 3],
    lever_arm: [f64; 3],
    steps: Vec<StepInput>,
    floor_tilt: f64,
    uphill: f64,
    acceleration: f64,
    unevenness: (f64, f64),
    slips: f64,
    vibration: f64,
    disturbances: Vec<DisturbanceInput>,
    faults: Vec<FaultInput>,
    gravity: f64,
    latitude: Option<f64>,
    temperature: f64,
}

/// Largest number of samples; one takes 72 bytes.
const MOST_SAMPLES: f64 = 1e8;

impl TryFrom<StepInput> for Step {
    type Error = PyErr;

    fn try_from(input: StepInput) -> PyResult<Self> {
        Ok(match input.kind.as_str() {
            "rest" => Step::Rest {
                duration: input.duration,
                slow_turn: input.rate,
            },
            "turn" => Step::Turn {
                angle: input.angle,
                rate: input.rate,
            },
            "drive" => Step::Drive {
                duration: input.duration,
                speed: input.rate,
                bend: input.angle,
                floor: Floor {
                    tilt: input.floor_tilt,
                    uphill: input.uphill,
                },
            },
            name => return Err(unknown("step", name)),
        })
    }
}

fn plan(input: &mut SpinInput) -> PyResult<Plan> {
    let [roll, pitch, yaw] = input.mounting;
    Ok(Plan {
        steps: core::mem::take(&mut input.steps)
            .into_iter()
            .map(Step::try_from)
            .collect::<PyResult<_>>()?,
        floor: Floor {
            tilt: input.floor_tilt,
            uphill: input.uphill,
        },
        acceleration: input.acceleration,
        unevenness: input.unevenness,
        slips: input.slips,
        vibration: input.vibration,
        disturbances: core::mem::take(&mut input.disturbances)
            .into_iter()
            .map(|each| Disturbance {
                start: each.start,
                duration: each.duration,
                tilt: each.tilt,
                lift: each.lift,
            })
            .collect(),
        case_from_floor: mounted(roll, pitch, yaw),
        gravity: input.gravity,
        latitude: input.latitude,
    })
}

fn imu(input: SpinInput, lever_arm: Vector3<f64>) -> PyResult<Unit> {
    let scale = |axis| Fault::Scale {
        channels: Channels::Gyroscope,
        axis,
        factor: 1.0 + input.gyroscope_scale,
    };
    let mut faults: Vec<Fault> = (0..3).map(scale).collect();
    for fault in input.faults {
        faults.push(fault.try_into()?);
    }
    Ok(Unit {
        grade: input.grade.into(),
        geometry: if input.perfect {
            Geometry::Perfect
        } else {
            Geometry::Drawn
        },
        rate: input.rate,
        package_from_case: Mounting::Given(Vector3::zeros()),
        biases: [input.accelerometer_bias, input.gyroscope_bias].map(|bias| bias.map(Vector3::from)),
        ageing: [Ageing::NONE; 2],
        lever_arm,
        clock: ClockSetup::Given(Clock::SESSION),
        latency: 0.0,
        faults,
    })
}

/// Plays a plan: a mapping as `tumble.simulate` builds it, in SI units and rad.
#[pyfunction]
fn simulate_spin(py: Python<'_>, mut plan_of: SpinInput) -> PyResult<Py<PyDict>> {
    let conditions = Conditions {
        seed: plan_of.seed,
        warming: Warming {
            start: plan_of.temperature,
            rise: 0.0,
            time_constant: 1.0,
        },
        bias_instability: plan_of.bias_instability,
        quantisation: plan_of.quantisation,
        g_sensitivity: false,
    };
    let plan = plan(&mut plan_of)?;
    let (case_from_floor, floor) = (plan.case_from_floor, plan.floor);
    let motion = SpotMotion::new(plan, &mut stream(plan_of.seed, 1, Purpose::Floor));
    let samples = motion.duration() * plan_of.rate;
    if samples > MOST_SAMPLES {
        return Err(PyValueError::new_err(format!(
            "{samples:.3e} samples do not fit into memory"
        )));
    }
    let lever_arm = case_from_floor * Vector3::from(plan_of.lever_arm);
    let imu = imu(plan_of, lever_arm)?;
    let recorded = py.detach(|| record(&conditions, &motion, &imu, 1));
    let time = recorded.samples.time.clone();
    let up = case_from_floor * Vector3::z();
    let result = PyDict::new(py);
    result.set_item("unit", unit(py, recorded)?)?;
    result.set_item("duration", motion.duration())?;
    result.set_item("up", array1(py, &up))?;
    let (roll, pitch) = tumble_core::spin::axis::tilt(&up);
    result.set_item("roll", roll)?;
    result.set_item("pitch", pitch)?;
    result.set_item("uphill_bearing", reported_bearing(&case_from_floor, floor.uphill))?;
    result.set_item("lever_arm", array1(py, &(lever_arm - up * up.dot(&lever_arm))))?;
    let heading = time.iter().map(|t| motion.turning(*t).heading);
    result.set_item("heading", PyArray1::from_iter(py, heading))?;
    let moving = time.iter().map(|t| f64::from(u8::from(motion.wheels_turn(*t))));
    result.set_item("moving", PyArray1::from_iter(py, moving))?;
    result.set_item("rests", spans(py, &motion.rests())?)?;
    let turns = motion.turns();
    let turning: Vec<Span> = turns.iter().map(|(span, _)| *span).collect();
    result.set_item("turns", spans(py, &turning)?)?;
    let angles = turns.iter().map(|(_, angle)| *angle);
    result.set_item("turned", PyArray1::from_iter(py, angles))?;
    Ok(result.unbind())
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(simulate_spin, module)?)
}
