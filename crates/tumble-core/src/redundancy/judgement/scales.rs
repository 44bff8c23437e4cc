//! Four scales of time, and means that forget over each.

use nalgebra::Vector3;

use crate::real::{Real, count, real, tabulated};

/// How many there are.
pub const SCALES: usize = 4;

/// What each forgets over, s: a jump shows on the first, a drift on the last.
pub const SECONDS: [f32; SCALES] = [0.1, 1.0, 10.0, 60.0];

/// Share by which each mean moves towards a new window, that of the first windows being that of a plain mean
/// (docs/theory/judgement.md, eq. 2).
pub fn shares<T: Real>(window: T, windows: u32) -> [T; SCALES] {
    let plain = T::one() / count::<T>(windows.max(1));
    SECONDS.map(|scale| {
        let x = window / tabulated(scale);
        // 1 - exp(-x), to second order.
        let forgetting = x / (T::one() + x * real(0.5));
        forgetting.max(plain) // judgement.md, eq. 2
    })
}

/// Which scales have been filled by so many windows.
pub fn filled<T: Real>(window: T, windows: u32) -> [bool; SCALES] {
    let seen = window * count::<T>(windows);
    SECONDS.map(|scale| seen >= tabulated(scale))
}

/// Moves each of four means towards a value.
pub fn follow<T: Real>(means: &mut [T; SCALES], value: T, shares: &[T; SCALES]) {
    for (mean, share) in means.iter_mut().zip(shares) {
        *mean += (value - *mean) * *share;
    }
}

/// Moves each of four means towards a vector.
pub fn follow_vector<T: Real>(means: &mut [Vector3<T>; SCALES], value: &Vector3<T>, shares: &[T; SCALES]) {
    for (mean, share) in means.iter_mut().zip(shares) {
        *mean += (value - *mean) * *share;
    }
}
