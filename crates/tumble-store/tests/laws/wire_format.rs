//! Records are the postcard encoding of structs, see `docs/record-format.md`; here they are written by that library.

use postcard::fixint;
use proptest::prelude::*;
use serde::{Deserialize, Serialize};
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::redundancy::settings::FitModel;
use tumble_core::temperature::TemperatureDrift;
use tumble_store::record::{
    DRIFT_ENCODED, DRIFT_VERSION, DriftRecord, MAX_ENCODED, StoredRecord, VERSION, decode, decode_drift,
    encode, encode_drift, length,
};

use crate::common::{as_of, drift_record, record, sign};

/// Leading fields of versions 1 and 2.
#[derive(Serialize, Deserialize)]
struct Fields {
    #[serde(with = "fixint::le")]
    identity: u64,
    sensor: u8,
    fit_model: u8,
    directions: u8,
    #[serde(with = "fixint::le")]
    pairs: u32,
    #[serde(with = "fixint::le")]
    sequence: u32,
    matrix: [f32; 9],
    bias: [f32; 3],
    matrix_sigma: [f32; 9],
    bias_sigma: [f32; 3],
    lever_arm: [f32; 3],
    lever_arm_sigma: [f32; 3],
    residual: f32,
    residual_before: f32,
}

#[derive(Serialize, Deserialize)]
struct Version1 {
    fields: Fields,
    temperature: Option<f32>,
}

#[derive(Serialize, Deserialize)]
struct Version2 {
    fields: Fields,
    followed: [f32; 3],
    temperature: Option<f32>,
}

#[derive(Serialize, Deserialize)]
struct Version3 {
    #[serde(with = "fixint::le")]
    identity: u64,
    sensor: u8,
    reference: f32,
    range: [f32; 2],
    bias: [[f32; 3]; 3],
    scale: [[f32; 3]; 3],
}

const SENSORS: [Sensor; 2] = [Sensor::Accelerometer, Sensor::Gyroscope];
const FIT_MODELS: [FitModel; 4] = [
    FitModel::Offset,
    FitModel::Gain,
    FitModel::Affine,
    FitModel::AffineAndLeverArm,
];

fn code<C: PartialEq>(all: &[C], one: C) -> u8 {
    u8::try_from(all.iter().position(|other| *other == one).unwrap()).unwrap()
}

fn fields(record: &Record<f32>) -> Fields {
    let rows = |m: &nalgebra::Matrix3<f32>| m.transpose().as_slice().try_into().unwrap();
    Fields {
        identity: record.identity,
        sensor: code(&SENSORS, record.sensor),
        fit_model: code(&FIT_MODELS, record.fit_model),
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

fn record_of(fields: &Fields, followed: [f32; 3]) -> Option<Record<f32>> {
    let matrix = |rows: &[f32; 9]| nalgebra::Matrix3::from_row_slice(rows);
    let sensor = *SENSORS.get(usize::from(fields.sensor))?;
    Some(Record {
        model: ErrorModel {
            matrix: matrix(&fields.matrix),
            bias: fields.bias.into(),
        },
        matrix_sigma: matrix(&fields.matrix_sigma),
        bias_sigma: fields.bias_sigma.into(),
        lever_arm: fields.lever_arm.into(),
        lever_arm_sigma: fields.lever_arm_sigma.into(),
        fit_model: *FIT_MODELS.get(usize::from(fields.fit_model))?,
        directions: fields.directions,
        residual: fields.residual,
        residual_before: fields.residual_before,
        pairs: fields.pairs,
        sequence: fields.sequence,
        followed: followed.into(),
        ..Record::unknown(fields.identity, sensor)
    })
}

/// Checks that a reader may accept the record.
fn is_sound(stored: &StoredRecord) -> bool {
    let record = &stored.record;
    let sigmas = record.matrix_sigma.iter().chain(&record.bias_sigma);
    let sigmas = sigmas.chain(&record.lever_arm_sigma);
    let known = [record.residual, record.residual_before];
    record.is_finite()
        && !sigmas.chain(&known).any(|x| x.is_nan())
        && stored.temperature.is_none_or(f32::is_finite)
}

/// The fields of a version in the frame that all have.
fn framed(version: u8, fields: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; MAX_ENCODED];
    let fields = postcard::to_slice(fields, &mut buffer).unwrap();
    let mut bytes = [&b"TR"[..], &[version], &*fields, &[0; 4]].concat();
    sign(&mut bytes);
    bytes
}

/// All of a version that the bytes between its frame hold, if they hold nothing else.
fn unframed<'b, V: Deserialize<'b>>(bytes: &'b [u8]) -> Option<V> {
    let (fields, rest) = postcard::take_from_bytes(&bytes[3..bytes.len() - 4]).ok()?;
    rest.is_empty().then_some(fields)
}

/// Reads a record of version 1 or 2.
fn read(bytes: &[u8]) -> Option<StoredRecord> {
    let stored = match bytes[2] {
        1 => {
            let Version1 { fields, temperature } = unframed(bytes)?;
            let record = record_of(&fields, [0.0; 3])?;
            StoredRecord { record, temperature }
        }
        2 => {
            let Version2 {
                fields,
                followed,
                temperature,
            } = unframed(bytes)?;
            let record = record_of(&fields, followed)?;
            StoredRecord { record, temperature }
        }
        _ => return None,
    };
    is_sound(&stored).then_some(stored)
}

fn version_1(stored: &StoredRecord) -> Vec<u8> {
    let fields = fields(&stored.record);
    let temperature = stored.temperature;
    framed(1, &Version1 { fields, temperature })
}

fn version_2(stored: &StoredRecord) -> Vec<u8> {
    let fields = Version2 {
        fields: fields(&stored.record),
        followed: stored.record.followed.into(),
        temperature: stored.temperature,
    };
    framed(2, &fields)
}

fn version_3(record: &DriftRecord) -> Vec<u8> {
    let drift: &TemperatureDrift<f32> = &record.drift;
    let fields = Version3 {
        identity: record.identity,
        sensor: code(&SENSORS, record.sensor),
        reference: drift.reference,
        range: drift.range,
        bias: drift.bias.map(Into::into),
        scale: drift.scale.map(Into::into),
    };
    framed(3, &fields)
}

proptest! {
    #[test]
    fn a_record_is_written_as_postcard_writes_it(stored in record()) {
        let mut buffer = [0xA5; MAX_ENCODED];
        prop_assert_eq!(encode(&stored, &mut buffer).unwrap(), version_2(&stored));
        prop_assert_eq!(VERSION, 2);
    }

    #[test]
    fn a_drift_is_written_as_postcard_writes_it(record in drift_record()) {
        let mut buffer = [0xA5; DRIFT_ENCODED];
        prop_assert_eq!(encode_drift(&record, &mut buffer).unwrap(), version_3(&record));
        prop_assert_eq!(decode_drift(&version_3(&record)), Ok(record));
        prop_assert_eq!(DRIFT_VERSION, 3);
    }

    #[test]
    fn a_record_of_version_1_is_read_as_postcard_reads_it(stored in record()) {
        prop_assert_eq!(decode(&version_1(&stored)), Ok(as_of(1, stored)));
    }

    #[test]
    fn changed_bytes_are_read_or_refused_as_postcard_does(
        stored in record(),
        is_old in any::<bool>(),
        changes in proptest::collection::vec((2..MAX_ENCODED, any::<u8>()), 1..4),
        cut in prop::option::of(7..MAX_ENCODED),
    ) {
        let mut bytes = if is_old { version_1(&stored) } else { version_2(&stored) };
        let size = bytes.len();
        for (place, value) in changes {
            bytes[place.min(size - 1)] = value;
        }
        bytes.truncate(cut.unwrap_or(size));
        sign(&mut bytes);
        prop_assert_eq!(decode(&bytes).ok(), read(&bytes));
    }

    #[test]
    fn consecutive_records_are_distinguished_by_their_lengths(
        records in proptest::collection::vec((record(), drift_record(), 1..4_u8), 0..5),
    ) {
        let written: Vec<_> = records
            .iter()
            .map(|(stored, drift, version)| match version {
                1 => version_1(stored),
                2 => version_2(stored),
                _ => version_3(drift),
            })
            .collect();
        let (all, mut rest) = (written.concat(), Vec::new());
        let mut bytes = &all[..];
        while !bytes.is_empty() {
            let (record, others) = bytes.split_at(length(bytes).unwrap());
            rest.push(record.to_vec());
            bytes = others;
        }
        prop_assert_eq!(rest, written);
    }
}

#[test]
fn what_is_no_record_has_no_length() {
    for bytes in [&b""[..], b"TR", b"TR\x00", b"TR\x02", b"RT\x03", b"TR\x05"] {
        assert_eq!(length(bytes), None, "{bytes:?}");
    }
    let flag = 162;
    assert_eq!(length(&[&b"TR\x02"[..], &[2; 200]].concat()), None);
    assert_eq!(
        length(&[&b"TR\x02"[..], &[1; 200]].concat()),
        Some(flag + 1 + 4 + 4)
    );
}
