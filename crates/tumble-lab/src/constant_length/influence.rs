//! Influence of each pose on the result, and error of the prediction of unseen poses.

use nalgebra::{DMatrix, DVector};

use super::whitening::ResidualWhitening;

/// A fit, linearised where it ended.
#[derive(Clone, Debug)]
pub struct LinearFit {
    /// Residuals, unit of the readings.
    pub values: DVector<f64>,
    /// Their derivative by the unknowns.
    pub rows: DMatrix<f64>,
    /// Covariance of the unknowns, from noise alone.
    pub covariance: DMatrix<f64>,
    /// ResidualWhitening of the residuals.
    pub whitening: ResidualWhitening,
}

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
    fit: &'a LinearFit,
    rows: DMatrix<f64>,
    /// Gains from unknowns to whitened residuals.
    gains: DMatrix<f64>,
    /// Whitened residuals that no fit takes up.
    left: DVector<f64>,
}

/// Influence of each reading, given by the places of its residuals (Cook 1977; docs/theory/multipose.md, eq. 7 and 8).
pub fn influence(fit: &LinearFit, readings: &[Vec<usize>]) -> Vec<Influence> {
    let answer = Answer::of(fit);
    let sigmas = fit.covariance.diagonal().map(f64::sqrt);
    let of_reading = |places: &Vec<usize>| {
        let (own, shown_by_others) = answer.alone(places);
        let change = answer.change(&own, &shown_by_others);
        let change = change.map_or(f64::INFINITY, |change| {
            let each = change
                .iter()
                .zip(&sigmas)
                .map(|(change, sigma)| (change / sigma).abs());
            each.fold(0.0, f64::max)
        });
        Influence {
            leverage: 1.0 - shown_by_others.trace() / own.norm_squared(), // eq. 7
            change,
        }
    };
    readings.iter().map(of_reading).collect()
}

/// Size of the residual of each reading by a fit without it, in sigmas of that: root mean square of its components; zero where
/// nothing else shows it (docs/theory/magnetometer.md, eq. 8).
pub fn misfits(fit: &LinearFit, readings: &[Vec<usize>]) -> Vec<f64> {
    let answer = Answer::of(fit);
    let of_reading = |places: &Vec<usize>| {
        let (own, shown_by_others) = answer.alone(places);
        let left = own.tr_mul(&answer.left);
        let solved = shown_by_others.cholesky().map(|solver| solver.solve(&left));
        #[allow(clippy::cast_precision_loss)]
        let components = places.len() as f64;
        solved.map_or(0.0, |solved| (left.dot(&solved) / components).sqrt())
    };
    readings.iter().map(of_reading).collect()
}

/// Each residual by a fit without any reading of its group, to first order; `None` where the others do not carry one
/// (docs/theory/multipose.md, eq. 8).
pub fn held_out(fit: &LinearFit, readings: &[Vec<usize>], groups: &[usize]) -> Vec<Option<f64>> {
    let answer = Answer::of(fit);
    let mut residuals = vec![None; fit.values.len()];
    let last = groups.iter().max().map_or(0, |last| last + 1);
    for group in 0..last {
        let of_group = groups.iter().zip(readings).filter(|(own, _)| **own == group);
        let members: Vec<usize> = of_group.flat_map(|(_, places)| places.clone()).collect();
        if members.is_empty() {
            continue;
        }
        let (own, shown_by_others) = answer.alone(&members);
        let leverage = 1.0 - shown_by_others.trace() / own.norm_squared();
        let change = answer
            .change(&own, &shown_by_others)
            .filter(|_| leverage < DECISIVE);
        for k in members {
            let moved = |change: &DVector<f64>| (fit.rows.row(k) * change)[0];
            residuals[k] = change.as_ref().map(|change| fit.values[k] - moved(change));
        }
    }
    residuals
}

impl<'a> Answer<'a> {
    fn of(fit: &'a LinearFit) -> Self {
        let mut rows = fit.rows.clone();
        fit.whitening.apply(&mut rows);
        let gains = &fit.covariance * rows.transpose();
        let values = fit.whitening.of(fit.values.clone());
        Self {
            left: &values - &rows * (&gains * &values),
            fit,
            rows,
            gains,
        }
    }

    /// These residuals alone, whitened, and the share that the fit leaves of them.
    fn alone(&self, places: &[usize]) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut own = DMatrix::zeros(self.rows.nrows(), places.len());
        for (column, place) in places.iter().enumerate() {
            own[(*place, column)] = 1.0;
        }
        self.fit.whitening.apply(&mut own);
        let taken_up = own.tr_mul(&self.rows) * (&self.gains * &own);
        let left = own.tr_mul(&own) - taken_up;
        (own, left)
    }

    /// By how much the unknowns are what they are because of these residuals; `None` where nothing else shows them.
    fn change(&self, own: &DMatrix<f64>, shown_by_others: &DMatrix<f64>) -> Option<DVector<f64>> {
        let pulled = shown_by_others.clone().cholesky()?.solve(&own.tr_mul(&self.left));
        // A residual that is high has pulled the unknowns down its slope.
        Some(-(&self.gains * own * pulled)) // eq. 8
    }
}
