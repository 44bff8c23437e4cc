//! Errors that no sound unit has: beyond them one is out, by those without it.

use super::table::{BOUND_SIGMAS, BOUNDS, CLEAR};
use crate::real::{Real, real};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::unit_set::pairs;

/// Error of a unit along a motion, m/s^2 and rad/s, and the variance of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearntError<T: Real> {
    /// By sensor and axis.
    pub error: [[T; 3]; 2],
    /// By sensor and axis.
    pub variance: [[T; 3]; 2],
}

/// Unit beyond its bounds, and for how many blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bounds {
    odd: Option<u8>,
    blocks: u8,
}

impl Bounds {
    /// Compares the errors of all units that count with one another; names the unit that is odd for some blocks
    /// (docs/theory/set.md, eq. 24).
    #[allow(clippy::cast_possible_truncation)]
    pub fn take<T: Real, const UNITS: usize>(
        &mut self,
        errors: &[LearntError<T>; UNITS],
        is_active: &[bool; UNITS],
        is_rest: bool,
    ) -> Option<usize> {
        let enough = is_active.iter().filter(|active| **active).count() > 2;
        let mut odd = None;
        for unit in (0..UNITS).filter(|_| enough) {
            let [arming, always] = BOUNDS;
            let limits = if is_rest && unit == 0 { arming } else { always };
            if (0..2).any(|sensor| is_odd(unit, sensor, limits[sensor], errors, is_active)) {
                odd = Some(unit as u8);
            }
        }
        let is_same = odd.is_some() && odd == self.odd;
        self.blocks = if is_same {
            self.blocks.saturating_add(1)
        } else {
            u8::from(odd.is_some())
        };
        self.odd = odd;
        let (_, blocks) = BOUND_SIGMAS;
        odd.filter(|_| self.blocks >= blocks).map(usize::from)
    }
}

/// Tests whether all pairs with a unit are beyond the limit, and the others are clearly not.
fn is_odd<T: Real, const UNITS: usize>(
    unit: usize,
    sensor: usize,
    limit: f64,
    errors: &[LearntError<T>; UNITS],
    is_active: &[bool; UNITS],
) -> bool {
    let mut left = [T::zero(); UNITS];
    let mut least = None;
    for [i, j] in pairs::<UNITS>() {
        let (Some(first), Some(second)) = (errors.get(i), errors.get(j)) else {
            continue;
        };
        if is_active.get(i) != Some(&true) || is_active.get(j) != Some(&true) {
            continue;
        }
        let ratio = apart(first, second, sensor, limit);
        if i == unit || j == unit {
            least = Some(least.map_or(ratio, |least| smaller(least, ratio)));
        }
        for (_, left) in left
            .iter_mut()
            .enumerate()
            .filter(|(number, _)| *number != i && *number != j)
        {
            *left = larger(*left, ratio);
        }
    }
    let own = left.get(unit).copied().unwrap_or(T::zero());
    let others = left.iter().enumerate().filter(|(number, _)| *number != unit);
    let next = others.fold(None, |next: Option<T>, (_, ratio)| {
        Some(next.map_or(*ratio, |next| smaller(next, *ratio)))
    });
    let [clear, clearer, _] = CLEAR.map(real::<T>);
    least.is_some_and(|least| least > T::one())
        && own < clear
        && next.is_some_and(|next| own < clearer * next)
}

/// Difference of two errors over its limit.
fn apart<T: Real>(first: &LearntError<T>, second: &LearntError<T>, sensor: usize, limit: f64) -> T {
    let (sigmas, _) = BOUND_SIGMAS;
    let (mut square, mut variance) = (T::zero(), T::zero());
    for axis in 0..3 {
        let error = first.error[sensor][axis] - second.error[sensor][axis];
        square += error * error;
        variance += first.variance[sensor][axis] + second.variance[sensor][axis];
    }
    (square / (real::<T>(limit * limit) + real::<T>(sigmas * sigmas) * variance)).square_root()
}
