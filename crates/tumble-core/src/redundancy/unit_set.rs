//! Sets of units, one bit each, and the pairs of units.

/// Set of units, at most 32.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UnitSet(u32);

impl UnitSet {
    /// Set of the primary alone.
    pub const PRIMARY: Self = Self(1);

    /// Creates the set of those of `UNITS` units that meet a condition.
    pub fn of<const UNITS: usize>(is_so: impl Fn(usize) -> bool) -> Self {
        let mut units = Self::default();
        (0..UNITS).filter(|unit| is_so(*unit)).for_each(|unit| {
            units.insert(unit);
        });
        units
    }

    /// Numbers of the units, in order.
    pub fn units(self) -> impl Iterator<Item = usize> {
        let mut left = self.0;
        core::iter::from_fn(move || {
            let next = left.trailing_zeros();
            left &= left.wrapping_sub(1);
            usize::try_from(next).ok().filter(|_| next < u32::BITS)
        })
    }

    /// Returns whether the set contains a unit.
    pub fn contains(self, unit: usize) -> bool {
        self.0 & bit(unit) != 0
    }

    /// Returns whether the set contains both units of a pair.
    pub fn contain_both(self, [i, j]: [usize; 2]) -> bool {
        self.contains(i) && self.contains(j)
    }

    /// Adds a unit.
    pub fn insert(&mut self, unit: usize) {
        self.0 |= bit(unit);
    }

    /// Removes a unit.
    pub fn remove(&mut self, unit: usize) {
        self.0 &= !bit(unit);
    }

    /// Intersection of two sets.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        Self(self.0 & others.0)
    }

    /// Union of two sets.
    #[must_use]
    pub fn or(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Units that are not in the other set.
    #[must_use]
    pub fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// Number of units.
    pub fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// All sets of so many of these units.
    pub fn choose(self, count: u32) -> impl Iterator<Item = Self> {
        let mut next = Some(self.0);
        let all = core::iter::from_fn(move || {
            let now = next?;
            next = (now != 0).then(|| now.wrapping_sub(1) & self.0);
            Some(Self(now))
        });
        all.filter(move |some| some.count() == count)
    }

    /// First eight units, the lowest bit that of unit 0.
    #[allow(clippy::cast_possible_truncation)]
    pub fn bits(self) -> u8 {
        self.0 as u8
    }
}

/// Bit of a unit; zero for numbers beyond 31.
fn bit(unit: usize) -> u32 {
    let number = u32::try_from(unit).ok();
    number.and_then(|number| 1_u32.checked_shl(number)).unwrap_or(0)
}

/// All pairs of `UNITS` units, each once, the unit of the lower number first.
pub fn pairs<const UNITS: usize>() -> impl Iterator<Item = [usize; 2]> {
    let [mut i, mut j] = [0, 1];
    core::iter::from_fn(move || {
        let pair = (j < UNITS).then_some([i, j]);
        i += 1;
        if i >= j {
            [i, j] = [0, j + 1];
        }
        pair
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pair_comes_once() {
        let mut all = pairs::<4>();
        for pair in [[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]] {
            assert_eq!(all.next(), Some(pair));
        }
        assert_eq!(all.next(), None);
        assert_eq!(pairs::<1>().count(), 0);
    }

    #[test]
    fn each_choice_comes_once() {
        let mut some = UnitSet::of::<6>(|unit| unit != 2);
        let mut all = some.choose(2);
        for pair in [
            [4, 5],
            [3, 5],
            [1, 5],
            [0, 5],
            [3, 4],
            [1, 4],
            [0, 4],
            [1, 3],
            [0, 3],
            [0, 1],
        ] {
            let pair = UnitSet::of::<6>(|unit| pair.contains(&unit));
            assert_eq!(all.next(), Some(pair));
        }
        assert_eq!(all.next(), None);
        some = UnitSet::default();
        assert_eq!(some.choose(1).count(), 0);
    }

    #[test]
    fn a_unit_beyond_count_is_in_no_set() {
        let mut all = UnitSet::of::<40>(|_| true);
        assert_eq!(all.count(), 32);
        assert!(all.contains(31) && !all.contains(32));
        all.remove(40);
        assert_eq!(all.without(UnitSet::of::<31>(|_| true)).count(), 1);
    }
}
