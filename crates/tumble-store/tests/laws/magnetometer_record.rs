//! Laws of the error of a magnetometer as bytes, and in flash.

use nalgebra::Matrix3;
use postcard::fixint;
use proptest::prelude::*;
use serde::Serialize;
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_store::flash::{Saved, Which};
use tumble_store::record::{
    DecodeError, EncodeError, Field, MAGNETOMETER_ENCODED, MAGNETOMETER_VERSION, MAX_ENCODED,
    MagnetometerRecord, decode, decode_drift, decode_magnetometer, encode, encode_magnetometer, length,
};

use crate::common::history::{numbered, numbered_drift, numbered_magnetometer, open};
use crate::common::simulated::Simulated;
use crate::common::{NEWER, example, magnetometer, sign};

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

fn bytes_of(record: &MagnetometerRecord) -> Vec<u8> {
    encode_magnetometer(record, &mut [0; MAGNETOMETER_ENCODED])
        .unwrap()
        .to_vec()
}

#[test]
fn a_magnetometer_is_postcard_in_the_frame_of_all_records() {
    let record = magnetometer();
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
    assert_eq!(
        decode(&bytes_of(&magnetometer())),
        Err(DecodeError::OtherKind { found })
    );
    assert_eq!(
        decode_drift(&bytes_of(&magnetometer())),
        Err(DecodeError::OtherKind { found })
    );
    let mut buffer = [0; MAX_ENCODED];
    let error = encode(&example(), &mut buffer).unwrap();
    assert!(matches!(
        decode_magnetometer(error),
        Err(DecodeError::OtherKind { .. })
    ));
    let mut newer = bytes_of(&magnetometer());
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
        let mut changed = bytes_of(&magnetometer());
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(decode_magnetometer(&changed).is_err(), "bit {bit}");
    }
}

#[test]
fn a_code_that_means_nothing_is_named() {
    for (offset, field) in [(11, Field::Sensor), (12, Field::Load)] {
        let mut changed = bytes_of(&magnetometer());
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
        let mut record = magnetometer();
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

#[test]
fn a_magnetometer_is_kept_beside_the_other_sensors_of_its_unit() {
    let mut store = open(Simulated::<4>::new(2));
    let [factory, first, second] = [1, 2, 3].map(|number| numbered_magnetometer(5, number));
    assert_eq!(store.magnetometer_in_force(5), Ok(None));
    store.save_factory_magnetometer(0, &factory).unwrap();
    assert_eq!(store.magnetometer_in_force(5), Ok(Some(factory)));
    store.save_magnetometer(0, &first).unwrap();
    assert_eq!(store.save_magnetometer(0, &second), Ok(Saved::Written));
    assert_eq!(store.save_magnetometer(0, &second), Ok(Saved::AlreadyThere));
    // More than a bank holds.
    for number in 0..60 {
        store.save(0, &numbered(5, Sensor::Gyroscope, number)).unwrap();
    }
    let of = |which| store.load_magnetometer(5, which).unwrap();
    assert_eq!(
        [Which::Factory, Which::Previous, Which::Last].map(of),
        [factory, first, second].map(Some)
    );
    assert_eq!(store.roll_back_magnetometer(0, 5, Which::Previous), Ok(first));
    assert_eq!(store.magnetometer_in_force(5), Ok(Some(first)));
    assert_eq!(store.load(5, Sensor::Accelerometer, Which::Last), Ok(None));
    assert_eq!(store.magnetometer_in_force(6), Ok(None));
}

/// The checksum is that of flash as the store wrote it before it took magnetometers.
#[test]
fn a_store_without_a_magnetometer_keeps_its_bytes() {
    let mut store = open(Simulated::<4>::new(2));
    for number in 0..40 {
        let sensor = SENSORS[number as usize % 2];
        match number {
            3 | 4 => store.save_factory(0, &numbered(7, sensor, number)),
            5 => store.save_drift(0, &numbered_drift(7, sensor, number)),
            _ => store.save(0, &numbered(u64::from(number % 3), sensor, number)),
        }
        .unwrap();
    }
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    assert_eq!(crc.checksum(&store.into_flash().memory), 3_963_384_222);
}
