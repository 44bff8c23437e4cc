//! Laws of the record as bytes.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::FitModel;
use tumble_store::record::{
    DecodeError, EncodeError, Field, MAX_ENCODED, StoredRecord, VERSION, decode, encode,
};

use crate::common::{NEWER, example, record, sign};

fn bytes_of(record: &StoredRecord) -> Vec<u8> {
    encode(record, &mut [0; MAX_ENCODED]).unwrap().to_vec()
}

/// The bytes of the example in the document.
fn documented() -> Vec<u8> {
    let page = include_str!("../../../../docs/record-format.md");
    let dump = page.split("```").nth(1).expect("the page has a dump");
    let lines = dump.lines().filter_map(|line| line.split_once("  "));
    let bytes = lines.flat_map(|(_, bytes)| bytes.split(' '));
    bytes
        .map(|byte| u8::from_str_radix(byte, 16).expect("two digits"))
        .collect()
}

/// The numbers of a row of the table below the example.
fn documented_numbers(row: &str) -> Vec<f32> {
    let page = include_str!("../../../../docs/record-format.md");
    let table = page.split("```").nth(2).expect("the page has a table");
    let cell = table
        .lines()
        .find_map(|line| line.strip_prefix(&format!("| {row} | ")));
    let words = cell.expect("the table has the row").split([',', ';', '|', ' ']);
    words.filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn the_example_of_the_document_is_read_as_the_document_says() {
    let StoredRecord { record, temperature } = decode(&documented()).unwrap();
    assert_eq!(
        (record.identity, record.sensor),
        (0x0123_4567_89ab_cdef, Sensor::Accelerometer)
    );
    assert_eq!((record.sequence, temperature), (7, Some(36.5)));
    assert_eq!(record.fit_model, FitModel::AffineAndLeverArm);
    assert_eq!(
        vec![3.0, f32::from(record.directions), record.pairs as f32],
        documented_numbers("fitted")
    );
    assert_eq!(
        record.model.matrix.transpose().as_slice(),
        documented_numbers("M")
    );
    assert_eq!(record.model.bias.as_slice(), documented_numbers("b"));
    let sigma = documented_numbers("sigma of M")[0];
    let rows = [
        Vector3::repeat(sigma),
        Vector3::repeat(sigma),
        Vector3::repeat(f32::INFINITY),
    ];
    assert_eq!(record.matrix_sigma, Matrix3::from_columns(&rows).transpose());
    assert_eq!(record.bias_sigma.as_slice(), documented_numbers("sigma of b"));
    assert_eq!(record.lever_arm.as_slice(), documented_numbers("lever arm"));
    assert_eq!(
        record.lever_arm_sigma.as_slice(),
        documented_numbers("sigma of lever arm")
    );
    assert_eq!(
        vec![record.residual, record.residual_before],
        documented_numbers("residuals")
    );
    assert_eq!(record.followed.as_slice(), documented_numbers("followed"));
}

#[test]
fn the_example_of_the_document_is_written_as_the_document_says() {
    assert_eq!(bytes_of(&example()), documented());
    assert_eq!(documented().len(), MAX_ENCODED);
}

#[test]
fn a_record_without_temperature_is_four_bytes_shorter() {
    let without = StoredRecord {
        temperature: None,
        ..example()
    };
    assert_eq!(bytes_of(&without).len(), MAX_ENCODED - 4);
    assert_eq!(decode(&bytes_of(&without)), Ok(without));
}

#[test]
fn every_changed_bit_and_every_pair_of_neighbours_is_noticed() {
    let bytes = bytes_of(&example());
    for bit in 0..8 * bytes.len() {
        for width in 1..=2 {
            let mut changed = bytes.clone();
            for bit in bit..(bit + width).min(8 * bytes.len()) {
                changed[bit / 8] ^= 1 << (bit % 8);
            }
            let wanted = if bit < 16 {
                DecodeError::NotARecord
            } else {
                DecodeError::Corrupt
            };
            assert_eq!(decode(&changed), Err(wanted), "bit {bit}, {width} wide");
        }
    }
}

#[test]
fn a_record_cut_off_anywhere_is_no_record() {
    let bytes = bytes_of(&example());
    for length in 0..bytes.len() {
        let wanted = if length < 7 {
            DecodeError::TooShort { found: length }
        } else {
            DecodeError::Corrupt
        };
        assert_eq!(decode(&bytes[..length]), Err(wanted));
    }
    let longer = [bytes, vec![0]].concat();
    assert_eq!(decode(&longer), Err(DecodeError::Corrupt));
}

/// The same bytes with some changed on purpose, so that the checksum fits.
fn rewritten(changes: &[(usize, u8)]) -> Vec<u8> {
    let mut bytes = bytes_of(&example());
    for (place, byte) in changes {
        bytes[*place] = *byte;
    }
    sign(&mut bytes);
    bytes
}

#[test]
fn what_is_whole_but_means_nothing_is_named() {
    let unknown = |field, found| Err(DecodeError::UnknownCode { field, found });
    let found = NEWER;
    assert_eq!(
        decode(&rewritten(&[(2, found)])),
        Err(DecodeError::UnknownVersion { found })
    );
    assert_eq!(decode(&rewritten(&[(11, 2)])), unknown(Field::Sensor, 2));
    assert_eq!(decode(&rewritten(&[(12, 4)])), unknown(Field::FitModel, 4));
    assert_eq!(decode(&rewritten(&[(162, 2)])), Err(DecodeError::Corrupt));
    assert_eq!(
        decode(&rewritten(&[(162, 0)])),
        Err(DecodeError::Corrupt),
        "a temperature without its flag"
    );
    let infinite = [(24, 0x80), (25, 0x7f)];
    assert_eq!(
        decode(&rewritten(&infinite)),
        Err(DecodeError::NotFinite(Field::Numbers(RecordPart::Matrix)))
    );
}

#[test]
fn what_is_not_a_number_is_refused_field_by_field() {
    let outcome = |change: &dyn Fn(&mut StoredRecord)| {
        let mut record = example();
        change(&mut record);
        encode(&record, &mut [0; MAX_ENCODED]).map(<[u8]>::len)
    };
    for (index, part) in RecordPart::ALL.into_iter().enumerate() {
        let wanted = Err(EncodeError::NotFinite(Field::Numbers(part)));
        for element in 0..part.count() {
            let outcome_of = |x: f32| outcome(&|stored| stored.record.parts_mut()[index][element] = x);
            let infinite = if part.may_be_infinite() {
                Ok(MAX_ENCODED)
            } else {
                wanted
            };
            assert_eq!(outcome_of(f32::NAN), wanted);
            assert_eq!(outcome_of(f32::INFINITY), infinite);
            assert_eq!(outcome_of(f32::NEG_INFINITY), infinite);
        }
    }
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let wanted = Err(EncodeError::NotFinite(Field::Temperature));
        assert_eq!(outcome(&|stored| stored.temperature = Some(x)), wanted);
    }
}

#[test]
fn a_number_too_large_for_single_precision_is_refused() {
    let mut record: Record<f64> = example().record_in();
    record.model.bias[0] = 1e39;
    let stored = StoredRecord::of(&record, None);
    let outcome = encode(&stored, &mut [0; MAX_ENCODED]).map(<[u8]>::len);
    assert_eq!(
        outcome,
        Err(EncodeError::NotFinite(Field::Numbers(RecordPart::Bias)))
    );
}

#[test]
fn too_little_room_is_refused_whatever_its_length() {
    for room in 0..MAX_ENCODED {
        let outcome = encode(&example(), &mut vec![0; room]).map(<[u8]>::len);
        assert_eq!(outcome, Err(EncodeError::NoRoom), "{room} bytes");
    }
}

proptest! {
    #[test]
    fn what_is_written_is_read_bit_for_bit(stored in record()) {
        let bytes = bytes_of(&stored);
        let read = decode(&bytes).unwrap();
        prop_assert_eq!(&read, &stored);
        prop_assert_eq!(bytes_of(&read), bytes, "also the sign of zeros");
    }

    #[test]
    fn double_precision_is_rounded_once(stored in record(), x in -100.0..100.0_f64) {
        let mut double: Record<f64> = stored.record_in();
        prop_assert_eq!(StoredRecord::of(&double, stored.temperature.map(f64::from)), stored);
        double.model.bias[1] = x;
        let again: Record<f64> = decode(&bytes_of(&StoredRecord::of(&double, None))).unwrap().record_in();
        prop_assert_eq!(again.model.bias[1], f64::from(x as f32));
    }

    #[test]
    fn bytes_of_any_kind_are_no_record(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(decode(&bytes).is_err());
    }

    #[test]
    fn a_frame_around_bytes_of_any_kind_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let mut framed = [b"TR\x01", &bytes[..], &[0; 4]].concat();
        sign(&mut framed);
        prop_assert!(decode(&framed).is_err());
    }

    #[test]
    fn what_is_read_of_changed_bytes_is_written_as_these(
        stored in record(),
        changes in proptest::collection::vec((3..MAX_ENCODED, any::<u8>()), 1..4),
    ) {
        let mut bytes = bytes_of(&stored);
        let size = bytes.len();
        for (place, value) in changes {
            bytes[place % size] = value;
        }
        sign(&mut bytes);
        if let Ok(record) = decode(&bytes)
            && bytes[2] == VERSION
        {
            prop_assert_eq!(bytes_of(&record), bytes, "one record, one way to write it");
        }
    }
}
