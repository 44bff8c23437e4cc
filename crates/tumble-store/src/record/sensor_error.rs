//! The error of one sensor of one unit, byte by byte as in `docs/record-format.md`. The encoding of a version never changes:
//! another order, or another field, is another version.

use tumble_core::real::Real;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::settings::FitModel;

use crate::checksum::CHECKSUM;
use crate::record::frame::{HEAD, begin, code, end, field, put, subject};
use crate::record::numbers::{self, NUMBER, words, words_mut};
use crate::record::{DecodeError, EncodeError, Field, StoredRecord};

/// The version that is written: that of the newest part.
pub const VERSION: u8 = PARTS[PARTS.len() - 1].version();

/// Parts in the order of their numbers; a version has those up to its last.
const PARTS: [RecordPart; RecordPart::COUNT] = RecordPart::ALL;

/// Offsets of what is not a number of single precision.
const FIT_MODEL: usize = HEAD;
const DIRECTIONS: usize = 13;
const PAIRS: usize = 14;
const SEQUENCE: usize = 18;

/// Offset of the first number; the others follow.
const NUMBERS: usize = 22;

/// In the order of their codes.
const FIT_MODELS: [FitModel; 4] = [
    FitModel::Offset,
    FitModel::Gain,
    FitModel::Affine,
    FitModel::AffineAndLeverArm,
];

/// Where the numbers of each part end.
const ENDS: [usize; PARTS.len()] = {
    let (mut ends, mut part, mut end) = ([0; PARTS.len()], 0, NUMBERS);
    while part < PARTS.len() {
        end += NUMBER * PARTS[part].count();
        ends[part] = end;
        part += 1;
    }
    ends
};

/// Offset of the flag for a temperature that follows, in the version that is written.
const FLAG: usize = ENDS[PARTS.len() - 1];

/// Most bytes of a record: a temperature is there.
pub const MAX_ENCODED: usize = FLAG + 1 + NUMBER + CHECKSUM;

/// Offset of the flag of a version, if it is of this kind: behind the last of its parts.
pub fn flag_of(version: u8) -> Option<usize> {
    // Read forwards: a pair of iterators that is read from its end leaves a panic in the image.
    let parts = PARTS.iter().zip(ENDS);
    parts.fold(None, |found, (part, end)| {
        if part.version() == version {
            Some(end)
        } else {
            found
        }
    })
}

/// Bytes of a record whose flag is at an offset, if that has a meaning.
pub fn length(bytes: &[u8], flag: usize) -> Option<usize> {
    let temperature = match bytes.get(flag)? {
        0 => 0,
        1 => NUMBER,
        _ => return None,
    };
    Some(flag + 1 + temperature + CHECKSUM)
}

/// Writes a record of either precision at the start of a buffer; gives how many bytes it has.
#[inline(never)]
pub fn write<T: Real>(
    record: &Record<T>,
    temperature: Option<f32>,
    buffer: &mut [u8],
) -> Result<usize, EncodeError> {
    let known = temperature.map_or(0, |_| NUMBER);
    let length = FLAG + 1 + known + CHECKSUM;
    let bytes = buffer.get_mut(..length).ok_or(EncodeError::NoRoom)?;
    begin(bytes, VERSION, record.identity, record.sensor);
    put(bytes, FIT_MODEL, [code(&FIT_MODELS, record.fit_model)]);
    put(bytes, DIRECTIONS, [record.directions]);
    put(bytes, PAIRS, record.pairs.to_le_bytes());
    put(bytes, SEQUENCE, record.sequence.to_le_bytes());
    numbers::write(words_mut(bytes, NUMBERS, FLAG), &record.parts());
    put(bytes, FLAG, [u8::from(temperature.is_some())]);
    if let Some(temperature) = temperature {
        put(bytes, FLAG + 1, temperature.to_le_bytes());
    }
    check(bytes, FLAG).map_err(EncodeError::NotFinite)?;
    end(bytes);
    Ok(length)
}

/// Reads a record, in either precision, from bytes that are as they were written.
#[inline(never)]
pub fn read<T: Real>(bytes: &[u8], flag: usize) -> Result<StoredRecord<T>, DecodeError> {
    if length(bytes, flag) != Some(bytes.len()) {
        return Err(DecodeError::Corrupt);
    }
    let (identity, sensor) = subject(bytes)?;
    // It stays so where an older version has no numbers.
    let mut stored = StoredRecord {
        record: Record::unknown(identity, sensor),
        temperature: temperature(bytes, flag),
    };
    let record = &mut stored.record;
    let [found, directions] = field(bytes, FIT_MODEL).unwrap_or_default();
    let fit_model = FIT_MODELS.get(usize::from(found));
    record.fit_model = *fit_model.ok_or(DecodeError::UnknownCode {
        field: Field::FitModel,
        found,
    })?;
    record.directions = directions;
    record.pairs = u32::from_le_bytes(field(bytes, PAIRS).unwrap_or_default());
    record.sequence = u32::from_le_bytes(field(bytes, SEQUENCE).unwrap_or_default());
    check(bytes, flag).map_err(DecodeError::NotFinite)?;
    numbers::read(words(bytes, NUMBERS, flag), &mut record.parts_mut());
    Ok(stored)
}

/// The temperature of a record, if it has one.
fn temperature(bytes: &[u8], flag: usize) -> Option<f32> {
    let [known, number @ ..] = field::<{ 1 + NUMBER }>(bytes, flag)?;
    (known == 1).then_some(f32::from_le_bytes(number))
}

/// Finds what is not a number that a record may hold.
fn check(bytes: &[u8], flag: usize) -> Result<(), Field> {
    let mut words = words(bytes, NUMBERS, flag).iter();
    for part in PARTS {
        for number in words
            .by_ref()
            .take(part.count())
            .map(|word| f32::from_le_bytes(*word))
        {
            if !(number.is_finite() || part.may_be_infinite() && number.is_infinite()) {
                return Err(Field::Numbers(part));
            }
        }
    }
    let temperature = temperature(bytes, flag).is_none_or(f32::is_finite);
    temperature.then_some(()).ok_or(Field::Temperature)
}
