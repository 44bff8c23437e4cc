//! Version 3, byte by byte as in `docs/record-format.md`: what temperature does to one sensor of one unit. This
//! encoding never changes.

use core::slice;

use tumble_core::products::zeros;
use tumble_core::temperature::TemperatureDrift;

use crate::checksum::CHECKSUM;
use crate::record::frame::{HEAD, begin, end, subject};
use crate::record::numbers::{self, NUMBER, words, words_mut};
use crate::record::{DecodeError, DriftRecord, EncodeError, Field};

/// The version that is written.
pub const VERSION: u8 = 3;

/// Where the numbers end: reference, range, and two times three powers of three axes.
const NUMBERS_END: usize = HEAD + NUMBER * (1 + 2 + 2 * 9);

/// Bytes of a record.
pub const ENCODED: usize = NUMBERS_END + CHECKSUM;

/// Writes a record at the start of a buffer; gives how many bytes it has.
pub fn write(record: &DriftRecord, buffer: &mut [u8]) -> Result<usize, EncodeError> {
    check(&record.drift).map_err(EncodeError::NotFinite)?;
    let bytes = buffer.get_mut(..ENCODED).ok_or(EncodeError::NoRoom)?;
    begin(bytes, VERSION, record.identity, record.sensor);
    let TemperatureDrift {
        reference,
        range,
        bias: [b1, b2, b3],
        scale: [s1, s2, s3],
    } = &record.drift;
    let parts: [&[f32]; 8] = [
        slice::from_ref(reference),
        range,
        b1.as_slice(),
        b2.as_slice(),
        b3.as_slice(),
        s1.as_slice(),
        s2.as_slice(),
        s3.as_slice(),
    ];
    numbers::write(words_mut(bytes, HEAD, NUMBERS_END), &parts);
    end(bytes);
    Ok(ENCODED)
}

/// Reads a record from bytes that are as they were written.
pub fn read(bytes: &[u8]) -> Result<DriftRecord, DecodeError> {
    if bytes.len() != ENCODED {
        return Err(DecodeError::Corrupt);
    }
    let (identity, sensor) = subject(bytes)?;
    let mut drift = TemperatureDrift {
        reference: 0.0,
        range: [0.0; 2],
        bias: [zeros(); 3],
        scale: [zeros(); 3],
    };
    let TemperatureDrift {
        reference,
        range,
        bias: [b1, b2, b3],
        scale: [s1, s2, s3],
    } = &mut drift;
    let mut parts: [&mut [f32]; 8] = [
        slice::from_mut(reference),
        range,
        b1.as_mut_slice(),
        b2.as_mut_slice(),
        b3.as_mut_slice(),
        s1.as_mut_slice(),
        s2.as_mut_slice(),
        s3.as_mut_slice(),
    ];
    numbers::read(words(bytes, HEAD, NUMBERS_END), &mut parts);
    check(&drift).map_err(DecodeError::NotFinite)?;
    Ok(DriftRecord {
        identity,
        sensor,
        drift,
    })
}

/// Finds what is no drift: numbers that are not finite, and a range that is none.
fn check(drift: &TemperatureDrift<f32>) -> Result<(), Field> {
    let TemperatureDrift {
        reference,
        range: [low, high],
        bias,
        scale,
    } = drift;
    let finite = bias.iter().chain(scale).flatten().all(|x| x.is_finite());
    let ordered = low <= reference && reference <= high && low.is_finite() && high.is_finite();
    (finite && ordered).then_some(()).ok_or(Field::Drift)
}
