//! Laws of a drift as bytes, and in flash beside the records.

use proptest::prelude::*;
use tumble_core::redundancy::sensor::Sensor;
use tumble_store::flash::{Saved, Which};
use tumble_store::record::{
    DRIFT_ENCODED, DRIFT_VERSION, DecodeError, DriftRecord, EncodeError, Field, MAX_ENCODED, VERSION, decode,
    decode_drift, encode, encode_drift,
};

use crate::common::history::{numbered, numbered_drift, open};
use crate::common::simulated::Simulated;
use crate::common::{NEWER, drift, drift_record, example, sign};

fn bytes_of(record: &DriftRecord) -> Vec<u8> {
    encode_drift(record, &mut [0; DRIFT_ENCODED]).unwrap().to_vec()
}

fn gyroscope() -> DriftRecord {
    DriftRecord {
        identity: 0x0123_4567_89ab_cdef,
        sensor: Sensor::Gyroscope,
        drift: drift(),
    }
}

/// The bytes of the example of version 3 in the document.
fn documented() -> Vec<u8> {
    let page = include_str!("../../../../docs/record-format.md");
    let dump = page.split("```").nth(3).expect("the page has a second dump");
    let lines = dump.lines().filter_map(|line| line.split_once("  "));
    let bytes = lines.flat_map(|(_, bytes)| bytes.split(' '));
    bytes
        .map(|byte| u8::from_str_radix(byte, 16).expect("two digits"))
        .collect()
}

#[test]
fn the_documented_example_is_encoded_and_decoded_bit_for_bit() {
    assert_eq!(bytes_of(&gyroscope()), documented());
    assert_eq!(decode_drift(&documented()), Ok(gyroscope()));
    assert_eq!(
        (documented().len(), documented()[2]),
        (DRIFT_ENCODED, DRIFT_VERSION)
    );
}

#[test]
fn a_drift_is_no_record_of_an_error_nor_the_other_way_round() {
    assert_eq!(decode(&documented()), Err(DecodeError::OtherKind { found: 3 }));
    let mut buffer = [0; MAX_ENCODED];
    let error = encode(&example(), &mut buffer).unwrap();
    assert_eq!(
        decode_drift(error),
        Err(DecodeError::OtherKind { found: VERSION })
    );
    let mut newer = documented();
    newer[2] = NEWER;
    sign(&mut newer);
    assert_eq!(
        decode_drift(&newer),
        Err(DecodeError::UnknownVersion { found: NEWER })
    );
}

#[test]
fn every_changed_bit_of_a_drift_is_noticed() {
    for bit in 0..8 * DRIFT_ENCODED {
        let mut changed = documented();
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(decode_drift(&changed).is_err(), "bit {bit}");
    }
}

#[test]
fn what_is_no_drift_is_not_written() {
    let spoilt: [fn(&mut DriftRecord); 6] = [
        |r| r.drift.bias[2].z = f32::NAN,
        |r| r.drift.scale[0].x = f32::INFINITY,
        |r| r.drift.reference = 71.0,
        |r| r.drift.reference = f32::NAN,
        |r| r.drift.range = [70.0, -20.0],
        |r| r.drift.range[1] = f32::INFINITY,
    ];
    for spoil in spoilt {
        let mut record = gyroscope();
        spoil(&mut record);
        let outcome = encode_drift(&record, &mut [0; DRIFT_ENCODED]).map(<[u8]>::len);
        assert_eq!(outcome, Err(EncodeError::NotFinite(Field::Drift)));
    }
}

#[test]
fn calibrations_that_are_adopted_leave_the_drift_as_it_is() {
    let mut store = open(Simulated::<4>::new(2));
    let kept = numbered_drift(1, Sensor::Gyroscope, 5);
    assert_eq!(store.drift(1, Sensor::Gyroscope), Ok(None));
    assert_eq!(store.save_drift(0, &kept), Ok(Saved::Written));
    assert_eq!(store.save_drift(0, &kept), Ok(Saved::AlreadyThere));
    for number in 0..100 {
        store.save(0, &numbered(1, Sensor::Gyroscope, number)).unwrap();
    }
    assert_eq!(store.drift(1, Sensor::Gyroscope), Ok(Some(kept.drift)));
    assert_eq!(store.drift(1, Sensor::Accelerometer), Ok(None));
    assert_eq!(store.load(1, Sensor::Gyroscope, Which::Factory), Ok(None));
}

proptest! {
    #[test]
    fn a_drift_is_read_bit_for_bit_as_it_was_written(record in drift_record()) {
        let bytes = bytes_of(&record);
        let read = decode_drift(&bytes).unwrap();
        prop_assert_eq!(&read, &record);
        prop_assert_eq!(bytes_of(&read), bytes, "also the sign of zeros");
    }

    #[test]
    fn a_frame_of_version_3_around_any_bytes_is_a_drift_or_refused(
        bytes in proptest::collection::vec(any::<u8>(), 0..120),
    ) {
        let mut framed = [b"TR\x03", &bytes[..], &[0; 4]].concat();
        sign(&mut framed);
        if let Ok(record) = decode_drift(&framed) {
            prop_assert_eq!(bytes_of(&record), framed);
        }
    }
}
