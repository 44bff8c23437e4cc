//! Influence of each pose on the result, and error of the prediction of unseen poses.

use nalgebra::{DMatrix, DVector};

use super::accelerometer::AccelerometerFit;
use super::settings::FEWEST_DIRECTIONS;

/// Change of the fit without a rest, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Share of the rest's own residual that the fit takes up: one where nothing else shows what it shows.
    pub leverage: f64,
    /// Largest change of an unknown without the rest, in units of its sigma.
    pub change: f64,
}

/// Leverage beyond which the others do not carry a fit.
const DECISIVE: f64 = 1.0 - 1e-6;

/// A fit as it answers to its residuals.
struct Answer<'a> {
    fit: &'a AccelerometerFit,
    rows: DMatrix<f64>,
    /// Gains from unknowns to whitened residuals.
    gains: DMatrix<f64>,
    /// Whitened residuals that no fit takes up.
    left: DVector<f64>,
}

/// Influence of each rest (Cook 1977; docs/theory/multipose.md, eq. 7 and 8).
pub fn influence(fit: &AccelerometerFit) -> Vec<Influence> {
    let answer = Answer::of(fit);
    let sigmas = fit.covariance.diagonal().map(f64::sqrt);
    let of_rest = |k: usize| {
        let (own, shown_by_others) = answer.alone(&[k]);
        let change = answer.change(&own, &shown_by_others);
        let change = change.map_or(f64::INFINITY, |change| {
            let each = change
                .iter()
                .zip(&sigmas)
                .map(|(change, sigma)| (change / sigma).abs());
            each.fold(0.0, f64::max)
        });
        Influence {
            leverage: 1.0 - shown_by_others[(0, 0)] / own.norm_squared(), // eq. 7
            change,
        }
    };
    (0..fit.residuals.len()).map(of_rest).collect()
}

/// `|u| - g` of each rest, m/s^2, by a fit without any rest in its direction, to first order; `None` where the others do not
/// carry one (docs/theory/multipose.md, eq. 8).
pub fn held_out(fit: &AccelerometerFit) -> Vec<Option<f64>> {
    let answer = Answer::of(fit);
    let mut residuals = vec![None; fit.residuals.len()];
    let groups = fit.groups.iter().max().map_or(0, |last| last + 1);
    if groups <= FEWEST_DIRECTIONS {
        return residuals;
    }
    for group in 0..groups {
        let members: Vec<usize> = (0..residuals.len()).filter(|k| fit.groups[*k] == group).collect();
        let (own, shown_by_others) = answer.alone(&members);
        let leverage = 1.0 - shown_by_others.trace() / own.norm_squared();
        let change = answer
            .change(&own, &shown_by_others)
            .filter(|_| leverage < DECISIVE);
        for k in members {
            let found = &fit.residuals[k];
            let moved =
                |change: &DVector<f64>| -> f64 { found.row.iter().zip(change).map(|(a, b)| a * b).sum() };
            residuals[k] = change.as_ref().map(|change| found.value - moved(change));
        }
    }
    residuals
}

impl<'a> Answer<'a> {
    fn of(fit: &'a AccelerometerFit) -> Self {
        let rows = fit.whitened_rows();
        let unknowns = rows.ncols();
        let gains = DMatrix::from_fn(unknowns, unknowns, |i, j| fit.covariance[(i, j)]) * rows.transpose();
        let values = fit.whitened_residuals();
        Self {
            left: &values - &rows * (&gains * &values),
            fit,
            rows,
            gains,
        }
    }

    /// Readings of these rests alone, whitened, and the share that the fit leaves of them.
    fn alone(&self, rests: &[usize]) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut own = DMatrix::zeros(self.rows.nrows(), rests.len());
        for (column, rest) in rests.iter().enumerate() {
            own[(*rest, column)] = 1.0;
        }
        self.fit.factor.solve_lower_triangular_mut(&mut own);
        let taken_up = own.tr_mul(&self.rows) * (&self.gains * &own);
        let left = own.tr_mul(&own) - taken_up;
        (own, left)
    }

    /// By how much the unknowns are what they are because of these rests; `None` where nothing else shows them.
    fn change(&self, own: &DMatrix<f64>, shown_by_others: &DMatrix<f64>) -> Option<DVector<f64>> {
        let pulled = shown_by_others.clone().cholesky()?.solve(&own.tr_mul(&self.left));
        // A residual that is high has pulled the unknowns down its slope.
        Some(-(&self.gains * own * pulled)) // eq. 8
    }
}
