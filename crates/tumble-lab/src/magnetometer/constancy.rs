//! Residuals of a fit: the length of the field is the same at all readings, and so is its part along gravity
//! (docs/theory/magnetometer.md).

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use tumble_core::model::PARAMETERS;

use super::error::MagnetometerError;
use super::readings::{FieldReading, FieldReadings};
use super::unknowns::{CURRENT, FieldUnknowns, STATE, State, UPWARD};
use crate::constant_length::levenberg_marquardt::Linearised;
use crate::constant_length::observability;
use crate::constant_length::residual::{LengthResidual, derivative};
use crate::constant_length::reweighted::Problem;
use crate::constant_length::whitening::ResidualWhitening;

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

/// Readings whose corrected length, and part along gravity, are the same.
pub(super) struct Constancy<'a> {
    pub(super) data: &'a FieldReadings,
    pub(super) strength: f64,
    pub(super) layout: FieldUnknowns,
    pub(super) places: Vec<usize>,
}

impl<'a> Constancy<'a> {
    pub(super) fn of(data: &'a FieldReadings, strength: f64, layout: FieldUnknowns) -> Self {
        Self {
            data,
            strength,
            layout,
            places: layout.places(),
        }
    }

    pub(super) fn residuals(&self, x: &DVector<f64>) -> Option<Vec<FieldResidual>> {
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

    pub(super) fn values(&self, residuals: &[FieldResidual]) -> DVector<f64> {
        let components = self.layout.components();
        DVector::from_fn(components * residuals.len(), |k, _| {
            residuals[k / components].values[k % components]
        })
    }

    pub(super) fn rows(&self, residuals: &[FieldResidual]) -> DMatrix<f64> {
        let components = self.layout.components();
        DMatrix::from_fn(components * residuals.len(), self.places.len(), |k, i| {
            residuals[k / components].rows[(k % components, self.places[i])]
        })
    }

    pub(super) fn whitening_of(
        &self,
        residuals: &[FieldResidual],
        weights: &[f64],
    ) -> Option<ResidualWhitening> {
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
    pub(super) fn prediction_sizes(
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

/// Covariance of the unknowns, and what whitens the residuals.
pub(super) fn covariance_of(
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
