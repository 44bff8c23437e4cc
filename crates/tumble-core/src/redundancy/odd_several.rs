//! Several faults at once: the fewest units without which the rest, more than half of all, agree.

use crate::real::Real;
use crate::redundancy::components::{larger, smaller};
use crate::redundancy::unit_set::UnitSet;

/// Returns the fewest units, of two and more, that each of the rest contradicts; none where fewer than five are left to compare.
///
/// `ratios` gives the deviation of each pair over its limit, or its square; `None` where none was compared. The rest agree within
/// `agrees`, and within `better` of what any others as many would leave (docs/theory/set.md, eq. 21a).
#[inline(never)]
pub fn odd_several<T: Real, I>(units: UnitSet, ratios: impl Fn() -> I, [agrees, better]: [T; 2]) -> UnitSet
where
    I: Iterator<Item = ([usize; 2], Option<T>)>,
{
    for count in 2..=units.count().saturating_sub(1) / 2 {
        let (mut odd, mut best, mut next) = (UnitSet::default(), None, None);
        for some in units.choose(count) {
            let rest = units.without(some);
            let (mut left, mut is_apart) = (T::zero(), true);
            for (pair, ratio) in ratios() {
                if rest.contain_both(pair) {
                    left = larger(left, ratio.unwrap_or(T::zero()));
                    // Units that were not compared do not agree.
                    is_apart &= ratio.is_some();
                } else if !some.contain_both(pair) {
                    is_apart &= ratio.is_some_and(|ratio| ratio > T::one());
                }
            }
            if is_apart && best.is_none_or(|best| left < best) {
                next = least(next, best);
                (odd, best) = (some, Some(left));
            } else {
                next = least(next, Some(left));
            }
        }
        if let (Some(best), Some(next)) = (best, next)
            && best < agrees
            && best < better * next
        {
            return odd;
        }
    }
    UnitSet::default()
}

/// The smaller of two numbers, of those that are there.
fn least<T: Real>(one: Option<T>, other: Option<T>) -> Option<T> {
    match (one, other) {
        (Some(one), Some(other)) => Some(smaller(one, other)),
        _ => one.or(other),
    }
}
