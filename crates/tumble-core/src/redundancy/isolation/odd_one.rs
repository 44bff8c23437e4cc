//! Isolation among three or more units: the faulty one, or the fewest, is that without which the others agree.

use crate::real::{Real, real};
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::odd_several::odd_several;
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
    /// Without these units, a bit each, all agree.
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
    let limits = [REST_AGREES * REST_AGREES, BETTER * BETTER].map(real::<T>);
    let [agrees, better] = limits;
    let odd = if least < agrees && least < second * better {
        UnitSet::of::<UNITS>(|unit| unit == best) // eq. 10
    } else {
        let judged = || pairs::<UNITS>().filter(|pair| voters.contain_both(*pair));
        odd_several(voters, || judged().map(|pair| (pair, squared(pair))), limits)
    };
    if odd.count() > 0 {
        Finding::Odd(odd.bits())
    } else {
        ambiguous
    }
}

/// Converts the number of a unit, which always fits a byte.
fn number(unit: usize) -> u8 {
    u8::try_from(unit).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Squared ratios of five units of which some deviate, each by itself.
    fn of_five(apart: [f32; 5]) -> Finding {
        let squared = |[i, j]: [usize; 2]| Some((apart[i] - apart[j]).powi(2) + 0.01);
        isolate::<f32, 5>(UnitSet::of::<5>(|_| true), &squared)
    }

    #[test]
    fn three_that_agree_name_two_of_five() {
        assert_eq!(of_five([0.0, 0.1, 0.0, 0.1, 0.0]), Finding::Agreement);
        assert_eq!(of_five([0.0, 3.0, 0.0, 0.1, 0.0]), Finding::Odd(0b00010));
        assert_eq!(of_five([3.0, -3.0, 0.0, 0.1, 0.0]), Finding::Odd(0b00011));
        assert_eq!(of_five([0.0, 3.0, 0.0, 0.1, 3.1]), Finding::Odd(0b10010));
        assert_eq!(of_five([0.0, 3.0, 6.0, 0.1, -3.0]), Finding::Ambiguous(2, 4));
        assert_eq!(of_five([0.0, 3.0, 0.0, 0.9, 0.0]), Finding::Ambiguous(0, 1));
    }

    #[test]
    fn no_two_of_four_are_named() {
        let apart = [3.0_f32, -3.0, 0.0, 0.1];
        let squared = |[i, j]: [usize; 2]| Some((apart[i] - apart[j]).powi(2) + 0.01);
        let found = isolate::<f32, 4>(UnitSet::of::<4>(|_| true), &squared);
        assert_eq!(found, Finding::Ambiguous(0, 1));
    }
}
