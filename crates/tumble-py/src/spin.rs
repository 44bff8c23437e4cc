//! A robot that turns on the spot: settings, and the estimate from its samples.

use nalgebra::Vector3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::gravity::vertical_earth_rate;
use tumble_core::real::{Real, real};
use tumble_core::sample::Sample;
use tumble_core::spin::estimate::TrueAngle;
use tumble_core::spin::failure::SpinFailure;
use tumble_core::spin::settings::SpinSettings;
use tumble_lab::spin::{SpinFit, fit};

use crate::convert::rows;
use crate::spin_figures::{block_figures, error, figures};

/// How to spin and how to judge it.
#[pyclass(module = "tumble._core", name = "SpinSettings", frozen)]
pub struct PySpinSettings {
    pub(crate) inner: SpinSettings<f64>,
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
    let samples = SampleArrays::new(&time, &accelerometer, &gyroscope)?;
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
pub(crate) struct SampleArrays<'a> {
    pub(crate) time: &'a [f64],
    force: &'a [[f64; 3]],
    rate: &'a [[f64; 3]],
}

impl<'a> SampleArrays<'a> {
    pub(crate) fn new(
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

    pub(crate) fn iter<T: Real>(&self, origin: f64) -> impl Iterator<Item = Sample<T>> + Clone {
        self.time
            .iter()
            .zip(self.force.iter().zip(self.rate))
            .map(move |(time, (force, rate))| Sample {
                time: microseconds(time - origin),
                specific_force: Vector3::from(*force).map(real),
                angular_rate: Vector3::from(*rate).map(real),
            })
    }

    fn fit<T: Real>(
        &self,
        origin: f64,
        rests: &[(u64, u64)],
        settings: &SpinSettings<T>,
        instability: Option<(T, T)>,
        angle: Option<(f64, f64, f64)>,
    ) -> Result<SpinFit<T>, SpinFailure<T>> {
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
pub(crate) fn microseconds(seconds: f64) -> u64 {
    (seconds * 1e6).round().max(0.0) as u64
}

pub(crate) fn is_single(precision: &str) -> PyResult<bool> {
    match precision {
        "f32" => Ok(true),
        "f64" => Ok(false),
        _ => Err(PyValueError::new_err("precision is f32 or f64")),
    }
}

pub(crate) fn converted(settings: &SpinSettings<f64>) -> SpinSettings<f32> {
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

pub(crate) fn true_angle<T: Real>(angle: Option<(f64, f64, f64)>) -> Option<TrueAngle<T>> {
    let known = |value: f64| value.is_finite().then(|| real(value));
    angle.map(|(clockwise, counter_clockwise, sigma)| TrueAngle {
        clockwise: known(clockwise),
        counter_clockwise: known(counter_clockwise),
        sigma: real(sigma),
    })
}

fn both<'py, T: Real>(
    py: Python<'py>,
    fitted: Result<SpinFit<T>, SpinFailure<T>>,
    origin: f64,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let fitted = fitted.map_err(|failure| error(py, &failure, origin))?;
    Ok((
        figures(py, &fitted.estimate)?,
        block_figures(py, &fitted.blocks, origin)?,
    ))
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySpinSettings>()?;
    module.add_function(wrap_pyfunction!(fit_spin, module)?)
}
