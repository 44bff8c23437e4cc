//! One calibration record as bytes: a frame with version and CRC-32 around fields in a fixed order.
//!
//! Numbers are single precision on the wire, whatever the core runs on. Its rounding, 6e-8 of a value, is some thousand
//! times below the sigma of any calibration; devices compute in single precision anyway; and half the bytes are half
//! the wear.

mod drift;
mod frame;
#[cfg(feature = "magnetometer")]
mod magnetometer;
mod numbers;
mod sensor_error;

pub(crate) use frame::{MAGNETOMETER, is_sensor, sensor_code};

use nalgebra::{Matrix3, Vector3, convert, convert_unchecked};
use tumble_core::magnetometer::MagnetometerModel;
use tumble_core::real::Real;
use tumble_core::redundancy::record::{Record, RecordPart};
use tumble_core::redundancy::sensor::Sensor;
use tumble_core::temperature::TemperatureDrift;

/// The version that [`encode`] writes; [`decode`] reads it and all before it.
pub const VERSION: u8 = sensor_error::VERSION;

/// Most bytes that [`encode`] writes.
pub const MAX_ENCODED: usize = sensor_error::MAX_ENCODED;

/// The version that [`encode_drift`] writes: a record of another kind, for whoever uses it.
pub const DRIFT_VERSION: u8 = drift::VERSION;

/// Bytes that [`encode_drift`] writes.
pub const DRIFT_ENCODED: usize = drift::ENCODED;

/// The version that [`encode_magnetometer`] writes: a record of a third kind.
#[cfg(feature = "magnetometer")]
pub const MAGNETOMETER_VERSION: u8 = magnetometer::VERSION;

/// Bytes that [`encode_magnetometer`] writes.
#[cfg(feature = "magnetometer")]
pub const MAGNETOMETER_ENCODED: usize = magnetometer::ENCODED;

/// A record of the core, with what the core does not need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredRecord<T: Real = f32> {
    /// Error of one sensor of one unit.
    pub record: Record<T>,
    /// Temperature of the unit while it was calibrated, degC, if known.
    pub temperature: Option<f32>,
}

/// Effect of temperature on one sensor of one unit: on its own readings, whatever its error against a primary is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriftRecord {
    /// Identity of the unit.
    pub identity: u64,
    /// Which sensor of it.
    pub sensor: Sensor,
    /// In the axes and the unit of the sensor.
    pub drift: TemperatureDrift<f32>,
}

/// Error of the magnetometer of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagnetometerRecord {
    /// Identity of the unit.
    pub identity: u64,
    /// In the case frame of the unit, uT.
    pub magnetometer: MagnetometerModel<f32>,
    /// Load that its effect of current is of.
    pub load: Load,
    /// 1-sigma of M; infinite where it is not known.
    pub matrix_sigma: Matrix3<f32>,
    /// 1-sigma of b, uT; infinite where it is not known.
    pub bias_sigma: Vector3<f32>,
}

/// Load that disturbs a magnetometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Current of the motors, A.
    Current,
    /// Throttle from 0 to 1.
    Throttle,
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
    /// They are as written, but of another kind, such as a drift where an error is asked for.
    OtherKind {
        /// Their version.
        found: u8,
    },
    /// They are as written, but a code in them means nothing.
    UnknownCode {
        /// Field with the wrong value.
        field: Field,
        /// Value found.
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
    /// Model that was fitted.
    FitModel,
    /// Numbers of the error.
    Numbers(RecordPart),
    /// While it was calibrated.
    Temperature,
    /// Reference, range or coefficients of a drift.
    Drift,
    /// Current or throttle.
    Load,
    /// Numbers of a magnetometer.
    Magnetometer,
}

/// Writes a record at the start of `buffer`; gives the bytes that are the record.
///
/// # Errors
/// [`EncodeError`]; what is in `buffer` then is no record.
pub fn encode<'b>(stored: &StoredRecord, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    let length = encode_of(&stored.record, stored.temperature, buffer)?;
    buffer.get(..length).ok_or(EncodeError::NoRoom)
}

/// Writes a record of either precision at the start of `buffer`; gives how many bytes it has.
pub(crate) use sensor_error::write as encode_of;

/// Writes the error of a magnetometer at the start of `buffer`; gives how many bytes it has.
#[cfg(feature = "magnetometer")]
pub(crate) use magnetometer::write as encode_magnetometer_of;

/// Reads a record from the bytes that are it, neither more nor fewer.
///
/// # Errors
/// [`DecodeError`], never another record than was written.
pub fn decode(bytes: &[u8]) -> Result<StoredRecord, DecodeError> {
    decode_in(bytes)
}

/// Reads a record in either precision.
pub(crate) fn decode_in<T: Real>(bytes: &[u8]) -> Result<StoredRecord<T>, DecodeError> {
    let found = frame::version_of(bytes)?;
    match sensor_error::flag_of(found) {
        Some(flag) => sensor_error::read(bytes, flag),
        None if is_of_another_kind(found) => Err(DecodeError::OtherKind { found }),
        None => Err(DecodeError::UnknownVersion { found }),
    }
}

/// Writes what temperature does at the start of `buffer`; gives the bytes that are it, [`DRIFT_ENCODED`].
///
/// # Errors
/// [`EncodeError`]; what is in `buffer` then is no record.
pub fn encode_drift<'b>(record: &DriftRecord, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    let length = drift::write(record, buffer)?;
    buffer.get(..length).ok_or(EncodeError::NoRoom)
}

/// Reads what temperature does from the bytes that are it, neither more nor fewer.
///
/// # Errors
/// [`DecodeError`], never another record than was written.
pub fn decode_drift(bytes: &[u8]) -> Result<DriftRecord, DecodeError> {
    match frame::version_of(bytes)? {
        DRIFT_VERSION => drift::read(bytes),
        found if sensor_error::flag_of(found).is_some() || is_of_another_kind(found) => {
            Err(DecodeError::OtherKind { found })
        }
        found => Err(DecodeError::UnknownVersion { found }),
    }
}

/// Writes the error of a magnetometer at the start of `buffer`; gives the bytes that are it, [`MAGNETOMETER_ENCODED`].
///
/// # Errors
/// [`EncodeError`]; what is in `buffer` then is no record.
#[cfg(feature = "magnetometer")]
pub fn encode_magnetometer<'b>(
    record: &MagnetometerRecord,
    buffer: &'b mut [u8],
) -> Result<&'b [u8], EncodeError> {
    let length = magnetometer::write(record, buffer)?;
    buffer.get(..length).ok_or(EncodeError::NoRoom)
}

/// Reads the error of a magnetometer from the bytes that are it, neither more nor fewer.
///
/// # Errors
/// [`DecodeError`], never another record than was written.
#[cfg(feature = "magnetometer")]
pub fn decode_magnetometer(bytes: &[u8]) -> Result<MagnetometerRecord, DecodeError> {
    match frame::version_of(bytes)? {
        MAGNETOMETER_VERSION => magnetometer::read(bytes),
        found if sensor_error::flag_of(found).is_some() || found == DRIFT_VERSION => {
            Err(DecodeError::OtherKind { found })
        }
        found => Err(DecodeError::UnknownVersion { found }),
    }
}

/// Tests whether a version is known, and not that of the error of a sensor.
fn is_of_another_kind(version: u8) -> bool {
    #[cfg(feature = "magnetometer")]
    if version == MAGNETOMETER_VERSION {
        return true;
    }
    version == DRIFT_VERSION
}

/// Returns the length of a record of any kind and version from its first bytes; `None` where they have no meaning here.
pub fn length(bytes: &[u8]) -> Option<usize> {
    match frame::version_in(bytes)? {
        DRIFT_VERSION => Some(DRIFT_ENCODED),
        #[cfg(feature = "magnetometer")]
        MAGNETOMETER_VERSION => Some(MAGNETOMETER_ENCODED),
        version => sensor_error::length(bytes, sensor_error::flag_of(version)?),
    }
}

impl Field {
    /// Name in files and Python.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::FitModel => "fit_model",
            Self::Numbers(part) => part.name(),
            Self::Temperature => "temperature",
            Self::Drift => "drift",
            Self::Load => "load",
            Self::Magnetometer => "magnetometer",
        }
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
}
