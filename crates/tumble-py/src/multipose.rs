//! Calibration without equipment: samples of one unit in, both triads out.

use nalgebra::Vector3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::sample::CHANNELS;
use tumble_lab::acquisition::Tremor;
use tumble_lab::multipose::accelerometer::PLACES;
use tumble_lab::multipose::ferraris::FerrarisTriad;
use tumble_lab::multipose::next_turn::NextTurn;
use tumble_lab::multipose::stated_rate::{CRYSTAL, StampedRate};
use tumble_lab::multipose::turn_bias::{TurnBias, TurnLoss};
use tumble_lab::multipose::{
    FEWEST_DIRECTIONS, FULL_TURN_SIGMA, Faces, Gyroscope, KnownNoise, Multipose, MultiposeError,
    MultiposeSamples, MultiposeSettings, Pose, Section, SectionLabel, grouped, held_spans, multipose,
};
use tumble_lab::turntable::TriadCalibration;

use crate::acquisition::PyAcquired;
use crate::convert::{array1, array2, rows, stacked};
use crate::turntable::{CoreError, triad};

/// Calibrates a unit from finite samples in order of time: time (n,) s, accelerometer (n, 3) m/s^2, gyroscope (n, 3) rad/s,
/// or both in counts where `raw`. Latitude in rad. Noise that is known, (6,), with NaN where it is not, goes before that of
/// the rests. With `faces` the unit lay on six faces; `sections` are label, first sample and the one after the last. `pace_sigma` is that of the
/// clock, relative, `stamp_sigma` that of the time of a sample, s.
#[pyfunction]
#[pyo3(signature = (time, force, rate, gravity, *, gyroscope=true, g_sensitivity=false, latitude=None, raw=false,
    shortest_rest=1.0, noise_density=None, bias_instability=None, faces=false, sections=Vec::new(), pace_sigma=0.0,
    stamp_sigma=0.0, gravity_sigma=0.0))]
#[allow(clippy::too_many_arguments)]
fn multipose_of<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    force: PyReadonlyArray2<'py, f64>,
    rate: PyReadonlyArray2<'py, f64>,
    gravity: f64,
    gyroscope: bool,
    g_sensitivity: bool,
    latitude: Option<f64>,
    raw: bool,
    shortest_rest: f64,
    noise_density: Option<[f64; CHANNELS]>,
    bias_instability: Option<[f64; CHANNELS]>,
    faces: bool,
    sections: Vec<(String, usize, usize)>,
    pace_sigma: f64,
    stamp_sigma: f64,
    gravity_sigma: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let sections: PyResult<Vec<Section>> = sections
        .into_iter()
        .map(|each| section(each, time.len()?))
        .collect();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let settings = MultiposeSettings {
        gravity,
        gravity_sigma,
        latitude,
        g_sensitivity,
        gyroscope,
        raw,
        shortest_rest: (shortest_rest * 1e6) as u64,
        noise: std::array::from_fn(|k| KnownNoise {
            density: stated(noise_density, k),
            bias_instability: stated(bias_instability, k),
        }),
        faces,
        pace_sigma,
        stamp_sigma,
        sections: sections?,
    };
    let samples = unit_samples(&time, &force, &rate)?;
    let found = py.detach(|| multipose(&samples, &settings));
    let found = found.map_err(|error| refusal(py, &error))?;
    figures(py, found)
}

/// A number of a list that may be absent, and hold NaN for what is not known.
fn stated(numbers: Option<[f64; CHANNELS]>, place: usize) -> Option<f64> {
    numbers
        .map(|numbers| numbers[place])
        .filter(|number| number.is_finite())
}

/// First and last sample of each stretch, `shortest` s or longer, in which a unit kept its mean orientation, whether or not it
/// trembled, as `multipose_of` finds them; arguments as those of `multipose_of`.
#[pyfunction]
fn held_rests(
    py: Python<'_>,
    time: PyReadonlyArray1<'_, f64>,
    force: PyReadonlyArray2<'_, f64>,
    rate: PyReadonlyArray2<'_, f64>,
    shortest: f64,
) -> PyResult<Vec<(usize, usize)>> {
    let samples = unit_samples(&time, &force, &rate)?;
    let spans = py.detach(|| held_spans(&samples, shortest));
    Ok(spans.into_iter().map(|(first, end)| (first, end - 1)).collect())
}

fn unit_samples<'a>(
    time: &'a PyReadonlyArray1<'_, f64>,
    force: &'a PyReadonlyArray2<'_, f64>,
    rate: &'a PyReadonlyArray2<'_, f64>,
) -> PyResult<MultiposeSamples<'a>> {
    let samples = MultiposeSamples {
        time: time.as_slice()?,
        force: rows(force, "accelerometer")?,
        rate: rows(rate, "gyroscope")?,
    };
    if samples.time.len() != samples.force.len() || samples.time.len() != samples.rate.len() {
        return Err(PyValueError::new_err(
            "time, accelerometer and gyroscope must have the same length",
        ));
    }
    Ok(samples)
}

/// Numbers the directions that rests show, by their mean specific force (k, 3): near ones are one.
#[pyfunction]
fn multipose_directions(force: PyReadonlyArray2<'_, f64>) -> PyResult<Vec<usize>> {
    let directions: Vec<_> = rows(&force, "accelerometer")?
        .iter()
        .map(|force| Vector3::from(*force))
        .collect();
    Ok(grouped(&directions))
}

fn section((label, first, end): (String, usize, usize), samples: usize) -> PyResult<Section> {
    let known = SectionLabel::named(&label);
    // Two samples make an interval.
    let holds = end <= samples && first + 2 <= end;
    known
        .filter(|_| holds)
        .map(|label| Section { label, first, end })
        .ok_or_else(|| PyValueError::new_err(format!("{label}: no such section of {samples} samples")))
}

fn figures(py: Python<'_>, found: Multipose) -> PyResult<Bound<'_, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("tolerance", found.tolerance)?;
    let left_out = found.left_out.iter();
    let left_out: Vec<_> = left_out
        .map(|each| (each.span.0, each.span.1, each.tremor.map(tremor_figures)))
        .collect();
    figures.set_item("left_out", left_out)?;
    let rests = 0..found.acquired.rests.len();
    let tremors: Vec<_> = rests
        .map(|k| {
            found
                .acquired
                .restlessness(k)
                .map(|rest| tremor_figures(rest.tremor))
        })
        .collect();
    figures.set_item("tremors", tremors)?;
    let nominal = found.nominal.map(|scale| (scale.force, scale.rate));
    figures.set_item("nominal_scale", nominal)?;
    figures.set_item("accelerometer", triad(py, &found.accelerometer)?)?;
    let listed = |each: [Vector3<f64>; 2]| each.map(|of| of.as_slice().to_vec());
    let non_linearity = found
        .non_linearity
        .map(|found| (listed(found.square), listed(found.magnitude)));
    figures.set_item("non_linearity", non_linearity)?;
    figures.set_item("poses", poses(py, &found.poses)?)?;
    match &found.next {
        Some(next) => {
            let figures_of_next = PyDict::new(py);
            figures_of_next.set_item("up", array1(py, &next.up))?;
            figures_of_next.set_item("before", next.before)?;
            figures_of_next.set_item("after", next.after)?;
            figures_of_next.set_item("unknown", PLACES[next.unknown])?;
            figures.set_item("next", figures_of_next)?;
        }
        None => figures.set_item("next", py.None())?,
    }
    let faces = found.faces.as_ref().map(|faces| face_figures(py, faces, &found));
    figures.set_item("faces", faces.transpose()?)?;
    match &found.gyroscope {
        Ok(gyroscope) => {
            figures.set_item("gyroscope", gyroscope_figures(py, gyroscope)?)?;
            figures.set_item("gyroscope_refusal", py.None())?;
        }
        Err(error) => {
            figures.set_item("gyroscope", py.None())?;
            figures.set_item("gyroscope_refusal", (error.name(), refusal_figures(py, error)?))?;
        }
    }
    figures.set_item(
        "acquired",
        Py::new(
            py,
            PyAcquired {
                inner: found.acquired,
            },
        )?,
    )?;
    Ok(figures)
}

/// Amplitude of the angular rate, rad/s, and frequency, Hz.
fn tremor_figures(tremor: Tremor) -> (f64, f64) {
    (tremor.amplitude, tremor.frequency)
}

fn poses<'py>(py: Python<'py>, poses: &[Pose]) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    let each = |value: fn(&Pose) -> f64| poses.iter().map(value).collect::<Vec<f64>>();
    figures.set_item("force", stacked(py, poses.iter().map(|pose| pose.force)))?;
    figures.set_item("before", each(|pose| pose.before))?;
    figures.set_item("after", each(|pose| pose.after))?;
    figures.set_item("sigma", each(|pose| pose.sigma))?;
    figures.set_item("weight", each(|pose| pose.weight))?;
    figures.set_item("leverage", each(|pose| pose.influence.leverage))?;
    figures.set_item("influence", each(|pose| pose.influence.change))?;
    figures.set_item("held_out", each(|pose| pose.held_out.unwrap_or(f64::NAN)))?;
    let directions: Vec<usize> = poses.iter().map(|pose| pose.direction).collect();
    figures.set_item("direction", directions)?;
    Ok(figures)
}

fn gyroscope_figures<'py>(py: Python<'py>, gyroscope: &Gyroscope) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("calibration", triad(py, &gyroscope.calibration)?)?;
    figures.set_item("turns", &gyroscope.turns)?;
    let (before, after): (Vec<f64>, Vec<f64>) = gyroscope.angles.iter().copied().unzip();
    figures.set_item("angles_before", before)?;
    figures.set_item("angles_after", after)?;
    figures.set_item("with_g_sensitivity", gyroscope.with_g_sensitivity)?;
    let next = gyroscope.next.as_ref().map(|next| turn_to_add(py, next));
    figures.set_item("next", next.transpose()?)?;
    figures.set_item("implausible_scale", gyroscope.implausible_scale)?;
    figures.set_item("turn_excess", gyroscope.excess.turn.sqrt())?;
    figures.set_item("bias_excess", gyroscope.excess.rest.sqrt())?;
    let bias = gyroscope.turn_bias.as_ref().map(|bias| turn_bias(py, bias));
    figures.set_item("turn_bias", bias.transpose()?)?;
    let loss = gyroscope.turn_loss.filter(TurnLoss::contradicts);
    figures.set_item("turn_loss", loss.map(|loss| (loss.angle, loss.sigma)))?;
    let band = gyroscope.dead_band.map(|band| (band.axis, band.half_width));
    figures.set_item("dead_band", band)?;
    figures.set_item("turn_widening", gyroscope.turn_widening)?;
    Ok(figures)
}

fn turn_bias<'py>(py: Python<'py>, bias: &TurnBias) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("difference", array1(py, &bias.difference))?;
    figures.set_item("sigma", array1(py, &bias.sigma))?;
    figures.set_item("chance", bias.chance)?;
    figures.set_item("contradicts", bias.contradicts())?;
    Ok(figures)
}

/// Rate that (n,) stamps, s, show beside one that was stated, Hz: with the samples that are missing, and whether clocks
/// explain the difference; `None` where the stamps show none, or another unit.
#[pyfunction]
fn stamped_rate(
    py: Python<'_>,
    stamps: PyReadonlyArray1<'_, f64>,
    stated: f64,
) -> PyResult<Option<(f64, u64, bool)>> {
    let stamps = stamps.as_slice()?;
    let found = py.detach(|| StampedRate::of(stamps, stated));
    Ok(found.map(|found| (found.shown, found.missing, found.agrees())))
}

fn turn_to_add<'py>(py: Python<'py>, next: &NextTurn) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("axis", array1(py, &next.axis))?;
    figures.set_item("up", array1(py, &next.up))?;
    figures.set_item("before", next.before)?;
    figures.set_item("after", next.after)?;
    figures.set_item("unknown", next.unknown)?;
    Ok(figures)
}

fn face_figures<'py>(py: Python<'py>, faces: &Faces, found: &Multipose) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("tilt", faces.tilt)?;
    let sections = faces.sections.iter();
    let sections: Vec<_> = sections
        .map(|each| (each.label.name(), each.first, each.end))
        .collect();
    figures.set_item("sections", sections)?;
    let nominal = found
        .nominal
        .map_or((1.0, 1.0), |scale| (scale.force, scale.rate));
    let ferraris = &faces.ferraris;
    let accelerometer = ferraris_triad(py, &ferraris.accelerometer, nominal.0, Some(&found.accelerometer))?;
    figures.set_item("accelerometer", accelerometer)?;
    let own = found
        .gyroscope
        .as_ref()
        .ok()
        .map(|gyroscope| &gyroscope.calibration);
    let gyroscope = ferraris.gyroscope.as_ref();
    let gyroscope = gyroscope.map(|triad| ferraris_triad(py, triad, nominal.1, own));
    figures.set_item("gyroscope", gyroscope.transpose()?)?;
    figures.set_item("g_sensitivity", array2(py, &ferraris.g_sensitivity))?;
    Ok(figures)
}

fn ferraris_triad<'py>(
    py: Python<'py>,
    triad: &FerrarisTriad,
    nominal: f64,
    own: Option<&TriadCalibration>,
) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("scale", array1(py, &triad.scale))?;
    figures.set_item("rotation", array2(py, &triad.rotation))?;
    figures.set_item("bias", array1(py, &triad.bias))?;
    figures.set_item("parameters", own.and_then(|own| triad.parameters(nominal, own)))?;
    Ok(figures)
}

fn refusal(py: Python<'_>, error: &MultiposeError) -> PyErr {
    match refusal_figures(py, error) {
        Ok(figures) => CoreError::new_err((error.name(), figures.unbind())),
        Err(failure) => failure,
    }
}

fn refusal_figures<'py>(py: Python<'py>, error: &MultiposeError) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    match *error {
        MultiposeError::TooFewDirections { found, needed, rests } => {
            figures.set_item("found", found)?;
            figures.set_item("needed", needed)?;
            figures.set_item("rests", rests)?;
        }
        MultiposeError::FacesMissing { missing } => {
            let faces = SectionLabel::FACES.iter().zip(missing);
            let named: Vec<_> = faces
                .filter(|(_, missing)| *missing)
                .map(|(face, _)| face.name())
                .collect();
            figures.set_item("missing", named)?;
        }
        MultiposeError::PosesLeaveOpen { shares } | MultiposeError::TurnsLeaveOpen { shares } => {
            figures.set_item("shares", shares.to_vec())?;
        }
        MultiposeError::GyroscopeContradicts { angle } => figures.set_item("angle", angle)?,
        MultiposeError::NoRests
        | MultiposeError::NoTurns
        | MultiposeError::LeftHandedGyroscope
        | MultiposeError::AxesCoincide
        | MultiposeError::Unsolvable => {}
    }
    Ok(figures)
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("FULL_TURN_SIGMA", FULL_TURN_SIGMA)?;
    module.add("FEWEST_DIRECTIONS", FEWEST_DIRECTIONS)?;
    module.add("CRYSTAL", CRYSTAL)?;
    module.add_function(wrap_pyfunction!(stamped_rate, module)?)?;
    module.add_function(wrap_pyfunction!(multipose_of, module)?)?;
    module.add_function(wrap_pyfunction!(held_rests, module)?)?;
    module.add_function(wrap_pyfunction!(multipose_directions, module)?)
}
