//! Random input: numbers, times and bytes, the worst of them more often than by chance.

use std::collections::VecDeque;
use std::convert::Infallible;

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng, TryRng};
use rand_pcg::Pcg64Mcg;

/// Numbers at the edges of single precision, and those whose squares and products leave it.
const EXTREMES: [f32; 20] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    1e-45,
    f32::EPSILON,
    0.0,
    -0.0,
    1.0,
    -1.0,
    1.9e19,
    -1.9e19,
    1e-20,
    1e30,
    -1e30,
    16_777_216.0,
    1e12,
];

/// Times and lengths of time at the edges of counters, and about those that settings name.
const EDGES: [u64; 18] = [
    0,
    1,
    2,
    999,
    1000,
    50_000,
    100_000,
    250_000,
    999_999,
    1_000_000,
    600_000_000,
    1 << 31,
    (1 << 32) - 1,
    1 << 40,
    1 << 53,
    (1 << 63) - 1,
    1 << 63,
    u64::MAX,
];

/// Where randomness comes from.
#[derive(Clone)]
enum Source {
    Seed(Pcg64Mcg),
    /// Bytes still to be taken, and what goes on where they end.
    Input(VecDeque<u8>, Pcg64Mcg),
}

/// All that is random in one run.
#[derive(Clone)]
pub struct FuzzDraw(Source);

impl FuzzDraw {
    /// Everything follows from the seed, on every machine alike.
    pub fn new(seed: u64) -> Self {
        Self(Source::Seed(Pcg64Mcg::seed_from_u64(seed)))
    }

    /// Everything follows from bytes, of which each draw takes the next, so that who chooses them chooses what is drawn. After
    /// them the run goes on as one of a seed.
    pub fn of_input(bytes: &[u8]) -> Self {
        Self(Source::Input(
            bytes.iter().copied().collect(),
            Pcg64Mcg::seed_from_u64(0),
        ))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.random()
    }

    /// A byte.
    pub fn byte(&mut self) -> u8 {
        match &mut self.0 {
            Source::Seed(random) => random.random(),
            Source::Input(bytes, rest) => bytes.pop_front().unwrap_or_else(|| rest.random()),
        }
    }

    /// A whole number from 0 up to below `end`, which is above zero.
    pub fn below(&mut self, end: usize) -> usize {
        match &mut self.0 {
            Source::Input(bytes, _) if !bytes.is_empty() && end <= 256 => usize::from(self.byte()) % end,
            source => source.random_range(0..end),
        }
    }

    /// True once in `of` times.
    pub fn once_in(&mut self, of: usize) -> bool {
        self.below(of) == 0
    }

    /// One of several.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// One of several, to be changed.
    pub fn among<'t, T>(
        &mut self,
        of: impl IntoIterator<Item = &'t mut T, IntoIter: ExactSizeIterator>,
    ) -> &'t mut T {
        let mut of = of.into_iter();
        let chosen = self.below(of.len());
        of.nth(chosen).expect("it is below their number")
    }

    /// A number as sensors and people give them, up to `size` either way.
    pub fn usual(&mut self, size: f32) -> f32 {
        self.0.random_range(-size..size)
    }

    /// Any number, the worst among them.
    pub fn number(&mut self) -> f32 {
        match self.below(4) {
            0 => self.usual(20.0),
            1 => f32::from_bits(self.0.random()),
            2 => self.pick(&EXTREMES) * self.usual(1.0),
            _ => self.pick(&EXTREMES),
        }
    }

    /// Any time, the worst among them.
    pub fn time(&mut self) -> u64 {
        match self.below(4) {
            0 => self.bits(),
            1 => self.bits() >> self.below(64),
            2 => self.pick(&EDGES).wrapping_add(self.pick(&EDGES)),
            _ => self.pick(&EDGES),
        }
    }

    /// Three of any number.
    pub fn vector(&mut self) -> Vector3<f32> {
        Vector3::from_fn(|_, _| self.number())
    }

    /// A rotation, up to rounding.
    pub fn rotation(&mut self) -> Matrix3<f32> {
        let about = |axis: usize, angle: f32| {
            let (s, c) = angle.sin_cos();
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut r = Matrix3::identity();
            (r[(i, i)], r[(i, j)], r[(j, i)], r[(j, j)]) = (c, -s, s, c);
            r
        };
        (0..3).fold(Matrix3::identity(), |r, axis| r * about(axis, self.usual(3.2)))
    }

    /// Overwrites some elements of a matrix or vector with any number.
    pub fn spoil<'n>(&mut self, numbers: impl IntoIterator<Item = &'n mut f32>) {
        for number in numbers {
            if self.once_in(4) {
                *number = self.number();
            }
        }
    }
}

impl TryRng for Source {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        let mut bytes = [0; 4];
        self.try_fill_bytes(&mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        let mut bytes = [0; 8];
        self.try_fill_bytes(&mut bytes)?;
        Ok(u64::from_le_bytes(bytes))
    }

    fn try_fill_bytes(&mut self, filled: &mut [u8]) -> Result<(), Infallible> {
        match self {
            Self::Seed(random) => random.try_fill_bytes(filled),
            Self::Input(bytes, rest) => {
                rest.try_fill_bytes(filled)?;
                let taken = bytes.len().min(filled.len());
                for (place, byte) in filled.iter_mut().zip(bytes.drain(..taken)) {
                    *place = byte;
                }
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_drawn_as_they_come_and_then_as_of_a_seed() {
        let mut draw = FuzzDraw::of_input(&[7, 6, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
        assert_eq!((draw.byte(), draw.below(4)), (7, 2));
        assert_eq!(draw.bits(), u64::from_le_bytes([1, 2, 3, 4, 5, 6, 7, 8]));
        assert_eq!(draw.byte(), 9);
        let mut other = FuzzDraw::of_input(&[0; 11]);
        other.byte();
        other.below(4);
        other.bits();
        other.byte();
        let rest = |draw: &mut FuzzDraw| [draw.bits(), draw.below(1000) as u64, u64::from(draw.byte())];
        assert_eq!(
            rest(&mut draw),
            rest(&mut other),
            "what follows does not depend on what was chosen"
        );
    }
}
