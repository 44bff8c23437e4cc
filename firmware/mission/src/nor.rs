//! NOR flash made of memory: a write clears bits and never sets them, only an erasure does, by whole pages.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// Byte of erased flash.
pub const ERASED: u8 = 0xFF;

/// Bytes of a page.
pub const PAGE: usize = 4096;

/// Bytes of a word, which is the least that is written.
pub const WORD: usize = 4;

/// Pages of the chip: two banks of one.
pub const PAGES: usize = 2;

/// Bytes of the chip.
pub const BYTES: usize = PAGE * PAGES;

/// The chip, in memory that outlasts it.
pub struct Nor<'m> {
    memory: &'m mut [u8; BYTES],
    /// Pages that were erased since this was made.
    pub erasures: u32,
    /// Bytes that were written since.
    pub written: u32,
}

impl<'m> Nor<'m> {
    /// With what memory holds.
    pub fn new(memory: &'m mut [u8; BYTES]) -> Self {
        Self {
            memory,
            erasures: 0,
            written: 0,
        }
    }

    /// All it holds.
    pub fn content(&self) -> &[u8; BYTES] {
        self.memory
    }

    fn range(&mut self, from: u32, to: u32) -> Result<&mut [u8], NorFlashErrorKind> {
        let (from, to) = (usize::try_from(from), usize::try_from(to));
        let (Ok(from), Ok(to)) = (from, to) else {
            return Err(NorFlashErrorKind::OutOfBounds);
        };
        self.memory
            .get_mut(from..to)
            .ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl ErrorType for Nor<'_> {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Nor<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        let held = self.range(offset, end(offset, bytes))?;
        // The compiler has to see that the lengths are equal.
        let held = held.get(..bytes.len()).ok_or(NorFlashErrorKind::OutOfBounds)?;
        bytes.copy_from_slice(held);
        Ok(())
    }

    fn capacity(&self) -> usize {
        BYTES
    }
}

impl NorFlash for Nor<'_> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        self.range(from, to)?.fill(ERASED);
        self.erasures = self.erasures.saturating_add((to - from) / PAGE as u32);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        let held = self.range(offset, end(offset, bytes))?;
        held.iter_mut().zip(bytes).for_each(|(held, byte)| *held &= byte);
        self.written = self.written.saturating_add(bytes.len() as u32);
        Ok(())
    }
}

/// Where bytes end that lie at an offset.
fn end(offset: u32, bytes: &[u8]) -> u32 {
    offset.saturating_add(u32::try_from(bytes.len()).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_clears_bits_and_only_a_page_erasure_sets_them() {
        let mut memory = [ERASED; BYTES];
        let mut nor = Nor::new(&mut memory);
        let mut read = [0; WORD];
        nor.write(0, &[0b1100; WORD]).unwrap();
        nor.write(0, &[0b1010; WORD]).unwrap();
        nor.read(0, &mut read).unwrap();
        assert_eq!(read, [0b1000; WORD]);
        let page = PAGE as u32;
        nor.erase(page, 2 * page).unwrap();
        nor.read(0, &mut read).unwrap();
        assert_eq!(read, [0b1000; WORD]);
        nor.erase(0, page).unwrap();
        nor.read(0, &mut read).unwrap();
        assert_eq!(read, [ERASED; WORD]);
        assert_eq!((nor.erasures, nor.written), (2, 2 * WORD as u32));
    }

    #[test]
    fn what_is_not_aligned_or_not_there_is_refused() {
        let mut memory = [ERASED; BYTES];
        let mut nor = Nor::new(&mut memory);
        let capacity = BYTES as u32;
        assert_eq!(nor.write(2, &[0; WORD]), Err(NorFlashErrorKind::NotAligned));
        assert_eq!(nor.write(0, &[0; 3]), Err(NorFlashErrorKind::NotAligned));
        assert_eq!(nor.erase(0, 100), Err(NorFlashErrorKind::NotAligned));
        assert_eq!(
            nor.write(capacity, &[0; WORD]),
            Err(NorFlashErrorKind::OutOfBounds)
        );
        assert_eq!(nor.read(capacity, &mut [0]), Err(NorFlashErrorKind::OutOfBounds));
    }
}
