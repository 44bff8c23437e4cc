//! A reference whose bias drifts: the length of gravity at its own rests shows that (docs/theory/turntable.md, section 15).

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use tumble_core::noise::Interval;
use tumble_core::regression::{LeastSquares, Prior, Solution};
use tumble_core::turntable::reference::{SphereFit, fit_sphere};

use super::error::TurntableError;
use super::session_change::{BiasDrift, Course, shown};

/// Largest plausible bias of a reference accelerometer, and change of it, m/s^2.
const LARGEST_BIAS: f64 = 2.0;

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

/// The sphere of a reference and the drift of its bias, where `|r - b|` shows one and it explains what noise does not.
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
    let mut best: Option<(f64, Course)> = None;
    for course in Course::tried() {
        let freedom = f64::from(plain.degrees_of_freedom) - course.unknowns();
        let found = drifting_sphere(spans, forces, gravity, &session, course)?;
        let chance = shown(
            plain.chi_square,
            found.chi_square,
            course.unknowns(),
            freedom,
            1.0,
        );
        if let Some(chance) = chance.filter(|_| freedom >= FEWEST_LEFT)
            && best.is_none_or(|(least, _)| chance < least)
        {
            best = Some((chance, course));
        }
    }
    let Some((_, course)) = best else {
        return Ok((plain, None));
    };
    let found = drifting_sphere(spans, forces, gravity, &session, course)?;
    let drift = ReferenceDrift {
        course,
        session,
        change: found.x.fixed_rows::<3>(3).into_owned(),
        covariance: found.covariance.fixed_view::<3, 3>(3, 3).into_owned(),
    };
    let each = spans.iter().zip(forces);
    let settled: Vec<_> = each.map(|(span, force)| drift.taken_off(span, *force)).collect();
    let sphere = fit_sphere(&settled, gravity)?;
    // Errors of scale look like a drift where each face comes once; what comes again contradicts it.
    if sphere.excess() > 1.0 {
        return Ok((plain, None));
    }
    let covariance = found.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    Ok((SphereFit { covariance, ..sphere }, Some(drift)))
}

/// Bias and its change: `|r_k - b - a s_k| = g` by Gauss-Newton (docs/theory/turntable.md, eq. 59).
fn drifting_sphere(
    spans: &[Interval<f64>],
    forces: &[(Vector3<f64>, Matrix3<f64>)],
    gravity: f64,
    session: &Interval<f64>,
    course: Course,
) -> Result<Solution<f64, 6>, TurntableError> {
    let prior = Prior {
        mean: SVector::<f64, 6>::zeros(),
        covariance: SMatrix::<f64, 6, 6>::identity() * LARGEST_BIAS.powi(2),
    };
    let mut solution = LeastSquares::<f64, 6>::new(&prior).solve()?;
    for _ in 0..STEPS {
        let mut equations = LeastSquares::<f64, 6>::new(&prior);
        for (span, (mean, covariance)) in spans.iter().zip(forces) {
            let share = course.at(span, session);
            let part = |first: usize| solution.x.fixed_rows::<3>(first).into_owned();
            let u = mean - part(0) - part(3) * share;
            let direction = u.normalize();
            let mut row = SVector::<f64, 6>::zeros();
            row.fixed_rows_mut::<3>(0).copy_from(&direction);
            row.fixed_rows_mut::<3>(3).copy_from(&(direction * share));
            let value = row.dot(&solution.x) + u.norm() - gravity; // eq. 59
            equations.push(&row, value, direction.dot(&(covariance * direction)));
        }
        solution = equations.solve()?;
    }
    Ok(solution)
}
