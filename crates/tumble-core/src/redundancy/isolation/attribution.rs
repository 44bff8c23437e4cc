//! Isolation of the faulty one of two units that disagree, by evidence from each unit alone.
//!
//! Two units cannot outvote each other. The decision rests on a step of one unit alone, on a reading at rest
//! that differs from the one in health, or on a gyroscope and an accelerometer of one unit that contradict each
//! other. Without such evidence the faulty unit is not isolated (docs/theory/isolation.md, section 5).

use nalgebra::{Matrix3, Vector3};

use crate::products::{Length, product, squared, zeros};
use crate::real::{Real, real, tabulated};
use crate::redundancy::components::larger;
use crate::redundancy::samples::steps::LargestSteps;
use crate::redundancy::sensor::Sensor;

crate::vocabulary! {
    /// Kind of evidence that isolates the faulty one of two units.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Ground {
        /// The unit stepped from one sample to the next by the difference of the two, and the other did not.
        Step = "own step",
        /// The reading of the unit at rest left its value in health, and that of the other did not.
        Rest = "rest",
        /// Gravity carried by the gyroscope of the unit differs from the reading of its accelerometer.
        Gravity = "own gyroscope",
        /// An aiding measurement contradicts the unit.
        Aiding = "aiding",
    }
}

/// Precedence of evidence, the least first: each overrules those before it that concern the same sensor
/// (docs/theory/isolation.md, section 14).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Precedence {
    /// Evidence from the unit alone in motion.
    Own,
    /// Agreement of the other units.
    Vote,
    /// An aiding measurement.
    Aiding,
    /// Physics at rest.
    Physics,
}

impl Ground {
    /// Precedence of this kind of evidence.
    pub fn precedence(self) -> Precedence {
        match self {
            Self::Step | Self::Gravity => Precedence::Own,
            Self::Aiding => Precedence::Aiding,
            Self::Rest => Precedence::Physics,
        }
    }
}

/// Evidence against one of two units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proof<T: Real> {
    /// Kind of evidence.
    pub ground: Ground,
    /// Figure of the evidence: a share of the difference of the two, m/s^2 or rad/s, or the logarithm of a
    /// likelihood ratio.
    pub value: T,
    /// Threshold that the figure exceeded.
    pub limit: T,
}

impl<T: Real> Proof<T> {
    /// Evidence from the error of a well calibrated unit at rest, m/s^2 or rad/s, beside a unit that is not.
    pub(crate) fn at_rest(sensor: Sensor, off: T) -> Self {
        let least = tabulated::<T>(*sensor.of(&RESTS_WITHIN));
        Self {
            ground: Ground::Rest,
            value: off * off / (least * least * real(2.0)),
            limit: real(DECIDES),
        }
    }
}

/// Limits of an own step: shares of the disagreement, multiple of the step of the other unit, multiple of the
/// usual step.
const STEP_LEAST: f64 = 0.5;
const STEP_MOST: f64 = 2.5;
const STEP_TIMES_OTHER: f64 = 2.5;
const STEP_TIMES_USUAL: f64 = 2.5;

/// Changes of a sensor from sample to sample, and the mounting of its unit.
pub(super) struct MountedSteps<'a, T: Real> {
    /// Changes in the axes of the sensor.
    pub steps: &'a LargestSteps<T>,
    /// Rotation from the case frame of the primary to these axes.
    pub sensor_from_primary: &'a Matrix3<T>,
}

impl<T: Real> MountedSteps<'_, T> {
    /// Largest change along a direction in the case frame of the primary, and against it.
    fn along(&self, direction: &Vector3<T>) -> (T, T) {
        self.steps.along(&product(self.sensor_from_primary, direction))
    }

    fn moves_along(&self, direction: &Vector3<T>) -> bool {
        self.steps
            .moves_along(&product(self.sensor_from_primary, direction))
    }
}

/// Returns the evidence if a unit stepped by `apart` (m/s^2 or rad/s, from the other unit to it) and the other
/// did not: docs/theory/isolation.md, eq. 12.
pub(super) fn by_step<T: Real>(
    apart: &Vector3<T>,
    own: &MountedSteps<'_, T>,
    other: &MountedSteps<'_, T>,
) -> Option<Proof<T>> {
    let size = apart.length();
    if size <= T::zero() {
        return None;
    }
    let direction = apart / size;
    let (step, _) = own.along(&direction);
    // Beside a unit that is stuck along that direction, motion would count as a step.
    if !other.moves_along(&direction) {
        return None;
    }
    // A change that both units measured is motion.
    let (along, against) = other.along(&direction);
    let limit = (size * real(STEP_LEAST))
        .max(along.max(against) * real(STEP_TIMES_OTHER))
        .max(own.steps.usual()? * real(STEP_TIMES_USUAL));
    let stepped = step > limit && step < size * real(STEP_MOST); // isolation.md, eq. 12
    stepped.then(|| Proof {
        ground: Ground::Step,
        value: step / size,
        limit: limit / size,
    })
}

/// Least standard deviation of the reading of a healthy unit at rest from its usual value: m/s^2 and rad/s.
const RESTS_WITHIN: [f32; 2] = [0.025, 0.0025];

/// Largest mismatch between the deviations of two units at rest and their difference along gravity: m/s^2, and
/// a share of the deviation.
const FITS: [f32; 2] = [0.04, 0.5];

/// Deviation of a reading at rest from its value in health: of `|f|`, m/s^2, or `|w|`, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LeftAtRest<T: Real> {
    pub left: T,
    /// Square of the largest deviation between rests in health: the error of an uncalibrated unit differs in
    /// every attitude.
    pub strays_squared: T,
}

/// Largest evidence of carried gravity from one independent window, and the number of such windows after which
/// it is forgotten.
const MOST: f64 = 2.0;
const REMEMBERED: f64 = 12.0;

/// Logarithm of the likelihood ratio that decides: one decision in 150 is wrong.
pub(crate) const DECIDES: f64 = 5.0;

/// Factor on the square of that deviation: attitudes recur, and their errors with them.
const REST_DOUBTED: f64 = 2.0;

/// Cosine of the turn beyond which the error of an accelerometer is independent.
const SAME_ATTITUDE: f64 = 0.9;

/// Sums over the observations of carried gravity, each weighted by its news over twice its variance
/// (docs/theory/isolation.md, eq. 15).
#[derive(Clone, Copy, Debug, PartialEq)]
struct CarriedSums<T: Real> {
    weight: T,
    /// Weighted difference of the errors of the two units, and their mean.
    apart: Vector3<T>,
    shared: Vector3<T>,
    products: Products<T>,
}

/// Weighted sums of products of the difference of two errors and of their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Products<T: Real> {
    /// Square of the first error minus that of the second.
    balance: T,
    /// Square of the difference.
    apart: T,
    /// Square of the mean.
    shared: T,
}

impl<T: Real> Products<T> {
    fn of(apart: &Vector3<T>, shared: &Vector3<T>, weight: T) -> Self {
        let balance = apart.dot(shared) * weight;
        Self {
            balance: balance + balance,
            apart: squared(apart) * weight,
            shared: squared(shared) * weight,
        }
    }

    /// Logarithm of the likelihood ratio that the first unit and not the second is wrong, if the error of the wrong one
    /// may contain any multiple of the shared acceleration, of the order of one.
    fn ratio(&self) -> T {
        // The acceleration is what the unit measures that is then the sound one.
        let shared = self.shared + self.apart * real(0.25) - self.balance.abs() * real(0.5);
        let variance = self.apart + shared * shared * real(2.0);
        if variance > T::zero() {
            self.balance * self.apart / variance // isolation.md, eq. 15
        } else {
            T::zero()
        }
    }
}

impl<T: Real> CarriedSums<T> {
    fn none() -> Self {
        Self {
            weight: T::zero(),
            apart: zeros(),
            shared: zeros(),
            products: Products {
                balance: T::zero(),
                apart: T::zero(),
                shared: T::zero(),
            },
        }
    }

    fn push(&mut self, first: &Vector3<T>, second: &Vector3<T>, inverse: T, news: T) {
        let (apart, shared) = (first - second, (first + second) * real::<T>(0.5));
        let (most, balance) = (real::<T>(MOST), apart.dot(&shared).abs() * inverse * real(2.0));
        let share = if balance > most { most / balance } else { T::one() };
        let weight = inverse * share * news;
        let products = Products::of(&apart, &shared, weight);
        self.weight += weight;
        self.apart += apart * weight;
        self.shared += shared * weight;
        self.products.balance += products.balance;
        self.products.apart += products.apart;
        self.products.shared += products.shared;
    }

    fn fade(&mut self, left: T) {
        self.weight *= left;
        self.apart *= left;
        self.shared *= left;
        self.products.balance *= left;
        self.products.apart *= left;
        self.products.shared *= left;
    }

    /// Logarithm of the likelihood ratio that the first unit and not the second is wrong: that of the means, and that of
    /// the deviations from them.
    fn ratio(&self) -> T {
        if self.weight <= T::zero() {
            return T::zero();
        }
        let (all, inverse) = (&self.products, T::one() / self.weight);
        let means = Products::of(&self.apart, &self.shared, inverse);
        let deviations = Products {
            balance: all.balance - means.balance,
            apart: larger(T::zero(), all.apart - means.apart),
            shared: larger(T::zero(), all.shared - means.shared),
        };
        means.ratio() + deviations.ratio()
    }
}

/// Evidence against the first of two units, minus evidence against the second: logarithms of a likelihood
/// ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evidence<T: Real> {
    gathered: T,
    carried: CarriedSums<T>,
    /// Evidence of rests in the latest attitude, which are not independent of each other.
    at_rest: T,
    /// Direction of gravity in that attitude, m/s^2.
    gravity: Vector3<T>,
}

impl<T: Real> Evidence<T> {
    /// Creates evidence of zero.
    pub fn none() -> Self {
        Self {
            gathered: T::zero(),
            carried: CarriedSums::none(),
            at_rest: T::zero(),
            gravity: zeros(),
        }
    }

    /// Adds the readings of two units at a rest where gravity is `gravity`, m/s^2 (docs/theory/isolation.md,
    /// eq. 13).
    ///
    /// `along_gravity` is the growth of their difference along gravity, m/s^2; `None` for gyroscopes.
    pub fn push_rest(
        &mut self,
        sensor: Sensor,
        first: &LeftAtRest<T>,
        second: &LeftAtRest<T>,
        along_gravity: Option<T>,
        gravity: &Vector3<T>,
    ) {
        if gravity.dot(&self.gravity) < gravity.length() * self.gravity.length() * real(SAME_ATTITUDE) {
            self.gathered += core::mem::replace(&mut self.at_rest, T::zero());
        }
        self.gravity = *gravity;
        let [within, share] = FITS.map(tabulated::<T>);
        let (a, b) = (first.left, second.left);
        let fits = along_gravity
            .is_none_or(|apart| (a - b - apart).abs() < within.max(a.abs().max(b.abs()) * share));
        if fits {
            let least = tabulated::<T>(*sensor.of(&RESTS_WITHIN));
            let strays = first.strays_squared.max(second.strays_squared) * real(REST_DOUBTED);
            self.at_rest = (a * a - b * b) / (strays.max(least * least) * real(2.0)); // eq. 13
        }
    }

    /// Adds the differences of two accelerometers from carried gravity, with their usual variance, `(m/s^2)^2`
    /// (docs/theory/isolation.md, eq. 15). `news` is the independent share of the window.
    pub fn push(&mut self, first: &Vector3<T>, second: &Vector3<T>, variance: T, news: T) {
        if variance <= T::zero() {
            return;
        }
        self.carried
            .push(first, second, T::one() / (variance + variance), news);
        self.fade(news);
    }

    /// Forgets evidence over a window that adds none.
    pub fn fade(&mut self, news: T) {
        let left = T::one() - news / real(REMEMBERED);
        self.gathered *= left;
        self.carried.fade(left);
        self.at_rest *= left;
    }

    /// Returns the faulty one of two units, 0 or 1, with the latest kind of evidence, if the evidence decides.
    pub fn decides(&self, ground: Ground) -> Option<(usize, Proof<T>)> {
        let gathered = self.gathered + self.at_rest + self.carried.ratio();
        let (evidence, limit) = (gathered, real::<T>(DECIDES));
        let proof = Proof {
            ground,
            value: evidence.abs(),
            limit,
        };
        (evidence.abs() > limit).then_some((usize::from(evidence < T::zero()), proof))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::redundancy::isolation::turn::{Turned, UsualError};
    use crate::redundancy::samples::steps::UnitSteps;

    const UP: Vector3<f64> = Vector3::new(0.0, 0.0, 9.8);
    const WINDOW: f64 = 0.05;

    fn left(left: f64, strays: f64) -> LeftAtRest<f64> {
        LeftAtRest {
            left,
            strays_squared: strays * strays,
        }
    }

    fn after_rests(rests: &[(f64, f64, f64, Vector3<f64>)]) -> Option<usize> {
        let mut evidence = Evidence::none();
        for (first, second, strays, gravity) in rests {
            let (first, second) = (left(*first, *strays), left(*second, *strays));
            let along = Some(first.left - second.left);
            evidence.push_rest(Sensor::Accelerometer, &first, &second, along, gravity);
        }
        evidence.decides(Ground::Rest).map(|(wrong, _)| wrong)
    }

    #[test]
    fn one_rest_decides_between_two_that_are_calibrated_well() {
        assert_eq!(after_rests(&[(0.09, 0.01, 0.01, UP)]), Some(0));
        assert_eq!(after_rests(&[(-0.01, -0.09, 0.01, UP)]), Some(1));
        assert_eq!(after_rests(&[(0.04, 0.01, 0.01, UP)]), None);
    }

    #[test]
    fn one_rest_does_not_decide_between_units_that_err_by_attitude() {
        assert_eq!(after_rests(&[(0.38, -0.02, 0.3, UP)]), None);
    }

    #[test]
    fn rests_in_one_attitude_are_no_more_than_one() {
        let rest = (0.5, -0.02, 0.3, UP);
        assert_eq!(after_rests(&[rest; 20]), None);
        let around = |k: u32| {
            let angle = f64::from(k);
            (0.5, -0.02, 0.3, Vector3::new(angle.sin(), 0.0, angle.cos()) * 9.8)
        };
        let rests: [_; 20] = core::array::from_fn(|k| around(k as u32));
        assert_eq!(after_rests(&rests), Some(0));
    }

    #[test]
    fn a_rest_that_fits_no_disagreement_is_no_evidence() {
        let mut evidence = Evidence::none();
        let (first, second) = (left(0.3, 0.0), left(0.0, 0.0));
        evidence.push_rest(Sensor::Accelerometer, &first, &second, Some(0.0), &UP);
        assert_eq!(evidence.decides(Ground::Rest), None);
    }

    #[test]
    fn evidence_is_forgotten_by_the_time_that_is_news() {
        // Whatever the share of a window that is news, as many windows as are remembered leave one part in e.
        for news in [1.0, 0.3, 0.05] {
            let mut evidence = Evidence::none();
            evidence.push_rest(Sensor::Accelerometer, &left(0.5, 0.1), &left(0.0, 0.1), None, &UP);
            evidence.push(&Vector3::repeat(0.1), &Vector3::zeros(), 0.05, 1.0);
            let before = (evidence.carried.products.balance, evidence.at_rest);
            for _ in 0..(REMEMBERED / news).round() as u32 {
                evidence.fade(news);
            }
            for (left, before) in [
                (evidence.carried.products.balance, before.0),
                (evidence.at_rest, before.1),
            ] {
                let share = left / before;
                assert!((share - (-1.0_f64).exp()).abs() < 0.02, "{share} with {news}");
            }
        }
    }

    #[test]
    fn motion_beside_a_unit_that_is_stuck_is_no_step_of_the_other() {
        let noise = |x: f64, k: u32| [x, 0.01 * f64::from(k % 3), -0.02];
        let steps = |along: f64, last: f64| {
            let mut steps = UnitSteps::<f64>::none();
            for k in 0..60_u32 {
                let x = if k == 59 { last } else { along };
                let step = noise(x, k);
                let square = step.iter().map(|x| x * x).sum();
                steps.take(&[(step, square), (step, square)]);
                steps.complete(10);
            }
            steps
        };
        let mounted = Matrix3::identity();
        let sensor = Sensor::Accelerometer;
        let (moving, noisy, stuck) = (steps(0.02, 0.5), steps(0.02, 0.02), steps(0.0, 0.0));
        let step = |own: &UnitSteps<f64>, other: &UnitSteps<f64>| {
            let of = |steps| MountedSteps {
                steps,
                sensor_from_primary: &mounted,
            };
            by_step(
                &Vector3::new(0.5, 0.0, 0.0),
                &of(sensor.of(own.sensors())),
                &of(sensor.of(other.sensors())),
            )
        };
        assert!(step(&moving, &noisy).is_some());
        assert!(step(&moving, &stuck).is_none());
    }

    #[test]
    fn carried_gravity_has_the_usual_error_of_turns_after_a_turn() {
        let (mut turned, mut usual) = (Turned::not(), UsualError::unknown());
        assert_eq!(usual.variance(&turned), None);
        for _ in 0..10_000 {
            turned.push(&Vector3::new(0.5, 0.0, 0.0), WINDOW);
            usual.learn(0.09, &turned, WINDOW);
        }
        let after_turns = usual.variance(&turned).expect("turns were seen");
        assert!((after_turns - 0.0925).abs() < 1e-3, "{after_turns}");
        for _ in 0..4000 {
            turned.push(&Vector3::zeros(), WINDOW);
            usual.learn(0.0, &turned, WINDOW);
        }
        let still = usual.variance(&turned).expect("turns were seen");
        assert!(still < 0.003, "{still}");
        assert!((turned.news(WINDOW) - WINDOW / 20.0).abs() < 1e-12);
    }
}
