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
use tumble_lab::setting::Value;
use tumble_lab::setting_table;
use tumble_lab::spin::{SpinFit, fit};

use crate::convert::rows;
use crate::settings::{settings_of, values};
use crate::spin_figures::{block_figures, error, figures, wide};

/// Settings of a spin.
#[pyclass(module = "tumble._core", name = "SpinSettings", frozen)]
pub struct PySpinSettings {
    pub(crate) wide: SpinSettings<f64>,
    pub(crate) narrow: SpinSettings<f32>,
    bias_instability: Option<(f64, f64)>,
}

#[pymethods]
impl PySpinSettings {
    #[new]
    #[pyo3(signature = (stated=None, *, latitude=None, bias_instability=None))]
    fn new(
        stated: Option<&Bound<'_, PyDict>>,
        latitude: Option<f64>,
        bias_instability: Option<(f64, f64)>,
    ) -> PyResult<Self> {
        let mut values = stated.map_or(Ok(Vec::new()), values)?;
        let mut number = |name: &str, value| values.push((name.to_string(), Value::Number(value)));
        if let Some(latitude) = latitude {
            // Zero stands for a latitude that is not known.
            let up = vertical_earth_rate(latitude);
            let known = if up == 0.0 {
                f64::from(f32::MIN_POSITIVE)
            } else {
                up
            };
            number("earth_rate_up", known);
        }
        if let Some((of_force, of_rate)) = bias_instability {
            number("specific_force_instability", of_force);
            number("angular_rate_instability", of_rate);
        }
        Ok(Self {
            wide: settings_of(&setting_table::spin(), &values)?,
            narrow: settings_of(&setting_table::spin(), &values)?,
            bias_instability,
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
    let samples = SampleArrays::new(&time, &accelerometer, &gyroscope)?;
    let origin = samples.time.first().copied().unwrap_or(0.0);
    let rests: Vec<(u64, u64)> = rests
        .as_array()
        .rows()
        .into_iter()
        .map(|row| (microseconds(row[0] - origin), microseconds(row[1] - origin)))
        .collect();
    let instability = settings.bias_instability;
    if is_single(precision)? {
        let narrow = instability.map(|(a, g)| (real(a), real(g)));
        let fitted = py.detach(|| samples.fit::<f32>(origin, &rests, &settings.narrow, narrow, true_angle));
        both(py, fitted, origin)
    } else {
        let fitted =
            py.detach(|| samples.fit::<f64>(origin, &rests, &settings.wide, instability, true_angle));
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
    let found = figures(py, &fitted.estimate)?;
    found.set_item("row_factor", wide(fitted.row_factor))?;
    Ok((found, block_figures(py, &fitted.blocks, origin)?))
}

/// Adds what is here to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySpinSettings>()?;
    module.add_function(wrap_pyfunction!(fit_spin, module)?)
}
