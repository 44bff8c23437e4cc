//! Vote of three and more: the unit, or the fewest units, without which the others agree.

use super::table::{CLEAR, COUNT};
use super::test::{Exceedance, PairComparison, norm};
use crate::real::{Real, real};
use crate::redundancy::components::larger;
use crate::redundancy::sensor::SENSORS;
use crate::redundancy::unit_set::{UnitSet, pairs};

/// Units that were odd in a window, and the largest deviation of a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Odd<T: Real> {
    units: UnitSet,
    deviation: [T; 3],
}

/// Findings of each scale and sensor in the window before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vote<T: Real> {
    before: [[Odd<T>; 2]; COUNT],
}

/// The units that a window names, and what names them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Named<T: Real> {
    /// One unit, or several of five and more.
    pub units: UnitSet,
    /// Largest ratio of a pair.
    pub finding: Exceedance<T>,
}

impl<T: Real> Vote<T> {
    /// Begins without a finding.
    pub fn new() -> Self {
        let none = Odd {
            units: UnitSet::default(),
            deviation: [T::zero(); 3],
        };
        Self {
            before: [[none; 2]; COUNT],
        }
    }

    /// Takes the comparisons of all pairs over one scale, of which those of `active` units count, and names the units that are odd
    /// now as in the window before, unless `best` is named by a larger ratio (docs/theory/set.md, eq. 21 and 21a).
    pub fn take<const UNITS: usize>(
        &mut self,
        scale: usize,
        compared: &[PairComparison<T>],
        active: UnitSet,
        best: Option<Named<T>>,
    ) -> Option<Named<T>> {
        let mut best = best;
        let Some(before) = self.before.get_mut(scale) else {
            return best;
        };
        for (sensor, before) in SENSORS.into_iter().zip(before) {
            let judged = || {
                let all = pairs::<UNITS>().zip(compared);
                all.filter(|(pair, _)| active.contain_both(*pair))
            };
            let mut worst = T::zero();
            let mut deviation = compared
                .first()
                .map_or([T::zero(); 3], |first| *sensor.of(&first.deviation));
            for (_, found) in judged() {
                let ratio = *sensor.of(&found.ratio);
                if ratio > worst {
                    (worst, deviation) = (ratio, *sensor.of(&found.deviation));
                }
            }
            // A deviation beyond the limit of one pair is no agreement in another.
            let in_limits = worst / larger(norm(&deviation), T::default_epsilon());
            let ratios = || {
                judged().map(|(pair, found)| {
                    let own = *sensor.of(&found.ratio);
                    let is_known = own > T::zero();
                    let limited = larger(own, in_limits * norm(sensor.of(&found.deviation)));
                    (pair, if is_known { limited } else { own })
                })
            };
            let mut left = [T::zero(); UNITS];
            for (pair, ratio) in ratios() {
                for (_, left) in left
                    .iter_mut()
                    .enumerate()
                    .filter(|(unit, _)| !pair.contains(unit))
                {
                    *left = larger(*left, ratio);
                }
            }
            let odd = match odd_one(&left, worst) {
                Some(unit) => UnitSet::of::<UNITS>(|number| number == unit),
                None if worst > T::one() => odd_several(active, ratios),
                None => UnitSet::default(),
            };
            if odd.count() > 0
                && odd == before.units
                && is_steady(&deviation, &before.deviation)
                && best.as_ref().is_none_or(|best| worst > best.finding.ratio)
            {
                best = Some(Named {
                    units: odd,
                    finding: Exceedance::of(worst, &deviation, sensor, scale),
                });
            }
            *before = Odd {
                units: odd,
                deviation,
            };
        }
        best
    }
}

impl<T: Real> Default for Vote<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// The unit without which the largest ratio is clear, and clearly less than without any other one.
pub fn odd_one<T: Real, const UNITS: usize>(left: &[T; UNITS], worst: T) -> Option<usize> {
    let (mut unit, mut best, mut next) = (0, None, None);
    for (number, ratio) in left.iter().enumerate() {
        match best {
            Some(least) if *ratio >= least => {
                if next.is_none_or(|next| *ratio < next) {
                    next = Some(*ratio);
                }
            }
            _ => (unit, next, best) = (number, best, Some(*ratio)),
        }
    }
    let [clear, clearer, _] = CLEAR.map(real::<T>);
    let (best, next) = (best?, next?);
    (worst > T::one() && best < clear && best < clearer * next).then_some(unit)
}

/// The fewest units, two and more, without which the rest agree, more than half of all: clearly, and clearly better than without
/// any others as many. Each of them disagrees with each of the rest (docs/theory/set.md, eq. 21a).
#[inline(never)]
fn odd_several<T: Real, I>(active: UnitSet, ratios: impl Fn() -> I) -> UnitSet
where
    I: Iterator<Item = ([usize; 2], T)>,
{
    let [clear, clearer, _] = CLEAR.map(real::<T>);
    for count in 2..=active.count().saturating_sub(1) / 2 {
        let (mut units, mut best, mut next) = (UnitSet::default(), None, None);
        for some in active.choose(count) {
            let rest = active.without(some);
            let (mut left, mut is_apart) = (T::zero(), true);
            for (pair, ratio) in ratios() {
                if rest.contain_both(pair) {
                    left = larger(left, ratio);
                    // Means that are not usable are no agreement.
                    is_apart &= ratio > T::zero();
                } else if !some.contain_both(pair) {
                    is_apart &= ratio > T::one();
                }
            }
            if is_apart && best.is_none_or(|best| left < best) {
                next = smallest(next, best);
                (units, best) = (some, Some(left));
            } else {
                next = smallest(next, Some(left));
            }
        }
        if let (Some(best), Some(next)) = (best, next)
            && best < clear
            && best < clearer * next
        {
            return units;
        }
    }
    UnitSet::default()
}

/// The smaller of two numbers, of those that are there.
fn smallest<T: Real>(one: Option<T>, other: Option<T>) -> Option<T> {
    match (one, other) {
        (Some(one), Some(other)) => Some(if other < one { other } else { one }),
        _ => one.or(other),
    }
}

/// Tests whether two deviations point one way.
fn is_steady<T: Real>([a, b, c]: &[T; 3], [x, y, z]: &[T; 3]) -> bool {
    let along = *a * *x + *b * *y + *c * *z;
    let squares = (*a * *a + *b * *b + *c * *c) * (*x * *x + *y * *y + *z * *z);
    let [_, _, steady] = CLEAR;
    along > real::<T>(steady) * squares.square_root()
}
