//! Recent turning of the set, which determines how much new evidence carried gravity gives and how accurate it
//! is.

use nalgebra::Vector3;

use crate::products::squared;
use crate::real::{Real, real};
use crate::redundancy::components::smaller;
use crate::redundancy::isolation::unit::CARRIED_OVER;

/// Turn beyond which the errors of an accelerometer along gravity are independent, rad.
const FAR: f64 = 1.0;

/// Rate at which turning counts in full, rad/s, and the time after which evidence is independent then, s.
const TURNS: f64 = 0.2;
const INDEPENDENT: f64 = 5.0;

/// Angle turned by the set, as long as carried gravity remembers it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turned<T: Real> {
    /// Angle turned, rad, forgotten with the time constant of carried gravity.
    angle: T,
    /// Angular rate in this window, rad/s.
    rate: T,
}

impl<T: Real> Turned<T> {
    /// Creates the state of a set that has not turned.
    pub fn not() -> Self {
        Self {
            angle: T::zero(),
            rate: T::zero(),
        }
    }

    /// Adds an angular rate, rad/s, over a window, s.
    pub fn push(&mut self, rate: &Vector3<T>, window: T) {
        self.rate = squared(rate).square_root();
        self.angle += (self.rate - self.angle / real(CARRIED_OVER)) * window;
    }

    /// Squared share of a turn that makes errors independent.
    fn share_squared(&self) -> T {
        let share = smaller(T::one(), self.angle / real(FAR));
        share * share
    }

    /// Amount of independent evidence in a window, s: in one attitude the error of an accelerometer stays the
    /// same for as long as carried gravity remembers another.
    pub fn news(&self, window: T) -> T {
        let (still, turning) = (real::<T>(1.0 / CARRIED_OVER), real::<T>(1.0 / INDEPENDENT));
        let turns = smaller(T::one(), self.rate / real(TURNS));
        window * (still + (turning - still) * turns)
    }
}

/// Usual difference between accelerometer and carried gravity in health, which grows with the angle turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UsualError<T: Real> {
    /// Mean square, `(m/s^2)^2`, and mean squared share of a turn.
    square: T,
    turned: T,
}

/// Time constant of learning, s.
const LEARNT_OVER: f64 = 60.0;

/// Least squared share of a turn that is learnt from.
const LEAST_LEARNT: f64 = 0.25;

/// Standard deviation of carried gravity without any turn, m/s^2.
const UNTURNED: f64 = 0.05;

impl<T: Real> UsualError<T> {
    /// Creates an unknown error.
    pub fn unknown() -> Self {
        Self {
            square: T::zero(),
            turned: T::zero(),
        }
    }

    /// Learns from a squared difference in health, `(m/s^2)^2`, over a window, s; windows without a turn are
    /// skipped.
    pub fn learn(&mut self, square: T, turned: &Turned<T>, window: T) {
        let share = turned.share_squared();
        if share < real(LEAST_LEARNT) {
            return;
        }
        if self.turned <= T::zero() {
            (self.square, self.turned) = (square, share);
            return;
        }
        let gain = window / real(LEARNT_OVER);
        self.square += (square - self.square) * gain; // isolation.md, eq. 15
        self.turned += (share - self.turned) * gain; // isolation.md, eq. 15
    }

    /// Variance after such turns, `(m/s^2)^2`; `None` while it is unknown.
    pub fn variance(&self, turned: &Turned<T>) -> Option<T> {
        let least = real::<T>(UNTURNED * UNTURNED);
        (self.turned > T::zero()).then(|| least + self.square / self.turned * turned.share_squared())
    }
}
