//! Magnetometers: readings corrected, and their errors as records.

use core::mem::MaybeUninit;

use tumble_core::magnetometer::{MagnetometerCorrection as CoreCorrection, MagnetometerModel as CoreModel};
use tumble_core::model::Correction as OneCorrection;
#[cfg(feature = "records")]
use tumble_store::record::{
    Load, MAGNETOMETER_ENCODED, MagnetometerRecord as StoredMagnetometer, decode_magnetometer,
    encode_magnetometer,
};

use crate::code::truth;
use crate::model::{ErrorModel, matrix, rows, vector};
use crate::pointer::{Place, look, read};
#[cfg(feature = "records")]
use crate::record::{encode_error, read_bytes};
use crate::status::{Status, StatusResult, status};

/// Bytes of the encoded error of a magnetometer.
pub const TUMBLE_MAGNETOMETER_BYTES: usize = 125;

#[cfg(feature = "records")]
const _: () = assert!(TUMBLE_MAGNETOMETER_BYTES == MAGNETOMETER_ENCODED);

/// Errors of a magnetometer, `y = M u + b + c I`: `u` is the field in the case frame of the unit, uT, and I the current
/// through the motors, or the throttle that it follows.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Magnetometer {
    /// M, which holds soft iron too, and b, hard iron, uT.
    pub error: ErrorModel,
    /// c, uT per A, or uT at full throttle; zero where it is not known.
    pub current: [f32; 3],
}

/// Correction that inverts the errors of a magnetometer, `u = C (y - b - c I)` with `C = M^-1`. It is plain data: it may be
/// copied, and lie in read-only memory.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MagnetometerCorrection {
    /// C, row by row: from the sensing axes to the case frame.
    pub matrix: [[f32; 3]; 3],
    /// b, uT.
    pub bias: [f32; 3],
    /// c, uT per A, or uT at full throttle.
    pub current: [f32; 3],
}

/// Error of the magnetometer of one unit, in its stored form.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct MagnetometerRecord {
    /// Identity of the unit.
    pub identity: u64,
    /// Its errors.
    pub magnetometer: Magnetometer,
    /// 1-sigma of M, row by row; infinite where it is not known.
    pub matrix_sigma: [[f32; 3]; 3],
    /// 1-sigma of b, uT; infinite where it is not known.
    pub bias_sigma: [f32; 3],
    /// True where `current` is that of a throttle from 0 to 1, false where it is per A.
    pub of_throttle: MaybeUninit<bool>,
}

/// Computes what undoes the errors of a magnetometer.
///
/// Errors: ::TUMBLE_ERROR_NULL, ::TUMBLE_ERROR_NOT_FINITE, ::TUMBLE_ERROR_SINGULAR.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_magnetometer_correction_init(
    correction: *mut MagnetometerCorrection,
    magnetometer: *const Magnetometer,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (place, magnetometer) = unsafe { (Place::at(correction), look(magnetometer)) };
    status((|| {
        let (place, magnetometer) = (place?, magnetometer?.in_core()?);
        let found = magnetometer
            .correction()
            .map_err(|_| Status::TumbleErrorSingular)?;
        if !found.correction.matrix.iter().all(|x| x.is_finite()) {
            return Err(Status::TumbleErrorSingular);
        }
        place.write(MagnetometerCorrection {
            matrix: rows(&found.correction.matrix),
            bias: found.correction.bias.into(),
            current: found.current.into(),
        });
        Ok(())
    })())
}

/// Corrects a reading of the magnetometer, uT, at a current, A, or a throttle from 0 to 1; its effect stays where it is NaN.
/// `reading` and `field` may be the same.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NOT_FINITE if the reading or what the correction makes of it is not.
///
/// cbindgen:ptrs-as-arrays=[[reading; 3], [field; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_magnetometer_correction_apply(
    correction: *const MagnetometerCorrection,
    reading: *const f32,
    current: f32,
    field: *mut f32,
) -> Status {
    let (reading, field) = (reading.cast::<[f32; 3]>(), field.cast::<[f32; 3]>());
    // SAFETY: the header requires it of all pointers.
    let (correction, reading, place) = unsafe { (look(correction), read(reading), Place::at(field)) };
    status((|| {
        let (correction, reading, place) = (correction?.in_core(), reading?, place?);
        let found = correction.apply(&vector(&reading), current);
        if !found.iter().all(|u| u.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        place.write(found.into());
        Ok(())
    })())
}

/// Writes the error of a magnetometer at the start of the `size` bytes at `bytes`, ::TUMBLE_MAGNETOMETER_BYTES of them.
///
/// Errors: ::TUMBLE_ERROR_NULL; ::TUMBLE_ERROR_NO_ROOM; ::TUMBLE_ERROR_NOT_FINITE of the numbers, and NaN of sigmas.
#[cfg(feature = "records")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_magnetometer_encode(
    record: *const MagnetometerRecord,
    bytes: *mut u8,
    size: usize,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    let (record, place) = unsafe {
        (
            read(record),
            Place::at(bytes.cast::<[u8; MAGNETOMETER_ENCODED]>()),
        )
    };
    status((|| {
        let (record, place) = (record?.in_store()?, place?);
        if size < MAGNETOMETER_ENCODED {
            return Err(Status::TumbleErrorNoRoom);
        }
        let mut buffer = [0; MAGNETOMETER_ENCODED];
        encode_magnetometer(&record, &mut buffer).map_err(encode_error)?;
        place.write(buffer);
        Ok(())
    })())
}

/// Reads the error of a magnetometer from the `length` bytes that are it, neither more nor fewer.
///
/// Errors: as of tumble_record_decode(); ::TUMBLE_ERROR_NOT_A_RECORD if they are a record of another kind.
#[cfg(feature = "records")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_magnetometer_decode(
    bytes: *const u8,
    length: usize,
    record: *mut MagnetometerRecord,
) -> Status {
    // SAFETY: the header requires it of all pointers.
    unsafe { read_bytes(bytes, length, record, decode_magnetometer, MagnetometerRecord::of) }
}

impl Magnetometer {
    fn in_core(&self) -> StatusResult<CoreModel<f32>> {
        if !self.current.iter().all(|c| c.is_finite()) {
            return Err(Status::TumbleErrorNotFinite);
        }
        Ok(CoreModel {
            model: self.error.in_core()?,
            current: vector(&self.current),
        })
    }

    fn of(magnetometer: &CoreModel<f32>) -> Self {
        Self {
            error: ErrorModel {
                matrix: rows(&magnetometer.model.matrix),
                bias: magnetometer.model.bias.into(),
            },
            current: magnetometer.current.into(),
        }
    }
}

impl MagnetometerCorrection {
    fn in_core(&self) -> CoreCorrection<f32> {
        CoreCorrection {
            correction: OneCorrection {
                matrix: matrix(&self.matrix),
                bias: vector(&self.bias),
            },
            current: vector(&self.current),
        }
    }
}

#[cfg(feature = "records")]
impl MagnetometerRecord {
    /// Converts the store's type.
    pub fn of(record: &StoredMagnetometer) -> Self {
        Self {
            identity: record.identity,
            magnetometer: Magnetometer::of(&record.magnetometer),
            matrix_sigma: rows(&record.matrix_sigma),
            bias_sigma: record.bias_sigma.into(),
            of_throttle: MaybeUninit::new(record.load == Load::Throttle),
        }
    }

    /// Converts it to the store's type.
    pub fn in_store(&self) -> StatusResult<StoredMagnetometer> {
        Ok(StoredMagnetometer {
            identity: self.identity,
            magnetometer: self.magnetometer.in_core()?,
            load: if truth(self.of_throttle) {
                Load::Throttle
            } else {
                Load::Current
            },
            matrix_sigma: matrix(&self.matrix_sigma),
            bias_sigma: vector(&self.bias_sigma),
        })
    }
}
