//! Rotation about an axis that is the only one the units turned about: the rates do not show it, but gravity and
//! every push across that axis do.

use nalgebra::Vector3;

use crate::align::forces::ForcesFit;
use crate::align::rates::{ABOVE_NOISE, RatesFit};
use crate::align::samples::force_of;

/// 1-sigma, rad, up to which the forces' answer is one.
const LARGEST_SIGMA: f64 = 0.1;

/// 1-sigma of the angle between the two triads of a unit, rad: what the forces show need not hold for the rates.
const BETWEEN_TRIADS: f64 = 0.005;

/// Turns the rotation about the axis that the rates leave open to where the specific forces agree best
/// (docs/theory/align.md, eq. 16); gives the mean square of the primary's force across that axis, less its mean.
pub fn turn_about_unseen(rates: &mut RatesFit) -> Option<f64> {
    let [axis] = rates.unseen[..] else { return None };
    let pairs = || {
        let forces = rates
            .pairs
            .iter()
            .map(|pair| (&pair.primary.mean, &pair.secondary.mean));
        forces.map(|(p, s)| (rates.rotation * force_of(p), force_of(s)))
    };
    #[allow(clippy::cast_precision_loss)]
    let share = 1.0 / rates.pairs.len().max(1) as f64;
    let mean_from = pairs().map(|(from, _)| from).sum::<Vector3<f64>>() * share;
    let mean_to = pairs().map(|(_, to)| to).sum::<Vector3<f64>>() * share;
    let (mut sine, mut cosine, mut across) = (0.0, 0.0, 0.0);
    for (from, to) in pairs() {
        let (from, to) = (from - mean_from, to - mean_to);
        sine += axis.dot(&from.cross(&to)); // eq. 16
        cosine += from.dot(&to) - axis.dot(&from) * axis.dot(&to); // eq. 16
        across += share * axis.cross(&from).norm_squared();
    }
    rates.turn(&axis, sine.atan2(cosine)); // eq. 16
    Some(across)
}

/// Takes over the rotation of the forces about that axis, given their mean square across it; returns whether they
/// determined it, rather than noise.
pub fn complete(rates: &mut RatesFit, forces: &ForcesFit, across: f64) -> bool {
    let [axis] = rates.unseen[..] else { return false };
    let variance = axis.dot(&(forces.angle_covariance * axis));
    let noise = 2.0 * forces.scale * forces.scale;
    if !(across > ABOVE_NOISE * noise && variance < LARGEST_SIGMA * LARGEST_SIGMA) {
        return false;
    }
    rates.turn(&axis, axis.dot(&forces.angle));
    rates.open(&axis, variance + BETWEEN_TRIADS * BETWEEN_TRIADS);
    rates.unseen.clear();
    true
}
