//! How far the set has turned lately: what gravity carried by a gyroscope can say that is new, and how well.

use nalgebra::Vector3;

use crate::products::squared;
use crate::real::{Real, real};
use crate::redundancy::components::smaller;
use crate::redundancy::judgement::unit::CARRIED_OVER;

/// Turn after which an accelerometer has its errors elsewhere against gravity, rad.
const FAR: f64 = 1.0;

/// Rate from which on the set turns, rad/s, and the time after which evidence is independent then, s.
const TURNS: f64 = 0.2;
const INDEPENDENT: f64 = 5.0;

/// How far the set has turned, as long as carried gravity remembers it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turned<T: Real> {
    /// Rad, forgotten as carried gravity forgets.
    angle: T,
    /// Rad/s, of the window at hand.
    rate: T,
}

impl<T: Real> Turned<T> {
    /// It has not.
    pub fn not() -> Self {
        Self {
            angle: T::zero(),
            rate: T::zero(),
        }
    }

    /// Takes in an angular rate, rad/s, over a window, s.
    pub fn push(&mut self, rate: &Vector3<T>, window: T) {
        self.rate = squared(rate).square_root();
        self.angle += (self.rate - self.angle / real(CARRIED_OVER)) * window;
    }

    /// Square of the share of a turn far enough.
    fn share_squared(&self) -> T {
        let share = smaller(T::one(), self.angle / real(FAR));
        share * share
    }

    /// How much independent evidence there is in a window, s: in one attitude an accelerometer errs in one way, for as long as carried
    /// gravity remembers another.
    pub fn news(&self, window: T) -> T {
        let (still, turning) = (real::<T>(1.0 / CARRIED_OVER), real::<T>(1.0 / INDEPENDENT));
        let turns = smaller(T::one(), self.rate / real(TURNS));
        window * (still + (turning - still) * turns)
    }
}

/// What accelerometers say beyond carried gravity in health: it goes with how far the set has turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UsualError<T: Real> {
    /// Usual square, `(m/s^2)^2`, and usual share of a turn, squared.
    square: T,
    turned: T,
}

/// Time over which it is learnt, s.
const LEARNT_OVER: f64 = 60.0;

/// Least square of a share of a turn from which anything is learnt.
const LEAST_LEARNT: f64 = 0.25;

/// Standard deviation that gravity carried without any turn is granted, m/s^2.
const UNTURNED: f64 = 0.05;

impl<T: Real> UsualError<T> {
    /// Not known.
    pub fn unknown() -> Self {
        Self {
            square: T::zero(),
            turned: T::zero(),
        }
    }

    /// Takes in a square of health, `(m/s^2)^2`, over a window, s; without a turn in it, it says nothing of turns.
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
        self.square += (square - self.square) * gain; // judgement.md, eq. 15
        self.turned += (share - self.turned) * gain; // judgement.md, eq. 15
    }

    /// Variance of it after such turns, `(m/s^2)^2`; `None` while it is not known.
    pub fn variance(&self, turned: &Turned<T>) -> Option<T> {
        let least = real::<T>(UNTURNED * UNTURNED);
        (self.turned > T::zero()).then(|| least + self.square / self.turned * turned.share_squared())
    }
}
