//! One calibration record as bytes: a frame with version and CRC-32 around fields in a fixed order.
//!
//! Numbers are single precision on the wire, whatever the core runs on. Its rounding, 6e-8 of a value, is some thousand
//! times below the sigma of any calibration; devices compute in single precision anyway; and half the bytes are half
//! the wear.

mod frame;
mod version_1;
mod version_2;
mod version_3;

#[cfg(test)]
mod older_version_tests;

pub(crate) use frame::checksum;
pub(crate) use version_1::{sensor, sensor_code};

use nalgebra::{convert, convert_unchecked};
use tumble_core::real::Real;
use tumble_core::redundancy::record::Record;
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::temperature::TemperatureDrift;

/// The version that [`encode`] writes; [`decode`] reads it and all before it.
pub const VERSION: u8 = 2;

/// Most bytes that [`encode`] writes.
pub const MAX_ENCODED: usize = frame::FRAME + version_2::MAX_PAYLOAD;

/// The version that [`encode_drift`] writes: a record of another kind, for whoever uses it.
pub const DRIFT_VERSION: u8 = 3;

/// Bytes that [`encode_drift`] writes.
pub const DRIFT_ENCODED: usize = frame::FRAME + version_3::PAYLOAD;

/// A record of the core, with what the core does not need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredRecord {
    /// Error of one sensor of one unit.
    pub record: Record<f32>,
    /// Of the unit while it was calibrated, degC, if known.
    pub temperature: Option<f32>,
}

/// What temperature does to one sensor of one unit: to what it says itself, whatever its error against a primary is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftRecord {
    /// Of the unit.
    pub identity: u64,
    /// Which sensor of it.
    pub sensor: Sensor,
    /// In the axes and the unit of the sensor.
    pub drift: TemperatureDrift<f32>,
}

/// Why a record cannot be written as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// A number is not one that a record may hold in single precision.
    NotFinite(Field),
    /// The bytes given are fewer than the record needs; [`MAX_ENCODED`] are always enough.
    NoRoom,
}

/// Why bytes are not a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecodeError {
    /// Fewer bytes than any record has.
    TooShort {
        /// Bytes given.
        found: usize,
    },
    /// They do not begin as records do.
    NotARecord,
    /// They are not as they were written.
    Corrupt,
    /// They are as written, by a newer version of this crate.
    UnknownVersion {
        /// Their version.
        found: u8,
    },
    /// They are as written, but of another kind: a drift where an error is asked for, or the other way round.
    OtherKind {
        /// Their version.
        found: u8,
    },
    /// They are as written, but a code in them means nothing.
    UnknownCode {
        /// What it should say.
        field: Field,
        /// What it says.
        found: u8,
    },
    /// They are as written, but a number in them is not one that a record may hold.
    NotFinite(Field),
}

/// A part of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Accelerometer or gyroscope.
    Sensor,
    /// What was fitted.
    Rung,
    /// M.
    Matrix,
    /// b.
    Bias,
    /// From primary to secondary.
    LeverArm,
    /// 1-sigma of M, b and lever arm.
    Sigmas,
    /// Of the fit, and before it.
    Residuals,
    /// How far the primary was followed.
    Followed,
    /// While it was calibrated.
    Temperature,
    /// Reference, range or coefficients of a drift.
    Drift,
}

/// Writes a record at the start of `buffer`; gives the bytes that are the record.
///
/// # Errors
/// [`EncodeError`]; what is in `buffer` then is no record.
pub fn encode<'b>(record: &StoredRecord, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    record.check().map_err(EncodeError::NotFinite)?;
    frame::write(VERSION, &version_2::Payload::from(record), buffer)
}

/// Reads a record from the bytes that are it, neither more nor fewer.
///
/// # Errors
/// [`DecodeError`], never another record than was written.
pub fn decode(bytes: &[u8]) -> Result<StoredRecord, DecodeError> {
    decode_by(&READERS, bytes)
}

/// What reads the fields of one version.
type Reader = fn(&[u8]) -> Result<StoredRecord, DecodeError>;

/// Of every version that was ever written.
const READERS: [(u8, Reader); 2] = [(1, version_1::read), (2, version_2::read)];

/// Reads a record of any version that has a reader.
fn decode_by(readers: &[(u8, Reader)], bytes: &[u8]) -> Result<StoredRecord, DecodeError> {
    let (found, payload) = frame::open(bytes)?;
    if found == DRIFT_VERSION {
        return Err(DecodeError::OtherKind { found });
    }
    let mut readers = readers.iter().filter(|(version, _)| *version == found);
    let (_, read) = readers.next().ok_or(DecodeError::UnknownVersion { found })?;
    let record = read(payload)?;
    record.check().map_err(DecodeError::NotFinite)?;
    Ok(record)
}

/// Writes what temperature does at the start of `buffer`; gives the bytes that are it, [`DRIFT_ENCODED`].
///
/// # Errors
/// [`EncodeError`]; what is in `buffer` then is no record.
pub fn encode_drift<'b>(record: &DriftRecord, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    record.check().map_err(EncodeError::NotFinite)?;
    frame::write(DRIFT_VERSION, &version_3::Payload::from(record), buffer)
}

/// Reads what temperature does from the bytes that are it, neither more nor fewer.
///
/// # Errors
/// [`DecodeError`], never another record than was written.
pub fn decode_drift(bytes: &[u8]) -> Result<DriftRecord, DecodeError> {
    match frame::open(bytes)? {
        (DRIFT_VERSION, payload) => {
            let record = version_3::read(payload)?;
            record.check().map_err(DecodeError::NotFinite)?;
            Ok(record)
        }
        (found, _) if found < DRIFT_VERSION => Err(DecodeError::OtherKind { found }),
        (found, _) => Err(DecodeError::UnknownVersion { found }),
    }
}

impl DriftRecord {
    /// Finds what is no drift: numbers that are not finite, and a range that is none.
    fn check(&self) -> Result<(), Field> {
        let TemperatureDrift {
            reference,
            range: [low, high],
            bias,
            scale,
        } = &self.drift;
        let finite = bias.iter().chain(scale).flatten().all(|x| x.is_finite());
        let ordered = low <= reference && reference <= high && low.is_finite() && high.is_finite();
        (finite && ordered).then_some(()).ok_or(Field::Drift)
    }
}

impl StoredRecord {
    /// Takes a record of the core in either precision.
    pub fn of<T: Real>(record: &Record<T>, temperature: Option<T>) -> Self {
        let single = convert_unchecked::<T, f32>;
        Self {
            record: record.in_numbers(single),
            temperature: temperature.map(single),
        }
    }

    /// Gives the record of the core in either precision.
    pub fn record_in<T: Real>(&self) -> Record<T> {
        self.record.in_numbers(convert::<f32, T>)
    }

    /// Finds what is not a number that a record may hold. Sigmas and residuals may be infinite: nothing is known then.
    fn check(&self) -> Result<(), Field> {
        let record = &self.record;
        let sigmas = record.matrix_sigma.iter().chain(&record.bias_sigma);
        let sigmas = sigmas.chain(&record.lever_arm_sigma);
        let faults = [
            (Field::Matrix, record.model.matrix.iter().all(|x| x.is_finite())),
            (Field::Bias, record.model.bias.iter().all(|x| x.is_finite())),
            (Field::LeverArm, record.lever_arm.iter().all(|x| x.is_finite())),
            (Field::Sigmas, sigmas.into_iter().all(|x| !x.is_nan())),
            (
                Field::Residuals,
                !(record.residual.is_nan() || record.residual_before.is_nan()),
            ),
            (Field::Followed, record.followed.iter().all(|x| x.is_finite())),
            (Field::Temperature, self.temperature.is_none_or(f32::is_finite)),
        ];
        let fault = faults.iter().find(|(_, sound)| !sound);
        fault.map_or(Ok(()), |(field, _)| Err(*field))
    }
}
