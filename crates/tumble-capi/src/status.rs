//! Outcomes of a call, and their description in words.

/// Outcome of a call: ::TUMBLE_OK, or the reason why nothing was done. Unless a function states otherwise, its outputs
/// were not written then, and no state has changed.
///
/// cbindgen:rename-all=ScreamingSnakeCase
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(clippy::enum_variant_names)] // As they are called in C.
pub enum Status {
    /// It was done.
    TumbleOk = 0,
    /// A pointer is null.
    TumbleErrorNull,
    /// A pointer is not aligned as its type asks. Any call that is given pointers may answer it.
    TumbleErrorUnaligned,
    /// The storage, settings or a unit have another size or version than this library was built for: header and library do
    /// not belong together. Or settings or a unit were not filled with their defaults.
    TumbleErrorSize,
    /// The storage was not initialised, or was overwritten since.
    TumbleErrorNotInitialised,
    /// A call that changes the same storage is under way, so this one comes from a callback, an interrupt or another thread.
    TumbleErrorBusy,
    /// The library was built for another number of units than were given; see #TUMBLE_UNITS.
    TumbleErrorUnits,
    /// There is no unit of this number.
    TumbleErrorNoSuchUnit,
    /// An enumerated value is none of its kind.
    TumbleErrorCode,
    /// A number is not finite.
    TumbleErrorNotFinite,
    /// A setting is not positive or out of its range.
    TumbleErrorSetting,
    /// Settings contradict each other; tumble_redundancy_check() names them.
    TumbleErrorContradiction,
    /// A matrix has no inverse: two axes coincide, or one is zero.
    TumbleErrorSingular,
    /// The axes of a triad form a left-handed set, which no mounting explains.
    TumbleErrorLeftHanded,
    /// The primary has to have an axis, and its rotation has to be the identity.
    TumbleErrorPrimary,
    /// The matrix of a unit's mounting is no rotation.
    TumbleErrorMounting,
    /// Two units have the same identity.
    TumbleErrorSameIdentity,
    /// The primary's own calibration is taken before the first sample only.
    TumbleErrorBegun,
    /// The spin shows nothing that could be solved for; the failure gives the reason.
    TumbleErrorSpin,
    /// The buffer is too small; #TUMBLE_RECORD_BYTES are always enough.
    TumbleErrorNoRoom,
    /// Fewer bytes than any record has.
    TumbleErrorTooShort,
    /// The bytes do not begin as records do.
    TumbleErrorNotARecord,
    /// The bytes are not as they were written.
    TumbleErrorCorrupt,
    /// The record was written by a newer version of this library.
    TumbleErrorVersion,
    /// The range of flash does not begin at a page, or has not an even number of pages; or a page is no multiple of 32 bytes.
    TumbleErrorPages,
    /// The range of flash is empty, or goes beyond 32 bits.
    TumbleErrorBounds,
    /// Half of the range of flash has no room for the records of one sensor: 832 bytes.
    TumbleErrorTooSmall,
    /// A callback of the flash is missing.
    TumbleErrorNoDriver,
    /// The driver of the flash reported errors for all of it, or could not erase.
    TumbleErrorFlash,
    /// Eight places in a row hold something else than was written to them: the flash is worn.
    TumbleErrorNotAsWritten,
    /// Flash would wear out; the call returns the time to wait.
    TumbleErrorTooSoon,
    /// There are too many units for the range of flash, even without the previous records, which are dropped first.
    TumbleErrorFull,
    /// There is no such record.
    TumbleErrorNothingStored,
}

/// Result of a fallible step.
pub type StatusResult<T = ()> = Result<T, Status>;

/// The outcome as C has it.
pub fn status(outcome: StatusResult) -> Status {
    match outcome {
        Ok(()) => Status::TumbleOk,
        Err(status) => status,
    }
}
