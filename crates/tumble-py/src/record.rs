//! Calibration records as the bytes that a device keeps.

use nalgebra::Matrix3;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use tumble_core::magnetometer::MagnetometerModel;
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::record::RecordPart;
use tumble_core::temperature::{Coefficients, TemperatureDrift};
use tumble_store::record::{
    DRIFT_VERSION, DecodeError, DriftRecord, EncodeError, Load, MAX_ENCODED, MagnetometerRecord,
    StoredRecord, decode, decode_drift, decode_magnetometer, encode, encode_drift, encode_magnetometer,
    length,
};

use crate::correct::DriftSection;
use crate::redundancy_values::{read_record, read_subject, write_record};
use crate::turntable::CoreError;

/// Key of a temperature drift.
const DRIFT: &str = "temperature_drift";
/// Sensor that a record of a magnetometer is about.
const MAGNETOMETER: &str = "magnetometer";
/// Unit of a throttle from 0 to 1, in place of A.
const OF_THROTTLE: &str = "1";

/// Encodes a record: `identity`, `sensor`, and either the fields of an error or `temperature_drift`, that of a
/// calibration file. For the sensor `magnetometer` the fields are `matrix`, `bias`, uT, `matrix_sigma`, `bias_sigma`,
/// `current`, and its `current_unit`, A or 1. `temperature`, degC, is that of the unit while its error was calibrated.
#[pyfunction]
#[pyo3(signature = (record, temperature=None))]
fn encode_record<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyDict>,
    temperature: Option<f64>,
) -> PyResult<Bound<'py, PyBytes>> {
    let mut buffer = [0; MAX_ENCODED];
    let bytes = match record.get_item(DRIFT)? {
        Some(drift) => encode_drift(&read_drift(record, &drift)?, &mut buffer),
        None if is_magnetometer(record)? => encode_magnetometer(&read_magnetometer(record)?, &mut buffer),
        None => encode(&StoredRecord::of(&read_record(record)?, temperature), &mut buffer),
    };
    Ok(PyBytes::new(py, bytes.map_err(not_written)?))
}

/// Decodes bytes that are a record, neither more nor fewer; one of an error has its `temperature` too, None where it is not
/// known.
#[pyfunction]
fn decode_record<'py>(py: Python<'py>, record: &[u8]) -> PyResult<Bound<'py, PyDict>> {
    match decode(record) {
        Err(DecodeError::OtherKind { found: DRIFT_VERSION }) => {
            write_drift(py, &decode_drift(record).map_err(not_read)?)
        }
        Err(DecodeError::OtherKind { .. }) => {
            write_magnetometer(py, &decode_magnetometer(record).map_err(not_read)?)
        }
        decoded => {
            let stored = decoded.map_err(not_read)?;
            let record = write_record(py, &stored.record_in(), None)?;
            record.set_item("temperature", stored.temperature)?;
            Ok(record)
        }
    }
}

/// Length of a record of any kind by its first bytes, None where they have no meaning.
#[pyfunction]
fn record_length(begins: &[u8]) -> Option<usize> {
    length(begins)
}

fn read_drift(record: &Bound<'_, PyDict>, drift: &Bound<'_, PyAny>) -> PyResult<DriftRecord> {
    let (identity, sensor) = read_subject(record)?;
    let drift: DriftSection = drift.extract()?;
    Ok(DriftRecord {
        identity,
        sensor,
        drift: in_single(&drift.in_core()?),
    })
}

fn write_drift<'py>(py: Python<'py>, record: &DriftRecord) -> PyResult<Bound<'py, PyDict>> {
    let (dict, drift) = (PyDict::new(py), PyDict::new(py));
    drift.set_item("reference", record.drift.reference)?;
    drift.set_item("range", record.drift.range)?;
    drift.set_item("bias", record.drift.bias.map(<[f32; 3]>::from))?;
    drift.set_item("scale", record.drift.scale.map(<[f32; 3]>::from))?;
    dict.set_item("identity", record.identity)?;
    dict.set_item("sensor", record.sensor.name())?;
    dict.set_item(DRIFT, drift)?;
    Ok(dict)
}

fn is_magnetometer(record: &Bound<'_, PyDict>) -> PyResult<bool> {
    let sensor: Option<String> = record
        .get_item("sensor")?
        .map(|name| name.extract())
        .transpose()?;
    Ok(sensor.as_deref() == Some(MAGNETOMETER))
}

fn read_magnetometer(record: &Bound<'_, PyDict>) -> PyResult<MagnetometerRecord> {
    let rows = |key| -> PyResult<[[f32; 3]; 3]> { item(record, key)?.extract() };
    let vector = |key| -> PyResult<[f32; 3]> { item(record, key)?.extract() };
    let unit: String = item(record, "current_unit")?.extract()?;
    Ok(MagnetometerRecord {
        identity: item(record, "identity")?.extract()?,
        magnetometer: MagnetometerModel {
            model: ErrorModel {
                matrix: Matrix3::from(rows("matrix")?).transpose(),
                bias: vector("bias")?.into(),
            },
            current: vector("current")?.into(),
        },
        load: if unit == OF_THROTTLE {
            Load::Throttle
        } else {
            Load::Current
        },
        matrix_sigma: Matrix3::from(rows("matrix_sigma")?).transpose(),
        bias_sigma: vector("bias_sigma")?.into(),
    })
}

fn item<'py>(record: &Bound<'py, PyDict>, key: &str) -> PyResult<Bound<'py, PyAny>> {
    let found = record.get_item(key)?;
    found.ok_or_else(|| CoreError::new_err(format!("has no {key}")))
}

fn write_magnetometer<'py>(py: Python<'py>, record: &MagnetometerRecord) -> PyResult<Bound<'py, PyDict>> {
    let rows = |matrix: &Matrix3<f32>| <[[f32; 3]; 3]>::from(matrix.transpose());
    let dict = PyDict::new(py);
    dict.set_item("identity", record.identity)?;
    dict.set_item("sensor", MAGNETOMETER)?;
    dict.set_item("matrix", rows(&record.magnetometer.model.matrix))?;
    dict.set_item("bias", <[f32; 3]>::from(record.magnetometer.model.bias))?;
    dict.set_item("current", <[f32; 3]>::from(record.magnetometer.current))?;
    dict.set_item(
        "current_unit",
        if record.load == Load::Throttle {
            OF_THROTTLE
        } else {
            "A"
        },
    )?;
    dict.set_item("matrix_sigma", rows(&record.matrix_sigma))?;
    dict.set_item("bias_sigma", <[f32; 3]>::from(record.bias_sigma))?;
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
        EncodeError::NotFinite(field) => format!("{} holds what no record may", field.name()),
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
            format!("{} has the code {found}, which means nothing", field.name())
        }
        DecodeError::NotFinite(field) => format!("{} holds what no record may", field.name()),
    })
}

/// Rows of the table of records: name, meaning, unit, count of numbers, whether they may be infinite, and the first version
/// of the bytes that has them.
#[pyfunction]
fn record_table(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let row = |part: RecordPart| {
        let dict = PyDict::new(py);
        dict.set_item("name", part.name())?;
        dict.set_item("meaning", part.meaning())?;
        dict.set_item("unit", part.unit())?;
        dict.set_item("count", part.count())?;
        dict.set_item("may_be_infinite", part.may_be_infinite())?;
        dict.set_item("version", part.version())?;
        Ok(dict)
    };
    RecordPart::ALL.into_iter().map(row).collect()
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(encode_record, module)?)?;
    module.add_function(wrap_pyfunction!(decode_record, module)?)?;
    module.add_function(wrap_pyfunction!(record_length, module)?)?;
    module.add_function(wrap_pyfunction!(record_table, module)?)
}
