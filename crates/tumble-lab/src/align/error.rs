//! Why two units cannot be aligned, with the figures.

/// Why two units cannot be aligned.
#[derive(Clone, Debug, PartialEq)]
pub enum AlignError {
    /// They share too little time in which both can be used.
    NothingInCommon,
    /// Neither turned: root mean square rate, rad/s, and what is needed.
    NoMotion {
        /// Root mean square rate less its mean, rad/s.
        found: f64,
        /// Least of it.
        needed: f64,
    },
    /// They do not feel one motion.
    NotAlike {
        /// Best correlation of their rates.
        correlation: f64,
    },
    /// One of them is left-handed.
    Mirrored,
    /// One of them is in another unit.
    Scaled {
        /// Rate of the secondary over that of the primary.
        ratio: f64,
    },
    /// The motion repeats itself, so that several offsets fit alike.
    Ambiguous {
        /// Offset that fits best, s.
        offset: f64,
        /// Another.
        other: f64,
    },
    /// The accelerometers do not feel one motion, turned as the gyroscopes are.
    ForcesDisagree {
        /// 1-sigma of a component of what remains between them, m/s^2.
        apart: f64,
    },
    /// The equations have no solution.
    Unsolvable,
}
