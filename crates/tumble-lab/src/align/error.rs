//! Why two units cannot be aligned, with the figures.

tumble_core::vocabulary! {
    /// Why two units cannot be aligned.
    #[derive(Clone, Debug, PartialEq)]
    pub enum AlignError {
        /// They share too little time in which both can be used.
        NothingInCommon = "nothing in common",
        /// The time of the primary leaps: when, s from its first sample, and by how much, s.
        Leaps {
            /// s from the first sample.
            after: f64,
            /// s.
            by: f64,
        } = "leaps",
        /// Neither turned: root mean square rate, rad/s, and what is needed.
        NoMotion {
            /// Root mean square rate less its mean, rad/s.
            found: f64,
            /// Least of it.
            needed: f64,
        } = "no motion",
        /// They do not feel one motion.
        NotAlike {
            /// Best correlation of their rates.
            correlation: f64,
        } = "not alike",
        /// One of them is left-handed.
        Mirrored = "mirrored",
        /// One of them is in another unit.
        Scaled {
            /// Rate of the secondary over that of the primary.
            ratio: f64,
        } = "scaled",
        /// The motion repeats itself, so that several offsets fit alike.
        Ambiguous {
            /// Offset that fits best, s.
            offset: f64,
            /// Another.
            other: f64,
        } = "ambiguous",
        /// The accelerometers do not feel one motion, turned as the gyroscopes are.
        ForcesDisagree {
            /// 1-sigma of a component of what remains between them, m/s^2.
            apart: f64,
        } = "forces disagree",
        /// An axis of the gyroscope shares the motion in one part of the log and not in another.
        AxisChanged {
            /// 0, 1 or 2 for x, y or z of the secondary.
            axis: f64,
            /// Its reading over that of a sound one there: negative where its sign changed, near zero where it was frozen.
            gain: f64,
            /// Begin of that part, s from the first that both show.
            start: f64,
            /// End of it, s.
            end: f64,
        } = "axis changed",
        /// The equations have no solution.
        Unsolvable = "unsolvable",
    }
}
