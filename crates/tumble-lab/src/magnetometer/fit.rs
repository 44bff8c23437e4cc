//! All unknowns at once: the length of the field is the same at all readings, and so is its part along gravity
//! (docs/theory/magnetometer.md).

use nalgebra::{SMatrix, SVector, Vector3};
use tumble_core::model::{ErrorModel, ModelCovariance, PARAMETERS};

use super::constancy::{Constancy, FieldResidual, covariance_of};
use super::disturbed::{chances, masked, misfits_of, most_disturbed};
use super::error::MagnetometerError;
use super::readings::FieldReadings;
use super::settled::settle;
use super::unknowns::{FieldUnknowns, State, UPWARD};
use crate::constant_length::directions;
use crate::constant_length::influence::LinearFit;
use crate::constant_length::sphere::{sphere, start};
use crate::multipose::FEWEST_DIRECTIONS;

/// Share of the readings that may be left out (docs/theory/magnetometer.md, section 3).
pub const MOST_LEFT_OUT: f64 = 0.4;

/// Settings of a calibration of a magnetometer.
#[derive(Clone, Copy, Debug, Default)]
pub struct FieldSettings {
    /// Strength of the field, uT; `None` where only ratios are to be found.
    pub strength: Option<f64>,
    /// True to fit the response to current, or throttle.
    pub current: bool,
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

/// Dip of a field below the horizontal, rad, from what of it points up and from its length, both uT.
pub fn dip_of(upward: f64, strength: f64) -> f64 {
    -upward.atan2((strength.powi(2) - upward.powi(2)).max(0.0).sqrt())
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
        self.upward.map(|upward| dip_of(upward, self.strength))
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
            || ((data.readings.len() - used.len()) as f64) > MOST_LEFT_OUT * data.readings.len() as f64;
        if too_few {
            return Err(MagnetometerError::Disturbed {
                found: data.readings.len() - used.len(),
                readings: data.readings.len(),
            });
        }
    }
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
