//! Flash as the caller's callbacks have it.

use core::ffi::{c_int, c_void};

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// NOR flash, reached by callbacks: each returns 0 on success, and anything else on failure. Addresses are whatever the
/// driver takes them for; the library adds nothing to them. Callbacks may not use the store that calls them, which is
/// answered by ::TUMBLE_ERROR_BUSY.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Flash {
    /// Handed to each callback. It is the caller's, and has to be there as long as the store.
    pub context: *mut c_void,
    /// Reads `length` bytes at `address`, 32 at a time or a multiple of it, at addresses that are multiples of 32. `bytes`
    /// is aligned to 4. Words that flash with an error-correcting code cannot read are a failure; they are passed over.
    pub read: Option<
        unsafe extern "C" fn(context: *mut c_void, address: u32, bytes: *mut u8, length: u32) -> c_int,
    >,
    /// Writes `length` bytes at `address`, both multiples of 32, to flash that is erased. `bytes` is aligned to 4.
    /// Written bytes have to be in flash when it returns.
    pub write: Option<
        unsafe extern "C" fn(context: *mut c_void, address: u32, bytes: *const u8, length: u32) -> c_int,
    >,
    /// Erases the page that begins at `address`, after which all its bytes are FF.
    pub erase: Option<unsafe extern "C" fn(context: *mut c_void, address: u32) -> c_int>,
    /// Bytes that are erased at once: of a page, or sector. A multiple of 32.
    pub page: u32,
}

/// The driver reported an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriverError;

impl NorFlashError for DriverError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Size, in bytes, of the units in which the store reads and writes.
///
/// cbindgen:ignore
pub const WORD: usize = 32;

/// Flash with all its callbacks there.
pub struct Driver {
    flash: Flash,
    end: u32,
}

impl Driver {
    /// Flash up to the address `end`; `None` if a callback is missing.
    pub fn new(flash: Flash, end: u32) -> Option<Self> {
        let complete = flash.read.is_some() && flash.write.is_some() && flash.erase.is_some();
        complete.then_some(Self { flash, end })
    }
}

fn done(answer: c_int) -> Result<(), DriverError> {
    if answer == 0 { Ok(()) } else { Err(DriverError) }
}

fn length(bytes: &[u8]) -> Result<u32, DriverError> {
    u32::try_from(bytes.len()).map_err(|_| DriverError)
}

impl ErrorType for Driver {
    type Error = DriverError;
}

impl ReadNorFlash for Driver {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), DriverError> {
        let (read, length) = (self.flash.read.ok_or(DriverError)?, length(bytes)?);
        // SAFETY: the caller gave both for this, and there is room for as many bytes.
        done(unsafe { read(self.flash.context, address, bytes.as_mut_ptr(), length) })
    }

    fn capacity(&self) -> usize {
        usize::try_from(self.end).unwrap_or(usize::MAX)
    }
}

impl NorFlash for Driver {
    const WRITE_SIZE: usize = WORD;
    /// The size of a page is known only when the program runs.
    const ERASE_SIZE: usize = WORD;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), DriverError> {
        let erase = self.flash.erase.ok_or(DriverError)?;
        let mut address = from;
        while address < to {
            // SAFETY: the caller gave both for this.
            done(unsafe { erase(self.flash.context, address) })?;
            address = address.checked_add(self.flash.page).ok_or(DriverError)?;
        }
        Ok(())
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), DriverError> {
        let (write, length) = (self.flash.write.ok_or(DriverError)?, length(bytes)?);
        // SAFETY: the caller gave both for this, and there are as many bytes.
        done(unsafe { write(self.flash.context, address, bytes.as_ptr(), length) })
    }
}
