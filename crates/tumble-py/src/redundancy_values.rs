//! Settings, records and results of the redundancy monitor, to and from Python.

use nalgebra::{Matrix3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tumble_core::redundancy::aiding::{Aiding, AidingKind};
use tumble_core::redundancy::monitor::Command;
use tumble_core::redundancy::platform::PlatformError;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::FitModel;
use tumble_core::redundancy::settings::validate::{InvalidSetting, SettingError};
use tumble_lab::redundancy::dyn_monitor::{Model, OutputSample, WindowMeans};
use tumble_lab::redundancy::event_text::{EventText, Figure};
use tumble_lab::redundancy::replay::{Replay, ReplayWindow, Said};
use tumble_lab::setting::in_seconds;

use crate::convert::{array1, array2, matrix};
use crate::turntable::CoreError;

/// A platform that cannot be, as `CoreError` with its figures.
pub(crate) fn platform_error(py: Python<'_>, error: &PlatformError) -> PyErr {
    let figures = PyDict::new(py);
    let set = match error {
        PlatformError::Settings(InvalidSetting { setting, error }) => figures
            .set_item("setting", setting)
            .and_then(|()| figures.set_item("objection", error.name()))
            .and_then(|()| figures.set_item("other", other_of(error))),
        PlatformError::TooFewUnits | PlatformError::Primary => Ok(()),
        PlatformError::Mounting(unit)
        | PlatformError::Threshold(unit)
        | PlatformError::SameIdentity(unit) => figures.set_item("unit", unit),
    };
    match set {
        Ok(()) => CoreError::new_err((error.name(), figures.unbind())),
        Err(error) => error,
    }
}

/// The name or the figure, s, that an error of a setting refers to.
fn other_of(error: &SettingError) -> String {
    match error {
        SettingError::ShorterThan(other)
        | SettingError::SmallerThan(other)
        | SettingError::MoreThanFit(other) => (*other).to_string(),
        SettingError::TooLong(most) => in_seconds(*most).to_string(),
        SettingError::NotPositive
        | SettingError::NotAShare
        | SettingError::AlwaysExceeded
        | SettingError::NoLastError
        | SettingError::NotAPartOfASecond => String::new(),
    }
}

/// A command by name.
pub(crate) fn command((time, name): &(f64, String)) -> PyResult<(f64, Command)> {
    let command = Command::named(name);
    let command = command.ok_or_else(|| PyValueError::new_err(format!("there is no command '{name}'")))?;
    Ok((*time, command))
}

/// Aiding measurement in Python's form: time, s, kind, number of a unit, value, sigma, and the turn of the samples with
/// which it came, s.
pub(crate) type PySaid<'py> = (
    f64,
    String,
    usize,
    PyReadonlyArray1<'py, f64>,
    PyReadonlyArray1<'py, f64>,
    f64,
);

/// Converts an aiding measurement by the name of its kind.
pub(crate) fn aiding((time, kind, unit, value, sigma, turn): &PySaid<'_>) -> PyResult<Said> {
    let (value, sigma) = (vector(value, "value")?, vector(sigma, "sigma")?);
    let kind = AidingKind::named(kind)
        .ok_or_else(|| PyValueError::new_err(format!("there is no aiding measurement '{kind}'")))?;
    Ok(Said {
        time: *time,
        turn: *turn,
        aiding: Aiding::of_kind(kind, *unit, value, sigma),
    })
}

/// `M`, `b` and residual of a sensor, where a calibration has them.
pub(crate) fn model(calibration: &Bound<'_, PyDict>, sensor: Sensor) -> PyResult<Option<Model>> {
    let Some(found) = calibration.get_item(sensor.name())? else {
        return Ok(None);
    };
    let (m, b, residual): (PyReadonlyArray2<'_, f64>, PyReadonlyArray1<'_, f64>, f64) = found.extract()?;
    Ok(Some((matrix(&m, "M")?, vector(&b, "b")?, residual)))
}

/// A vector of three.
pub(crate) fn vector(array: &PyReadonlyArray1<'_, f64>, name: &str) -> PyResult<Vector3<f64>> {
    match array.as_slice()? {
        [x, y, z] => Ok(Vector3::new(*x, *y, *z)),
        _ => Err(PyValueError::new_err(format!("{name} must have shape (3,)"))),
    }
}

/// An offset of a clock in microseconds.
#[allow(clippy::cast_possible_truncation)]
pub(crate) fn offset(seconds: f64) -> i64 {
    (seconds * 1e6).round() as i64
}

/// A word that the core does not know.
pub(crate) fn unknown_word(kind: &str, word: &str) -> PyErr {
    PyValueError::new_err(format!("there is no {kind} '{word}'"))
}

fn item<'py, V: FromPyObjectOwned<'py>>(dict: &Bound<'py, PyDict>, name: &str) -> PyResult<V> {
    let found = dict.get_item(name)?;
    let found = found.ok_or_else(|| PyValueError::new_err(format!("the record has no '{name}'")))?;
    found.extract().map_err(Into::into)
}

/// Reads identity and sensor of a record.
pub(crate) fn read_subject(dict: &Bound<'_, PyDict>) -> PyResult<(u64, Sensor)> {
    let sensor: String = item(dict, "sensor")?;
    let sensor = Sensor::named(&sensor).ok_or_else(|| unknown_word("sensor", &sensor))?;
    Ok((item(dict, "identity")?, sensor))
}

/// Reads a record of a dictionary; numbers that it lacks, or that are None, are not known.
pub(crate) fn read_record(dict: &Bound<'_, PyDict>) -> PyResult<Record<f64>> {
    let (identity, sensor) = read_subject(dict)?;
    let fit_model: String = item(dict, "fit_model")?;
    let mut record = Record {
        fit_model: FitModel::named(&fit_model).ok_or_else(|| unknown_word("fit_model", &fit_model))?,
        directions: item(dict, "directions")?,
        pairs: item(dict, "pairs")?,
        sequence: item(dict, "sequence")?,
        ..Record::unknown(identity, sensor)
    };
    for (part, numbers) in RecordPart::ALL.into_iter().zip(record.parts_mut()) {
        let name = part.name();
        let Some(value) = dict.get_item(name)?.filter(|value| !value.is_none()) else {
            continue;
        };
        match numbers {
            [number] => *number = value.extract()?,
            [_, _, _] => numbers.copy_from_slice(vector(&value.extract()?, name)?.as_slice()),
            _ => numbers.copy_from_slice(matrix(&value.extract()?, name)?.as_slice()),
        }
    }
    Ok(record)
}

/// A record for Python; gyroscopes have no lever arm.
pub(crate) fn write_record<'py>(
    py: Python<'py>,
    record: &Record<f64>,
    adopted: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("identity", record.identity)?;
    dict.set_item("sensor", record.sensor.name())?;
    dict.set_item("fit_model", record.fit_model.name())?;
    dict.set_item("directions", record.directions)?;
    dict.set_item("pairs", record.pairs)?;
    dict.set_item("sequence", record.sequence)?;
    for (part, numbers) in RecordPart::ALL.into_iter().zip(record.parts()) {
        let of_lever_arm = matches!(part, RecordPart::LeverArm | RecordPart::LeverArmSigma);
        match numbers {
            _ if of_lever_arm && record.sensor == Sensor::Gyroscope => {
                dict.set_item(part.name(), py.None())?
            }
            [number] => dict.set_item(part.name(), number)?,
            [_, _, _] => dict.set_item(part.name(), array1(py, &Vector3::from_column_slice(numbers)))?,
            _ => dict.set_item(part.name(), array2(py, &Matrix3::from_column_slice(numbers)))?,
        }
    }
    dict.set_item("adopted", adopted)?;
    Ok(dict)
}

/// Figures of an event.
pub(crate) fn figures<'py>(py: Python<'py>, event: &EventText) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, figure) in &event.figures {
        match figure {
            Figure::Number(number) => dict.set_item(name, number)?,
            Figure::Count(count) => dict.set_item(name, count)?,
            Figure::Units(units) => {
                let numbers: Vec<u32> = (0..u32::BITS).filter(|unit| units >> unit & 1 == 1).collect();
                dict.set_item(name, numbers)?;
            }
            Figure::Text(text) => dict.set_item(name, text)?,
            Figure::Flag(flag) => dict.set_item(name, flag)?,
        }
    }
    Ok(dict)
}

/// Why a record was rejected, if it was.
pub(crate) fn rejection(event: &EventText) -> Option<&'static str> {
    let reason = event.figures.iter().find_map(|(name, figure)| match figure {
        Figure::Text(text) if *name == "reason" => Some(*text),
        _ => None,
    });
    reason.filter(|_| event.event == "record rejected")
}

/// Column of three components of the means of a unit over a window.
type MeansColumn = fn(&WindowMeans) -> &[f64];

/// Adds the windows of a replay as arrays.
pub(crate) fn traces(
    py: Python<'_>,
    dict: &Bound<'_, PyDict>,
    replay: &Replay,
    units: usize,
    origin: f64,
) -> PyResult<()> {
    let middle = |window: &ReplayWindow| window.time + origin;
    let times: Vec<f64> = replay.windows.iter().map(middle).collect();
    dict.set_item("window_time", PyArray1::from_vec(py, times))?;
    let columns: [(&str, MeansColumn); 4] = [
        ("specific_force", |means| &means.read[..3]),
        ("angular_rate", |means| &means.read[3..]),
        ("specific_force_compensated", |means| &means.compensated[..3]),
        ("angular_rate_compensated", |means| &means.compensated[3..]),
    ];
    for (name, column) in columns {
        let of_unit = |unit: usize| {
            let rows = replay
                .windows
                .iter()
                .map(|window| window.means.get(unit).and_then(Option::as_ref));
            let nothing: &[f64] = &[f64::NAN; 3];
            array_of(py, rows.flat_map(|means| means.map_or(nothing, column)).copied())
        };
        let arrays: PyResult<Vec<_>> = (0..units).map(of_unit).collect();
        dict.set_item(name, arrays?)?;
    }
    Ok(())
}

/// The output of a replay as arrays.
pub(crate) fn output<'py>(py: Python<'py>, replay: &Replay, origin: f64) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let output = &replay.output;
    let time = output.iter().map(|said| in_seconds(said.time) + origin).collect();
    #[allow(clippy::cast_precision_loss)]
    let source = output.iter().map(|said| said.source as f64).collect();
    let flags = output
        .iter()
        .map(|said| f64::from(u8::from(said.degraded)))
        .collect();
    dict.set_item("said", replay.said)?;
    dict.set_item("degraded", replay.degraded)?;
    dict.set_item("output_flags", PyArray1::<f64>::from_vec(py, flags))?;
    dict.set_item("output_time", PyArray1::<f64>::from_vec(py, time))?;
    dict.set_item("output_unit", PyArray1::<f64>::from_vec(py, source))?;
    let flat = |part: fn(&OutputSample) -> &[f64; 3]| array_of(py, output.iter().flat_map(part).copied());
    dict.set_item("output_specific_force", flat(|said| &said.specific_force)?)?;
    dict.set_item("output_angular_rate", flat(|said| &said.angular_rate)?)?;
    Ok(dict)
}

fn array_of(py: Python<'_>, flat: impl Iterator<Item = f64>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let flat: Vec<f64> = flat.collect();
    let rows = flat.len() / 3;
    PyArray1::from_vec(py, flat).reshape([rows, 3])
}
