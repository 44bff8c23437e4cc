//! Flash with words that cannot be read or do not take what is written.
//!
//! Where flash has an error-correcting code, a word in which power was cut answers reads with an error, and so does a
//! worn one. The store passes over such a word. An error of the bus passes, which two signs show: the word is
//! read again, and a header is readable between the attempts.

use embedded_storage::nor_flash::{ErrorType, NorFlash};

use crate::flash::StoreError;
use crate::flash::entry::Entry;
use crate::flash::header::{COPY, Copy};

/// Result of reading flash.
pub type Seen<T, F> = Result<T, <F as ErrorType>::Error>;

/// Result of writing flash.
pub type Done<T, F> = Result<T, StoreError<<F as ErrorType>::Error>>;

/// Byte of a part that cannot be read: no header, checksum, kind or mark has such bytes, and erased flash has not.
const UNREADABLE: u8 = 0x5A;

/// Reads of a word after the first, while others are readable.
const RETRIES: usize = 2;

/// A flash, and where both of its banks begin.
pub struct FlashWords<F: NorFlash> {
    pub flash: F,
    pub banks: [u32; 2],
}

impl<F: NorFlash> FlashWords<F> {
    pub fn new(flash: F, banks: [u32; 2]) -> Self {
        Self { flash, banks }
    }

    /// Reads bytes; those of a word that cannot be read are [`UNREADABLE`]. An error of the flash as a whole is one.
    #[inline(never)]
    pub fn read(&mut self, address: u32, bytes: &mut [u8]) -> Seen<(), F> {
        let Err(error) = self.flash.read(address, bytes) else {
            return Ok(());
        };
        if !self.answers() {
            return Err(error);
        }
        for _ in 0..RETRIES {
            if self.flash.read(address, bytes).is_ok() {
                return Ok(());
            }
        }
        bytes.fill(UNREADABLE);
        Ok(())
    }

    /// Checks that any copy of a header is readable, whatever is in it.
    fn answers(&mut self) -> bool {
        let (Self { flash, banks }, mut bytes) = (self, Copy::blank());
        [0, COPY].into_iter().any(|copy| {
            banks
                .iter()
                .any(|bank| flash.read(bank + copy, &mut bytes.0).is_ok())
        })
    }

    /// Writes a copy of a header, or as many bytes, and verifies them.
    pub fn put(&mut self, address: u32, bytes: &Copy) -> Done<(), F> {
        self.flash.write(address, &bytes.0)?;
        let mut read = Copy::blank();
        self.read(address, &mut read.0)?;
        same(read == *bytes)
    }

    /// Writes an entry to erased flash, and verifies it.
    pub fn put_entry(&mut self, address: u32, entry: &Entry) -> Done<(), F> {
        let mut read = Entry::blank();
        self.read(address, &mut read.0)?;
        same(read.is_blank())?;
        self.flash.write(address, &entry.0)?;
        self.read(address, &mut read.0)?;
        same(read == *entry)
    }
}

fn same<E>(same: bool) -> Result<(), StoreError<E>> {
    if same {
        Ok(())
    } else {
        Err(StoreError::NotAsWritten)
    }
}
