//! All unknowns at once: the length of the field is the same at all readings, and so is its part along gravity
//! (docs/theory/magnetometer.md).

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use rayon::prelude::*;
use tumble_core::model::{ErrorModel, ModelCovariance, PARAMETERS};

use super::alignment::rotation_by_dip;
use super::error::MagnetometerError;
use super::readings::{FieldReading, FieldReadings};
use crate::constant_length::influence::{LinearFit, misfits};
use crate::constant_length::levenberg_marquardt::Linearised;
use crate::constant_length::residual::{LengthResidual, derivative};
use crate::constant_length::reweighted::{Problem, solve};
use crate::constant_length::sphere::{sphere, start};
use crate::constant_length::whitening::ResidualWhitening;
use crate::constant_length::{directions, observability, robust};
use crate::distributions::{chi_square_tail, f_tail};
use crate::multipose::FEWEST_DIRECTIONS;
use crate::turntable::widening;

/// `[M row by row, b, response to current, upward part of the field]`.
pub const STATE: usize = 16;

const CURRENT: usize = PARAMETERS;
const UPWARD: usize = 15;

/// Chance, of any reading among all, below which one that disagrees so much is taken for disturbed.
pub(super) const FALSE_ALARM: f64 = 1e-3;

/// Share of the readings beyond which disturbance leaves nothing to trust.
const MOST_DISTURBED: f64 = 0.4;

/// Settings of a calibration of a magnetometer.
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldSettings {
    /// Strength of the field, uT; `None` where only ratios are to be found.
    pub strength: Option<f64>,
    /// True to fit the response to current, or throttle.
    pub current: bool,
}

/// Unknowns of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FieldUnknowns {
    /// All of M, and the upward part of the field: readings know up.
    aligned: bool,
    current: bool,
}

impl FieldUnknowns {
    /// Where the unknowns stand in the state.
    fn places(self) -> Vec<usize> {
        let matrix: &[usize] = if self.aligned {
            &[0, 1, 2, 3, 4, 5, 6, 7, 8]
        } else {
            &[0, 3, 4, 6, 7, 8]
        };
        let current = if self.current { CURRENT..UPWARD } else { 0..0 };
        let upward = self.aligned.then_some(UPWARD);
        matrix
            .iter()
            .copied()
            .chain(9..12)
            .chain(current)
            .chain(upward)
            .collect()
    }

    fn components(self) -> usize {
        1 + usize::from(self.aligned)
    }
}

/// State of a magnetometer and the field.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    model: ErrorModel<f64>,
    current: Vector3<f64>,
    upward: f64,
}

impl State {
    fn of(x: &DVector<f64>, layout: FieldUnknowns) -> Self {
        let mut all = [0.0; STATE];
        for (place, value) in layout.places().into_iter().zip(x.iter()) {
            all[place] = *value;
        }
        Self {
            model: ErrorModel {
                matrix: Matrix3::from_row_slice(&all[..9]),
                bias: Vector3::from_column_slice(&all[9..12]),
            },
            current: Vector3::from_column_slice(&all[CURRENT..UPWARD]),
            upward: all[UPWARD],
        }
    }

    fn unknowns(&self, layout: FieldUnknowns) -> DVector<f64> {
        let value = |place: usize| match place {
            0..9 => self.model.matrix[(place / 3, place % 3)],
            9..12 => self.model.bias[place - 9],
            CURRENT..UPWARD => self.current[place - CURRENT],
            _ => self.upward,
        };
        let places = layout.places();
        DVector::from_iterator(places.len(), places.iter().map(|place| value(*place)))
    }
}

/// Residuals of a reading: length, and part along gravity.
#[derive(Clone, Copy, Debug)]
pub struct FieldResidual {
    /// `|u|` less the strength, and upward part less that of all, uT; the latter zero where nothing shows up.
    pub values: Vector2<f64>,
    /// Covariance of both from noise of this reading alone, uT^2.
    pub covariance: Matrix2<f64>,
    /// Field in the case frame, uT.
    pub field: Vector3<f64>,
    /// Derivatives by the state.
    pub rows: SMatrix<f64, 2, STATE>,
    /// Derivative of the upward part by the accelerometer's `[M row by row, b]`.
    by_accelerometer: SVector<f64, PARAMETERS>,
}

/// Fit of a magnetometer.
#[derive(Clone, Debug)]
pub struct FieldFit {
    /// M and b; M is lower triangular where nothing shows up.
    pub model: ErrorModel<f64>,
    /// Response to current, uT/A, where it was asked for.
    pub current: Option<Vector3<f64>>,
    /// Strength of the field, uT: as given, else as a sensor with a mean scale of one reads it.
    pub strength: f64,
    /// Upward part of the field, uT, where readings know up: negative where the field points down.
    pub upward: Option<f64>,
    /// Covariance of the state and, last, of the strength, from noise alone; zero where something is no unknown.
    pub covariance: SMatrix<f64, 17, 17>,
    /// Residuals of each reading, disturbed or not.
    pub residuals: Vec<FieldResidual>,
    /// Weight of each reading in the robust loss; zero where it is disturbed.
    pub weights: Vec<f64>,
    /// Chance that noise alone makes any reading disagree as much as each.
    pub chances: Vec<f64>,
    /// Direction each reading meets the field from, numbered.
    pub groups: Vec<usize>,
    /// Fit of what is not disturbed, linearised where it ended.
    pub linear: LinearFit,
    /// Readings that are not disturbed.
    pub used: Vec<usize>,
    /// Places of the unknowns in the state.
    pub places: Vec<usize>,
}

impl FieldFit {
    /// Sum of the squares of the whitened residuals.
    pub fn chi_square(&self) -> f64 {
        self.linear
            .whitening
            .of(self.linear.values.clone())
            .norm_squared()
    }

    /// Residuals less unknowns.
    pub fn degrees_of_freedom(&self) -> u32 {
        let freedom = self.linear.values.len().saturating_sub(self.places.len());
        u32::try_from(freedom).unwrap_or(u32::MAX)
    }

    /// Covariance of `[M row by row, b]`.
    pub fn model_covariance(&self) -> ModelCovariance<f64> {
        self.covariance
            .fixed_view::<PARAMETERS, PARAMETERS>(0, 0)
            .into_owned()
    }

    /// Tests whether readings know up.
    pub fn is_aligned(&self) -> bool {
        self.upward.is_some()
    }

    /// Dip of the field, rad, positive down.
    pub fn dip(&self) -> Option<f64> {
        self.upward
            .map(|upward| -(upward / self.strength).clamp(-1.0, 1.0).asin())
    }

    /// 1-sigma of the dip, rad.
    pub fn dip_sigma(&self) -> f64 {
        let (upward, strength) = (self.upward.unwrap_or(0.0), self.strength);
        let across = (strength * strength - upward * upward).max(1e-12).sqrt();
        let mut row = SVector::<f64, 17>::zeros();
        row[UPWARD] = -1.0 / across;
        row[16] = upward / (strength * across);
        (row.transpose() * self.covariance * row)[0].sqrt()
    }

    /// Places of the residuals of each used reading among those of the fit.
    pub fn residual_places(&self) -> Vec<Vec<usize>> {
        let components = 1 + usize::from(self.is_aligned());
        (0..self.used.len())
            .map(|k| (components * k..components * (k + 1)).collect())
            .collect()
    }
}

/// Readings whose corrected length, and part along gravity, are the same.
struct Constancy<'a> {
    data: &'a FieldReadings,
    strength: f64,
    layout: FieldUnknowns,
    places: Vec<usize>,
}

impl<'a> Constancy<'a> {
    fn of(data: &'a FieldReadings, strength: f64, layout: FieldUnknowns) -> Self {
        Self {
            data,
            strength,
            layout,
            places: layout.places(),
        }
    }

    fn residuals(&self, x: &DVector<f64>) -> Option<Vec<FieldResidual>> {
        let state = State::of(x, self.layout);
        let correction = state.model.correction().ok()?;
        let each = self.data.readings.iter().map(|reading| {
            let mean = reading.mean - state.current * reading.current; // eq. 1
            let length = LengthResidual::of(&correction, &mean, &reading.variance, self.strength);
            residual(reading, &length, &correction.matrix, state.upward)
        });
        let found: Vec<_> = each.collect();
        let finite = |r: &FieldResidual| r.values.iter().chain(r.covariance.iter()).all(|v| v.is_finite());
        found.iter().all(finite).then_some(found)
    }

    fn values(&self, residuals: &[FieldResidual]) -> DVector<f64> {
        let components = self.layout.components();
        DVector::from_fn(components * residuals.len(), |k, _| {
            residuals[k / components].values[k % components]
        })
    }

    fn rows(&self, residuals: &[FieldResidual]) -> DMatrix<f64> {
        let components = self.layout.components();
        DMatrix::from_fn(components * residuals.len(), self.places.len(), |k, i| {
            residuals[k / components].rows[(k % components, self.places[i])]
        })
    }

    fn whitening_of(&self, residuals: &[FieldResidual], weights: &[f64]) -> Option<ResidualWhitening> {
        if !self.layout.aligned {
            let sigmas = residuals
                .iter()
                .zip(weights)
                .map(|(r, weight)| (r.covariance[(0, 0)] / weight).sqrt());
            return Some(ResidualWhitening::Each(DVector::from_iterator(
                residuals.len(),
                sigmas,
            )));
        }
        let size = 2 * residuals.len();
        let mut covariance = DMatrix::zeros(size, size);
        for (k, (own, weight)) in residuals.iter().zip(weights).enumerate() {
            covariance
                .view_mut((2 * k, 2 * k), (2, 2))
                .copy_from(&(own.covariance / *weight));
            let common = self.data.accelerometer * own.by_accelerometer;
            for (l, other) in residuals.iter().enumerate().take(k + 1) {
                covariance[(2 * k + 1, 2 * l + 1)] += common.dot(&other.by_accelerometer); // eq. 6
            }
        }
        covariance
            .cholesky()
            .map(|factor| ResidualWhitening::Lower(factor.l()))
    }

    /// Size of the residual of each reading, in sigmas.
    fn sizes(&self, residuals: &[FieldResidual]) -> Option<Vec<f64>> {
        let components = self.layout.components();
        let each = residuals.iter().map(|r| {
            if components == 1 {
                return Some(r.values.x.abs() / r.covariance[(0, 0)].sqrt());
            }
            let mut covariance = r.covariance;
            covariance[(1, 1)] += self.by_accelerometer(r);
            let squares = r.values.dot(&covariance.cholesky()?.solve(&r.values));
            Some((0.5 * squares).sqrt())
        });
        each.collect()
    }
}

impl Constancy<'_> {
    /// Size of the residual of each reading that a fit has not seen, in sigmas of its prediction.
    fn prediction_sizes(
        &self,
        residuals: &[FieldResidual],
        covariance: &DMatrix<f64>,
    ) -> Result<Vec<f64>, MagnetometerError> {
        let components = self.layout.components();
        let each = residuals.iter().map(|own| {
            let rows = DMatrix::from_fn(components, self.places.len(), |k, i| {
                own.rows[(k, self.places[i])]
            });
            let mut total = &rows * covariance * rows.transpose();
            total += own.covariance.view((0, 0), (components, components));
            if components == 2 {
                total[(1, 1)] += self.by_accelerometer(own);
            }
            let value = DVector::from_fn(components, |k, _| own.values[k]);
            #[allow(clippy::cast_precision_loss)]
            let mean_square = value.dot(&total.cholesky()?.solve(&value)) / components as f64;
            Some(mean_square.sqrt())
        });
        each.collect::<Option<Vec<_>>>()
            .ok_or(MagnetometerError::FieldUnsolvable)
    }

    /// Variance of the upward part by the calibration of the accelerometer.
    fn by_accelerometer(&self, own: &FieldResidual) -> f64 {
        own.by_accelerometer
            .dot(&(self.data.accelerometer * own.by_accelerometer))
    }
}

impl Problem for Constancy<'_> {
    fn linearised(&self, x: &DVector<f64>) -> Option<Linearised> {
        let found = self.residuals(x)?;
        Some(Linearised {
            residuals: self.values(&found),
            jacobian: self.rows(&found),
        })
    }

    fn whitening(&self, x: &DVector<f64>, weights: &[f64]) -> Option<ResidualWhitening> {
        self.whitening_of(&self.residuals(x)?, weights)
    }

    fn normalised(&self, x: &DVector<f64>) -> Option<Vec<f64>> {
        self.sizes(&self.residuals(x)?)
    }

    fn components(&self) -> usize {
        self.layout.components()
    }
}

fn residual(
    reading: &FieldReading,
    length: &LengthResidual,
    inverse: &Matrix3<f64>,
    upward: f64,
) -> FieldResidual {
    let noise = Matrix3::from_diagonal(&reading.variance);
    let along = length.response();
    let mut found = FieldResidual {
        values: Vector2::new(length.value - length.excess, 0.0), // eq. 2
        covariance: Matrix2::from_diagonal(&Vector2::new(length.sigma.powi(2), 1.0)),
        field: length.vector,
        rows: SMatrix::zeros(),
        by_accelerometer: SVector::zeros(),
    };
    put_row(&mut found.rows, 0, &length.row, reading.current);
    if let Some(up) = &reading.up {
        let response = inverse.tr_mul(&up.direction);
        found.values.y = up.direction.dot(&length.vector) - upward; // eq. 3
        put_row(
            &mut found.rows,
            1,
            &derivative(&response, &length.vector),
            reading.current,
        );
        found.rows[(1, UPWARD)] = -1.0;
        let both = along.dot(&(noise * response));
        let of_up = length.vector.dot(&(up.covariance * length.vector));
        found.covariance = Matrix2::new(
            found.covariance[(0, 0)],
            both,
            both,
            response.dot(&(noise * response)) + of_up,
        ); // eq. 4
        found.by_accelerometer = up.by_accelerometer.tr_mul(&length.vector);
    }
    found
}

/// Fills a row of the derivative; current acts as bias does, times its size.
fn put_row(rows: &mut SMatrix<f64, 2, STATE>, row: usize, by_model: &SVector<f64, PARAMETERS>, current: f64) {
    for place in 0..PARAMETERS {
        rows[(row, place)] = by_model[place];
    }
    for axis in 0..3 {
        rows[(row, CURRENT + axis)] = by_model[9 + axis] * current;
    }
}

/// Fits a magnetometer to readings from many directions, some of which may be disturbed.
///
/// # Errors
/// [`MagnetometerError`] where the readings do not show all unknowns, or nothing to check them by.
pub fn fit_field(data: &FieldReadings, settings: &FieldSettings) -> Result<FieldFit, MagnetometerError> {
    let own_axes = FieldUnknowns {
        aligned: false,
        current: settings.current,
    };
    let needed = own_axes.places().len() + 1;
    if data.readings.len() < needed {
        return Err(MagnetometerError::TooFewReadings {
            found: data.readings.len(),
            needed,
        });
    }
    let means: Vec<_> = data.readings.iter().map(|reading| reading.mean).collect();
    let (_, radius) = sphere(&means).ok_or(MagnetometerError::Flat)?;
    let strength = settings.strength.unwrap_or(radius);
    let first = State {
        model: start(&means, strength),
        current: Vector3::zeros(),
        upward: 0.0,
    };
    refuse_too_few(data, &first)?;
    let layout = FieldUnknowns {
        aligned: data.know_up(),
        ..own_axes
    };
    let mut used: Vec<usize> = (0..data.readings.len()).collect();
    loop {
        let (state, weights) = settle(&data.only(&used), strength, first, layout)?;
        let all = Constancy::of(data, strength, layout);
        let residuals = all
            .residuals(&state.unknowns(layout))
            .ok_or(MagnetometerError::FieldUnsolvable)?;
        let chances = chances(&misfits_of(&all, &residuals, &used)?, layout);
        let mut disturbed = most_disturbed(&chances, &used, layout);
        if disturbed.is_empty() && layout.aligned {
            disturbed.extend(masked(&all, &residuals, &used, first)?);
        }
        if disturbed.is_empty() {
            let found = finish(&all, &state, residuals, (weights, used, chances))?;
            return Ok(if settings.strength.is_none() {
                relative(found)
            } else {
                found
            });
        }
        used.retain(|k| !disturbed.contains(k));
        #[allow(clippy::cast_precision_loss)]
        let too_few = used.len() < needed
            || ((data.readings.len() - used.len()) as f64) > MOST_DISTURBED * data.readings.len() as f64;
        if too_few {
            return Err(MagnetometerError::Disturbed {
                found: data.readings.len() - used.len(),
                readings: data.readings.len(),
            });
        }
    }
}

/// Readings to leave out next: of rests the one that disagrees most, as it may make others look disturbed; of many samples all.
fn most_disturbed(chances: &[f64], used: &[usize], layout: FieldUnknowns) -> Vec<usize> {
    let found: Vec<usize> = used
        .iter()
        .copied()
        .filter(|k| chances[*k] < FALSE_ALARM)
        .collect();
    if !layout.aligned {
        return found;
    }
    let worst = found
        .into_iter()
        .min_by(|a, b| chances[*a].total_cmp(&chances[*b]));
    worst.into_iter().collect()
}

/// The rest without which the others agree, where all disagree beyond chance and none stands out: one that is far off bends the
/// fit until all are (docs/theory/magnetometer.md, eq. 12).
fn masked(
    all: &Constancy<'_>,
    residuals: &[FieldResidual],
    used: &[usize],
    first: State,
) -> Result<Option<usize>, MagnetometerError> {
    let whole = chi_square(all, residuals, used)?;
    let freedom = (all.layout.components() * used.len()).saturating_sub(all.places.len());
    let left = freedom.saturating_sub(all.layout.components());
    if left == 0 || widening(whole, u32::try_from(freedom).unwrap_or(u32::MAX)) <= 1.0 {
        return Ok(None);
    }
    let without = |k: &usize| {
        let others: Vec<usize> = used.iter().copied().filter(|other| other != k).collect();
        let (state, _) = settle(&all.data.only(&others), all.strength, first, all.layout).ok()?;
        let residuals = all.residuals(&state.unknowns(all.layout))?;
        Some((*k, chi_square(all, &residuals, &others).ok()?))
    };
    let tried: Vec<_> = used.par_iter().filter_map(without).collect();
    let Some((best, least)) = tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Ok(None);
    };
    #[allow(clippy::cast_precision_loss)]
    let (components, left, count) = (all.layout.components() as f64, left as f64, used.len() as f64);
    let ratio = (whole - least).max(0.0) / components / (least / left).max(f64::MIN_POSITIVE);
    Ok((count * f_tail(ratio, components, left) < FALSE_ALARM).then_some(best)) // eq. 12
}

/// Sum of the squares of the whitened residuals of some readings, all of weight one.
fn chi_square(
    all: &Constancy<'_>,
    residuals: &[FieldResidual],
    used: &[usize],
) -> Result<f64, MagnetometerError> {
    let kept = all.data.only(used);
    let problem = Constancy::of(&kept, all.strength, all.layout);
    let of_used: Vec<_> = used.iter().map(|k| residuals[*k]).collect();
    let whitening = problem
        .whitening_of(&of_used, &vec![1.0; used.len()])
        .ok_or(MagnetometerError::FieldUnsolvable)?;
    Ok(whitening.of(problem.values(&of_used)).norm_squared())
}

/// Size of the residual of each reading in sigmas, by a fit without it.
fn misfits_of(
    all: &Constancy<'_>,
    residuals: &[FieldResidual],
    used: &[usize],
) -> Result<Vec<f64>, MagnetometerError> {
    let kept = all.data.only(used);
    let problem = Constancy::of(&kept, all.strength, all.layout);
    let of_used: Vec<_> = used.iter().map(|k| residuals[*k]).collect();
    let (covariance, whitening) = covariance_of(&problem, &of_used, &vec![1.0; used.len()])?;
    let mut sizes = all.prediction_sizes(residuals, &covariance)?;
    if all.layout.aligned {
        let linear = LinearFit {
            values: problem.values(&of_used),
            rows: problem.rows(&of_used),
            covariance,
            whitening,
        };
        let places: Vec<Vec<usize>> = (0..used.len()).map(|k| vec![2 * k, 2 * k + 1]).collect();
        for (k, size) in used.iter().zip(misfits(&linear, &places)) {
            sizes[*k] = size;
        }
        return Ok(sizes);
    }
    for k in used {
        let own = &residuals[*k];
        let row = DVector::from_iterator(
            all.places.len(),
            all.places.iter().map(|place| own.rows[(0, *place)]),
        );
        let variance = own.covariance[(0, 0)];
        let left = variance - row.dot(&(&covariance * &row));
        sizes[*k] = if left > 0.0 {
            own.values.x.abs() / left.sqrt()
        } else {
            0.0
        };
    }
    Ok(sizes)
}

/// State, and the weight of each reading, from a start in the sensor's own axes.
fn settle(
    data: &FieldReadings,
    strength: f64,
    begin: State,
    layout: FieldUnknowns,
) -> Result<(State, Vec<f64>), MagnetometerError> {
    let own_axes = FieldUnknowns {
        aligned: false,
        ..layout
    };
    let mut weights = vec![1.0; data.readings.len()];
    let lengths = Constancy::of(data, strength, own_axes);
    let x =
        solve(&lengths, begin.unknowns(own_axes), &mut weights).ok_or(MagnetometerError::FieldUnsolvable)?;
    let residuals = lengths.residuals(&x).ok_or(MagnetometerError::FieldUnsolvable)?;
    covariance_of(&lengths, &residuals, &weights)?;
    let mut state = State::of(&x, own_axes);
    if !layout.aligned {
        return Ok((state, weights));
    }
    let fields: Vec<_> = residuals.iter().map(|r| r.field).collect();
    let ups: Vec<_> = data
        .readings
        .iter()
        .filter_map(|reading| Some(reading.up?.direction))
        .collect();
    let (rotation, upward) = rotation_by_dip(&fields, &ups).ok_or(MagnetometerError::FieldUnsolvable)?;
    state.model.matrix *= rotation.matrix().transpose();
    state.upward = upward;
    weights.fill(1.0);
    let both = Constancy::of(data, strength, layout);
    let x = solve(&both, state.unknowns(layout), &mut weights).ok_or(MagnetometerError::FieldUnsolvable)?;
    Ok((State::of(&x, layout), weights))
}

fn refuse_too_few(data: &FieldReadings, state: &State) -> Result<(), MagnetometerError> {
    let correction = state
        .model
        .correction()
        .map_err(|_| MagnetometerError::FieldUnsolvable)?;
    let each = data.readings.iter();
    let fields: Vec<_> = each
        .map(|reading| correction.apply(&reading.mean).normalize())
        .collect();
    let found = directions::count(&directions::grouped(&fields));
    if found < FEWEST_DIRECTIONS {
        return Err(MagnetometerError::TooFewFieldDirections {
            found,
            needed: FEWEST_DIRECTIONS,
        });
    }
    Ok(())
}

/// Chance that noise alone makes any of all readings disagree as much as each (docs/theory/magnetometer.md, eq. 8).
fn chances(sizes: &[f64], layout: FieldUnknowns) -> Vec<f64> {
    let components = layout.components();
    let scatter = robust::scatter(sizes, 0, components);
    #[allow(clippy::cast_precision_loss)]
    let (count, freedom) = (sizes.len() as f64, components as f64);
    let one = |size: f64| chi_square_tail(freedom * (size / scatter).powi(2), freedom);
    sizes.iter().map(|size| (count * one(*size)).min(1.0)).collect() // eq. 8
}

fn covariance_of(
    problem: &Constancy<'_>,
    residuals: &[FieldResidual],
    weights: &[f64],
) -> Result<(DMatrix<f64>, ResidualWhitening), MagnetometerError> {
    let whitening = problem
        .whitening_of(residuals, weights)
        .ok_or(MagnetometerError::FieldUnsolvable)?;
    let mut rows = problem.rows(residuals);
    whitening.apply(&mut rows);
    let largest = problem
        .data
        .readings
        .iter()
        .map(|reading| reading.current.abs())
        .fold(0.0, f64::max);
    let size = |place: usize| match place {
        0..9 => 1.0,
        CURRENT..UPWARD => problem.strength / largest.max(f64::MIN_POSITIVE),
        _ => problem.strength,
    };
    let sizes = DVector::from_iterator(
        problem.places.len(),
        problem.places.iter().map(|place| size(*place)),
    );
    let covariance = observability::covariance(&rows, &sizes).map_err(|found| {
        let mut shares = [0.0; STATE];
        for (place, share) in problem.places.iter().zip(&found) {
            shares[*place] = *share;
        }
        MagnetometerError::ReadingsLeaveOpen {
            shares: Box::new(shares),
        }
    })?;
    Ok((covariance, whitening))
}

fn finish(
    all: &Constancy<'_>,
    state: &State,
    residuals: Vec<FieldResidual>,
    (weights, used, chances): (Vec<f64>, Vec<usize>, Vec<f64>),
) -> Result<FieldFit, MagnetometerError> {
    let kept = all.data.only(&used);
    let problem = Constancy::of(&kept, all.strength, all.layout);
    let of_used: Vec<_> = used.iter().map(|k| residuals[*k]).collect();
    let (covariance, whitening) = covariance_of(&problem, &of_used, &weights)?;
    let mut of_state = SMatrix::zeros();
    for (i, place) in problem.places.iter().enumerate() {
        for (j, other) in problem.places.iter().enumerate() {
            of_state[(*place, *other)] = covariance[(i, j)];
        }
    }
    let fields: Vec<_> = residuals.iter().map(|r| r.field.normalize()).collect();
    let mut of_all = vec![0.0; residuals.len()];
    for (k, weight) in used.iter().zip(&weights) {
        of_all[*k] = *weight;
    }
    Ok(FieldFit {
        model: state.model,
        current: all.layout.current.then_some(state.current),
        strength: all.strength,
        upward: all.layout.aligned.then_some(state.upward),
        covariance: of_state,
        linear: LinearFit {
            values: problem.values(&of_used),
            rows: problem.rows(&of_used),
            covariance,
            whitening,
        },
        groups: directions::grouped(&fields),
        residuals,
        weights: of_all,
        chances,
        used,
        places: problem.places,
    })
}

/// The same with a mean scale of one, as nobody knows how strong the field is (docs/theory/magnetometer.md, eq. 7).
fn relative(mut fit: FieldFit) -> FieldFit {
    let factor = fit.model.matrix.determinant().cbrt();
    let Some(inverse) = fit.model.matrix.try_inverse() else {
        return fit;
    };
    let matrix = fit.model.matrix / factor; // eq. 7
    let mut jacobian = SMatrix::<f64, 17, 17>::identity();
    for place in 0..9 {
        // Relative change of the factor by an element of M.
        let share = inverse[(place % 3, place / 3)] / 3.0;
        for element in 0..9 {
            let own = if element == place { 1.0 / factor } else { 0.0 };
            jacobian[(element, place)] = own - matrix[(element / 3, element % 3)] * share;
        }
        jacobian[(UPWARD, place)] = fit.upward.unwrap_or(0.0) * factor * share;
        jacobian[(16, place)] = fit.strength * factor * share;
    }
    jacobian[(UPWARD, UPWARD)] = factor;
    fit.covariance = jacobian * fit.covariance * jacobian.transpose();
    fit.model.matrix = matrix;
    fit.strength *= factor;
    fit.upward = fit.upward.map(|upward| upward * factor);
    for residual in &mut fit.residuals {
        residual.values *= factor;
        residual.covariance *= factor * factor;
        residual.field *= factor;
    }
    fit
}
