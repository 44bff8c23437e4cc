//! Laws of the error of a magnetometer as bytes.

use nalgebra::{Matrix3, Vector3};
use postcard::fixint;
use proptest::prelude::*;
use serde::Serialize;
use tumble_core::magnetometer::MagnetometerModel;
use tumble_core::model::ErrorModel;
use tumble_store::record::{
    DecodeError, EncodeError, Field, Load, MAGNETOMETER_ENCODED, MAGNETOMETER_VERSION, MAX_ENCODED,
    MagnetometerRecord, decode, decode_drift, decode_magnetometer, encode, encode_magnetometer, length,
};

use crate::common::{NEWER, example, sign};

/// Fields of version 4.
#[derive(Serialize)]
struct Fields {
    #[serde(with = "fixint::le")]
    identity: u64,
    sensor: u8,
    load: u8,
    matrix: [[f32; 3]; 3],
    bias: [f32; 3],
    current: [f32; 3],
    matrix_sigma: [[f32; 3]; 3],
    bias_sigma: [f32; 3],
}

fn unit() -> MagnetometerRecord {
    MagnetometerRecord {
        identity: 0x0123_4567_89ab_cdef,
        magnetometer: MagnetometerModel {
            model: ErrorModel {
                matrix: Matrix3::new(1.125, 0.0625, 0.0, 0.0625, 0.875, -0.03125, 0.0, -0.03125, 1.0),
                bias: Vector3::new(12.5, -36.0, 4.5),
            },
            current: Vector3::new(0.5, -0.25, 2.0),
        },
        load: Load::Current,
        matrix_sigma: Matrix3::from_element(1.0 / 1024.0),
        bias_sigma: Vector3::new(0.125, 0.125, f32::INFINITY),
    }
}

fn bytes_of(record: &MagnetometerRecord) -> Vec<u8> {
    encode_magnetometer(record, &mut [0; MAGNETOMETER_ENCODED])
        .unwrap()
        .to_vec()
}

#[test]
fn a_magnetometer_is_postcard_in_the_frame_of_all_records() {
    let record = unit();
    let rows = |m: &Matrix3<f32>| <[[f32; 3]; 3]>::from(m.transpose());
    let fields = Fields {
        identity: record.identity,
        sensor: 2,
        load: 0,
        matrix: rows(&record.magnetometer.model.matrix),
        bias: record.magnetometer.model.bias.into(),
        current: record.magnetometer.current.into(),
        matrix_sigma: rows(&record.matrix_sigma),
        bias_sigma: record.bias_sigma.into(),
    };
    let mut buffer = [0; MAX_ENCODED];
    let fields = postcard::to_slice(&fields, &mut buffer).unwrap();
    let mut expected = [&b"TR\x04"[..], fields, &[0; 4]].concat();
    sign(&mut expected);
    assert_eq!(bytes_of(&record), expected);
    assert_eq!(decode_magnetometer(&expected), Ok(record));
    assert_eq!(length(&expected), Some(MAGNETOMETER_ENCODED));
}

#[test]
fn a_magnetometer_is_no_record_of_another_kind() {
    let found = MAGNETOMETER_VERSION;
    assert_eq!(decode(&bytes_of(&unit())), Err(DecodeError::OtherKind { found }));
    assert_eq!(
        decode_drift(&bytes_of(&unit())),
        Err(DecodeError::OtherKind { found })
    );
    let mut buffer = [0; MAX_ENCODED];
    let error = encode(&example(), &mut buffer).unwrap();
    assert!(matches!(
        decode_magnetometer(error),
        Err(DecodeError::OtherKind { .. })
    ));
    let mut newer = bytes_of(&unit());
    newer[2] = NEWER;
    sign(&mut newer);
    assert_eq!(
        decode_magnetometer(&newer),
        Err(DecodeError::UnknownVersion { found: NEWER })
    );
}

#[test]
fn every_changed_bit_of_a_magnetometer_is_noticed() {
    for bit in 0..8 * MAGNETOMETER_ENCODED {
        let mut changed = bytes_of(&unit());
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(decode_magnetometer(&changed).is_err(), "bit {bit}");
    }
}

#[test]
fn a_code_that_means_nothing_is_named() {
    for (offset, field) in [(11, Field::Sensor), (12, Field::Load)] {
        let mut changed = bytes_of(&unit());
        changed[offset] = 7;
        sign(&mut changed);
        assert_eq!(
            decode_magnetometer(&changed),
            Err(DecodeError::UnknownCode { field, found: 7 })
        );
    }
}

#[test]
fn numbers_that_are_none_are_not_written() {
    let spoilt: [fn(&mut MagnetometerRecord); 4] = [
        |r| r.magnetometer.model.matrix.m12 = f32::NAN,
        |r| r.magnetometer.model.bias.x = f32::INFINITY,
        |r| r.magnetometer.current.z = f32::NEG_INFINITY,
        |r| r.bias_sigma.y = f32::NAN,
    ];
    for spoil in spoilt {
        let mut record = unit();
        spoil(&mut record);
        let outcome = encode_magnetometer(&record, &mut [0; MAGNETOMETER_ENCODED]).map(<[u8]>::len);
        assert_eq!(outcome, Err(EncodeError::NotFinite(Field::Magnetometer)));
    }
}

proptest! {
    #[test]
    fn a_frame_around_any_bytes_is_a_magnetometer_or_refused(
        bytes in proptest::collection::vec(any::<u8>(), 0..130),
    ) {
        let mut framed = [b"TR\x04", &bytes[..], &[0; 4]].concat();
        sign(&mut framed);
        if let Ok(record) = decode_magnetometer(&framed) {
            prop_assert_eq!(bytes_of(&record), framed);
        }
    }
}
