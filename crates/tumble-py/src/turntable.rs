//! The turntable procedure: reference, then targets.

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use tumble_core::model::ModelCovariance;
use tumble_core::turntable::truth::TruthSource;
use tumble_lab::acquisition::consistency::{GyroscopeConsistency, compare_gyroscope};
use tumble_lab::simulate::grade::SensorGrade;
use tumble_lab::turntable::{
    AxisResponse, BiasDrift, Clocks, CommandedRates, GSensitivity, PairingError, RESPONSE_FALSE_ALARM,
    RateLevel, Reference, ReferenceUncertainty, ResidualLabel, Side, Target, TriadCalibration, Triads,
    TurntableError, TurntableSettings, as_reference, calibrate, fit_reference, own_sphere, poses,
    reference_uncertainty,
};

use crate::acquisition::PyAcquired;
use crate::convert::{array1, array2, rows, stacked};

create_exception!(
    _core,
    CoreError,
    PyException,
    "What the core objects to: (kind, figures)."
);

/// Settings of a calibration on the turntable.
#[pyclass(module = "tumble._core", frozen, name = "TurntableSettings")]
pub struct PySettings {
    inner: TurntableSettings,
    /// Rates of the table, where they are the truth of gyroscopes.
    commanded: Option<CommandedRates>,
}

#[pymethods]
impl PySettings {
    /// Gravity in m/s^2, latitude in rad, truth and clocks by name; `g_sensitivity` None fits it where residuals ask for it.
    /// `commanded`, where it is the truth of gyroscopes: magnitudes of the rates of the table, rad/s, and the relative 1-sigma that
    /// they have in common. `gravity_sigma` in m/s^2; 0 where scale is relative to gravity.
    #[new]
    #[pyo3(signature = (gravity, truth="reference", clocks="auto", latitude=None, g_sensitivity=None, commanded=None, gravity_sigma=0.0))]
    fn new(
        gravity: f64,
        truth: &str,
        clocks: &str,
        latitude: Option<f64>,
        g_sensitivity: Option<bool>,
        commanded: Option<(Vec<f64>, f64)>,
        gravity_sigma: f64,
    ) -> PyResult<Self> {
        let truth = match truth {
            "reference" => TruthSource::Reference,
            "rotate-truth" => TruthSource::RotateTruth,
            "rotate-measurement" => TruthSource::RotateMeasurement,
            "ideal" => TruthSource::Ideal,
            _ => return Err(PyValueError::new_err(format!("unknown truth {truth:?}"))),
        };
        let clocks = match clocks {
            "auto" => Clocks::Unknown,
            "shared" => Clocks::Shared,
            "apart" => Clocks::Apart,
            _ => return Err(PyValueError::new_err(format!("unknown clocks {clocks:?}"))),
        };
        Ok(Self {
            commanded: commanded.map(|(rates, accuracy)| CommandedRates { rates, accuracy }),
            inner: TurntableSettings {
                gravity,
                gravity_sigma,
                latitude,
                truth,
                clocks,
                g_sensitivity: match g_sensitivity {
                    Some(true) => GSensitivity::Always,
                    Some(false) => GSensitivity::Never,
                    None => GSensitivity::WhereShown,
                },
            },
        })
    }
}

/// The reference with its biases, attitudes and mounting.
#[pyclass(module = "tumble._core", frozen, name = "Reference")]
pub struct PyReference {
    inner: Reference,
    #[pyo3(get)]
    figures: Py<PyDict>,
}

fn ups_of(ups: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<Option<Vector3<f64>>>> {
    let known = |row: &[f64; 3]| {
        let up = Vector3::from(*row);
        up.iter().all(|value| value.is_finite()).then_some(up)
    };
    Ok(rows(ups, "ups")?.iter().map(known).collect())
}

/// Covariance (12, 12) of `[E row by row, e]` of one triad of a reference.
fn uncertainty_of(array: Option<PyReadonlyArray2<'_, f64>>) -> PyResult<Option<ModelCovariance<f64>>> {
    array.map(|array| covariance(&array)).transpose()
}

pub(crate) fn covariance(array: &PyReadonlyArray2<'_, f64>) -> PyResult<ModelCovariance<f64>> {
    let view = array.as_array();
    if view.shape() != [12, 12] || view.iter().any(|value| !value.is_finite()) {
        return Err(PyValueError::new_err(
            "a covariance must have shape (12, 12) and be finite",
        ));
    }
    Ok(ModelCovariance::from_fn(|i, j| view[(i, j)]))
}

/// Covariance (12, 12) of `[E row by row, e]` of a triad corrected by a calibration with that M (3, 3) and covariance (12, 12)
/// of `[M row by row, b]`.
#[pyfunction]
fn uncertainty_of_calibration(
    py: Python<'_>,
    matrix: PyReadonlyArray2<'_, f64>,
    stated: PyReadonlyArray2<'_, f64>,
) -> PyResult<Py<PyArray2<f64>>> {
    let matrix = crate::convert::matrix(&matrix, "matrix")?;
    reference_uncertainty::of_calibration(&matrix, &covariance(&stated)?)
        .map(|found| array2(py, &found))
        .ok_or_else(|| PyValueError::new_err("M cannot be inverted"))
}

/// Covariances (12, 12) of `[E row by row, e]` of accelerometer and gyroscope of a unit of a grade as delivered.
#[pyfunction]
fn uncertainty_of_grade(py: Python<'_>, name: &str) -> PyResult<[Py<PyArray2<f64>>; 2]> {
    let grade =
        SensorGrade::named(name).ok_or_else(|| PyValueError::new_err(format!("no grade {name:?}")))?;
    let of = |triad| array2(py, &reference_uncertainty::of_grade(triad));
    Ok([of(&grade.accelerometer), of(&grade.gyroscope)])
}

/// `gyroscope` states whether its log has one; `accelerometer_uncertainty` and `gyroscope_uncertainty` (12, 12), where
/// they are stated, are covariances of `[E row by row, e]`.
#[pyfunction(name = "fit_reference")]
#[pyo3(signature = (unit, ups, settings, gyroscope=true, accelerometer_uncertainty=None, gyroscope_uncertainty=None))]
fn fit_reference_of(
    py: Python<'_>,
    unit: &PyAcquired,
    ups: PyReadonlyArray2<'_, f64>,
    settings: &PySettings,
    gyroscope: bool,
    accelerometer_uncertainty: Option<PyReadonlyArray2<'_, f64>>,
    gyroscope_uncertainty: Option<PyReadonlyArray2<'_, f64>>,
) -> PyResult<PyReference> {
    let ups = ups_of(&ups)?;
    let uncertainty = ReferenceUncertainty {
        accelerometer: uncertainty_of(accelerometer_uncertainty)?,
        gyroscope: uncertainty_of(gyroscope_uncertainty)?,
    };
    let commanded = &settings.commanded;
    let (unit, settings) = (&unit.inner, &settings.inner);
    let inner = py
        .detach(|| {
            let mut reference = fit_reference(unit, &ups, settings, gyroscope)?;
            if let Some(commanded) = commanded {
                reference = reference.with_commanded(unit, settings, commanded)?;
            }
            reference.with_uncertainty(unit, &ups, settings, gyroscope, uncertainty)
        })
        .map_err(|error| core_error(py, &error))?;
    let figures = PyDict::new(py);
    let sphere = &inner.sphere;
    let sigma = (sphere.covariance * inner.excess()).diagonal().map(f64::sqrt);
    figures.set_item("bias", array1(py, &sphere.bias))?;
    figures.set_item("bias_sigma", array1(py, &sigma))?;
    figures.set_item("norm_residual", sphere.norm_residual)?;
    if let Some(drift) = &inner.drift {
        figures.set_item("drift", bias_drift(py, &drift.as_bias_drift()))?;
    }
    figures.set_item("excess", inner.excess())?;
    figures.set_item("gyroscope_bias", array1(py, &inner.earth.bias))?;
    let rate_sigma = inner.earth.covariance.diagonal().map(f64::sqrt);
    figures.set_item(
        "gyroscope_bias_sigma",
        array1(py, &rate_sigma.fixed_rows::<3>(0).into_owned()),
    )?;
    figures.set_item("earth_rate", array1(py, &inner.earth.earth_rate))?;
    figures.set_item(
        "earth_rate_sigma",
        array1(py, &rate_sigma.fixed_rows::<3>(3).into_owned()),
    )?;
    if let Some(table) = &inner.table {
        figures.set_item("commanded", &table.by_rate)?;
    }
    if let Some(mounting) = &inner.mounting {
        let known = poses(unit, &ups);
        figures.set_item("R_e", array2(py, mounting.rotation.matrix()))?;
        figures.set_item("rotation_vector", array1(py, &mounting.rotation.scaled_axis()))?;
        figures.set_item(
            "rotation_sigma",
            array1(py, &mounting.covariance.diagonal().map(f64::sqrt)),
        )?;
        figures.set_item(
            "table_errors",
            stacked(
                py,
                known.iter().map(|pose| mounting.residual(pose, settings.gravity)),
            ),
        )?;
        let angles: Vec<f64> = known
            .iter()
            .map(|pose| mounting.table_error(pose, settings.gravity))
            .collect();
        figures.set_item("table_error_angles", angles)?;
        let sigmas: Vec<f64> = known.iter().map(|pose| pose.sigma / settings.gravity).collect();
        figures.set_item("table_error_sigmas", sigmas)?;
    }
    Ok(PyReference {
        inner,
        figures: figures.unbind(),
    })
}

/// A target with rests and constant rates as the reference saw them.
#[pyfunction(name = "as_reference")]
fn as_reference_of(
    py: Python<'_>,
    reference_unit: &PyAcquired,
    unit: Py<PyAcquired>,
    settings: &PySettings,
) -> PyResult<Py<PyAcquired>> {
    let (seen, felt, clocks) = (&reference_unit.inner, &unit.get().inner, settings.inner.clocks);
    match py.detach(|| as_reference(seen, felt, clocks)) {
        Some(inner) => Py::new(py, PyAcquired { inner }),
        None => Ok(unit),
    }
}

/// Calibrates one target. `triads`: accelerometer and gyroscope, whether there is one to calibrate.
#[pyfunction]
#[pyo3(signature = (reference_unit, reference, unit, ups, settings, triads=(true, true)))]
fn calibrate_target(
    py: Python<'_>,
    reference_unit: &PyAcquired,
    reference: &PyReference,
    unit: &PyAcquired,
    ups: PyReadonlyArray2<'_, f64>,
    settings: &PySettings,
    triads: (bool, bool),
) -> PyResult<Py<PyDict>> {
    let ups = ups_of(&ups)?;
    let (seen, felt, settings) = (&reference_unit.inner, &unit.inner, &settings.inner);
    let triads = Triads {
        accelerometer: triads.0,
        gyroscope: triads.1,
    };
    let target = py
        .detach(|| calibrate(seen, &reference.inner, felt, &ups, settings, triads))
        .map_err(|error| core_error(py, &error))?;
    let result = PyDict::new(py);
    result.set_item("clock", clock(py, &target, seen.origin, felt.origin)?)?;
    let pairs: Vec<(usize, usize, usize)> = target
        .pairing
        .pairs
        .iter()
        .map(|pair| (pair.reference, pair.target.0, pair.target.1))
        .collect();
    result.set_item("pairs", pairs)?;
    result.set_item("continued", &target.pairing.continued)?;
    let figures = |found: &Option<TriadCalibration>| found.as_ref().map(|it| triad(py, it)).transpose();
    result.set_item("accelerometer", figures(&target.accelerometer)?)?;
    result.set_item("gyroscope", figures(&target.gyroscope)?)?;
    let responses = target.responses.iter().map(|axis| response(py, axis));
    result.set_item("responses", responses.collect::<PyResult<Vec<_>>>()?)?;
    Ok(result.unbind())
}

/// Figures of a sensing axis at constant rates; those of each rate are (rate, turns, scale, sigma, deviation, sigma).
fn response<'py>(py: Python<'py>, axis: &AxisResponse) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("axis", axis.axis)?;
    figures.set_item("full_scale", axis.full_scale)?;
    figures.set_item("scale", axis.scale)?;
    figures.set_item("linearity", axis.linearity)?;
    figures.set_item("asymmetry", axis.asymmetry)?;
    let level = |level: &RateLevel| {
        (
            level.rate,
            level.turns,
            level.scale,
            level.scale_sigma,
            level.deviation,
            level.deviation_sigma,
        )
    };
    figures.set_item("levels", axis.levels.iter().map(level).collect::<Vec<_>>())?;
    Ok(figures)
}

fn clock<'py>(
    py: Python<'py>,
    target: &Target,
    reference_origin: f64,
    own_origin: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (pairing, clock) = (&target.pairing, &target.pairing.clock);
    let figures = PyDict::new(py);
    let (offset, offset_sigma) = clock.offset_at(0.0);
    figures.set_item("shared", pairing.shared)?;
    let offset = if pairing.shared {
        0.0
    } else {
        offset + own_origin - reference_origin
    };
    figures.set_item("offset", offset)?;
    figures.set_item("offset_sigma", offset_sigma)?;
    figures.set_item("skew", clock.skew)?;
    figures.set_item("skew_sigma", clock.covariance[(1, 1)].sqrt())?;
    figures.set_item("turns", clock.turns)?;
    figures.set_item("contradiction", pairing.contradiction)?;
    Ok(figures)
}

/// Change over the session, its 1-sigma, and its time constant, s.
fn bias_drift(py: Python<'_>, drift: &BiasDrift) -> (Py<PyArray1<f64>>, Py<PyArray1<f64>>, f64) {
    (
        array1(py, &drift.change),
        array1(py, &drift.sigma),
        drift.constant,
    )
}

/// Figures of one triad.
pub fn triad<'py>(py: Python<'py>, triad: &TriadCalibration) -> PyResult<Bound<'py, PyDict>> {
    let figures = PyDict::new(py);
    figures.set_item("M", array2(py, &triad.model.matrix))?;
    figures.set_item("b", array1(py, &triad.model.bias))?;
    figures.set_item("covariance", array2(py, &triad.covariance))?;
    figures.set_item("observed", triad.observed.to_vec())?;
    figures.set_item("scale", array1(py, &triad.parts.scale))?;
    figures.set_item("L", array2(py, &triad.parts.non_orthogonality))?;
    figures.set_item("Q", array2(py, triad.parts.mounting.matrix()))?;
    figures.set_item("values", triad.values())?;
    figures.set_item("sigmas", triad.sigmas())?;
    if let Some(inherited) = &triad.inherited {
        let of_parts = triad
            .parts
            .carry(inherited)
            .diagonal()
            .map(|variance| variance.max(0.0).sqrt());
        figures.set_item("inherited", array2(py, inherited))?;
        figures.set_item("inherited_sigmas", of_parts.as_slice().to_vec())?;
        let responses = &triad.inheritance;
        figures.set_item("by_reference", array2(py, &responses.by_reference))?;
        figures.set_item("by_gravity", responses.by_gravity.as_slice().to_vec())?;
        figures.set_item("by_table", responses.by_table.as_slice().to_vec())?;
        figures.set_item("parts_jacobian", array2(py, &triad.parts.jacobian()))?;
    }
    if let Some(drift) = &triad.drift {
        figures.set_item("drift", bias_drift(py, drift))?;
    }
    if let Some(slip) = &triad.slip {
        let angle = slip.turn.norm();
        let along = slip.turn / angle;
        let sigma = along.dot(&(slip.covariance * along)).sqrt();
        figures.set_item(
            "slip",
            (
                slip.rests.0,
                slip.rests.1,
                angle,
                sigma,
                slip.side == Side::Behind,
            ),
        )?;
    }
    if let Some((asymmetry, sigma)) = &triad.asymmetry {
        figures.set_item(
            "asymmetry",
            (<[f64; 3]>::from(*asymmetry), <[f64; 3]>::from(*sigma)),
        )?;
    }
    figures.set_item("rank", triad.rank)?;
    figures.set_item("widened", triad.widened)?;
    figures.set_item("by_direction", triad.by_direction)?;
    figures.set_item("variance_freedom", triad.variance_freedom)?;
    figures.set_item("chi_square", triad.chi_square)?;
    figures.set_item("degrees_of_freedom", triad.degrees_of_freedom)?;
    figures.set_item(
        "residuals",
        stacked(py, triad.residuals.iter().map(|(residual, _)| *residual)),
    )?;
    figures.set_item(
        "residual_sigmas",
        stacked(py, triad.residuals.iter().map(|(_, sigma)| *sigma)),
    )?;
    figures.set_item(
        "labels",
        triad.labels.iter().map(ResidualLabel::named).collect::<Vec<_>>(),
    )?;
    if let Some((g, sigma)) = &triad.g_sensitivity {
        figures.set_item("g_sensitivity", array2(py, g))?;
        figures.set_item("g_sensitivity_sigma", array2(py, sigma))?;
    }
    Ok(figures)
}

/// Fits a unit's own rests by a sphere: (norm residual m/s^2, median length m/s^2), or None.
#[pyfunction]
fn sphere_residual(unit: &PyAcquired, gravity: f64) -> Option<f64> {
    own_sphere(&unit.inner, gravity).map(|sphere| sphere.norm_residual)
}

/// Checks that gyroscope and accelerometer measure the same turns: (consistency, figure or axes).
#[pyfunction]
fn gyroscope_consistency(unit: &PyAcquired) -> (&'static str, f64, Vec<(usize, f64)>) {
    match compare_gyroscope(&unit.inner) {
        GyroscopeConsistency::Consistent => ("consistent", 0.0, Vec::new()),
        GyroscopeConsistency::Unknown => ("unknown", 0.0, Vec::new()),
        GyroscopeConsistency::Scaled(scale) => ("scaled", scale, Vec::new()),
        GyroscopeConsistency::Permuted(axes) => ("permuted", 0.0, axes.to_vec()),
        GyroscopeConsistency::Inconsistent(angle) => ("inconsistent", angle, Vec::new()),
    }
}

pub(crate) fn core_error(py: Python<'_>, error: &TurntableError) -> PyErr {
    #[allow(clippy::cast_precision_loss)]
    let values: Vec<(&str, f64)> = match *error {
        TurntableError::TooFewRests { found, needed } => {
            vec![("found", found as f64), ("needed", needed as f64)]
        }
        TurntableError::NotCommanded { time, rate } => vec![("time", time), ("rate", rate)],
        TurntableError::AxisNotVertical { time, angle } => vec![("time", time), ("angle", angle)],
        TurntableError::Pairing(PairingError::MovedDuringRest { rest, time, angle }) => {
            vec![("rest", rest as f64), ("time", time), ("angle", angle)]
        }
        TurntableError::Pairing(PairingError::ReferenceMoved { time, angle }) => {
            vec![("time", time), ("angle", angle)]
        }
        TurntableError::Pairing(PairingError::FewMeet { met, rests }) => {
            vec![("met", met as f64), ("rests", rests as f64)]
        }
        TurntableError::Pairing(PairingError::ClocksApart { offset }) => vec![("offset", offset)],
        TurntableError::Pairing(
            PairingError::NoCommonTime | PairingError::OneInFiles | PairingError::NoCommonFile,
        )
        | TurntableError::DirectionsTooAlike
        | TurntableError::NoConstantRates
        | TurntableError::NeedsPoses
        | TurntableError::LeftHanded
        | TurntableError::AxesCoincide
        | TurntableError::LeftHandedGyroscope
        | TurntableError::GyroscopeAxesCoincide
        | TurntableError::Unsolvable => vec![],
    };
    match values.into_py_dict(py) {
        Ok(figures) => CoreError::new_err((error.word(), figures.unbind())),
        Err(error) => error,
    }
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("CoreError", module.py().get_type::<CoreError>())?;
    module.add("RESPONSE_FALSE_ALARM", RESPONSE_FALSE_ALARM)?;
    module.add_class::<PySettings>()?;
    module.add_class::<PyReference>()?;
    module.add_function(wrap_pyfunction!(fit_reference_of, module)?)?;
    module.add_function(wrap_pyfunction!(as_reference_of, module)?)?;
    module.add_function(wrap_pyfunction!(uncertainty_of_calibration, module)?)?;
    module.add_function(wrap_pyfunction!(uncertainty_of_grade, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate_target, module)?)?;
    module.add_function(wrap_pyfunction!(sphere_residual, module)?)?;
    module.add_function(wrap_pyfunction!(normal_gravity, module)?)?;
    module.add_function(wrap_pyfunction!(gyroscope_consistency, module)?)
}

/// WGS 84 normal gravity, m/s^2, at a latitude in rad and a height in m.
#[pyfunction]
fn normal_gravity(latitude: f64, height: f64) -> f64 {
    tumble_core::gravity::normal(latitude, height)
}
