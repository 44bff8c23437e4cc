//! Records, flash and histories to test with.

pub mod ecc;
pub mod history;
pub mod simulated;

use nalgebra::{Matrix3, Vector3};
use proptest::array::{uniform3, uniform9};
use proptest::num::f32::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
use proptest::prelude::*;
use tumble_core::magnetometer::MagnetometerModel;
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_core::redundancy::settings::FitModel;
use tumble_core::temperature::TemperatureDrift;
use tumble_store::record::{
    DRIFT_VERSION, DriftRecord, Load, MAGNETOMETER_VERSION, MagnetometerRecord, StoredRecord, VERSION,
};

/// The example of `docs/record-format.md`.
pub fn example() -> StoredRecord {
    let seen = 1.0 / 8192.0;
    let unseen = f32::INFINITY;
    let record = Record {
        model: ErrorModel {
            matrix: Matrix3::new(
                1.0 + 1.0 / 1024.0,
                1.0 / 2048.0,
                0.0,
                -1.0 / 4096.0,
                1.0 - 1.0 / 1024.0,
                0.0,
                0.0,
                seen,
                1.0,
            ),
            bias: Vector3::new(0.125, -0.0625, 0.03125),
        },
        matrix_sigma: Matrix3::new(seen, seen, seen, seen, seen, seen, unseen, unseen, unseen),
        bias_sigma: Vector3::new(1.0 / 128.0, 1.0 / 128.0, 1.0 / 64.0),
        lever_arm: Vector3::new(0.25, -0.125, 0.0625),
        lever_arm_sigma: Vector3::repeat(1.0 / 512.0),
        fit_model: FitModel::AffineAndLeverArm,
        directions: 3,
        residual: 0.0625,
        residual_before: 0.5,
        pairs: 412,
        sequence: 7,
        followed: Vector3::new(1.0 / 64.0, -1.0 / 32.0, 0.0),
        ..Record::unknown(0x0123_4567_89ab_cdef, Sensor::Accelerometer)
    };
    StoredRecord {
        record,
        temperature: Some(36.5),
    }
}

/// A version that no record has yet.
pub const NEWER: u8 = MAGNETOMETER_VERSION + 1;

const _: () = assert!(NEWER > VERSION && NEWER > DRIFT_VERSION);

/// The same record as a version has it that lacks the newer parts.
pub fn as_of(version: u8, mut stored: StoredRecord) -> StoredRecord {
    let unknown = Record::unknown(stored.record.identity, stored.record.sensor);
    let parts = stored.record.parts_mut().into_iter().zip(unknown.parts());
    for (part, (to, from)) in RecordPart::ALL.into_iter().zip(parts) {
        if part.version() > version {
            to.copy_from_slice(from);
        }
    }
    stored
}

/// The example of a drift in `docs/record-format.md`.
pub fn drift() -> TemperatureDrift<f32> {
    TemperatureDrift {
        reference: 25.0,
        range: [-20.0, 70.0],
        bias: [
            Vector3::new(1.0 / 1024.0, 0.0, -1.0 / 512.0),
            Vector3::new(0.0, 1.0 / 65536.0, 0.0),
            Vector3::zeros(),
        ],
        scale: [
            Vector3::new(1.0 / 65536.0, -1.0 / 32768.0, 0.0),
            Vector3::zeros(),
            Vector3::zeros(),
        ],
    }
}

/// Error of a magnetometer.
pub fn magnetometer() -> MagnetometerRecord {
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

/// Any number that a record may hold.
fn finite() -> impl Strategy<Value = f32> {
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

/// Draws any sigma.
fn sigma() -> impl Strategy<Value = f32> {
    POSITIVE | NORMAL | SUBNORMAL | ZERO | INFINITE
}

/// Draws the numbers of a part.
fn numbers(part: RecordPart) -> BoxedStrategy<Vec<f32>> {
    let number = if part.may_be_infinite() {
        sigma().boxed()
    } else {
        finite().boxed()
    };
    prop::collection::vec(number, part.count()).boxed()
}

prop_compose! {
    /// Any record.
    pub fn record()(
        identity in any::<u64>(),
        sensor in prop::sample::select(SENSORS.to_vec()),
        fit_model in prop::sample::select(vec![FitModel::Offset, FitModel::Gain, FitModel::Affine, FitModel::AffineAndLeverArm]),
        counts in any::<(u8, u32, u32)>(),
        parts in RecordPart::ALL.map(numbers).to_vec(),
        temperature in prop::option::of(finite()),
    ) -> StoredRecord {
        let (directions, pairs, sequence) = counts;
        let mut record = Record { fit_model, directions, pairs, sequence, ..Record::unknown(identity, sensor) };
        for (to, from) in record.parts_mut().into_iter().zip(parts) {
            to.copy_from_slice(&from);
        }
        StoredRecord { record, temperature }
    }
}

prop_compose! {
    /// Any drift.
    pub fn drift_record()(
        identity in any::<u64>(),
        sensor in prop::sample::select(SENSORS.to_vec()),
        mut temperatures in uniform3(finite()),
        powers in (uniform9(finite()), uniform9(finite())),
    ) -> DriftRecord {
        temperatures.sort_by(f32::total_cmp);
        let [low, reference, high] = temperatures;
        let rows = |row: &[f32; 9]| [0, 3, 6].map(|k| Vector3::new(row[k], row[k + 1], row[k + 2]));
        let (bias, scale) = (rows(&powers.0), rows(&powers.1));
        DriftRecord { identity, sensor, drift: TemperatureDrift { reference, range: [low, high], bias, scale } }
    }
}

/// Puts the checksum of what is before it at the end.
pub fn sign(bytes: &mut [u8]) {
    let (covered, checksum) = bytes.split_last_chunk_mut::<4>().unwrap();
    *checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC)
        .checksum(covered)
        .to_le_bytes();
}
