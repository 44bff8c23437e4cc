//! A reference whose bias drifts: the length of gravity at its own rests shows that (docs/theory/turntable.md, section 15).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use tumble_core::noise::Interval;
use tumble_core::regression::{LeastSquares, Prior, Solution, degrees_of_freedom};
use tumble_core::turntable::reference::{LARGEST_REFERENCE_BIAS, SphereFit, fit_sphere};

use super::error::TurntableError;
use super::session_change::{BiasDrift, Course, shown};

/// Rounds of Gauss-Newton.
const STEPS: u32 = 6;

/// Fewest degrees of freedom that are left to judge a drift by.
const FEWEST_LEFT: f64 = 3.0;

/// The drift of a reference, as its rests show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceDrift {
    /// Course of the bias.
    pub course: Course,
    /// From the first rest to the last.
    pub session: Interval<f64>,
    /// Change from the beginning of the session to its end, m/s^2.
    pub change: Vector3<f64>,
    /// Its covariance, (m/s^2)^2.
    pub covariance: Matrix3<f64>,
}

impl ReferenceDrift {
    /// A mean over a span, and its covariance, without the drift.
    pub(super) fn taken_off(
        &self,
        span: &Interval<f64>,
        (mean, covariance): (Vector3<f64>, Matrix3<f64>),
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let share = self.course.at(span, &self.session);
        (
            mean - self.change * share,
            covariance + self.covariance * share.powi(2), // eq. 60
        )
    }

    /// In the words of a target's.
    pub fn as_bias_drift(&self) -> BiasDrift {
        BiasDrift {
            change: self.change,
            sigma: self.covariance.diagonal().map(f64::sqrt),
            constant: self.course.constant(&self.session),
        }
    }
}

/// The sphere of a reference and the drift of its bias, where `|r - b|` shows one beside errors of scale, which look alike
/// where each face comes once.
pub(super) fn settled_sphere(
    spans: &[Interval<f64>],
    forces: &[(Vector3<f64>, Matrix3<f64>)],
    gravity: f64,
) -> Result<(SphereFit<f64>, Option<ReferenceDrift>), TurntableError> {
    let plain = fit_sphere(forces, gravity)?;
    let ends = spans.first().zip(spans.last());
    let Some((first, last)) = ends.filter(|_| plain.excess() > 1.0) else {
        return Ok((plain, None));
    };
    let session = Interval {
        start: first.start,
        end: last.end,
    };
    let scaled = lengths(spans, forces, gravity, &session, None)?;
    let mut best: Option<(f64, Course, Solution<f64, UNKNOWNS>)> = None;
    for course in Course::tried(first, &session) {
        let freedom = f64::from(degrees_of_freedom(scaled.rows, SCALED)) - course.unknowns();
        let found = lengths(spans, forces, gravity, &session, Some(course))?;
        let left = shown(
            scaled.chi_square,
            found.chi_square,
            course.unknowns(),
            freedom,
            1.0,
        );
        if let Some(left) = left.filter(|_| freedom >= FEWEST_LEFT)
            && best.as_ref().is_none_or(|(least, ..)| left < *least)
        {
            best = Some((left, course, found));
        }
    }
    let Some((_, course, found)) = best else {
        return Ok((plain, None));
    };
    let drift = ReferenceDrift {
        course,
        session,
        change: found.x.fixed_rows::<3>(DRIFT).into_owned(),
        covariance: found.covariance.fixed_view::<3, 3>(DRIFT, DRIFT).into_owned(),
    };
    let each = spans.iter().zip(forces);
    let settled: Vec<_> = each.map(|(span, force)| drift.taken_off(span, *force)).collect();
    Ok((fit_sphere(&settled, gravity)?, Some(drift)))
}

/// Bias, its change, and errors of scale.
const UNKNOWNS: usize = 9;
const DRIFT: usize = 3;
const SCALE: usize = 6;
/// Unknowns of the fit without a drift.
const SCALED: usize = 6;
/// 1-sigma of an error of scale of a reference, before any data.
const LARGEST_SCALE: f64 = 0.05;
/// 1-sigma of a drift that is not fitted, m/s^2.
const HELD: f64 = 1e-9;

/// `|(r_k - b - a s_k) / (1 + k)| = g` by Gauss-Newton (docs/theory/turntable.md, eq. 59); without a course a is zero.
fn lengths(
    spans: &[Interval<f64>],
    forces: &[(Vector3<f64>, Matrix3<f64>)],
    gravity: f64,
    session: &Interval<f64>,
    course: Option<Course>,
) -> Result<Solution<f64, UNKNOWNS>, TurntableError> {
    let sigma = |i: usize| match i {
        0..DRIFT => LARGEST_REFERENCE_BIAS,
        DRIFT..SCALE if course.is_some() => LARGEST_REFERENCE_BIAS,
        DRIFT..SCALE => HELD,
        _ => LARGEST_SCALE,
    };
    let prior = Prior {
        mean: SVector::<f64, UNKNOWNS>::zeros(),
        covariance: SMatrix::from_diagonal(&SVector::from_fn(|i, _| sigma(i).powi(2))),
    };
    let mut solution = LeastSquares::<f64, UNKNOWNS>::new(&prior).solve()?;
    for _ in 0..STEPS {
        let mut equations = LeastSquares::<f64, UNKNOWNS>::new(&prior);
        for (span, (mean, covariance)) in spans.iter().zip(forces) {
            let share = course.map_or(0.0, |course| course.at(span, session));
            let part = |first: usize| solution.x.fixed_rows::<3>(first).into_owned();
            let scale = part(SCALE).add_scalar(1.0);
            let u = (mean - part(0) - part(DRIFT) * share).component_div(&scale);
            let direction = u.normalize();
            let by_bias = direction.component_div(&scale);
            let mut row = SVector::<f64, UNKNOWNS>::zeros();
            row.fixed_rows_mut::<3>(0).copy_from(&by_bias);
            row.fixed_rows_mut::<3>(DRIFT).copy_from(&(by_bias * share));
            row.fixed_rows_mut::<3>(SCALE)
                .copy_from(&by_bias.component_mul(&u));
            let value = row.dot(&solution.x) + u.norm() - gravity; // eq. 59
            equations.push(&row, value, by_bias.dot(&(covariance * by_bias)));
        }
        solution = equations.solve()?;
    }
    Ok(solution)
}
