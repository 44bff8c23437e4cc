//! Records, flash and histories to test with.

pub mod history;
pub mod simulated;

use nalgebra::{Matrix3, Vector3};
use proptest::array::{uniform3, uniform9};
use proptest::num::f32::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
use proptest::prelude::*;
use tumble_core::model::ErrorModel;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::{SENSORS, Sensor};
use tumble_core::redundancy::settings::FitModel;
use tumble_core::temperature::TemperatureDrift;
use tumble_store::record::{DriftRecord, StoredRecord};

/// The example of `docs/record-format.md`.
pub fn example() -> StoredRecord {
    let seen = 1.0 / 8192.0;
    let unseen = f32::INFINITY;
    let record = Record {
        identity: 0x0123_4567_89ab_cdef,
        sensor: Sensor::Accelerometer,
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
    };
    StoredRecord {
        record,
        temperature: Some(36.5),
    }
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

/// Any number that a record may hold.
fn finite() -> impl Strategy<Value = f32> {
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

/// Draws any sigma.
fn sigma() -> impl Strategy<Value = f32> {
    POSITIVE | NORMAL | SUBNORMAL | ZERO | INFINITE
}

prop_compose! {
    /// Any record.
    pub fn record()(
        identity in any::<u64>(),
        sensor in prop::sample::select(SENSORS.to_vec()),
        matrix in uniform9(finite()),
        vectors in uniform3(finite()),
        lever_arm in uniform3(finite()),
        followed in uniform3(finite()),
        matrix_sigma in uniform9(sigma()),
        sigmas in (uniform3(sigma()), uniform3(sigma())),
        fit_model in prop::sample::select(vec![FitModel::Offset, FitModel::Gain, FitModel::Affine, FitModel::AffineAndLeverArm]),
        counts in any::<(u8, u32, u32)>(),
        residuals in (sigma(), sigma()),
        temperature in prop::option::of(finite()),
    ) -> StoredRecord {
        let record = Record {
            identity,
            sensor,
            model: ErrorModel { matrix: Matrix3::from_row_slice(&matrix), bias: Vector3::from(vectors) },
            matrix_sigma: Matrix3::from_row_slice(&matrix_sigma),
            bias_sigma: Vector3::from(sigmas.0),
            lever_arm: Vector3::from(lever_arm),
            lever_arm_sigma: Vector3::from(sigmas.1),
            fit_model,
            directions: counts.0,
            residual: residuals.0,
            residual_before: residuals.1,
            pairs: counts.1,
            sequence: counts.2,
            followed: Vector3::from(followed),
        };
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
