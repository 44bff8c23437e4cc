//! How a version that no longer is written stays readable, shown by one that never was: without lever arm, residuals
//! and temperature.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::Rung;

use super::{DecodeError, MAX_ENCODED, Reader, StoredRecord, decode_by, encode, version_1};

/// What the older version had.
#[derive(Serialize, Deserialize)]
struct Older {
    #[serde(with = "postcard::fixint::le")]
    identity: u64,
    sensor: u8,
    matrix: [[f32; 3]; 3],
    bias: [f32; 3],
}

/// Takes what is missing as: no lever arm, nothing known of how good it is, first of its sequence.
fn read_older(fields: &[u8]) -> Result<StoredRecord, DecodeError> {
    let older: Older = postcard::from_bytes(fields).map_err(|_| DecodeError::Corrupt)?;
    let unknown = f32::INFINITY;
    let record = Record {
        identity: older.identity,
        sensor: version_1::sensor(older.sensor)?,
        model: ErrorModel {
            matrix: Matrix3::from(older.matrix).transpose(),
            bias: Vector3::from(older.bias),
        },
        matrix_sigma: Matrix3::repeat(unknown),
        bias_sigma: Vector3::repeat(unknown),
        lever_arm: Vector3::zeros(),
        lever_arm_sigma: Vector3::repeat(unknown),
        rung: Rung::Affine,
        directions: 0,
        residual: unknown,
        residual_before: unknown,
        pairs: 0,
        sequence: 1,
    };
    Ok(StoredRecord {
        record,
        temperature: None,
    })
}

const READERS: [(u8, Reader); 2] = [(0, read_older), (1, version_1::read)];

/// As such a version would have left it in a device: frozen.
fn frozen() -> [u8; 64] {
    let mut bytes = [0; 64];
    bytes[..12].copy_from_slice(b"TR\x00\x2a\x00\x00\x00\x00\x00\x00\x00\x01");
    for (place, number) in [
        (12, 1.0_f32),
        (24, 0.5),
        (28, 1.0),
        (44, 1.0),
        (48, 0.125),
        (56, -1.0),
    ] {
        bytes[place..place + 4].copy_from_slice(&number.to_le_bytes());
    }
    bytes[60..].copy_from_slice(&0xd160_72f4_u32.to_le_bytes());
    bytes
}

#[test]
fn the_reader_of_an_older_version_is_chosen_by_the_version_and_given_its_fields() {
    let read = decode_by(&READERS, &frozen()).unwrap();
    assert_eq!(read.record.identity, 42);
    assert_eq!(read.record.sensor, Sensor::Gyroscope);
    let matrix = Matrix3::new(1.0, 0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 1.0);
    assert_eq!(read.record.model.matrix, matrix);
    assert_eq!(read.record.model.bias, Vector3::new(0.125, 0.0, -1.0));
}

#[test]
fn what_was_read_of_an_older_version_is_written_as_the_newest_and_reads_the_same() {
    let read = decode_by(&READERS, &frozen()).unwrap();
    let mut buffer = [0; MAX_ENCODED];
    let bytes = encode(&read, &mut buffer).unwrap();
    assert_eq!(bytes[2], super::VERSION);
    assert_eq!(decode_by(&READERS, bytes), Ok(read));
}

#[test]
fn a_version_without_a_reader_is_named() {
    assert_eq!(
        super::decode(&frozen()),
        Err(DecodeError::UnknownVersion { found: 0 })
    );
}
