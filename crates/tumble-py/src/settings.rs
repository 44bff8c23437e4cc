//! Settings by name, to and from Python, and the tables they stand in.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyString, PyTuple};
use tumble_lab::setting::{Bound as Limit, Setting, SettingKind, Unfit, Value, stated};

/// Named values of a dictionary.
pub(crate) fn values(settings: &Bound<'_, PyDict>) -> PyResult<Vec<(String, Value)>> {
    settings
        .iter()
        .map(|(name, value)| Ok((name.extract()?, read_value(&value)?)))
        .collect()
}

fn read_value(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    Ok(if value.is_none() {
        Value::None
    } else if value.is_instance_of::<PyBool>() {
        Value::Flag(value.extract()?)
    } else if value.is_instance_of::<PyString>() {
        Value::Text(value.extract()?)
    } else {
        Value::Number(value.extract()?)
    })
}

/// A setting for Python.
fn write_value<'py>(py: Python<'py>, value: Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Number(number) => PyFloat::new(py, number).into_any(),
        Value::Text(text) => PyString::new(py, &text).into_any(),
        Value::Flag(flag) => PyBool::new(py, flag).to_owned().into_any(),
        Value::None => py.None().into_bound(py),
    })
}

/// Defaults with what is stated in their place.
pub(crate) fn settings_of<S: Default>(table: &[Setting<S>], values: &[(String, Value)]) -> PyResult<S> {
    stated(table, values.iter().map(|(name, value)| (name.as_str(), value))).map_err(|error| unfit(&error))
}

/// A setting that cannot be.
fn unfit(error: &Unfit) -> PyErr {
    PyValueError::new_err(match error {
        Unfit::Unknown(name) => format!("there is no setting '{name}'"),
        Unfit::Kind(name) => format!("the setting '{name}' cannot have that value"),
        Unfit::Bound(name) => format!("the setting '{name}' is out of its bounds"),
    })
}

/// All settings of a procedure, `redundancy` or `spin`, in the order they are explained.
#[pyfunction]
fn setting_table<'py>(py: Python<'py>, of: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
    match of {
        "redundancy" => rows(py, &tumble_lab::setting_table::redundancy::<f64>()),
        "spin" => rows(py, &tumble_lab::setting_table::spin::<f64>()),
        _ => Err(PyValueError::new_err(format!("there are no settings of '{of}'"))),
    }
}

fn rows<'py, S: Default>(py: Python<'py>, table: &[Setting<S>]) -> PyResult<Vec<Bound<'py, PyDict>>> {
    table.iter().map(|setting| row(py, setting)).collect()
}

fn row<'py, S: Default>(py: Python<'py>, setting: &Setting<S>) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let (above, least, below) = match setting.bound {
        Limit::Any => (None, None, None),
        Limit::Positive if setting.kind == SettingKind::Count => (None, Some(1.0), None),
        Limit::AboveOne => (Some(1.0), None, None),
        Limit::Share => (None, Some(0.0), Some(1.0)),
        Limit::NotNegative => (None, Some(0.0), None),
        Limit::Positive | Limit::MoreThan(_) => (Some(0.0), None, None),
    };
    let more_than = match setting.bound {
        Limit::MoreThan(other) => Some(other),
        _ => None,
    };
    dict.set_item("name", setting.name)?;
    dict.set_item("path", setting.path)?;
    dict.set_item("group", setting.group)?;
    dict.set_item("kind", setting.kind.name())?;
    let of_choice = match setting.kind {
        SettingKind::Choice(name) => name,
        _ => "",
    };
    dict.set_item("type", of_choice)?;
    dict.set_item("choices", PyTuple::new(py, &setting.choices)?)?;
    dict.set_item("unit", setting.unit)?;
    dict.set_item("meaning", setting.meaning)?;
    dict.set_item("none", setting.none)?;
    dict.set_item("above", above)?;
    dict.set_item("least", least)?;
    dict.set_item("below", below)?;
    dict.set_item("more_than", more_than)?;
    let default = write_value(py, (setting.get)(&S::default()))?;
    match setting.kind {
        SettingKind::Count => dict.set_item("default", default.call_method0("__int__")?)?,
        _ => dict.set_item("default", default)?,
    }
    Ok(dict)
}

/// Adds this part to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(setting_table, module)?)
}
