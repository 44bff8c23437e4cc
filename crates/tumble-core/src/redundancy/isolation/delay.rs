//! Clocks that drift: the growing delay of a unit shows in its deviation from the set, along the angular
//! acceleration of the set (docs/theory/isolation.md, section 16).

use nalgebra::Vector3;

use crate::products::squared;
use crate::real::{Real, count, real};
use crate::redundancy::components::{dot, larger};
use crate::redundancy::unit_set::UnitSet;

/// Time constant of the estimate, s, and the time with sufficient motion after which a delay is known.
const OVER: f64 = 20.0;

/// Time constant of the remainders of the regression, s: those of neighbouring windows are correlated.
const CORRELATED: f64 = 1.0;

/// Least mean squared angular acceleration that shows a delay, (rad/s^2)^2.
const SHOWS: f64 = 0.02;

/// Standard deviations of the growth of a delay beyond which it excludes a unit, least such growth, s, and the
/// largest share of it in all others.
const SIGMAS: f64 = 5.0;
const LEAST: f64 = 3e-3;
const OF_OTHERS: f64 = 0.5;

/// Fewest units among which a drifting clock is isolated: of two, either might drift.
const FEWEST: usize = 3;

/// Regression of the deviation of a unit on the angular acceleration of the set.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Regression<T: Real> {
    /// Mean product of deviation and angular acceleration, rad^2/s^3.
    along: T,
    /// Latest, mean, and mean square of what the delay does not explain of the product, rad^2/s^3 and its square.
    remainder: T,
    lag: T,
    spread: T,
    /// Variance of the delay at the latest sufficient motion, s^2.
    variance: T,
    /// Delay when it was first known, s, and its variance, s^2.
    at_first: T,
    variance_at_first: T,
    /// Windows with sufficient motion until then.
    windows: u16,
}

/// Delays of all units beside the set: docs/theory/isolation.md, eq. 23 and 24.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Delays<T: Real, const UNITS: usize> {
    /// Mean squared angular acceleration, (rad/s^2)^2.
    change: T,
    units: [Regression<T>; UNITS],
}

/// Growth of the delay of a unit since it was first known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GrownDelay<T: Real> {
    pub unit: usize,
    /// Growth without its sign, s.
    pub by: T,
    /// Largest growth that is accepted, s.
    pub limit: T,
}

impl<T: Real> Regression<T> {
    fn unknown() -> Self {
        Self {
            along: T::zero(),
            remainder: T::zero(),
            lag: T::zero(),
            spread: T::zero(),
            variance: T::zero(),
            at_first: T::zero(),
            variance_at_first: T::zero(),
            windows: 0,
        }
    }

    /// Adds a window of a length, s, with a product of deviation and acceleration; a silent unit keeps its delay.
    /// `change` and `strength` are mean and latest square of the acceleration.
    fn push(&mut self, product: Option<T>, change: T, strength: T, length: T) {
        let expected = self.delay(change) * strength;
        let product = product.unwrap_or(expected);
        self.remainder += (product - expected - self.remainder) * (length / real(CORRELATED));
        let gain = length / real(OVER);
        self.lag += (self.remainder - self.lag) * gain;
        self.spread += (self.remainder * self.remainder - self.spread) * gain;
        self.along += (product - self.along) * gain; // isolation.md, eq. 23
    }

    /// Delay, s.
    fn delay(&self, change: T) -> T {
        if change > T::zero() {
            self.along / change
        } else {
            T::zero()
        }
    }

    /// Updates the variance in sufficient motion, and the first delay if the window `shows` one.
    fn show(&mut self, change: T, shows: bool, length: T) {
        // A delay that grows is ahead of its estimate by a constant.
        let spread = larger(T::zero(), self.spread - self.lag * self.lag);
        self.variance = spread * real(CORRELATED / OVER) / (change * change); // isolation.md, eq. 24
        if shows && !self.is_known(length) {
            self.windows = self.windows.saturating_add(1);
            (self.at_first, self.variance_at_first) = (self.delay(change), self.variance);
        }
    }

    fn is_known(&self, length: T) -> bool {
        length * count::<T>(self.windows.into()) >= real(OVER)
    }
}

impl<T: Real, const UNITS: usize> Delays<T, UNITS> {
    /// Creates estimates without any window.
    pub fn unknown() -> Self {
        Self {
            change: T::zero(),
            units: [Regression::unknown(); UNITS],
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
        let (before, strength) = (self.change, squared(acceleration));
        self.change += (strength - before) * (length / real(OVER));
        let products: [Option<T>; UNITS] =
            core::array::from_fn(|unit| Some(-dot(&beyond(unit)?, acceleration)));
        // The delay of a unit that is known beside one other changes with the next that becomes known.
        let enough = products.iter().flatten().count() >= FEWEST;
        let (change, shows) = (self.change, self.shows());
        for (unit, product) in self.units.iter_mut().zip(products) {
            unit.push(product, before, strength, length);
            if shows {
                unit.show(change, enough && product.is_some(), length);
            }
        }
    }

    /// Unit whose delay has grown too much, where those of at least two others have not.
    pub fn drifting(&self, length: T) -> Option<GrownDelay<T>> {
        if !self.shows() {
            return None;
        }
        let grown = |unit: usize| self.grown(unit, length);
        let alone = |most: &GrownDelay<T>| {
            let (mut known, mut alike) = (1, 0);
            for other in (0..UNITS).filter(|other| *other != most.unit).filter_map(grown) {
                known += 1;
                alike += usize::from(other.by >= most.by * real(OF_OTHERS));
            }
            known >= FEWEST && alike == 0
        };
        let mut units = (0..UNITS)
            .filter_map(grown)
            .filter(|grown| grown.by > grown.limit);
        units.find(alone)
    }

    /// Units whose delay has grown by that share of their limit or more.
    pub fn late(&self, length: T) -> UnitSet {
        let is_late = |grown: GrownDelay<T>| grown.by > grown.limit * real(OF_OTHERS);
        UnitSet::of::<UNITS>(|unit| self.grown(unit, length).is_some_and(is_late))
    }

    /// Returns whether motion is sufficient to show delays.
    fn shows(&self) -> bool {
        self.change > real(SHOWS)
    }

    /// Growth of the delay of a unit since it was first known.
    fn grown(&self, number: usize, length: T) -> Option<GrownDelay<T>> {
        let unit = self.units.get(number).filter(|unit| unit.is_known(length))?;
        Some(GrownDelay {
            unit: number,
            by: (unit.delay(self.change) - unit.at_first).abs(),
            limit: larger(
                real(LEAST),
                (unit.variance + unit.variance_at_first).square_root() * real(SIGMAS),
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.05;

    /// Flies for a time, s, with the delay of each unit as a function of time; returns when, which unit and by how
    /// much.
    fn flown<const N: usize>(until: f64, delay: impl Fn(usize, f64) -> f64) -> Option<(f64, usize, f64)> {
        flown_shaken::<N>(until, 0.0, delay)
    }

    /// The same where vibration leaves a slow swing, rad/s, in each unit.
    fn flown_shaken<const N: usize>(
        until: f64,
        swing: f64,
        delay: impl Fn(usize, f64) -> f64,
    ) -> Option<(f64, usize, f64)> {
        let mut delays = Delays::<f64, N>::unknown();
        for k in 0..(until / H) as u64 {
            let t = k as f64 * H;
            let acceleration = Vector3::new((0.9 * t).cos(), 0.5 * (1.7 * t).sin(), 0.2);
            let swings = |unit: usize| {
                let turned = (5.0 + unit as f64) * t + 2.0 * (0.3 * t).sin();
                Vector3::new(turned.sin(), turned.cos(), (1.3 * turned).sin()) * swing
            };
            let beyond = |unit: usize| Some(acceleration * -delay(unit, t) + swings(unit));
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
                matches!(found, Some((t, 1, by)) if t < 60.0 && (3e-3..3.1e-3).contains(&by)),
                "{found:?}"
            );
        }
    }

    #[test]
    fn vibration_raises_the_limit() {
        let stays = |unit: usize, _: f64| if unit == 1 { 9e-3 } else { 0.0 };
        assert_eq!(flown_shaken::<3>(600.0, 0.05, stays), None);
        let grows = |unit: usize, t: f64| if unit == 1 { 1e-4 * t } else { 0.0 };
        let found = flown_shaken::<3>(600.0, 0.05, grows);
        assert!(matches!(found, Some((_, 1, by)) if by > 3.5e-3), "{found:?}");
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
