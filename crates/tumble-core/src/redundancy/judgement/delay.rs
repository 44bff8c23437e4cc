//! Clocks that drift: the growing delay of a unit shows in its deviation from the set, along the angular
//! acceleration of the set (docs/theory/judgement.md, section 16).

use nalgebra::Vector3;

use crate::products::squared;
use crate::real::{Real, count, real};
use crate::redundancy::components::{dot, larger};
use crate::redundancy::unit_set::UnitSet;

/// Time constant of the estimate, s, and the time with sufficient motion after which a delay is known.
const OVER: f64 = 20.0;

/// Least mean squared angular acceleration that shows a delay, (rad/s^2)^2.
const SHOWS: f64 = 0.02;

/// Growth of the delay that excludes a unit, s, and the largest share of it in all others. Vibration and low rates make an estimate wander by up to 6 ms.
const GROWN: f64 = 12e-3;
const OF_OTHERS: f64 = 0.25;

/// Fewest units among which a drifting clock is isolated: of two, either might drift.
const FEWEST: usize = 3;

/// Delays of all units beside the set: docs/theory/judgement.md, eq. 30.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Delays<T: Real, const UNITS: usize> {
    /// Mean squared angular acceleration, (rad/s^2)^2.
    change: T,
    /// Mean product of deviation and angular acceleration of each unit, rad^2/s^3.
    along: [T; UNITS],
    /// Delay of each unit when it was first known, s.
    at_first: [T; UNITS],
    /// Windows with sufficient motion until then.
    windows: [u16; UNITS],
}

/// Delay that has grown too much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GrownDelay<T: Real> {
    pub unit: usize,
    pub by: T,
    pub limit: T,
}

impl<T: Real, const UNITS: usize> Delays<T, UNITS> {
    /// Creates estimates without any window.
    pub fn unknown() -> Self {
        Self {
            change: T::zero(),
            along: [T::zero(); UNITS],
            at_first: [T::zero(); UNITS],
            windows: [0; UNITS],
        }
    }

    /// Updates the estimates with the angular acceleration of the set, rad/s^2, over a window of a length, s, and the
    /// deviation of each unit from the set in it, rad/s.
    pub fn push(
        &mut self,
        acceleration: &Vector3<T>,
        beyond: &dyn Fn(usize) -> Option<Vector3<T>>,
        length: T,
    ) {
        let (gain, strength) = (length / real(OVER), squared(acceleration));
        for unit in 0..UNITS {
            let delay = self.delay(unit);
            let Some(along) = self.along.get_mut(unit) else {
                continue;
            };
            // A silent unit keeps its delay.
            let product = beyond(unit).map_or(delay * strength, |beyond| -dot(&beyond, acceleration));
            *along += (product - *along) * gain; // judgement.md, eq. 30
        }
        self.change += (strength - self.change) * gain;
        if !self.shows() {
            return;
        }
        for unit in 0..UNITS {
            let delay = self.delay(unit);
            let learnt = self.windows.get_mut(unit).zip(self.at_first.get_mut(unit));
            if let Some((windows, at_first)) = learnt
                && length * count::<T>((*windows).into()) < real(OVER)
                && beyond(unit).is_some()
            {
                *windows = windows.saturating_add(1);
                *at_first = delay;
            }
        }
    }

    /// Unit whose delay has grown too much, where those of at least two others have not.
    pub fn drifting(&self, length: T) -> Option<GrownDelay<T>> {
        let (mut first, mut second, mut known) = (None::<GrownDelay<T>>, T::zero(), 0);
        for unit in 0..UNITS {
            let Some(by) = self.grown(unit, length) else {
                continue;
            };
            known += 1;
            match first {
                Some(most) if by.abs() <= most.by.abs() => second = larger(second, by.abs()),
                before => {
                    second = before.map_or(second, |before| larger(second, before.by.abs()));
                    first = Some(GrownDelay {
                        unit,
                        by,
                        limit: real(GROWN),
                    });
                }
            }
        }
        let clear = second < real(GROWN * OF_OTHERS) && known >= FEWEST && self.shows();
        first.filter(|most| clear && most.by.abs() > most.limit)
    }

    /// Units whose delay has grown by that share of the limit or more.
    pub fn late(&self, length: T) -> UnitSet {
        let is_late = |by: T| by.abs() > real(GROWN * OF_OTHERS);
        UnitSet::of::<UNITS>(|unit| self.grown(unit, length).is_some_and(is_late))
    }

    /// Returns whether motion is sufficient to show delays.
    fn shows(&self) -> bool {
        self.change > real(SHOWS)
    }

    /// Delay of a unit, s.
    fn delay(&self, unit: usize) -> T {
        let along = self.along.get(unit).copied().unwrap_or(T::zero());
        if self.change > T::zero() {
            along / self.change
        } else {
            T::zero()
        }
    }

    /// Growth of the delay of a unit since it was first known, s.
    fn grown(&self, unit: usize, length: T) -> Option<T> {
        let (windows, at_first) = (self.windows.get(unit)?, self.at_first.get(unit)?);
        let known = length * count::<T>((*windows).into()) >= real(OVER);
        known.then(|| self.delay(unit) - *at_first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.05;

    /// Flies for a time, s, with the delay of each unit as a function of time; returns when, which unit and by how
    /// much.
    fn flown<const N: usize>(until: f64, delay: impl Fn(usize, f64) -> f64) -> Option<(f64, usize, f64)> {
        let mut delays = Delays::<f64, N>::unknown();
        for k in 0..(until / H) as u64 {
            let t = k as f64 * H;
            let acceleration = Vector3::new((0.9 * t).cos(), 0.5 * (1.7 * t).sin(), 0.2);
            let beyond = |unit: usize| Some(acceleration * -delay(unit, t));
            delays.push(&acceleration, &beyond, H);
            if let Some(grown) = delays.drifting(H) {
                return Some((t, grown.unit, grown.by));
            }
        }
        None
    }

    #[test]
    fn a_delay_that_grows_either_way_is_found() {
        for rate in [1e-4, -1e-4] {
            let delay = |unit: usize, t: f64| if unit == 1 { rate * t } else { 2e-4 };
            let found = flown::<3>(300.0, delay);
            assert!(
                matches!(found, Some((t, 1, by)) if t < 200.0 && by.abs() < 13e-3 && by * rate > 0.0),
                "{found:?}"
            );
        }
    }

    #[test]
    fn a_delay_that_stays_is_no_fault() {
        let delay = |unit: usize, _: f64| if unit == 1 { 9e-3 } else { 0.0 };
        assert_eq!(flown::<3>(300.0, delay), None);
    }

    #[test]
    fn no_clock_of_two_units_is_named() {
        let delay = |unit: usize, t: f64| if unit == 1 { 1e-4 * t } else { 0.0 };
        assert_eq!(flown::<2>(300.0, delay), None);
    }

    #[test]
    fn delays_that_grow_alike_name_no_unit() {
        let delay = |unit: usize, t: f64| if unit == 0 { 0.0 } else { 1e-4 * t };
        assert_eq!(flown::<3>(300.0, delay), None);
    }
}
