//! Kinds of variances, and the differences that they are means of (docs/theory/noise.md, eq. 17 to 19).

/// Kinds of variances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VarianceKind {
    /// Half the mean squared difference of neighbouring averages.
    Allan,
    /// The same of averages that are themselves averaged over all starts within one: distinguishes quantisation from
    /// white noise.
    Modified,
    /// A sixth of the mean squared second difference of averages: blind to a steady drift.
    Hadamard,
}

impl VarianceKind {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; Self::COUNT] = [Self::Allan, Self::Modified, Self::Hadamard];
    /// Number of kinds.
    pub const COUNT: usize = 3;

    /// Averaging times that one difference reaches over, from its first sum to its last.
    pub(super) fn reach(self) -> usize {
        match self {
            Self::Allan => 2,
            Self::Modified | Self::Hadamard => 3,
        }
    }

    /// Samples that one difference of averages of so many samples is formed of.
    pub(super) fn span(self, samples: usize) -> usize {
        // A sum of sums is that of the sums before it (eq. 18), which lack the last sample.
        self.reach() * samples - usize::from(self == Self::Modified)
    }

    /// Divisor of the mean squared difference of sums, for averages of that many samples.
    pub(super) fn divisor(self, samples: f64) -> f64 {
        match self {
            Self::Allan => 2.0 * samples.powi(2),    // eq. 17
            Self::Hadamard => 6.0 * samples.powi(2), // eq. 17
            Self::Modified => 2.0 * samples.powi(4), // eq. 19
        }
    }
}
