//! Nonlinear least squares by Levenberg and Marquardt, for residuals whose derivative is known.
//!
//! Columns are scaled by the largest norm they have had (Moré 1978), so that unknowns may have any units; the damping
//! follows the ratio of gained to promised (Nielsen 1999).

use nalgebra::{DMatrix, DVector};

/// Residuals at a point, and their derivative by the unknowns.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// (m).
    pub residuals: DVector<f64>,
    /// (m, n).
    pub jacobian: DMatrix<f64>,
}

/// Where the sum of squares is least.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// (n).
    pub x: DVector<f64>,
    /// Linearisation there.
    pub at: Linearised,
}

const MOST_STEPS: u32 = 200;

/// A step that promises less than this share of the sum of squares is the last.
const NEGLIGIBLE: f64 = 1e-12;

/// Damping beyond which no shorter step helps: what is left is rounding.
const STUCK: f64 = 1e16;

/// Finds the least sum of squares near `start`; `None` where `evaluate` gives nothing finite at the start.
pub fn minimise(
    start: DVector<f64>,
    mut evaluate: impl FnMut(&DVector<f64>) -> Option<Linearised>,
) -> Option<Minimum> {
    let mut at = evaluate(&start)?;
    let mut x = start;
    let mut scale = DVector::from_element(x.len(), f64::MIN_POSITIVE);
    let (mut damping, mut growth) = (1e-3, 2.0);
    for _ in 0..MOST_STEPS {
        for (scale, column) in scale.iter_mut().zip(at.jacobian.column_iter()) {
            *scale = scale.max(column.norm());
        }
        let Some((step, promised)) = damped_step(&at, &scale, damping) else {
            damping *= 10.0;
            if damping > STUCK {
                break;
            }
            continue;
        };
        let cost = at.residuals.norm_squared();
        if promised <= NEGLIGIBLE * cost {
            break;
        }
        let tried = &x + step;
        let next = evaluate(&tried).filter(|next| next.residuals.norm_squared().is_finite());
        let gained = next
            .as_ref()
            .map_or(f64::NEG_INFINITY, |next| cost - next.residuals.norm_squared());
        if let Some(next) = next.filter(|_| gained > 0.0) {
            (x, at) = (tried, next);
            damping *= (1.0 - (2.0 * gained / promised - 1.0).powi(3)).max(1.0 / 3.0);
            growth = 2.0;
        } else {
            damping *= growth;
            growth *= 2.0;
            if damping > STUCK {
                break;
            }
        }
    }
    at.residuals
        .norm_squared()
        .is_finite()
        .then_some(Minimum { x, at })
}

/// The step, and by how much the linearised sum of squares falls with it.
fn damped_step(at: &Linearised, scale: &DVector<f64>, damping: f64) -> Option<(DVector<f64>, f64)> {
    let mut scaled = at.jacobian.clone();
    for (mut column, scale) in scaled.column_iter_mut().zip(scale) {
        column /= *scale;
    }
    let gradient = scaled.tr_mul(&at.residuals);
    let mut normal = scaled.tr_mul(&scaled);
    for i in 0..normal.nrows() {
        normal[(i, i)] += damping;
    }
    let step = -normal.cholesky()?.solve(&gradient);
    let promised = step.dot(&(&step * damping - &gradient));
    Some((step.component_div(scale), promised))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_valley_of_rosenbrock_is_followed_to_its_end() {
        let valley = |x: &DVector<f64>| {
            Some(Linearised {
                residuals: DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]),
                jacobian: DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]),
            })
        };
        let found = minimise(DVector::from_vec(vec![-1.2, 1.0]), valley).expect("finite");
        assert!((found.x - DVector::from_element(2, 1.0)).norm() < 1e-9);
    }

    #[test]
    fn an_unknown_that_nothing_depends_on_stays_where_it_was() {
        let flat = |x: &DVector<f64>| {
            Some(Linearised {
                residuals: DVector::from_vec(vec![x[0] - 3.0, 2.0 * (x[0] - 3.0)]),
                jacobian: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 2.0, 0.0]),
            })
        };
        let found = minimise(DVector::from_vec(vec![0.0, 7.0]), flat).expect("finite");
        assert!(
            (found.x[0] - 3.0).abs() < 1e-9 && found.x[1] == 7.0,
            "{}",
            found.x
        );
    }
}
