//! Square-root information: an upper triangle `R` with right sides `z`, where `R x = z` to within unit noise.
//!
//! Rows are added by Givens rotations, so that single precision holds what is known a million times better than
//! beforehand beside what is not known at all (docs/theory/set.md, eq. 7 to 10).

use crate::real::Real;

/// Triangle of N unknowns with M right sides: row `i` holds `R[i][i..N]`, then `z[i]`. LEN is `N (N + 1) / 2 + N M`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InformationTriangle<T: Real, const N: usize, const M: usize, const LEN: usize> {
    rows: [T; LEN],
}

impl<T: Real, const N: usize, const M: usize, const LEN: usize> InformationTriangle<T, N, M, LEN> {
    /// No information.
    pub fn none() -> Self {
        Self {
            rows: [T::zero(); LEN],
        }
    }

    /// Triangle of its rows.
    pub fn of_rows(rows: &[T; LEN]) -> Self {
        Self { rows: *rows }
    }

    /// Its rows, one after the other.
    pub fn rows(&self) -> &[T; LEN] {
        &self.rows
    }

    /// Independent unknowns, each with a mean for each right side and a standard deviation.
    pub fn independent(means: &[[T; M]; N], sigmas: &[T; N]) -> Self {
        let mut made = Self::none();
        let mut left = made.rows.as_mut_slice();
        for (i, (means, sigma)) in means.iter().zip(sigmas).enumerate() {
            let Some((row, rest)) = left.split_at_mut_checked(N - i + M) else {
                break;
            };
            if let Some(diagonal) = row.first_mut() {
                *diagonal = T::one() / *sigma;
            }
            if let Some((_, right)) = row.split_at_mut_checked(N - i) {
                for (right, mean) in right.iter_mut().zip(means) {
                    *right = *mean / *sigma;
                }
            }
            left = rest;
        }
        made
    }

    /// Adds a row `a . x = y` with unit noise: N elements of `a`, then M of `y`, which are overwritten (eq. 8).
    #[inline(never)]
    pub fn add(&mut self, row: &mut [T]) {
        let mut left = self.rows.as_mut_slice();
        let mut row = row;
        for i in 0..N {
            let Some((above, rest)) = left.split_at_mut_checked(N - i + M) else {
                return;
            };
            rotate(above, row);
            let Some((_, next)) = row.split_first_mut() else {
                return;
            };
            (row, left) = (next, rest);
        }
    }

    /// Adds what another triangle knows; `row` is memory for N + M numbers.
    pub fn add_all(&mut self, other: &Self, row: &mut [T]) {
        let mut left = other.rows.as_slice();
        for i in 0..N {
            let Some((known, rest)) = left.split_at_checked(N - i + M) else {
                return;
            };
            let Some((before, same)) = row.split_at_mut_checked(i) else {
                return;
            };
            before.iter_mut().for_each(|value| *value = T::zero());
            same.iter_mut().zip(known).for_each(|(to, from)| *to = *from);
            self.add(row);
            left = rest;
        }
    }

    /// Lets unknown `which` walk by a standard deviation that is not zero; `row` is memory for N + M numbers (eq. 9).
    #[inline(never)]
    pub fn walk(&mut self, which: usize, sigma: T, row: &mut [T]) {
        row.iter_mut().for_each(|value| *value = T::zero());
        // The step is an unknown of its own, in front of all others, and is left out at the end.
        let mut step = T::one() / sigma;
        let mut left = self.rows.as_mut_slice();
        for i in (0..N).rev() {
            let Some(at) = left.len().checked_sub(N - i + M) else {
                return;
            };
            let Some((rest, known)) = left.split_at_mut_checked(at) else {
                return;
            };
            left = rest;
            if i > which {
                continue;
            }
            let below = known.get(which - i).map_or(T::zero(), |value| -*value);
            if below == T::zero() {
                continue;
            }
            let length = step.hypotenuse_plain(below);
            let (cosine, sine) = (step / length, below / length);
            step = length;
            let Some((_, same)) = row.split_at_mut_checked(i) else {
                return;
            };
            for (top, known) in same.iter_mut().zip(known) {
                let (above, under) = (*top, *known);
                *top = cosine * above + sine * under;
                *known = cosine * under - sine * above;
            }
        }
    }

    /// The unknowns, by right side (eq. 10).
    pub fn solve(&self) -> [[T; M]; N] {
        let mut found = [[T::zero(); M]; N];
        let mut left = self.rows.as_slice();
        for i in (0..N).rev() {
            let Some((rest, row)) = left
                .len()
                .checked_sub(N - i + M)
                .and_then(|at| left.split_at_checked(at))
            else {
                break;
            };
            left = rest;
            let Some((known, right)) = row.split_at_checked(N - i) else {
                break;
            };
            let Some((diagonal, beyond)) = known.split_first() else {
                break;
            };
            let mut value = [T::zero(); M];
            for (value, right) in value.iter_mut().zip(right) {
                *value = *right;
            }
            for (factor, solved) in beyond.iter().zip(found.iter().skip(i + 1)) {
                for (value, solved) in value.iter_mut().zip(solved) {
                    *value -= *factor * *solved;
                }
            }
            if let Some(place) = found.get_mut(i) {
                *place = value.map(|value| value / *diagonal);
            }
        }
        found
    }

    /// Variance `phi' C phi` of a sum of unknowns, of which `phi` is overwritten: `|R^-T phi|^2` (eq. 11).
    #[inline(never)]
    pub fn variance(&self, phi: &mut [T]) -> T {
        let mut left = self.rows.as_slice();
        let mut phi = phi;
        let mut sum = T::zero();
        for i in 0..N {
            let Some((row, rest)) = left.split_at_checked(N - i + M) else {
                break;
            };
            left = rest;
            let Some((factor, next)) = phi.split_first_mut() else {
                break;
            };
            if *factor != T::zero()
                && let Some((diagonal, beyond)) = row.split_first()
            {
                let share = *factor / *diagonal;
                sum += share * share;
                for (value, above) in next.iter_mut().zip(beyond) {
                    *value -= share * *above;
                }
            }
            phi = next;
        }
        sum
    }
}

/// Turns a row under another of which it has the first column, so that its first element vanishes.
fn rotate<T: Real>(above: &mut [T], below: &mut [T]) {
    let (Some(diagonal), Some(first)) = (above.first(), below.first()) else {
        return;
    };
    // Nothing to turn: roots are dear on small processors.
    if *first == T::zero() {
        return;
    }
    let length = diagonal.hypotenuse_plain(*first);
    let (cosine, sine) = (*diagonal / length, *first / length);
    for (above, below) in above.iter_mut().zip(below) {
        let (up, down) = (*above, *below);
        *above = cosine * up + sine * down;
        *below = cosine * down - sine * up;
    }
}

/// Length of two legs.
trait Legs {
    /// `sqrt(x^2 + y^2)` of numbers whose squares are finite.
    fn hypotenuse_plain(self, other: Self) -> Self;
}

impl<T: Real> Legs for T {
    fn hypotenuse_plain(self, other: Self) -> Self {
        (self * self + other * other).square_root()
    }
}
