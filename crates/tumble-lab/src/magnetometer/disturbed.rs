//! Readings that disagree with all others by more than chance.

use nalgebra::DVector;
use rayon::prelude::*;

use super::constancy::{Constancy, FieldResidual, covariance_of};
use super::error::MagnetometerError;
use super::settled::settle;
use super::unknowns::{FieldUnknowns, State};
use crate::constant_length::influence::{LinearFit, misfits};
use crate::constant_length::robust;
use crate::distributions::{chi_square_tail, f_tail};
use crate::turntable::widening;

/// Chance, of any reading among all, below which one that disagrees so much is taken for disturbed.
pub(super) const FALSE_ALARM: f64 = 1e-3;

/// Readings to leave out next: of rests the one that disagrees most, as it may make others look disturbed; of many samples all.
pub(super) fn most_disturbed(chances: &[f64], used: &[usize], layout: FieldUnknowns) -> Vec<usize> {
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
/// fit until all are (docs/theory/magnetometer.md, eq. 9).
pub(super) fn masked(
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
    Ok((count * f_tail(ratio, components, left) < FALSE_ALARM).then_some(best)) // eq. 9
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
pub(super) fn misfits_of(
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

/// Chance that noise alone makes any of all readings disagree as much as each (docs/theory/magnetometer.md, eq. 8).
pub(super) fn chances(sizes: &[f64], layout: FieldUnknowns) -> Vec<f64> {
    let components = layout.components();
    let scatter = robust::scatter(sizes, 0, components);
    #[allow(clippy::cast_precision_loss)]
    let (count, freedom) = (sizes.len() as f64, components as f64);
    let one = |size: f64| chi_square_tail(freedom * (size / scatter).powi(2), freedom);
    sizes.iter().map(|size| (count * one(*size)).min(1.0)).collect() // eq. 8
}
