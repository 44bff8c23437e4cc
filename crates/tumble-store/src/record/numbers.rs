//! Numbers of single precision, one after the other.

use nalgebra::{convert, convert_unchecked};
use tumble_core::real::Real;

/// Bytes of a number.
pub const NUMBER: usize = 4;

/// Numbers as they are on the wire.
pub type Words = [[u8; NUMBER]];

/// The elements of a matrix in memory, which has them column by column, in their order on the wire: row by row.
const ROW_BY_ROW: [usize; 9] = [0, 3, 6, 1, 4, 7, 2, 5, 8];

/// Where the element of vectors, or of a matrix, is that comes next on the wire.
fn in_memory(count: usize, element: usize) -> usize {
    let of_matrix = ROW_BY_ROW.get(element).filter(|_| count == ROW_BY_ROW.len());
    of_matrix.copied().unwrap_or(element)
}

/// The numbers of a record from an offset up to an end.
pub fn words(bytes: &[u8], from: usize, to: usize) -> &Words {
    bytes.get(from..to).unwrap_or_default().as_chunks().0
}

/// The same, to be written.
pub fn words_mut(bytes: &mut [u8], from: usize, to: usize) -> &mut Words {
    bytes.get_mut(from..to).unwrap_or_default().as_chunks_mut().0
}

/// Writes vectors and matrices of either precision.
pub fn write<T: Real>(words: &mut Words, parts: &[&[T]]) {
    let mut words = words.iter_mut();
    for part in parts {
        for element in 0..part.len() {
            let number = part.get(in_memory(part.len(), element));
            if let (Some(number), Some(word)) = (number, words.next()) {
                *word = convert_unchecked::<T, f32>(*number).to_le_bytes();
            }
        }
    }
}

/// Reads vectors and matrices in either precision; those for which there are no words stay as they are.
pub fn read<T: Real>(words: &Words, parts: &mut [&mut [T]]) {
    let mut words = words.iter();
    for part in parts {
        for element in 0..part.len() {
            let number = part.get_mut(in_memory(part.len(), element));
            if let (Some(number), Some(word)) = (number, words.next()) {
                *number = convert(f32::from_le_bytes(*word));
            }
        }
    }
}
