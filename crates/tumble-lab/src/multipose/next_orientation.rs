//! Which orientation to add: the one that lowers the largest sigma most.

use nalgebra::{SMatrix, SVector, Vector3};

use super::accelerometer::{AccelerometerFit, RestForce, UNKNOWNS, own, residual, sizes};
use crate::constant_length::directions::covering;

/// Candidates all over the sphere, 7 deg apart.
const CANDIDATES: u32 = 1000;

/// An orientation that is worth adding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextOrientation {
    /// Up in the case frame there, a unit vector.
    pub up: Vector3<f64>,
    /// Largest sigma of an unknown as it is, in units of scale or of g.
    pub before: f64,
    /// The same with a rest more there.
    pub after: f64,
    /// Which unknown that is, as in [`super::accelerometer::PLACES`].
    pub unknown: usize,
}

/// Tries a rest of median noise all over the sphere (docs/theory/multipose.md, eq. 9).
pub fn next_orientation(
    fit: &AccelerometerFit,
    rests: &[RestForce],
    gravity: f64,
) -> Option<NextOrientation> {
    let size = sizes(gravity);
    let largest = |covariance: &SMatrix<f64, UNKNOWNS, UNKNOWNS>| {
        covariance.diagonal().map(f64::sqrt).component_div(&size).argmax()
    };
    let (unknown, before) = largest(&fit.covariance);
    let variance = median_variance(rests)?;
    let tried = covering(CANDIDATES).filter_map(|up| {
        let rest = RestForce {
            mean: fit.model.measure(&(up * gravity)),
            variance,
        };
        let found = residual(&fit.model, &rest, gravity)?;
        let row: SVector<f64, UNKNOWNS> = own(&found.row) / found.sigma;
        let gain = fit.covariance * row;
        let with = fit.covariance - gain * gain.transpose() / (1.0 + row.dot(&gain)); // eq. 9
        Some(NextOrientation {
            up,
            before,
            after: largest(&with).1,
            unknown,
        })
    });
    tried.min_by(|a, b| a.after.total_cmp(&b.after))
}

fn median_variance(rests: &[RestForce]) -> Option<Vector3<f64>> {
    let mut variances: Vec<_> = rests.iter().map(|rest| rest.variance).collect();
    variances.sort_by(|a, b| a.sum().total_cmp(&b.sum()));
    variances.get(variances.len() / 2).copied()
}
