//! Changes within a session that a few numbers describe: a bias that drifts, and a target that slips in its fixture
//! (docs/theory/turntable.md, section 15).

use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};
use tumble_core::noise::Interval;
use tumble_core::turntable::fit::{TriadFit, fit};
use tumble_core::turntable::observation::{FitInputs, Observation};
use tumble_core::turntable::truth::{ForceObservation, with_drift, with_slip};

use super::error::TurntableError;
use crate::distributions::{chi_square_tail, f_tail};

/// Chance of a change where there is none, by the noise that rests show and by that of the residuals.
const FALSE_ALARM: f64 = 1e-3;
const FALSE_ALARM_BY_RESIDUALS: f64 = 1e-2;

/// Largest slip that is no other fault, and 1-sigma of one before any data, rad.
pub(super) const LARGEST_SLIP: f64 = 0.05;

/// Cosine of the angle within which two directions, or their opposites, are one.
const ALIKE: f64 = 0.98;

/// Time constants of a bias that settles, over the session: a longer one is a line.
const CONSTANTS: (f64, f64) = (0.02, 2.0);

/// Constants that are tried, apart by a quarter.
const TRIED: u32 = 21;

/// Course of a bias over a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// It changes on a straight line.
    Line,
    /// It settles, with this time constant over the length of the session.
    Settling(f64),
}

impl Course {
    /// All that are tried: one that is over within the first rest would be a rest that differs from the others.
    pub(super) fn tried(first: &Interval<f64>, session: &Interval<f64>) -> impl Iterator<Item = Self> {
        let rest = first.duration() / session.duration();
        let longest = CONSTANTS.1;
        let shortest = CONSTANTS.0.max(rest).min(longest);
        let settling = (0..TRIED).map(move |k| {
            let share = f64::from(k) / f64::from(TRIED - 1);
            Self::Settling(shortest * (longest / shortest).powf(share))
        });
        std::iter::once(Self::Line).chain(settling)
    }

    /// Share of its change over the session by which the bias exceeds its mean in the middle of a span.
    pub(super) fn at(self, span: &Interval<f64>, session: &Interval<f64>) -> f64 {
        let x = (0.5 * (span.start + span.end) - session.start) / (session.end - session.start);
        match self {
            Self::Line => x - 0.5,
            Self::Settling(constant) => {
                let whole = 1.0 - (-constant.recip()).exp();
                let gone = |x: f64| (1.0 - (-x / constant).exp()) / whole;
                gone(x) - (1.0 - constant * whole) / whole // eq. 56
            }
        }
    }

    /// Its time constant, s; infinite for a line.
    pub(super) fn constant(self, session: &Interval<f64>) -> f64 {
        match self {
            Self::Line => f64::INFINITY,
            Self::Settling(constant) => constant * (session.end - session.start),
        }
    }

    /// Numbers of three axes that it takes.
    pub(super) fn unknowns(self) -> f64 {
        match self {
            Self::Line => 3.0,
            Self::Settling(_) => 4.0,
        }
    }
}

/// A bias that changed over the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasDrift {
    /// Change from the beginning of the session to its end.
    pub change: Vector3<f64>,
    /// Its 1-sigma.
    pub sigma: Vector3<f64>,
    /// Time constant with which it settles, s; infinite where it changes on a straight line.
    pub constant: f64,
}

/// A target that turned in its fixture between two rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// Rotation vector, rad, in the case of the reference.
    pub turn: Vector3<f64>,
    /// Its covariance, rad^2.
    pub covariance: Matrix3<f64>,
    /// Rests of the reference before it and behind it.
    pub rests: (usize, usize),
    /// From the end of the one to the beginning of the other, s on the clock of the reference.
    pub span: Interval<f64>,
    /// Side of the slip on which the calibration holds: before it, unless one direction alone was shown there.
    pub side: Side,
}

/// Side of a slip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Before it.
    Before,
    /// Behind it.
    Behind,
}

impl Side {
    /// The side on which a calibration holds, where the target slipped before the rest of this number.
    pub(super) fn of(observations: &[ForceObservation<f64>], place: usize) -> Self {
        if shows_two(&observations[..place]) {
            Self::Before
        } else {
            Self::Behind
        }
    }

    /// Tests whether a rest before which the target slipped already, or not, is on the other side.
    fn is_other(self, slipped: bool) -> bool {
        slipped == (self == Self::Before)
    }
}

impl SessionChange {
    /// Numbers that it takes.
    pub(super) fn unknowns(self) -> f64 {
        match self {
            Self::Drift(course) => course.unknowns(),
            Self::Slip(_) => 3.0,
        }
    }
}

impl Slip {
    /// Tests whether a span lies on the other side than the calibration; `None` where the target slipped within.
    pub(super) fn divides(&self, span: &Interval<f64>) -> Option<bool> {
        let middle = 0.5 * (span.start + span.end);
        if middle < self.span.start {
            Some(self.side.is_other(false))
        } else if middle > self.span.end {
            Some(self.side.is_other(true))
        } else {
            None
        }
    }
}

/// A change and where it took place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SessionChange {
    /// The bias drifted.
    Drift(Course),
    /// The target slipped before the rest of this number.
    Slip(usize),
}

/// The change that explains most of what residuals show beyond noise; `None` where none explains more than chance
/// (docs/theory/turntable.md, eq. 58). Where no direction was shown again, a straight line alone is sought: all else
/// looks like a fixture that gives way.
pub(super) fn find_change(
    observations: &[ForceObservation<f64>],
    inputs: &FitInputs<f64, 3>,
    repeated: bool,
) -> Result<Option<SessionChange>, TurntableError> {
    let plain = fit::<f64, 4, 3, 15>(observations, inputs)?;
    let places = if repeated {
        places_of_slips(observations)
    } else {
        Vec::new()
    };
    #[allow(clippy::cast_precision_loss)]
    let chances = places.len() as f64;
    let mut best: Option<(f64, SessionChange)> = None;
    let mut take = |left: f64, change: SessionChange| {
        if best.is_none_or(|(least, _)| left < least) {
            best = Some((left, change));
        }
    };
    let Some(first) = observations.first() else {
        return Ok(None);
    };
    for course in Course::tried(&first.interval, &inputs.session).take(if repeated { usize::MAX } else { 1 })
    {
        let drifting = drifting(observations, &inputs.session, course);
        let found = fit::<f64, 5, 3, 18>(&drifting, inputs)?;
        if let Some(left) = left(&plain, &found, course.unknowns(), 1.0) {
            take(left, SessionChange::Drift(course));
        }
    }
    for place in places {
        let found = fit::<f64, 4, 6, 18>(&slipping(observations, place), &with_slips(inputs))?;
        if let Some(left) = left(&plain, &found, 3.0, chances) {
            take(left, SessionChange::Slip(place));
        }
    }
    Ok(best.map(|(_, change)| change))
}

/// Chi-square that is left for each degree of freedom by so many numbers more; `None` where chance alone takes off as much.
fn left<const Q: usize>(
    plain: &TriadFit<f64, 3>,
    found: &TriadFit<f64, Q>,
    unknowns: f64,
    chances: f64,
) -> Option<f64> {
    // Shared errors are not counted among the unknowns of a fit, nor is the constant of a course.
    let freedom = f64::from(plain.degrees_of_freedom) - unknowns;
    shown(plain.chi_square, found.chi_square, unknowns, freedom, chances)
}

/// The same of two sums of squares. Chances themselves are all zero where a change is plain, and rank nothing.
pub(super) fn shown(plain: f64, found: f64, unknowns: f64, freedom: f64, chances: f64) -> Option<f64> {
    if freedom <= 0.0 {
        return None;
    }
    let explained = (plain - found).max(0.0);
    let by_noise = chances * chi_square_tail(explained, unknowns);
    let by_residuals = chances * f_tail(explained / unknowns / (found / freedom), unknowns, freedom);
    (by_noise < FALSE_ALARM && by_residuals < FALSE_ALARM_BY_RESIDUALS).then_some(found / freedom) // eq. 58
}

/// Rests before which a slip would show: there are two directions on a side.
fn places_of_slips(observations: &[ForceObservation<f64>]) -> Vec<usize> {
    (1..observations.len())
        .filter(|place| shows_two(&observations[..*place]) || shows_two(&observations[*place..]))
        .collect()
}

/// Tests whether rests show two directions of gravity that are no opposites.
fn shows_two(observations: &[ForceObservation<f64>]) -> bool {
    let up = |observation: &ForceObservation<f64>| {
        observation.regressor.fixed_rows::<3>(0).into_owned().normalize()
    };
    observations.first().is_some_and(|first| {
        let first = up(first);
        observations.iter().any(|each| first.dot(&up(each)).abs() < ALIKE)
    })
}

/// Observations with the course of a bias among the regressors.
pub(super) fn drifting(
    observations: &[ForceObservation<f64>],
    session: &Interval<f64>,
    course: Course,
) -> Vec<Observation<f64, 5, 3>> {
    observations
        .iter()
        .map(|each| with_drift(each, course.at(&each.interval, session)))
        .collect()
}

/// Observations with a slip before the rest of this number among the errors that they share.
pub(super) fn slipping(observations: &[ForceObservation<f64>], place: usize) -> Vec<Observation<f64, 4, 6>> {
    let side = Side::of(observations, place);
    observations
        .iter()
        .enumerate()
        .map(|(k, each)| with_slip(each, side.is_other(k >= place)))
        .collect()
}

/// Prior knowledge with that of a slip.
pub(super) fn with_slips(inputs: &FitInputs<f64, 3>) -> FitInputs<f64, 6> {
    let mut shared = SMatrix::<f64, 6, 6>::identity() * LARGEST_SLIP.powi(2);
    shared.fixed_view_mut::<3, 3>(0, 0).copy_from(&inputs.shared);
    FitInputs {
        noise: inputs.noise,
        session: inputs.session,
        nominal: inputs.nominal,
        largest_bias: inputs.largest_bias,
        shared,
    }
}

/// Observations as they would be without the drift that was found.
pub(super) fn without_drift(
    observations: &[ForceObservation<f64>],
    session: &Interval<f64>,
    course: Course,
    change: &Vector3<f64>,
) -> Vec<ForceObservation<f64>> {
    observations
        .iter()
        .map(|each| ForceObservation {
            reading: each.reading - change * course.at(&each.interval, session),
            ..*each
        })
        .collect()
}

/// Observations with the truth as a target that slipped sees it.
pub(super) fn as_slipped(
    observations: &[ForceObservation<f64>],
    place: usize,
    turn: &Vector3<f64>,
) -> Vec<ForceObservation<f64>> {
    let mut slipped = observations.to_vec();
    let behind = Side::of(observations, place) == Side::Before;
    let others = if behind { place..slipped.len() } else { 0..place };
    for observation in &mut slipped[others] {
        let mut truth = observation.regressor.fixed_rows_mut::<3>(0);
        let turned = Rotation3::new(*turn) * truth.clone_owned();
        truth.copy_from(&turned);
    }
    slipped
}
