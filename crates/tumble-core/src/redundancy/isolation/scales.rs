//! Four scales of time, and means that forget over each.

use crate::real::{Real, count, real, tabulated};
use crate::redundancy::components::larger;

/// Number of scales.
pub const SCALES: usize = 4;

/// Time constants of the scales, s: a jump shows on the first, a drift on the last.
pub const SECONDS: [f32; SCALES] = [0.1, 1.0, 10.0, 60.0];

/// Shares by which means follow a new window (docs/theory/isolation.md, eq. 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares<T: Real>([T; SCALES]);

impl<T: Real> Shares<T> {
    /// Returns the shares for windows of a length, s.
    pub fn of(window: T) -> Self {
        Self(SECONDS.map(|scale| {
            let x = window / tabulated(scale);
            // 1 - exp(-x), to second order.
            x / (T::one() + x * real(0.5))
        }))
    }

    /// Shares after a number of windows, the new one included: the first windows enter a plain mean.
    pub fn after(&self, windows: u16) -> [T; SCALES] {
        let plain = T::one() / count::<T>(u32::from(windows.max(1)));
        self.0.map(|forgetting| larger(forgetting, plain)) // isolation.md, eq. 2
    }
}

/// Returns the number of scales, the shortest first, that so many windows fill; fewer windows filled `before`
/// of them.
pub fn filled<T: Real>(before: u8, window: T, windows: u16) -> u8 {
    let seen = window * count::<T>(windows.into());
    let mut filled = before;
    while SECONDS
        .get(usize::from(filled))
        .is_some_and(|scale| seen >= tabulated(*scale))
    {
        filled += 1;
    }
    filled
}

/// Shares after a number of windows, cached because most units have received as many.
pub struct LatestShares<T: Real> {
    window: T,
    shares: Shares<T>,
    windows: u16,
    after: [T; SCALES],
}

impl<T: Real> LatestShares<T> {
    /// Returns the shares for windows of a length, s.
    pub fn of(window: T) -> Self {
        let shares = Shares::of(window);
        Self {
            window,
            after: shares.after(1),
            windows: 1,
            shares,
        }
    }

    /// Length of a window, s.
    pub fn window(&self) -> T {
        self.window
    }

    /// Shares after a number of windows, the new one included.
    pub fn after(&mut self, windows: u16) -> &[T; SCALES] {
        if windows != self.windows {
            (self.windows, self.after) = (windows, self.shares.after(windows));
        }
        &self.after
    }
}
