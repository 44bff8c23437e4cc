//! The accelerometer: at rest in any orientation the length of specific force is g (docs/theory/multipose.md).
//!
//! Nobody knows how the unit was held, so the case frame is that of the sensing axes: x along the first, y in the plane of
//! the first two. M is lower triangular then, `Q = 1`.

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector3};
use tumble_core::model::{ErrorModel, PARAMETERS};

use super::error::MultiposeError;
use super::settings::FEWEST_DIRECTIONS;
use crate::constant_length::influence::{Influence, LinearFit, held_out, influence};
use crate::constant_length::levenberg_marquardt::Linearised;
use crate::constant_length::residual::LengthResidual;
use crate::constant_length::reweighted::{Problem, solve};
use crate::constant_length::whitening::ResidualWhitening;
use crate::constant_length::{directions, observability};
use crate::distributions::chi_square_tail;

/// Six elements of M and three biases.
pub const UNKNOWNS: usize = 9;

/// Where the unknowns stand in `[M row by row, b]`.
pub const PLACES: [usize; UNKNOWNS] = [0, 3, 4, 6, 7, 8, 9, 10, 11];

/// Measurement at a rest.
#[derive(Clone, Copy, Debug)]
pub struct RestForce {
    /// Mean reading, m/s^2.
    pub mean: Vector3<f64>,
    /// Variance of the mean of each axis, (m/s^2)^2.
    pub variance: Vector3<f64>,
}

/// Axes of an accelerometer.
const AXES: usize = 3;

/// Chance of a non-linearity where there is none.
const FALSE_ALARM: f64 = 0.02;

/// Terms of a response that is no straight line: a square and a magnitude for each axis.
const BENDS: usize = 2 * AXES;

/// Usual size of such terms beforehand, 1-sigma. By the square, 1 / (m/s^2): 1000 µg/g^2, three times what data sheets state
/// of parts of 16 g (0.5 % of full scale). By the magnitude, 1: half of 4000 ppm between the scales of both signs.
const USUAL_BENDS: [f64; 2] = [1e-4, 2e-3];

/// Response of each axis that is no straight line: a sensor that feels `f + k f^2 + h |f|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonLinearity {
    /// k, 1 / (m/s^2), and its 1-sigma.
    pub square: [Vector3<f64>; 2],
    /// h, 1, and its 1-sigma.
    pub magnitude: [Vector3<f64>; 2],
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
    fn whitening(&self, residuals: &[LengthResidual], weights: &[f64]) -> Option<ResidualWhitening> {
        let size = residuals.len();
        let own = |k: usize| residuals[k].sigma.powi(2) / weights[k];
        if self.flicker == Vector3::zeros() {
            return Some(ResidualWhitening::Each(DVector::from_fn(size, |k, _| {
                own(k).sqrt()
            })));
        }
        let responses: Vec<_> = residuals.iter().map(LengthResidual::response).collect();
        let wandering: Vec<_> = responses.iter().map(|v| v.component_mul(&self.flicker)).collect();
        let mut covariance = DMatrix::zeros(size, size);
        for k in 0..size {
            covariance[(k, k)] = own(k);
            for l in 0..k {
                // The factor is made of the lower triangle alone.
                covariance[(k, l)] = wandering[k].dot(&responses[l]) * self.remembered[(k, l)]; // eq. 4
            }
        }
        covariance
            .cholesky()
            .map(|factor| ResidualWhitening::Lower(factor.l()))
    }
}

/// Scale, non-orthogonality and bias of an accelerometer.
#[derive(Clone, Debug)]
pub struct AccelerometerFit {
    /// M, lower triangular, and b.
    pub model: ErrorModel<f64>,
    /// Covariance of the unknowns, from noise alone.
    pub covariance: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Covariance that a response adds which may be no line, though the residuals do not show it.
    pub of_response: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Residual of each rest.
    pub residuals: Vec<LengthResidual>,
    /// Weight of each rest in the robust loss; one where none stands out.
    pub weights: Vec<f64>,
    /// Direction each rest shows, numbered.
    pub groups: Vec<usize>,
    /// ResidualWhitening of the residuals.
    pub whitening: ResidualWhitening,
    /// Response that is no straight line, where the residuals show it.
    pub non_linearity: Option<NonLinearity>,
    /// Covariance of the unknowns and of its terms.
    joint_covariance: DMatrix<f64>,
    /// Sum of the squares of its terms over their usual sizes.
    beyond_usual: f64,
}

impl AccelerometerFit {
    /// Sum of the squares of the whitened residuals, and of the terms of a response that is no line over their usual sizes.
    pub fn chi_square(&self) -> f64 {
        self.whitened_residuals().norm_squared() + self.beyond_usual
    }

    /// Rests less unknowns: a term of usual size is one more of each.
    pub fn degrees_of_freedom(&self) -> u32 {
        u32::try_from(self.residuals.len().saturating_sub(UNKNOWNS)).unwrap_or(u32::MAX)
    }

    /// Residuals, each independent of the others and of sigma one.
    pub fn whitened_residuals(&self) -> DVector<f64> {
        self.whitening.of(values_of(&self.residuals))
    }

    /// The fit, linearised where it ended.
    fn linear(&self) -> LinearFit {
        LinearFit {
            values: values_of(&self.residuals),
            rows: match self.non_linearity {
                Some(_) => rows_with_bends(&self.model, &self.residuals),
                None => rows_of(&self.residuals),
            },
            covariance: self.joint_covariance.clone(),
            whitening: self.whitening.clone(),
        }
    }

    fn places(&self) -> Vec<Vec<usize>> {
        (0..self.residuals.len()).map(|k| vec![k]).collect()
    }

    /// Influence of each rest (docs/theory/multipose.md, eq. 7 and 8).
    pub fn influence(&self) -> Vec<Influence> {
        influence(&self.linear(), &self.places())
    }

    /// `|u| - g` of each rest, m/s^2, by a fit without any rest in its direction, to first order; `None` where the others do
    /// not carry one (docs/theory/multipose.md, eq. 8).
    pub fn held_out(&self) -> Vec<Option<f64>> {
        if directions::count(&self.groups) <= FEWEST_DIRECTIONS {
            return vec![None; self.residuals.len()];
        }
        held_out(&self.linear(), &self.places(), &self.groups)
    }
}

fn values_of(residuals: &[LengthResidual]) -> DVector<f64> {
    DVector::from_iterator(residuals.len(), residuals.iter().map(|r| r.value))
}

fn rows_of(residuals: &[LengthResidual]) -> DMatrix<f64> {
    DMatrix::from_fn(residuals.len(), UNKNOWNS, |k, i| residuals[k].row[PLACES[i]])
}

/// Part of a derivative by `[M row by row, b]` that belongs to the unknowns.
pub(super) fn own(row: &SVector<f64, PARAMETERS>) -> SVector<f64, UNKNOWNS> {
    SVector::from_fn(|i, _| row[PLACES[i]])
}

/// Typical size of each unknown: a scale of one, a bias of g.
pub fn sizes(gravity: f64) -> SVector<f64, UNKNOWNS> {
    SVector::from_fn(|i, _| if i < 6 { 1.0 } else { gravity })
}

/// Length of the corrected mean of a rest less g, with its derivative; `None` where M has no inverse.
pub fn residual(model: &ErrorModel<f64>, rest: &RestForce, gravity: f64) -> Option<LengthResidual> {
    let correction = model.correction().ok()?;
    Some(LengthResidual::of(
        &correction,
        &rest.mean,
        &rest.variance,
        gravity,
    ))
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
    refuse_too_few(&data.rests, start)?;
    let mut weights = vec![1.0; data.rests.len()];
    let start = unknowns_of(start);
    // A direction that is not observable from the start leads a fit astray.
    finish(&start, data, gravity, weights.clone())?;
    let x = solve(&Lengths { data, gravity }, start, &mut weights).ok_or(MultiposeError::Unsolvable)?;
    let plain = finish(&x, data, gravity, weights.clone())?;
    let Some(bent) = bends(&plain) else {
        return Ok(plain);
    };
    if !bent.is_shown() {
        return Ok(AccelerometerFit {
            of_response: bent.beyond_a_line(&plain.covariance),
            ..plain
        });
    }
    let linear = linearised(data, &plain, &bent.terms());
    let lengths = Lengths {
        data: &linear,
        gravity,
    };
    let x = solve(&lengths, x, &mut weights).ok_or(MultiposeError::Unsolvable)?;
    Ok(AccelerometerFit {
        covariance: SMatrix::from_fn(|i, j| bent.covariance[(i, j)]),
        non_linearity: Some(bent.non_linearity()),
        beyond_usual: bent.terms().component_div(&usual_bends()).norm_squared(),
        joint_covariance: bent.covariance,
        ..finish(&x, &linear, gravity, weights)?
    })
}

/// Fit with a response that is no line.
struct Bent {
    /// Change of the unknowns, then the terms, squares first.
    step: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Decrease of the sum of squares, the terms over their usual sizes among them, in units of what remains for each degree of
    /// freedom where that is more than noise: a pose that was touched is no bend.
    explained: f64,
    /// Number of terms that the residuals determine, each by the share that is not known beforehand.
    determined: f64,
}

impl Bent {
    /// Terms of the response, squares first.
    fn terms(&self) -> SVector<f64, BENDS> {
        terms_of(&self.step)
    }

    /// True where the residuals show the response to be no line beyond chance.
    fn is_shown(&self) -> bool {
        #[allow(clippy::cast_precision_loss)]
        let freedom = BENDS as f64;
        chi_square_tail(self.explained.max(0.0), freedom) < FALSE_ALARM // eq. 40
    }

    /// Covariance of the unknowns about a fit of a line, of both fits by their Akaike weights, less that of noise alone
    /// (docs/theory/multipose.md, eq. 40a).
    fn beyond_a_line(&self, line: &SMatrix<f64, UNKNOWNS, UNKNOWNS>) -> SMatrix<f64, UNKNOWNS, UNKNOWNS> {
        let weight = (1.0 + libm::exp(self.determined - 0.5 * self.explained)).recip();
        SMatrix::from_fn(|i, j| {
            weight * (self.covariance[(i, j)] + self.step[i] * self.step[j] - line[(i, j)]) // eq. 40a
        })
    }

    fn non_linearity(&self) -> NonLinearity {
        let of = |first: usize| {
            let place = |axis: usize| UNKNOWNS + first + axis;
            [
                Vector3::from_fn(|axis, _| self.step[place(axis)]),
                Vector3::from_fn(|axis, _| self.covariance[(place(axis), place(axis))].sqrt()),
            ]
        };
        NonLinearity {
            square: of(0),
            magnitude: of(AXES),
        }
    }
}

fn terms_of(step: &DVector<f64>) -> SVector<f64, BENDS> {
    SVector::from_fn(|term, _| step[UNKNOWNS + term])
}

fn usual_bends() -> SVector<f64, BENDS> {
    SVector::from_fn(|term, _| USUAL_BENDS[term / AXES])
}

/// The fit with a response that is no line, to first order; `None` where too few directions check it
/// (docs/theory/multipose.md, eq. 39).
fn bends(plain: &AccelerometerFit) -> Option<Bent> {
    if directions::count(&plain.groups) <= UNKNOWNS + AXES {
        return None;
    }
    let mut rows = rows_with_bends(&plain.model, &plain.residuals);
    plain.whitening.apply(&mut rows);
    let values = plain.whitening.of(values_of(&plain.residuals));
    let usual = usual_bends();
    let mut information = rows.tr_mul(&rows);
    for term in 0..BENDS {
        information[(UNKNOWNS + term, UNKNOWNS + term)] += usual[term].powi(-2);
    }
    let covariance = information.cholesky()?.inverse();
    let step = -(&covariance * rows.tr_mul(&values));
    let left =
        (&values + &rows * &step).norm_squared() + terms_of(&step).component_div(&usual).norm_squared();
    #[allow(clippy::cast_precision_loss)]
    let freedom = (values.len() - UNKNOWNS) as f64;
    let explained = (values.norm_squared() - left) / (left / freedom).max(1.0);
    let share = |term: usize| {
        let place = UNKNOWNS + term;
        1.0 - covariance[(place, place)] / usual[term].powi(2)
    };
    let determined = (0..BENDS).map(share).sum();
    Some(Bent {
        step,
        covariance,
        explained,
        determined,
    })
}

/// Derivatives of the residuals by the unknowns, and by the terms of a response that is no line.
fn rows_with_bends(model: &ErrorModel<f64>, residuals: &[LengthResidual]) -> DMatrix<f64> {
    let mut rows = rows_of(residuals).insert_columns(UNKNOWNS, BENDS, 0.0);
    for (k, residual) in residuals.iter().enumerate() {
        for axis in 0..AXES {
            let of_axis = -residual.response().dot(&model.matrix.column(axis));
            rows[(k, UNKNOWNS + axis)] = of_axis * residual.vector[axis].powi(2); // eq. 39
            rows[(k, UNKNOWNS + AXES + axis)] = of_axis * residual.vector[axis].abs(); // eq. 39
        }
    }
    rows
}

/// The rests as a linear sensor would have read them.
fn linearised(data: &RestForces, plain: &AccelerometerFit, terms: &SVector<f64, BENDS>) -> RestForces {
    let each = data.rests.iter().zip(&plain.residuals);
    let rests = each.map(|(rest, residual)| {
        let bends = Vector3::from_fn(|axis, _| {
            let felt = residual.vector[axis];
            terms[axis] * felt.powi(2) + terms[AXES + axis] * felt.abs()
        });
        RestForce {
            mean: rest.mean - plain.model.matrix * bends, // eq. 39
            ..*rest
        }
    });
    RestForces {
        rests: rests.collect(),
        ..data.clone()
    }
}

/// Rests whose corrected length is gravity.
struct Lengths<'a> {
    data: &'a RestForces,
    gravity: f64,
}

impl Problem for Lengths<'_> {
    fn linearised(&self, x: &DVector<f64>) -> Option<Linearised> {
        let correction = model_of(x).correction().ok()?;
        let each = self.data.rests.iter();
        let found: Vec<_> = each
            .map(|rest| LengthResidual::of(&correction, &rest.mean, &rest.variance, self.gravity))
            .collect();
        Some(Linearised {
            residuals: values_of(&found),
            jacobian: rows_of(&found),
        })
    }

    fn whitening(&self, x: &DVector<f64>, weights: &[f64]) -> Option<ResidualWhitening> {
        let found = residuals_at(x, &self.data.rests, self.gravity).ok()?;
        self.data.whitening(&found, weights)
    }

    fn normalised(&self, x: &DVector<f64>) -> Option<Vec<f64>> {
        let found = residuals_at(x, &self.data.rests, self.gravity).ok()?;
        Some(found.iter().map(|r| r.value / r.sigma).collect())
    }
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
) -> Result<Vec<LengthResidual>, MultiposeError> {
    let model = model_of(x);
    let each = rests.iter().map(|rest| residual(&model, rest, gravity));
    let found: Option<Vec<_>> = each.collect();
    let usable = |all: &Vec<LengthResidual>| all.iter().all(|r| r.sigma > 0.0 && r.value.is_finite());
    found.filter(usable).ok_or(MultiposeError::Unsolvable)
}

fn finish(
    x: &DVector<f64>,
    data: &RestForces,
    gravity: f64,
    weights: Vec<f64>,
) -> Result<AccelerometerFit, MultiposeError> {
    let residuals = residuals_at(x, &data.rests, gravity)?;
    let whitening = data
        .whitening(&residuals, &weights)
        .ok_or(MultiposeError::Unsolvable)?;
    let ups: Vec<_> = residuals.iter().map(|r| r.vector.normalize()).collect();
    let mut rows = rows_of(&residuals);
    whitening.apply(&mut rows);
    let sizes = DVector::from_column_slice(sizes(gravity).as_slice());
    let covariance = observability::covariance(&rows, &sizes);
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
        joint_covariance: covariance,
        groups: directions::grouped(&ups),
        residuals,
        weights,
        whitening,
        non_linearity: None,
        beyond_usual: 0.0,
        of_response: SMatrix::zeros(),
    })
}
