//! Four scales of time, and means that forget over each.

use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::larger;

/// How many there are.
pub const SCALES: usize = 4;

/// What each forgets over, s: a jump shows on the first, a drift on the last.
pub const SECONDS: [f32; SCALES] = [0.1, 1.0, 10.0, 60.0];

/// Shares by which means move towards a new window (docs/theory/judgement.md, eq. 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares<T: Real>([T; SCALES]);

impl<T: Real> Shares<T> {
    /// Of windows of a length, s.
    pub fn of(window: T) -> Self {
        Self(SECONDS.map(|scale| {
            let x = window / tabulated(scale);
            // 1 - exp(-x), to second order.
            x / (T::one() + x * real(0.5))
        }))
    }

    /// With so many windows taken in, the new one among them: those of the first windows are of a plain mean.
    pub fn after(&self, windows: u16) -> [T; SCALES] {
        let plain = T::one() / count::<T>(u32::from(windows.max(1)));
        self.0.map(|forgetting| larger(forgetting, plain)) // judgement.md, eq. 2
    }
}

/// How many scales, the shortest first, have been filled by so many windows.
pub fn filled<T: Real>(window: T, windows: u16) -> usize {
    let seen = window * count::<T>(windows.into());
    SECONDS
        .iter()
        .take_while(|scale| seen >= tabulated(**scale))
        .count()
}
