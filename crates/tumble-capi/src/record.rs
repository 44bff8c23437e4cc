//! Calibration records, and their bytes.

use core::mem::MaybeUninit;
use core::slice;

use tumble_core::model::ErrorModel;
use tumble_core::record_table;
use tumble_core::redundancy::record::Record as Core;
use tumble_core::redundancy::sensor::Sensor as CoreSensor;
use tumble_core::redundancy::settings::FitModel as CoreFitModel;
use tumble_store::record::{DecodeError, EncodeError, MAX_ENCODED, StoredRecord, decode, encode};

use crate::code::{Code, code};
use crate::model::{Calibration, Correction, ErrorModel as Model, Mirrored};
use crate::pointer::{Place, look, read};
use crate::status::{Status, StatusResult, status};

/// Most bytes of an encoded record.
pub const TUMBLE_RECORD_BYTES: usize = 171;

const _: () = assert!(TUMBLE_RECORD_BYTES == MAX_ENCODED);

/// Three axes of one kind.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {
    /// Specific force, m/s^2.
    Accelerometer,
    /// Angular rate, rad/s.
    Gyroscope,
}

/// Models that a fit may estimate; each includes those before.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitModel {
    /// Three offsets.
    Offset,
    /// An offset and a gain for each axis.
    Gain,
    /// Offset and matrix.
    Affine,
    /// Offset, matrix and lever arm.
    AffineAndLeverArm,
}

/// Error of one sensor of a secondary against the primary, `y_secondary = M y_primary + b`, where specific force of the
/// primary is taken to the place of the secondary first.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Record {
    /// Identity of the unit.
    pub identity: u64,
    /// Which sensor of it.
    pub sensor: MaybeUninit<Sensor>,
    /// Model that was fitted.
    pub fit_model: MaybeUninit<FitModel>,
    /// M, row by row: from the primary's case frame to the axes of the secondary, mounting included; no unit.
    pub matrix: [[f32; 3]; 3],
    /// b, m/s^2 or rad/s.
    pub bias: [f32; 3],
    /// 1-sigma of M, row by row; infinite where motion did not show it.
    pub matrix_sigma: [[f32; 3]; 3],
    /// 1-sigma of b, m/s^2 or rad/s.
    pub bias_sigma: [f32; 3],
    /// From primary to secondary, m, primary's case frame; zero for gyroscopes, and where unknown.
    pub lever_arm: [f32; 3],
    /// 1-sigma of it, m; zero where it was given, infinite where motion did not show it.
    pub lever_arm_sigma: [f32; 3],
    /// Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s.
    pub residual: f32,
    /// The same with the error stored before.
    pub residual_before: f32,
    /// Shift by which its calibrations together have followed the primary without proof that it was right: the change
    /// they made to a mean reading, m/s^2 or rad/s, in the axes of the secondary. Zeros: it may follow as far as the
    /// settings allow.
    pub followed: [f32; 3],
    /// Temperature of the unit while it was calibrated, degC; NaN where it is not known.
    pub temperature: f32,
    /// Pairs it was fitted to.
    pub pairs: u32,
    /// Counts the calibrations of this sensor.
    pub sequence: u32,
    /// Directions of motion along which M was fitted.
    pub directions: u8,
}

/// Writes a record as bytes. The first `length` of the `size` bytes at `buffer`, which the caller owns, then hold the
/// record.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_NOT_FINITE of the record; ::TUMBLE_ERROR_NO_ROOM.
#[cfg(feature = "records")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_record_encode(
    record: *const Record,
    buffer: *mut u8,
    size: usize,
    length: *mut usize,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (record, place) = unsafe { (read(record), Place::at(length)) };
    status((|| {
        let (record, place) = (record?.in_store()?, place?);
        if buffer.is_null() {
            return Err(Status::TumbleErrorNull);
        }
        let mut bytes = [0; MAX_ENCODED];
        let written = encode(&record, &mut bytes).map_err(encode_error)?;
        if written.len() > size {
            return Err(Status::TumbleErrorNoRoom);
        }
        // SAFETY: there is room for `size` bytes.
        unsafe { buffer.copy_from_nonoverlapping(written.as_ptr(), written.len()) };
        place.write(written.len());
        Ok(())
    })())
}

/// Reads a record from the `length` bytes that are it, neither more nor fewer.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_TOO_SHORT, ::TUMBLE_ERROR_NOT_A_RECORD, ::TUMBLE_ERROR_CORRUPT,
/// ::TUMBLE_ERROR_VERSION; ::TUMBLE_ERROR_CODE, ::TUMBLE_ERROR_NOT_FINITE of what was written.
#[cfg(feature = "records")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_record_decode(
    bytes: *const u8,
    length: usize,
    record: *mut Record,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    unsafe { read_bytes(bytes, length, record, decode, Record::of_stored) }
}

/// Reads a record of a kind from bytes of the caller's, and writes it as C has it.
///
/// # Safety
/// The pointers satisfy the header.
#[cfg(feature = "records")]
pub unsafe fn read_bytes<S, C>(
    bytes: *const u8,
    length: usize,
    record: *mut C,
    decode: impl FnOnce(&[u8]) -> Result<S, DecodeError>,
    in_c: impl FnOnce(&S) -> C,
) -> Status {
    // SAFETY: the same is asked of the caller.
    let place = unsafe { Place::at(record) };
    status((|| {
        let place = place?;
        if bytes.is_null() {
            return Err(Status::TumbleErrorNull);
        }
        // No kind has more, and a slice has a limit.
        if length > TUMBLE_RECORD_BYTES {
            return Err(Status::TumbleErrorCorrupt);
        }
        // SAFETY: there are that many bytes, and few enough for a slice.
        let bytes = unsafe { slice::from_raw_parts(bytes, length) };
        place.write(in_c(&decode(bytes).map_err(decode_error)?));
        Ok(())
    })())
}

/// Computes the correction of the errors in two records of one unit, like tumble_correction_init() of a calibration.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_CODE if they are not of an accelerometer and a gyroscope, in this order;
/// ::TUMBLE_ERROR_NO_SUCH_UNIT if they are of different units; ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_correction_from_records(
    correction: *mut Correction,
    accelerometer: *const Record,
    gyroscope: *const Record,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, accelerometer, gyroscope) =
        unsafe { (Place::at(correction), look(accelerometer), look(gyroscope)) };
    status((|| {
        let (place, accelerometer, gyroscope) = (place?, accelerometer?, gyroscope?);
        let calibration = Calibration {
            accelerometer: accelerometer.model_of(Sensor::Accelerometer)?,
            gyroscope: gyroscope.model_of(Sensor::Gyroscope)?,
        };
        if accelerometer.identity != gyroscope.identity {
            return Err(Status::TumbleErrorNoSuchUnit);
        }
        place.write(Correction::of(&calibration)?);
        Ok(())
    })())
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for Sensor {
    const COUNT: u32 = 2;
}

// SAFETY: repr(u32), numbered from 0.
unsafe impl Code for FitModel {
    const COUNT: u32 = 4;
}

impl Sensor {
    /// Converts the core's type.
    pub fn of(sensor: CoreSensor) -> Self {
        match sensor {
            CoreSensor::Accelerometer => Self::Accelerometer,
            CoreSensor::Gyroscope => Self::Gyroscope,
        }
    }

    /// Converts it to the core's type.
    pub fn in_core(self) -> CoreSensor {
        match self {
            Self::Accelerometer => CoreSensor::Accelerometer,
            Self::Gyroscope => CoreSensor::Gyroscope,
        }
    }
}

impl FitModel {
    /// Converts the core's type.
    pub fn of(fit_model: CoreFitModel) -> Self {
        match fit_model {
            CoreFitModel::Offset => Self::Offset,
            CoreFitModel::Gain => Self::Gain,
            CoreFitModel::Affine => Self::Affine,
            CoreFitModel::AffineAndLeverArm => Self::AffineAndLeverArm,
        }
    }

    /// Converts it to the core's type.
    pub fn in_core(self) -> CoreFitModel {
        match self {
            Self::Offset => CoreFitModel::Offset,
            Self::Gain => CoreFitModel::Gain,
            Self::Affine => CoreFitModel::Affine,
            Self::AffineAndLeverArm => CoreFitModel::AffineAndLeverArm,
        }
    }
}

impl Record {
    /// Its error model, if it is one of this sensor.
    fn model_of(&self, sensor: Sensor) -> StatusResult<Model> {
        if code(self.sensor)? != sensor {
            return Err(Status::TumbleErrorCode);
        }
        Ok(Model {
            matrix: self.matrix,
            bias: self.bias,
        })
    }

    /// Converts a record with its temperature.
    pub fn of_stored(stored: &StoredRecord) -> Self {
        Self::of(&stored.record, stored.temperature)
    }

    /// Converts it to the store's type.
    pub fn in_store(&self) -> StatusResult<StoredRecord> {
        Ok(StoredRecord {
            record: self.in_core()?,
            temperature: (!self.temperature.is_nan()).then_some(self.temperature),
        })
    }
}

/// Makes the conversions from the table of records, so that each number of the core has its field here.
macro_rules! conversions {
    (
        in model: $($(#[$_shared:meta])+ $shared:ident: $_shared_type:ty = $($_shared_row:tt),+;)+
        in itself: $($(#[$_own:meta])+ $own:ident: $_own_type:ty = $($_own_row:tt),+;)+
    ) => {
        impl Record {
            /// Converts the core's type; temperature in degC.
            pub fn of(record: &Core<f32>, temperature: Option<f32>) -> Self {
                Self {
                    identity: record.identity,
                    sensor: MaybeUninit::new(Sensor::of(record.sensor)),
                    fit_model: MaybeUninit::new(FitModel::of(record.fit_model)),
                    $($shared: record.model.$shared.in_c(),)+
                    $($own: record.$own.in_c(),)+
                    temperature: temperature.unwrap_or(f32::NAN),
                    pairs: record.pairs,
                    sequence: record.sequence,
                    directions: record.directions,
                }
            }

            /// Converts it to the core's type, which has no temperature.
            fn in_core(&self) -> StatusResult<Core<f32>> {
                Ok(Core {
                    identity: self.identity,
                    sensor: code(self.sensor)?.in_core(),
                    model: ErrorModel { $($shared: Mirrored::of_c(&self.$shared),)+ },
                    fit_model: code(self.fit_model)?.in_core(),
                    directions: self.directions,
                    pairs: self.pairs,
                    sequence: self.sequence,
                    $($own: Mirrored::of_c(&self.$own),)+
                })
            }
        }
    };
}

record_table!(conversions);

/// Why a record cannot be written.
pub fn encode_error(error: EncodeError) -> Status {
    match error {
        EncodeError::NotFinite(_) => Status::TumbleErrorNotFinite,
        EncodeError::NoRoom => Status::TumbleErrorNoRoom,
    }
}

/// Why bytes are no record.
pub fn decode_error(error: DecodeError) -> Status {
    match error {
        DecodeError::TooShort { .. } => Status::TumbleErrorTooShort,
        DecodeError::NotARecord | DecodeError::OtherKind { .. } => Status::TumbleErrorNotARecord,
        DecodeError::Corrupt => Status::TumbleErrorCorrupt,
        DecodeError::UnknownVersion { .. } => Status::TumbleErrorVersion,
        DecodeError::UnknownCode { .. } => Status::TumbleErrorCode,
        DecodeError::NotFinite(_) => Status::TumbleErrorNotFinite,
    }
}
