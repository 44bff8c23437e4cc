//! Isolation among three or more units: the faulty one is that without which the others agree.

use crate::real::{Real, real};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::unit_set::{UnitSet, pairs};

/// Largest ratio of difference to threshold at which the remaining units agree.
const REST_AGREES: f64 = 0.8;

/// Largest ratio of the remaining difference to that without any other unit.
const BETTER: f64 = 0.6;

/// Successive windows, over each scale, that must isolate the same unit before it is excluded.
pub const DWELL: [u8; 4] = [3, 3, 8, 20];

/// Result of comparing all pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No pair disagrees.
    Agreement,
    /// Without this unit, all agree.
    Odd(u8),
    /// Pairs disagree, and several units may be the reason; these two disagree most.
    Ambiguous(u8, u8),
}

/// Finds the odd one among voters. `squared` returns the squared ratio of difference to threshold of a pair of
/// voters (docs/theory/isolation.md, eq. 9 and 10).
#[inline(never)]
pub fn isolate<T: Real, const UNITS: usize>(
    voters: UnitSet,
    squared: &dyn Fn([usize; 2]) -> Option<T>,
) -> Finding {
    let (mut worst, mut worst_pair) = (T::zero(), [0, 0]);
    let mut without = [T::zero(); UNITS];
    for pair in pairs::<UNITS>().filter(|pair| voters.contain_both(*pair)) {
        let Some(ratio) = squared(pair) else { continue };
        if ratio > worst {
            (worst, worst_pair) = (ratio, pair);
        }
        for (unit, most) in without.iter_mut().enumerate() {
            if !pair.contains(&unit) {
                *most = larger(*most, ratio); // eq. 9
            }
        }
    }
    if worst <= T::one() {
        return Finding::Agreement;
    }
    let [i, j] = worst_pair.map(number);
    let ambiguous = Finding::Ambiguous(i, j);
    if voters.count() < 3 {
        return ambiguous;
    }
    let mut ranked = without
        .iter()
        .enumerate()
        .filter(|(unit, _)| voters.contains(*unit));
    let Some((mut best, first)) = ranked.next() else {
        return ambiguous;
    };
    let (mut least, mut second) = (*first, real::<T>(f64::INFINITY));
    for (unit, most) in ranked {
        if *most < least {
            (best, second, least) = (unit, least, *most);
        } else {
            second = smaller(second, *most);
        }
    }
    if least < real(REST_AGREES * REST_AGREES) && least < second * real(BETTER * BETTER) {
        Finding::Odd(number(best)) // eq. 10
    } else {
        ambiguous
    }
}

/// Converts the number of a unit, which always fits a byte.
fn number(unit: usize) -> u8 {
    u8::try_from(unit).unwrap_or(u8::MAX)
}
