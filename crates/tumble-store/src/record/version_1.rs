//! The fields of version 1, in the order of `docs/record-format.md`, with which later versions begin. What is here never
//! changes: another order, or another field, is another version.

use nalgebra::{Matrix3, Vector3};
use postcard::fixint;
use serde::{Deserialize, Serialize};
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::Rung;

use crate::record::{DecodeError, Field, StoredRecord};

/// Bytes of [`Fields`].
pub const FIELDS: usize = 147;

/// As they are on the wire. Integers have all their bytes, so that every field has its place.
#[derive(Serialize, Deserialize)]
pub struct Fields {
    #[serde(with = "fixint::le")]
    identity: u64,
    sensor: u8,
    rung: u8,
    directions: u8,
    #[serde(with = "fixint::le")]
    pairs: u32,
    #[serde(with = "fixint::le")]
    sequence: u32,
    matrix: Rows,
    bias: [f32; 3],
    matrix_sigma: Rows,
    bias_sigma: [f32; 3],
    lever_arm: [f32; 3],
    lever_arm_sigma: [f32; 3],
    residual: f32,
    residual_before: f32,
}

/// All that version 1 has.
#[derive(Deserialize)]
struct Payload {
    fields: Fields,
    temperature: Option<f32>,
}

/// A matrix, row by row: flat, which has the same bytes and takes less code to read.
type Rows = [f32; 9];

/// Reads the fields.
pub fn read(fields: &[u8]) -> Result<StoredRecord, DecodeError> {
    let Payload { fields, temperature } = whole(fields)?;
    let record = fields.record(Vector3::zeros())?;
    Ok(StoredRecord { record, temperature })
}

/// Reads the fields of a version from bytes that hold nothing else.
pub fn whole<'b, P: Deserialize<'b>>(fields: &'b [u8]) -> Result<P, DecodeError> {
    let (payload, rest) = postcard::take_from_bytes::<P>(fields).map_err(|_| DecodeError::Corrupt)?;
    rest.is_empty().then_some(payload).ok_or(DecodeError::Corrupt)
}

impl From<&Record<f32>> for Fields {
    fn from(record: &Record<f32>) -> Self {
        Self {
            identity: record.identity,
            sensor: sensor_code(record.sensor),
            rung: rung_code(record.rung),
            directions: record.directions,
            pairs: record.pairs,
            sequence: record.sequence,
            matrix: rows(&record.model.matrix),
            bias: record.model.bias.into(),
            matrix_sigma: rows(&record.matrix_sigma),
            bias_sigma: record.bias_sigma.into(),
            lever_arm: record.lever_arm.into(),
            lever_arm_sigma: record.lever_arm_sigma.into(),
            residual: record.residual,
            residual_before: record.residual_before,
        }
    }
}

impl Fields {
    /// The record of these fields, and of how far it has followed the primary.
    pub fn record(self, followed: Vector3<f32>) -> Result<Record<f32>, DecodeError> {
        Ok(Record {
            identity: self.identity,
            sensor: sensor(self.sensor)?,
            model: ErrorModel {
                matrix: matrix(&self.matrix),
                bias: Vector3::from(self.bias),
            },
            matrix_sigma: matrix(&self.matrix_sigma),
            bias_sigma: Vector3::from(self.bias_sigma),
            lever_arm: Vector3::from(self.lever_arm),
            lever_arm_sigma: Vector3::from(self.lever_arm_sigma),
            rung: rung(self.rung)?,
            directions: self.directions,
            residual: self.residual,
            residual_before: self.residual_before,
            pairs: self.pairs,
            sequence: self.sequence,
            followed,
        })
    }
}

fn rows(m: &Matrix3<f32>) -> Rows {
    // Columns are how nalgebra keeps a matrix.
    let [[a, b, c], [d, e, f], [g, h, i]] = m.transpose().into();
    [a, b, c, d, e, f, g, h, i]
}

fn matrix(rows: &Rows) -> Matrix3<f32> {
    let [a, b, c, d, e, f, g, h, i] = *rows;
    Matrix3::new(a, b, c, d, e, f, g, h, i)
}

/// The code of a sensor.
pub fn sensor_code(sensor: Sensor) -> u8 {
    match sensor {
        Sensor::Accelerometer => 0,
        Sensor::Gyroscope => 1,
    }
}

/// The sensor of a code.
pub fn sensor(found: u8) -> Result<Sensor, DecodeError> {
    match found {
        0 => Ok(Sensor::Accelerometer),
        1 => Ok(Sensor::Gyroscope),
        _ => Err(DecodeError::UnknownCode {
            field: Field::Sensor,
            found,
        }),
    }
}

fn rung_code(rung: Rung) -> u8 {
    match rung {
        Rung::Offset => 0,
        Rung::Gain => 1,
        Rung::Affine => 2,
        Rung::AffineAndLeverArm => 3,
    }
}

fn rung(found: u8) -> Result<Rung, DecodeError> {
    match found {
        0 => Ok(Rung::Offset),
        1 => Ok(Rung::Gain),
        2 => Ok(Rung::Affine),
        3 => Ok(Rung::AffineAndLeverArm),
        _ => Err(DecodeError::UnknownCode {
            field: Field::Rung,
            found,
        }),
    }
}
