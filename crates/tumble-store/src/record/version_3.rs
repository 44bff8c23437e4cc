//! The fields of version 3, in the order of `docs/record-format.md`: what temperature does to one sensor of one unit.
//! What is here never changes.

use nalgebra::Vector3;
use postcard::fixint;
use serde::{Deserialize, Serialize};
use tumble_core::temperature::{Coefficients, TemperatureDrift};

use crate::record::version_1::{sensor, sensor_code, whole};
use crate::record::{DecodeError, DriftRecord};

/// Bytes of [`Payload`].
pub const PAYLOAD: usize = 93;

/// As they are on the wire.
#[derive(Serialize, Deserialize)]
pub struct Payload {
    #[serde(with = "fixint::le")]
    identity: u64,
    sensor: u8,
    reference: f32,
    range: [f32; 2],
    bias: Rows,
    scale: Rows,
}

/// Coefficients, one power after the other: flat, which has the same bytes and takes less code to read.
type Rows = [f32; 9];

/// Reads the fields.
pub fn read(fields: &[u8]) -> Result<DriftRecord, DecodeError> {
    let payload: Payload = whole(fields)?;
    Ok(DriftRecord {
        identity: payload.identity,
        sensor: sensor(payload.sensor)?,
        drift: TemperatureDrift {
            reference: payload.reference,
            range: payload.range,
            bias: coefficients(&payload.bias),
            scale: coefficients(&payload.scale),
        },
    })
}

impl From<&DriftRecord> for Payload {
    fn from(record: &DriftRecord) -> Self {
        let drift = &record.drift;
        Self {
            identity: record.identity,
            sensor: sensor_code(record.sensor),
            reference: drift.reference,
            range: drift.range,
            bias: rows(&drift.bias),
            scale: rows(&drift.scale),
        }
    }
}

fn rows(coefficients: &Coefficients<f32>) -> Rows {
    let [[a, b, c], [d, e, f], [g, h, i]] = coefficients.map(Into::into);
    [a, b, c, d, e, f, g, h, i]
}

fn coefficients(rows: &Rows) -> Coefficients<f32> {
    let [a, b, c, d, e, f, g, h, i] = *rows;
    [
        Vector3::new(a, b, c),
        Vector3::new(d, e, f),
        Vector3::new(g, h, i),
    ]
}
