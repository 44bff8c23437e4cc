//! Three units and more: the one without which the others agree.

use crate::real::{Real, real};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::unit_set::{UnitSet, pairs};

/// The rest agrees without the faulty one if no pair of it is beyond this share of its threshold.
const REST_AGREES: f64 = 0.8;

/// And by so much better than without any other.
const BETTER: f64 = 0.6;

/// Successive windows, over each scale, that name the same unit before it is believed.
pub const DWELL: [u8; 4] = [3, 3, 8, 20];

/// What all pairs together say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No pair disagrees.
    Agreement,
    /// Without this unit, all agree.
    Odd(u8),
    /// Pairs disagree, and more than one unit may be the reason; these two the most.
    Ambiguous(u8, u8),
}

/// Finds the odd one among voters. `squared` gives the square of how far a pair of two different voters is apart, over what it may be
/// (docs/theory/judgement.md, eq. 9 and 10).
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

/// Units are fewer than fit a byte.
fn number(unit: usize) -> u8 {
    u8::try_from(unit).unwrap_or(u8::MAX)
}
