//! Two units that disagree: what each says against itself.
//!
//! Nobody can vote here. What decides is that a unit stepped by itself, that it no longer says at rest what it said in
//! health, or that its own gyroscope and accelerometer no longer fit each other. Where none of it decides, nobody knows
//! (docs/theory/judgement.md, section 5).

use nalgebra::{Matrix3, Vector3};

use crate::real::{Real, real, tabulated};
use crate::redundancy::samples::steps::LargestSteps;
use crate::redundancy::sensor::Sensor;

crate::vocabulary! {
    /// What names the wrong one of two units.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Ground {
        /// It stepped from one sample to the next by what the two are apart, and the other did not.
        Step = "own step",
        /// At rest it left what it said in health, and the other did not.
        Rest = "rest",
        /// Gravity as its own gyroscope carries it is not where its accelerometer finds it.
        Gravity = "own gyroscope",
        /// A witness from outside contradicts it.
        Witness = "witness",
    }
}

/// Why one of two units is the wrong one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proof<T: Real> {
    /// On this ground.
    pub ground: Ground,
    /// Its figure: a share of how far the two are apart, m/s^2 or rad/s, or the logarithm of a ratio of likelihoods.
    pub value: T,
    /// What it had to exceed.
    pub limit: T,
}

/// Shares of the disagreement that an own step may be; times the other's, and times what is usual, that it has to be.
const STEP_LEAST: f64 = 0.5;
const STEP_MOST: f64 = 2.5;
const STEP_TIMES_OTHER: f64 = 2.5;
const STEP_TIMES_USUAL: f64 = 4.0;

/// Changes of a sensor from sample to sample, and how its unit is mounted.
pub(super) struct MountedSteps<'a, T: Real> {
    /// In its own axes.
    pub steps: &'a LargestSteps<T>,
    /// To these from the primary's case frame.
    pub sensor_from_primary: &'a Matrix3<T>,
}

impl<T: Real> MountedSteps<'_, T> {
    /// The largest along a direction in the primary's case frame, and against it.
    fn along(&self, direction: &Vector3<T>) -> (T, T) {
        self.steps.along(&(self.sensor_from_primary * direction))
    }
}

/// Whether a unit stepped by `apart` (m/s^2 or rad/s, from the other unit to it) and the other did not: docs/theory/judgement.md, eq. 12.
pub(super) fn by_step<T: Real>(
    apart: &Vector3<T>,
    own: &MountedSteps<'_, T>,
    other: &MountedSteps<'_, T>,
) -> Option<Proof<T>> {
    let size = apart.norm();
    if size <= T::zero() {
        return None;
    }
    let direction = apart / size;
    let (step, _) = own.along(&direction);
    // What both felt was motion.
    let (along, against) = other.along(&direction);
    let limit = (size * real(STEP_LEAST))
        .max(along.max(against) * real(STEP_TIMES_OTHER))
        .max(own.steps.usual()? * real(STEP_TIMES_USUAL));
    let stepped = step > limit && step < size * real(STEP_MOST); // judgement.md, eq. 12
    stepped.then(|| Proof {
        ground: Ground::Step,
        value: step / size,
        limit: limit / size,
    })
}

/// At rest, a unit that left what it said in health by more than the first, beside one that did not leave it by the
/// second: m/s^2 and rad/s.
const LEFT: [f32; 2] = [0.08, 0.008];
const STAYED: [f32; 2] = [0.04, 0.004];

/// Whether a unit at rest left what physics says and the other did not: changes of `|f|` or `|w|` since health, and how far the
/// two have come apart along gravity, m/s^2; `None` for gyroscopes (docs/theory/judgement.md, eq. 13).
pub(super) fn by_rest<T: Real>(
    sensor: Sensor,
    own: T,
    other: T,
    along_gravity: Option<T>,
) -> Option<Proof<T>> {
    let (left, stayed) = (
        tabulated::<T>(*sensor.of(&LEFT)),
        tabulated::<T>(*sensor.of(&STAYED)),
    );
    let fits =
        along_gravity.is_none_or(|apart| (own - other - apart).abs() < stayed.max(own.abs() * real(0.5)));
    let proves = own.abs() > left && other.abs() < stayed && fits; // judgement.md, eq. 13
    proves.then_some(Proof {
        ground: Ground::Rest,
        value: own,
        limit: left,
    })
}

/// Time over which evidence of carried gravity is independent, s; the most that one such time may say, and how long it is
/// remembered, s.
const INDEPENDENT: f64 = 5.0;
const MOST: f64 = 1.5;
const REMEMBERED: f64 = 60.0;

/// Logarithm of the ratio of likelihoods that decides: one in a hundred and fifty is wrong.
pub(crate) const DECIDES: f64 = 5.0;

/// Evidence that the first of two units is wrong, less that the second is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Evidence<T: Real>(T);

impl<T: Real> Evidence<T> {
    /// None.
    pub fn none() -> Self {
        Self(T::zero())
    }

    /// Takes in what the two units' accelerometers say beyond carried gravity, and its usual variance, `(m/s^2)^2`
    /// (docs/theory/judgement.md, eq. 15). `window` is its length, s.
    pub fn push(&mut self, first: &Vector3<T>, second: &Vector3<T>, variance: T, window: T) {
        if variance <= T::zero() {
            return;
        }
        let more = (first.norm_squared() - second.norm_squared()) / (variance + variance);
        let most = real::<T>(MOST);
        let said = more.max(-most).min(most) * (window / real(INDEPENDENT));
        self.0 += said - self.0 * (window / real(REMEMBERED)); // eq. 15
    }

    /// Forgets, while nothing is taken in.
    pub fn fade(&mut self, window: T) {
        self.0 -= self.0 * (window / real(REMEMBERED));
    }

    /// The wrong one of two, 0 or 1, where it is decided.
    pub fn decides(&self) -> Option<(usize, Proof<T>)> {
        let limit = real::<T>(DECIDES);
        let proof = Proof {
            ground: Ground::Gravity,
            value: self.0.abs(),
            limit,
        };
        (self.0.abs() > limit).then_some((usize::from(self.0 < T::zero()), proof))
    }
}
