//! How much the result leans on each pose, and how well it foretells poses that it has not seen.

use nalgebra::SVector;
use tumble_core::model::ErrorModel;

use super::accelerometer::{ForcesFit, RestForce, UNKNOWNS, fit_forces, residual};

/// What the fit would be without a rest, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Influence {
    /// Share of the rest's own residual that the fit takes up: one where nothing else shows what it shows.
    pub leverage: f64,
    /// Largest change of an unknown without the rest, in units of its sigma.
    pub change: f64,
}

/// Of each rest (Cook 1977; docs/theory/multipose.md, eq. 7 and 8).
pub fn influence(fit: &ForcesFit) -> Vec<Influence> {
    (0..fit.residuals.len()).map(|k| without(fit, k)).collect()
}

fn without(fit: &ForcesFit, k: usize) -> Influence {
    let row = fit.whitened(k);
    let gain: SVector<f64, UNKNOWNS> = fit.covariance * row;
    let leverage = row.dot(&gain).min(1.0); // eq. 7
    let normalised = fit.residuals[k].value * fit.weights[k].sqrt() / fit.residuals[k].sigma;
    let left = (1.0 - leverage).max(f64::EPSILON);
    let change = gain * (normalised / left); // eq. 8
    let sigmas = fit.covariance.diagonal().map(f64::sqrt);
    Influence {
        leverage,
        change: change.component_div(&sigmas).amax(),
    }
}

/// `|u| - g` of each rest, m/s^2, by a fit without any rest in its direction; `None` where the others do not carry one.
pub fn held_out(
    rests: &[RestForce],
    groups: &[usize],
    gravity: f64,
    start: &ErrorModel<f64>,
) -> Vec<Option<f64>> {
    let mut residuals = vec![None; rests.len()];
    for group in 0..=groups.iter().copied().max().unwrap_or(0) {
        let others = rests.iter().zip(groups).filter(|(_, own)| **own != group);
        let kept: Vec<RestForce> = others.map(|(rest, _)| *rest).collect();
        let Ok(fit) = fit_forces(&kept, gravity, start) else {
            continue;
        };
        for (k, rest) in rests.iter().enumerate().filter(|(k, _)| groups[*k] == group) {
            residuals[k] = residual(&fit.model, rest, gravity).map(|found| found.value);
        }
    }
    residuals
}
