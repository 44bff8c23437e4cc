//! Harmonics of the accelerometer over heading, as the triangle of a linear least-squares problem.
//!
//! While a robot turns on the spot its specific force is linear in a handful of known functions, and the triangle of
//! these (with the right-hand sides of the three axes) is all that any later fit, however nonlinear in physical
//! quantities, needs to know (docs/theory/spin.md, eq. 9).

use nalgebra::{SVector, Vector3};

use crate::products::{combined, squared, total, zeros};
use crate::real::{Real, count, real};
use crate::spin::block::Block;

/// `[1, C, S, h s, h c, t s, t c, w^2, dw/dt]`, with `c`, `s` cosine and sine of the heading as it was counted, `h` that
/// heading, `t` time, and `C = c + k s`, `S = s - k c` freed of the correction `k` that was added to it.
pub const FUNCTIONS: usize = 9;

/// The functions over one row, and the specific force, m/s^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HarmonicRow<T: Real> {
    /// The functions of eq. 9.
    pub functions: SVector<T, FUNCTIONS>,
    /// Specific force, case frame, m/s^2.
    pub specific_force: Vector3<T>,
}

/// Weight of a block over its length.
#[derive(Clone, Copy)]
enum Weight {
    /// From nothing to one.
    Rising,
    /// One.
    Even,
    /// From one to nothing.
    Falling,
}

impl<T: Real> HarmonicRow<T> {
    /// Row of one block; its neighbours are needed for the angular acceleration, which is left at zero.
    pub fn of_block(block: &Block<T>) -> Self {
        Self::weighted(block, Weight::Even)
    }

    /// Row of three successive blocks, the first weighted from nothing to one and the last from one to nothing: by
    /// these very weights the change of the mean rate from the first to the last is the mean angular acceleration
    /// (docs/theory/spin.md, eq. 10). Each counts by its length, since one that a rest cut off is short.
    pub fn of_three([first, middle, last]: [&Block<T>; 3]) -> Self {
        let half = real::<T>(0.5);
        let span = (first.duration() + last.duration()) * half + middle.duration(); // eq. 10: 2 T
        let mut row = Self::none();
        row.add(&Self::weighted(first, Weight::Rising), first.duration() / span);
        row.add(&Self::weighted(middle, Weight::Even), middle.duration() / span);
        row.add(&Self::weighted(last, Weight::Falling), last.duration() / span);
        row.functions[FUNCTIONS - 1] = (last.rate - first.rate) / span; // eq. 10
        row
    }

    fn none() -> Self {
        Self {
            functions: zeros(),
            specific_force: zeros(),
        }
    }

    /// Adds a share of another row.
    #[inline(never)]
    fn add(&mut self, row: &Self, share: T) {
        let [functions] = &mut self.functions.data.0;
        for (sum, value) in functions.iter_mut().zip(row.functions.as_slice()) {
            *sum += *value * share;
        }
        self.specific_force = combined(&[(&self.specific_force, T::one()), (&row.specific_force, share)]);
    }

    #[inline(never)]
    fn weighted(block: &Block<T>, weight: Weight) -> Self {
        let slope = T::one() / block.duration();
        let (share, slope) = match weight {
            Weight::Rising => (real(0.5), slope),
            Weight::Even => (T::one(), T::zero()),
            Weight::Falling => (real(0.5), -slope),
        };
        let [fx, fy, fz, of_cosine, of_sine, of_square] = block.levers;
        let c = block.cosine * share + of_cosine * slope;
        let s = block.sine * share + of_sine * slope;
        let (h, t, k) = (block.heading, block.time, block.correction);
        Self {
            functions: SVector::from([
                share,
                c + k * s, // eq. 9
                s - k * c, // eq. 9
                h * s,     // eq. 9
                h * c,     // eq. 9
                t * s,     // eq. 9
                t * c,     // eq. 9
                block.rate_squared * share + of_square * slope,
                T::zero(),
            ]),
            specific_force: block.specific_force() * share + Vector3::new(fx, fy, fz) * slope,
        }
    }
}

/// Frees successive rows of the noise they share: the block that falls in one rises in the next
/// (docs/theory/spin.md, eq. 11).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowWhitener<T: Real> {
    before: Option<HarmonicRow<T>>,
}

/// `(1 - sqrt(1 - 4 rho^2)) / (2 rho)`, for rows correlated by `rho` = 1/10.
const SHARED: f64 = 0.101_020_514_433_643_8; // eq. 11

impl<T: Real> RowWhitener<T> {
    /// Before the first row.
    pub fn new() -> Self {
        Self { before: None }
    }

    /// Adds a row; returns the part of it that those before it do not predict.
    pub fn push(&mut self, row: &HarmonicRow<T>) -> HarmonicRow<T> {
        let shared = real::<T>(SHARED);
        let mut own = *row;
        if let Some(before) = &self.before {
            own.add(before, -shared); // eq. 11
        }
        self.before = Some(own);
        own
    }

    /// The next row shares nothing with the one before.
    pub fn end_run(&mut self) {
        self.before = None;
    }
}

impl<T: Real> Default for RowWhitener<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Rows reduced to their triangle by Givens rotations (Golub and Van Loan, section 6.5.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonics<T: Real> {
    /// Row by row, as is the other.
    triangle: [[T; FUNCTIONS]; FUNCTIONS],
    right: [[T; 3]; FUNCTIONS],
    squares: Vector3<T>,
    rows: u32,
}

impl<T: Real> Default for Harmonics<T> {
    fn default() -> Self {
        Self {
            triangle: [[T::zero(); FUNCTIONS]; FUNCTIONS],
            right: [[T::zero(); 3]; FUNCTIONS],
            squares: zeros(),
            rows: 0,
        }
    }
}

impl<T: Real> Harmonics<T> {
    /// Forgets all rows.
    #[inline(never)]
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Takes in one row.
    pub fn push(&mut self, row: &HarmonicRow<T>) {
        self.rows = self.rows.saturating_add(1);
        let ([mut functions], [mut force]) = (row.functions.data.0, row.specific_force.data.0);
        for i in 0..FUNCTIONS {
            if functions[i] == T::zero() {
                continue;
            }
            let length =
                (self.triangle[i][i] * self.triangle[i][i] + functions[i] * functions[i]).square_root();
            let (cosine, sine) = (self.triangle[i][i] / length, functions[i] / length);
            for j in i..FUNCTIONS {
                let (above, below) = (self.triangle[i][j], functions[j]);
                self.triangle[i][j] = cosine * above + sine * below;
                functions[j] = cosine * below - sine * above;
            }
            for axis in 0..3 {
                let (above, below) = (self.right[i][axis], force[axis]);
                self.right[i][axis] = cosine * above + sine * below;
                force[axis] = cosine * below - sine * above;
            }
        }
        let force = Vector3::from(force);
        self.squares += force.component_mul(&force);
    }

    /// Rows taken in.
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// Lines of the triangle and of the right-hand sides.
    pub fn lines(&self) -> impl Iterator<Item = (&[T; FUNCTIONS], &[T; 3])> {
        self.triangle.iter().zip(&self.right)
    }

    /// Variance of a row about the free fit, each axis, (m/s^2)^2; `None` where too few rows are left over.
    ///
    /// Where the axes differ by no more than chance makes them, they share one variance: few rows give that of
    /// an axis too poorly to weight axes by it.
    ///
    /// Residuals are divided by it, and intervals made of it as if it were known: with two degrees of freedom less
    /// their squares are on average one all the same, and the intervals hold as often as they state.
    pub fn variance(&self) -> Option<Vector3<T>> {
        // Times chance, over two ways in which three axes differ: once in twenty, and once in a thousand.
        const UNUSUAL: f64 = 3.0;
        const UNLIKELY: f64 = 7.0;
        self.freedom().map(|freedom| {
            let own = self.squares / count::<T>(freedom.saturating_sub(2)); // eq. 14
            let shared = total(&self.squares) / count((3 * freedom).saturating_sub(2));
            let differ = squared(&own.map(|own| own - shared)) * count::<T>(freedom);
            let times_chance = differ / (shared * shared * real(4.0));
            let beyond = (times_chance - real(UNUSUAL)) / real(UNLIKELY - UNUSUAL);
            // Without any noise it is no number.
            let apart = if beyond > T::zero() {
                beyond.min(T::one())
            } else {
                T::zero()
            };
            own.map(|own| shared + (own - shared) * apart) // eq. 25
        })
    }

    /// Rows left over beyond the functions, that variance is found with; `None` where they are too few.
    pub fn freedom(&self) -> Option<u32> {
        const FEWEST: u32 = 6;
        self.rows.checked_sub(9).filter(|left| *left >= FEWEST)
    }
}
