//! Header of a bank, which is written after the entries that it speaks for.

use crate::checksum::{CHECKSUM, checksum, sign};
use crate::flash::entry::{ERASED, PART};

/// Bytes of one copy of a header. All sizes in flash are multiples of it.
pub const COPY: u32 = PART as u32;

/// Two copies, so that no single bit that changes takes a bank out of use, and no single word that dies.
pub const HEADER: u32 = 2 * COPY;

/// Magic bytes of a header, with the version of the layout.
const MAGIC: [u8; 4] = *b"TB\x02\xFF";

/// Magic bytes of version 1, whose headers lack the checksum of copied entries.
const MAGIC_1: [u8; 4] = *b"TB\x01\xFF";

/// The checksum of no entries.
pub const NO_CONTENT: u32 = 0;

/// Contents of a header.
#[derive(Clone, Copy)]
pub struct Header {
    /// Counts the banks that were made.
    sequence: u32,
    /// Slots to which entries were copied from the bank before.
    pub copied: u32,
    /// Checksum of them.
    pub content: u32,
}

/// A copy of a header, or as many bytes, aligned for drivers that move whole words.
#[derive(PartialEq, Eq)]
#[repr(align(4))]
pub struct Copy(pub [u8; COPY as usize]);

impl Copy {
    /// Header of a page to which nothing was written.
    pub fn blank() -> Self {
        Self([ERASED; COPY as usize])
    }

    /// Mark of a slot that is not to be written any more.
    pub fn mark() -> Self {
        Self([0; COPY as usize])
    }
}

impl Header {
    /// Header of the first bank, to which nothing is copied.
    pub fn first() -> Self {
        Self::of_version_1([1, 0, 0, 0])
    }

    /// Header of the bank that follows, to which entries were copied.
    pub fn next(&self, copied: u32, content: u32) -> Self {
        Self {
            sequence: self.sequence.wrapping_add(1),
            copied,
            content,
        }
    }

    /// Checks whether this header was made after another.
    pub fn follows(&self, other: &Self) -> bool {
        self.sequence.wrapping_sub(other.sequence).cast_signed() > 0
    }

    fn of_version_1(sequence: [u8; 4]) -> Self {
        Self {
            sequence: u32::from_le_bytes(sequence),
            copied: 0,
            content: NO_CONTENT,
        }
    }

    /// Reads a copy of a header, if it is whole.
    pub fn of(copy: &Copy) -> Option<Self> {
        let ([magic, sequence, copied, content, ..], _) = copy.0.as_chunks::<4>() else {
            return None;
        };
        let header = match *magic {
            MAGIC => Self {
                sequence: u32::from_le_bytes(*sequence),
                copied: u32::from_le_bytes(*copied),
                content: u32::from_le_bytes(*content),
            },
            MAGIC_1 => Self::of_version_1(*sequence),
            _ => return None,
        };
        (*copy == header.copy_of(*magic)).then_some(header)
    }

    /// A copy of it, as it is written today.
    pub fn copy(&self) -> Copy {
        self.copy_of(MAGIC)
    }

    /// A copy of it. In version 1 the checksum follows the sequence.
    fn copy_of(&self, magic: [u8; 4]) -> Copy {
        let numbers = [self.sequence, self.copied, self.content].map(u32::to_le_bytes);
        let [sequence, copied, content] = numbers;
        let covered = if magic == MAGIC_1 { 2 } else { 4 };
        let mut copy = Copy::blank();
        let words = [magic, sequence, copied, content].into_iter().take(covered);
        let places = copy.0.as_chunks_mut().0.iter_mut();
        places.zip(words).for_each(|(place, word)| *place = word);
        copy.0.get_mut(..4 * covered + CHECKSUM).and_then(sign);
        copy
    }
}

/// The checksum of entries and that of one more slot, which is none where nothing whole stands there.
pub fn with_entry(content: u32, signature: [u8; CHECKSUM]) -> u32 {
    checksum(0, [content.to_le_bytes(), signature].as_flattened())
}

/// The signature of a slot that holds no whole entry.
pub const NO_ENTRY: [u8; CHECKSUM] = [0; CHECKSUM];
