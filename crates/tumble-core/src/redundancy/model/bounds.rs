//! Errors that no sound unit has: beyond them one is out, by those without it.

use super::table::{BLOCK_SECONDS, BOUND_SIGMAS, CLEAR};
use super::test::Exceedance;
use crate::real::{Real, count, real};
use crate::redundancy::components::larger;
use crate::redundancy::sensor::SENSORS;
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<T: Real> {
    /// m/s^2 and rad/s by which others may differ from the primary at rest, and from any unit.
    limits: [[T; 2]; 2],
    odd: Option<u8>,
    blocks: u8,
}

impl<T: Real> Bounds<T> {
    /// No unit is beyond limits yet, of the primary at rest and of any unit, m/s^2 and rad/s.
    pub fn new(limits: [[T; 2]; 2]) -> Self {
        Self {
            limits,
            odd: None,
            blocks: 0,
        }
    }

    /// Compares the errors of all units that count with one another; names the unit that is odd for some blocks, and how far it is off
    /// (docs/theory/set.md, eq. 24).
    #[allow(clippy::cast_possible_truncation)]
    pub fn take<const UNITS: usize>(
        &mut self,
        errors: &[LearntError<T>; UNITS],
        is_active: &[bool; UNITS],
        is_rest: bool,
    ) -> Option<(usize, Exceedance<T>)> {
        let enough = is_active.iter().filter(|active| **active).count() > 2;
        let (mut odd, mut finding) = (None, Exceedance::none());
        for unit in (0..UNITS).filter(|_| enough) {
            let [arming, always] = self.limits;
            let limits = if is_rest && unit == 0 { arming } else { always };
            for (sensor, which) in SENSORS.into_iter().enumerate() {
                if let Some([ratio, apart]) = beyond(unit, sensor, limits[sensor], errors, is_active) {
                    odd = Some(unit as u8);
                    finding = Exceedance {
                        ratio,
                        apart,
                        sensor: which,
                        seconds: real(BLOCK_SECONDS),
                    };
                }
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
        finding.seconds *= count(blocks.into());
        odd.filter(|_| self.blocks >= blocks)
            .map(|unit| (usize::from(unit), finding))
    }
}

/// The smallest ratio to the limit, and difference, of the pairs with a unit, if all of these are beyond it and the others are clearly not.
fn beyond<T: Real, const UNITS: usize>(
    unit: usize,
    sensor: usize,
    limit: T,
    errors: &[LearntError<T>; UNITS],
    is_active: &[bool; UNITS],
) -> Option<[T; 2]> {
    let mut left = [T::zero(); UNITS];
    let mut least: Option<[T; 2]> = None;
    for [i, j] in pairs::<UNITS>() {
        let (Some(first), Some(second)) = (errors.get(i), errors.get(j)) else {
            continue;
        };
        if is_active.get(i) != Some(&true) || is_active.get(j) != Some(&true) {
            continue;
        }
        let [ratio, difference] = apart(first, second, sensor, limit);
        if (i == unit || j == unit) && least.is_none_or(|[least, _]| ratio < least) {
            least = Some([ratio, difference]);
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
        Some(next.map_or(*ratio, |next| if *ratio < next { *ratio } else { next }))
    });
    let [clear, clearer, _] = CLEAR.map(real::<T>);
    let is_clear = own < clear && next.is_some_and(|next| own < clearer * next);
    least.filter(|[least, _]| *least > T::one() && is_clear)
}

/// Difference of two errors over its limit, and the difference, m/s^2 or rad/s.
fn apart<T: Real>(first: &LearntError<T>, second: &LearntError<T>, sensor: usize, limit: T) -> [T; 2] {
    let (sigmas, _) = BOUND_SIGMAS;
    let (mut square, mut variance) = (T::zero(), T::zero());
    for axis in 0..3 {
        let error = first.error[sensor][axis] - second.error[sensor][axis];
        square += error * error;
        variance += first.variance[sensor][axis] + second.variance[sensor][axis];
    }
    let limit = limit * limit + real::<T>(sigmas * sigmas) * variance;
    [square / limit, square].map(Real::square_root)
}
