//! Version 4, byte by byte as in `docs/record-format.md`: the error of the magnetometer of one unit. This encoding never
//! changes.

use nalgebra::{Matrix3, Vector3};
use tumble_core::magnetometer::MagnetometerModel;
use tumble_core::model::ErrorModel;
use tumble_core::products::zeros;

use crate::checksum::CHECKSUM;
use crate::record::frame::{HEAD, MAGNETOMETER, begin_with, end, field, put, subject_code};
use crate::record::numbers::{self, NUMBER, words, words_mut};
use crate::record::{DecodeError, EncodeError, Field, Load, MagnetometerRecord};

/// The version that is written.
pub const VERSION: u8 = 4;

/// In the order of their codes.
const LOADS: [Load; 2] = [Load::Current, Load::Throttle];

/// Where the numbers begin: the code of the load is before them.
const NUMBERS: usize = HEAD + 1;

/// Where the numbers end: M, b, c, and the sigmas of M and b.
const NUMBERS_END: usize = NUMBERS + NUMBER * (9 + 3 + 3 + 9 + 3);

/// Bytes of a record.
pub const ENCODED: usize = NUMBERS_END + CHECKSUM;

/// Writes a record at the start of a buffer; gives how many bytes it has.
pub fn write(record: &MagnetometerRecord, buffer: &mut [u8]) -> Result<usize, EncodeError> {
    check(record).map_err(EncodeError::NotFinite)?;
    let bytes = buffer.get_mut(..ENCODED).ok_or(EncodeError::NoRoom)?;
    begin_with(bytes, VERSION, record.identity, MAGNETOMETER);
    put(bytes, HEAD, [u8::from(record.load == Load::Throttle)]);
    let MagnetometerModel { model, current } = &record.magnetometer;
    let parts: [&[f32]; 5] = [
        model.matrix.as_slice(),
        model.bias.as_slice(),
        current.as_slice(),
        record.matrix_sigma.as_slice(),
        record.bias_sigma.as_slice(),
    ];
    numbers::write(words_mut(bytes, NUMBERS, NUMBERS_END), &parts);
    end(bytes);
    Ok(ENCODED)
}

/// Reads a record from bytes that are as they were written.
pub fn read(bytes: &[u8]) -> Result<MagnetometerRecord, DecodeError> {
    if bytes.len() != ENCODED {
        return Err(DecodeError::Corrupt);
    }
    let (identity, sensor) = subject_code(bytes)?;
    if sensor != MAGNETOMETER {
        return Err(DecodeError::UnknownCode {
            field: Field::Sensor,
            found: sensor,
        });
    }
    let [code] = field(bytes, HEAD).ok_or(DecodeError::Corrupt)?;
    let load = LOADS.get(usize::from(code)).ok_or(DecodeError::UnknownCode {
        field: Field::Load,
        found: code,
    })?;
    let (mut matrix, mut matrix_sigma): (Matrix3<f32>, Matrix3<f32>) = (zeros(), zeros());
    let (mut bias, mut current, mut bias_sigma): (Vector3<f32>, Vector3<f32>, Vector3<f32>) =
        (zeros(), zeros(), zeros());
    let mut parts: [&mut [f32]; 5] = [
        matrix.as_mut_slice(),
        bias.as_mut_slice(),
        current.as_mut_slice(),
        matrix_sigma.as_mut_slice(),
        bias_sigma.as_mut_slice(),
    ];
    numbers::read(words(bytes, NUMBERS, NUMBERS_END), &mut parts);
    let record = MagnetometerRecord {
        identity,
        magnetometer: MagnetometerModel {
            model: ErrorModel { matrix, bias },
            current,
        },
        load: *load,
        matrix_sigma,
        bias_sigma,
    };
    check(&record).map_err(DecodeError::NotFinite)?;
    Ok(record)
}

/// Finds numbers that a record may not hold: values are finite, sigmas may be infinite.
fn check(record: &MagnetometerRecord) -> Result<(), Field> {
    let MagnetometerModel { model, current } = &record.magnetometer;
    let values = model.matrix.iter().chain(&model.bias).chain(current);
    let sigmas = record.matrix_sigma.iter().chain(&record.bias_sigma);
    let holds = values.copied().all(f32::is_finite) && sigmas.copied().all(|sigma| !sigma.is_nan());
    holds.then_some(()).ok_or(Field::Magnetometer)
}
