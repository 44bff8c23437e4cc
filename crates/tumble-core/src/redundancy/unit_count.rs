//! Tables with an entry for each secondary: one less than units.

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

    /// Creates a table of equal entries.
    fn filled<X: TableEntry>(entry: X) -> Self::OfSecondaries<X>;
}

macro_rules! unit_counts {
    ($($units:literal, $secondaries:literal;)*) => {$(
        impl UnitCount for Units<$units> {
            type OfSecondaries<X: TableEntry> = [X; $secondaries];

            fn filled<X: TableEntry>(entry: X) -> [X; $secondaries] {
                [entry; $secondaries]
            }
        }
    )*};
}

unit_counts!(2, 1; 3, 2; 4, 3; 5, 4; 6, 5; 7, 6; 8, 7;);
