//! The test of whether a gyroscope's residuals ask for its sensitivity to specific force.

use tumble_core::turntable::fit::{LARGEST_G_SENSITIVITY, TriadFit};

use crate::distributions::{chi_square_tail, f_tail};

/// Chance of fitting the response of a gyroscope that has none.
pub const FALSE_ALARM: f64 = 1e-3;

/// Elements of G.
const ELEMENTS: f64 = 9.0;

/// An element with less than a quarter of the variance of its prior was shown by the data, as one of M.
const SHOWN: f64 = 0.5;

/// True where the fit with G explains so much more than the one without it, both under the same noise, that chance does not,
/// neither by the stated noise nor by that of the residuals; and where the data show all of G, and with it all that they
/// show without it (docs/theory/turntable.md, eq. 43).
pub(super) fn is_shown(coupled: &TriadFit<f64, 6>, plain: &TriadFit<f64, 6>) -> bool {
    let shows_g = coupled
        .g_sensitivity
        .is_some_and(|(_, sigma)| sigma.iter().all(|sigma| *sigma < SHOWN * LARGEST_G_SENSITIVITY));
    let shows_rest = (plain.observed.iter().zip(coupled.observed)).all(|(plain, coupled)| coupled || !plain);
    let freedom = f64::from(coupled.degrees_of_freedom);
    if !(shows_g && shows_rest && freedom > 0.0) {
        return false;
    }
    let explained = plain.chi_square - coupled.chi_square;
    let ratio = explained / ELEMENTS / (coupled.chi_square / freedom);
    chi_square_tail(explained, ELEMENTS) < FALSE_ALARM && f_tail(ratio, ELEMENTS, freedom) < FALSE_ALARM // eq. 43
}
