//! Calibration records as the bytes that a device keeps.

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::temperature::{Coefficients, TemperatureDrift};
use tumble_store::record::{
    DRIFT_ENCODED, DecodeError, DriftRecord, EncodeError, MAX_ENCODED, StoredRecord, decode, decode_drift,
    encode, encode_drift, length,
};

use crate::correct::Drift;
use crate::redundancy_values::{read_record, unknown_word, write_record};
use crate::turntable::CoreError;

/// A record as bytes; `temperature`, degC, while the unit was calibrated.
#[pyfunction]
#[pyo3(signature = (record, temperature=None))]
fn encode_record<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyDict>,
    temperature: Option<f64>,
) -> PyResult<Bound<'py, PyBytes>> {
    let mut buffer = [0; MAX_ENCODED];
    let stored = StoredRecord::of(&read_record(record)?, temperature);
    let bytes = encode(&stored, &mut buffer).map_err(not_written)?;
    Ok(PyBytes::new(py, bytes))
}

/// The record that bytes are, neither more nor fewer, with its `temperature`, None where nobody knows.
#[pyfunction]
fn decode_record<'py>(py: Python<'py>, record: &[u8]) -> PyResult<Bound<'py, PyDict>> {
    let stored = decode(record).map_err(not_read)?;
    let record = write_record(py, &stored.record_in(), None)?;
    record.set_item("temperature", stored.temperature)?;
    Ok(record)
}

/// Length of a record of either kind by its first bytes, None where they have no meaning.
#[pyfunction]
fn record_length(begins: &[u8]) -> Option<usize> {
    length(begins)
}

/// Encodes the temperature drift of a sensor of a unit.
#[pyfunction]
fn encode_drift_record<'py>(
    py: Python<'py>,
    identity: u64,
    sensor: &str,
    drift: Drift,
) -> PyResult<Bound<'py, PyBytes>> {
    let mut buffer = [0; DRIFT_ENCODED];
    let record = DriftRecord {
        identity,
        sensor: Sensor::named(sensor).ok_or_else(|| unknown_word("sensor", sensor))?,
        drift: in_single(&drift.in_core()?),
    };
    let bytes = encode_drift(&record, &mut buffer).map_err(not_written)?;
    Ok(PyBytes::new(py, bytes))
}

/// Decodes a temperature drift: `identity`, `sensor`, and the fields of a calibration file.
#[pyfunction]
fn decode_drift_record<'py>(py: Python<'py>, record: &[u8]) -> PyResult<Bound<'py, PyDict>> {
    let DriftRecord {
        identity,
        sensor,
        drift,
    } = decode_drift(record).map_err(not_read)?;
    let dict = PyDict::new(py);
    dict.set_item("identity", identity)?;
    dict.set_item("sensor", sensor.name())?;
    dict.set_item("reference", drift.reference)?;
    dict.set_item("range", drift.range)?;
    dict.set_item("bias", drift.bias.map(<[f32; 3]>::from))?;
    dict.set_item("scale", drift.scale.map(<[f32; 3]>::from))?;
    Ok(dict)
}

#[allow(clippy::cast_possible_truncation)]
fn in_single(drift: &TemperatureDrift<f64>) -> TemperatureDrift<f32> {
    let powers = |rows: &Coefficients<f64>| rows.map(|row| row.map(|x| x as f32));
    TemperatureDrift {
        reference: drift.reference as f32,
        range: drift.range.map(|x| x as f32),
        bias: powers(&drift.bias),
        scale: powers(&drift.scale),
    }
}

fn not_written(error: EncodeError) -> PyErr {
    CoreError::new_err(match error {
        EncodeError::NotFinite(field) => format!("{field:?} holds what no record may"),
        EncodeError::NoRoom => "the record is longer than any".into(),
    })
}

fn not_read(error: DecodeError) -> PyErr {
    CoreError::new_err(match error {
        DecodeError::TooShort { found } => format!("{found} bytes are fewer than any record has"),
        DecodeError::NotARecord => "does not begin as records do".into(),
        DecodeError::Corrupt => "is not as it was written: its checksum or its length is wrong".into(),
        DecodeError::UnknownVersion { found } => format!("is of version {found}, which is newer"),
        DecodeError::OtherKind { found } => format!("is of version {found}, a record of another kind"),
        DecodeError::UnknownCode { field, found } => {
            format!("{field:?} has the code {found}, which means nothing")
        }
        DecodeError::NotFinite(field) => format!("{field:?} holds what no record may"),
    })
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("DRIFT_RECORD_VERSION", tumble_store::record::DRIFT_VERSION)?;
    module.add_function(wrap_pyfunction!(encode_record, module)?)?;
    module.add_function(wrap_pyfunction!(decode_record, module)?)?;
    module.add_function(wrap_pyfunction!(record_length, module)?)?;
    module.add_function(wrap_pyfunction!(encode_drift_record, module)?)?;
    module.add_function(wrap_pyfunction!(decode_drift_record, module)?)
}
