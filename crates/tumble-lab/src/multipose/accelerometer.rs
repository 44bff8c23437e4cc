//! The accelerometer: at rest in any orientation the length of specific force is g (docs/theory/multipose.md).
//!
//! Nobody knows how the unit was held, so the case frame is that of the sensing axes: x along the first, y in the plane of
//! the first two. M is lower triangular then, `Q = 1`.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};
use tumble_core::model::ErrorModel;

use super::directions;
use super::error::MultiposeError;
use super::levenberg_marquardt::{Linearised, minimise};
use super::observability;
use super::robust;
use super::settings::FEWEST_DIRECTIONS;

/// Six elements of M and three biases.
pub const UNKNOWNS: usize = 9;

/// Where the unknowns stand in `[M row by row, b]`.
pub const PLACES: [usize; UNKNOWNS] = [0, 3, 4, 6, 7, 8, 9, 10, 11];

/// Rounds in which weights settle.
const ROUNDS: u32 = 6;

/// Measurement at a rest.
#[derive(Clone, Copy, Debug)]
pub struct RestForce {
    /// Mean reading, m/s^2.
    pub mean: Vector3<f64>,
    /// Variance of the mean of each axis, (m/s^2)^2.
    pub variance: Vector3<f64>,
}

/// All rests that an accelerometer is fitted to, and what their means have in common.
#[derive(Clone, Debug)]
pub struct RestForces {
    /// Rests, in order of time.
    pub rests: Vec<RestForce>,
    /// B^2 of each axis, (m/s^2)^2.
    pub flicker: Vector3<f64>,
    /// Covariance of flicker of B = 1 among the rests (docs/theory/noise.md, eq. 4).
    pub remembered: DMatrix<f64>,
}

impl RestForces {
    /// Rests whose noise is white.
    pub fn independent(rests: Vec<RestForce>) -> Self {
        Self {
            flicker: Vector3::zeros(),
            remembered: DMatrix::zeros(rests.len(), rests.len()),
            rests,
        }
    }

    /// Lower triangle that whitens the residuals: what rests have in common is bias instability
    /// (docs/theory/multipose.md, eq. 4).
    fn factor(&self, residuals: &[NormResidual], weights: &[f64]) -> Option<DMatrix<f64>> {
        let size = residuals.len();
        let own = |k: usize| residuals[k].sigma.powi(2) / weights[k];
        if self.flicker == Vector3::zeros() {
            return Some(DMatrix::from_fn(size, size, |k, l| {
                if k == l { own(k).sqrt() } else { 0.0 }
            }));
        }
        let responses: Vec<_> = residuals.iter().map(NormResidual::response).collect();
        let wandering: Vec<_> = responses.iter().map(|v| v.component_mul(&self.flicker)).collect();
        let mut covariance = DMatrix::zeros(size, size);
        for k in 0..size {
            covariance[(k, k)] = own(k);
            for l in 0..k {
                // The factor is made of the lower triangle alone.
                covariance[(k, l)] = wandering[k].dot(&responses[l]) * self.remembered[(k, l)]; // eq. 4
            }
        }
        covariance.cholesky().map(|factor| factor.l())
    }
}

/// The length of gravity at a rest against what it should be.
#[derive(Clone, Copy, Debug)]
pub struct NormResidual {
    /// `|u| - g`, m/s^2.
    pub value: f64,
    /// 1-sigma of the same from noise, m/s^2.
    pub sigma: f64,
    /// Corrected specific force, m/s^2.
    pub force: Vector3<f64>,
    /// Derivative of the value by the unknowns.
    pub row: SVector<f64, UNKNOWNS>,
}

impl NormResidual {
    /// Derivative of the value by the reading.
    pub fn response(&self) -> Vector3<f64> {
        -self.row.fixed_rows::<3>(6)
    }
}

/// Scale, non-orthogonality and bias of an accelerometer.
#[derive(Clone, Debug)]
pub struct AccelerometerFit {
    /// M, lower triangular, and b.
    pub model: ErrorModel<f64>,
    /// Covariance of the unknowns, from noise alone.
    pub covariance: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Residual of each rest.
    pub residuals: Vec<NormResidual>,
    /// Weight of each rest in the robust loss; one where none stands out.
    pub weights: Vec<f64>,
    /// Direction each rest shows, numbered.
    pub groups: Vec<usize>,
    /// Lower triangle that whitens residuals.
    pub factor: DMatrix<f64>,
}

impl AccelerometerFit {
    /// Sum of the squares of the whitened residuals.
    pub fn chi_square(&self) -> f64 {
        self.whitened_residuals().norm_squared()
    }

    /// Rests less unknowns.
    pub fn degrees_of_freedom(&self) -> u32 {
        u32::try_from(self.residuals.len().saturating_sub(UNKNOWNS)).unwrap_or(u32::MAX)
    }

    /// Residuals, each independent of the others and of sigma one.
    pub fn whitened_residuals(&self) -> DVector<f64> {
        let mut values = DVector::from_iterator(self.residuals.len(), self.residuals.iter().map(|r| r.value));
        self.factor.solve_lower_triangular_mut(&mut values);
        values
    }

    /// Their derivative by the unknowns.
    pub fn whitened_rows(&self) -> DMatrix<f64> {
        whitened_rows(&self.residuals, &self.factor)
    }
}

fn whitened_rows(residuals: &[NormResidual], factor: &DMatrix<f64>) -> DMatrix<f64> {
    let mut rows = DMatrix::from_fn(residuals.len(), UNKNOWNS, |k, i| residuals[k].row[i]);
    factor.solve_lower_triangular_mut(&mut rows);
    rows
}

/// Typical size of each unknown: a scale of one, a bias of g.
pub fn sizes(gravity: f64) -> SVector<f64, UNKNOWNS> {
    SVector::from_fn(|i, _| if i < 6 { 1.0 } else { gravity })
}

/// Length of the corrected mean of a rest less g, with its derivative; `None` where M has no inverse.
pub fn residual(model: &ErrorModel<f64>, rest: &RestForce, gravity: f64) -> Option<NormResidual> {
    let correction = model.correction().ok()?;
    let force = correction.apply(&rest.mean); // eq. 1
    let length = force.norm();
    // Response of the length to the reading: C^T u / |u|.
    let response = correction.matrix.tr_mul(&force) / length; // eq. 3
    let by_element = |i: usize, j: usize| -response[i] * force[j]; // eq. 3
    let row = SVector::from_fn(|unknown, _| match PLACES[unknown] {
        place @ 0..9 => by_element(place / 3, place % 3),
        place => -response[place - 9],
    });
    Some(NormResidual {
        value: length - gravity,                                             // eq. 2
        sigma: response.component_mul(&response).dot(&rest.variance).sqrt(), // eq. 4
        force,
        row,
    })
}

/// The model of the unknowns.
pub fn model_of(x: &DVector<f64>) -> ErrorModel<f64> {
    ErrorModel {
        matrix: Matrix3::new(x[0], 0.0, 0.0, x[1], x[2], 0.0, x[3], x[4], x[5]),
        bias: Vector3::new(x[6], x[7], x[8]),
    }
}

/// The unknowns of a model whose M is lower triangular.
pub fn unknowns_of(model: &ErrorModel<f64>) -> DVector<f64> {
    DVector::from_fn(UNKNOWNS, |unknown, _| match PLACES[unknown] {
        place @ 0..9 => model.matrix[(place / 3, place % 3)],
        place => model.bias[place - 9],
    })
}

/// Fits all rests, from a model that may be far off.
///
/// # Errors
/// [`MultiposeError`] where the rests do not show all nine unknowns, or nothing to check them by.
pub fn fit_forces(
    data: &RestForces,
    gravity: f64,
    start: &ErrorModel<f64>,
) -> Result<AccelerometerFit, MultiposeError> {
    let rests = &data.rests;
    refuse_too_few(rests, start)?;
    let mut weights = vec![1.0; rests.len()];
    let mut x = unknowns_of(start);
    // A direction that is not observable from the start leads a fit astray.
    finish(&x, data, gravity, weights.clone())?;
    for _ in 0..ROUNDS {
        let sigmas = residuals_at(&x, rests, gravity)?;
        let factor = data.factor(&sigmas, &weights).ok_or(MultiposeError::Unsolvable)?;
        let solved = minimise(x.clone(), |x| whitened(x, rests, gravity, &factor));
        x = solved.ok_or(MultiposeError::Unsolvable)?.x;
        let found = residuals_at(&x, rests, gravity)?;
        let normalised: Vec<f64> = found.iter().map(|r| r.value / r.sigma).collect();
        let before = std::mem::replace(&mut weights, robust::weights(&normalised, UNKNOWNS));
        let change = weights.iter().zip(&before).map(|(a, b)| (a - b).abs());
        if change.fold(0.0, f64::max) < 1e-6 {
            break;
        }
    }
    finish(&x, data, gravity, weights)
}

fn refuse_too_few(rests: &[RestForce], start: &ErrorModel<f64>) -> Result<(), MultiposeError> {
    let correction = start.correction()?;
    let ups: Vec<_> = rests
        .iter()
        .map(|rest| correction.apply(&rest.mean).normalize())
        .collect();
    let found = directions::count(&directions::grouped(&ups));
    if rests.is_empty() {
        Err(MultiposeError::NoRests)
    } else if found < FEWEST_DIRECTIONS {
        Err(MultiposeError::TooFewDirections {
            found,
            needed: FEWEST_DIRECTIONS,
            rests: rests.len(),
        })
    } else {
        Ok(())
    }
}

fn residuals_at(
    x: &DVector<f64>,
    rests: &[RestForce],
    gravity: f64,
) -> Result<Vec<NormResidual>, MultiposeError> {
    let model = model_of(x);
    let each = rests.iter().map(|rest| residual(&model, rest, gravity));
    let found: Option<Vec<_>> = each.collect();
    let usable = |all: &Vec<NormResidual>| all.iter().all(|r| r.sigma > 0.0 && r.value.is_finite());
    found.filter(usable).ok_or(MultiposeError::Unsolvable)
}

/// Residuals whitened by what they scattered at the start of the round, so that a larger scale does not make them smaller.
fn whitened(
    x: &DVector<f64>,
    rests: &[RestForce],
    gravity: f64,
    factor: &DMatrix<f64>,
) -> Option<Linearised> {
    let model = model_of(x);
    let mut all = DMatrix::zeros(rests.len(), UNKNOWNS + 1);
    for (k, rest) in rests.iter().enumerate() {
        let found = residual(&model, rest, gravity)?;
        all.view_mut((k, 0), (1, UNKNOWNS))
            .copy_from(&found.row.transpose());
        all[(k, UNKNOWNS)] = found.value;
    }
    factor.solve_lower_triangular_mut(&mut all);
    Some(Linearised {
        residuals: all.column(UNKNOWNS).into_owned(),
        jacobian: all.columns(0, UNKNOWNS).into_owned(),
    })
}

fn finish(
    x: &DVector<f64>,
    data: &RestForces,
    gravity: f64,
    weights: Vec<f64>,
) -> Result<AccelerometerFit, MultiposeError> {
    let residuals = residuals_at(x, &data.rests, gravity)?;
    let factor = data
        .factor(&residuals, &weights)
        .ok_or(MultiposeError::Unsolvable)?;
    let ups: Vec<_> = residuals.iter().map(|r| r.force.normalize()).collect();
    let sizes = DVector::from_column_slice(sizes(gravity).as_slice());
    let covariance = observability::covariance(&whitened_rows(&residuals, &factor), &sizes);
    let covariance = covariance.map_err(|shares| {
        let mut placed = [0.0; 12];
        for (place, share) in PLACES.iter().zip(&shares) {
            placed[*place] = *share;
        }
        MultiposeError::PosesLeaveOpen { shares: placed }
    })?;
    Ok(AccelerometerFit {
        model: model_of(x),
        covariance: SMatrix::from_fn(|i, j| covariance[(i, j)]),
        groups: directions::grouped(&ups),
        residuals,
        weights,
        factor,
    })
}
