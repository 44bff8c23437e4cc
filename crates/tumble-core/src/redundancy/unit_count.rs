//! Tables with an entry for each secondary, one less than units, or for each pair of units.

use core::fmt::Debug;

/// Entry of a table.
pub trait TableEntry: Copy + Debug + PartialEq + Send + Sync {}

impl<X: Copy + Debug + PartialEq + Send + Sync> TableEntry for X {}

/// Number of units of a set, with the primary.
pub struct Units<const UNITS: usize>;

/// Numbers of units that a set may have: those of [`Units`] from 2 to 8.
pub trait UnitCount {
    /// Entries of all secondaries.
    type OfSecondaries<X: TableEntry>: AsRef<[X]> + AsMut<[X]> + TableEntry;

    /// Entries of all pairs, in the order of `pairs`.
    type OfPairs<X: TableEntry>: AsRef<[X]> + AsMut<[X]> + TableEntry;

    /// One entry for sets of three units and more, of which a majority can be right; none for two.
    type OfMajority<X: TableEntry>: AsRef<[X]> + AsMut<[X]> + TableEntry;

    /// Creates a table of equal entries, of secondaries.
    fn filled<X: TableEntry>(entry: X) -> Self::OfSecondaries<X>;

    /// Creates a table of equal entries, of pairs.
    fn filled_pairs<X: TableEntry>(entry: X) -> Self::OfPairs<X>;

    /// Creates the entry of sets with a majority.
    fn filled_majority<X: TableEntry>(entry: impl Fn() -> X) -> Self::OfMajority<X>;
}

macro_rules! unit_counts {
    ($($units:literal, $secondaries:literal, $pairs:literal, $majority:expr;)*) => {$(
        impl UnitCount for Units<$units> {
            type OfSecondaries<X: TableEntry> = [X; $secondaries];
            type OfPairs<X: TableEntry> = [X; $pairs];
            type OfMajority<X: TableEntry> = [X; $majority];

            fn filled<X: TableEntry>(entry: X) -> [X; $secondaries] {
                [entry; $secondaries]
            }

            fn filled_pairs<X: TableEntry>(entry: X) -> [X; $pairs] {
                [entry; $pairs]
            }

            fn filled_majority<X: TableEntry>(entry: impl Fn() -> X) -> [X; $majority] {
                core::array::from_fn(|_| entry())
            }
        }
    )*};
}

/// Entries of sets of three units and more: 0 where the model of a majority is left out.
pub const MAJORITY: usize = cfg!(feature = "majority") as usize;

unit_counts!(2, 1, 1, MAJORITY; 3, 2, 3, MAJORITY; 4, 3, 6, MAJORITY; 5, 4, 10, MAJORITY; 6, 5, 15, MAJORITY; 7, 6, 21, MAJORITY; 8, 7, 28, MAJORITY;);
