//! Offset of two clocks, to a window's length, whatever the rotation and the biases of the two units.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;

/// Fewest windows that must be common to both units.
const FEWEST: usize = 40;

/// A shift of one clock against the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Windows of the secondary that are passed over.
    pub windows: usize,
    /// The best rotation, `secondary_from_primary`: about an axis that is the only one, an arbitrary one of the best.
    pub rotation: Rotation3<f64>,
    /// Largest correlation that any rotation gives: 1 where it turns one unit's rates into the other's.
    pub correlation: f64,
    /// The same with any reflection.
    pub mirrored: f64,
    /// Root mean square rate of the secondary over that of the primary, less their means.
    pub ratio: f64,
    /// Root mean square rate of the primary less its mean, rad/s.
    pub motion: f64,
}

/// Sums over pairs of rates.
#[derive(Clone, Copy)]
struct CorrelationSums {
    count: usize,
    primary: Vector3<f64>,
    secondary: Vector3<f64>,
    cross: Matrix3<f64>,
    squares: (f64, f64),
}

/// The correlation at every shift up to `most` windows (docs/theory/align.md, eq. 5); no shift at which
/// fewer than forty windows, or a third of what the units have at best, are common to both.
pub fn correlations(
    primary: &[Option<Vector3<f64>>],
    secondary: &[Option<Vector3<f64>>],
    most: usize,
) -> Vec<Shift> {
    let sums: Vec<(usize, CorrelationSums)> = (0..=most)
        .into_par_iter()
        .map(|windows| (windows, sums_at(primary, secondary, windows)))
        .collect();
    let best = sums.iter().map(|(_, sums)| sums.count).max().unwrap_or(0);
    sums.iter()
        .filter(|(_, sums)| sums.count >= FEWEST && 3 * sums.count >= best)
        .filter_map(|(windows, sums)| shift(*windows, sums))
        .collect()
}

/// Shifts at which the correlation is larger than at their neighbours, best first.
pub fn peaks(shifts: &[Shift]) -> Vec<Shift> {
    let value = |k: usize| shifts.get(k).map_or(f64::NEG_INFINITY, |shift| shift.correlation);
    let mut found: Vec<Shift> = (0..shifts.len())
        .filter(|&k| value(k) >= value(k.wrapping_sub(1)) && value(k) > value(k + 1))
        .map(|k| shifts[k])
        .collect();
    found.sort_by(|a, b| b.correlation.total_cmp(&a.correlation));
    found
}

fn paired<'a>(
    primary: &'a [Option<Vector3<f64>>],
    secondary: &'a [Option<Vector3<f64>>],
    windows: usize,
) -> impl Iterator<Item = (&'a Vector3<f64>, &'a Vector3<f64>)> {
    let common = primary.iter().zip(secondary.iter().skip(windows));
    common.filter_map(|(p, s)| Some((p.as_ref()?, s.as_ref()?)))
}

fn sums_at(
    primary: &[Option<Vector3<f64>>],
    secondary: &[Option<Vector3<f64>>],
    windows: usize,
) -> CorrelationSums {
    let none = CorrelationSums {
        count: 0,
        primary: Vector3::zeros(),
        secondary: Vector3::zeros(),
        cross: Matrix3::zeros(),
        squares: (0.0, 0.0),
    };
    paired(primary, secondary, windows).fold(none, |sums, (p, s)| CorrelationSums {
        count: sums.count + 1,
        primary: sums.primary + p,
        secondary: sums.secondary + s,
        cross: sums.cross + s * p.transpose(),
        squares: (
            sums.squares.0 + p.norm_squared(),
            sums.squares.1 + s.norm_squared(),
        ),
    })
}

fn shift(windows: usize, sums: &CorrelationSums) -> Option<Shift> {
    #[allow(clippy::cast_precision_loss)]
    let count = sums.count as f64;
    let cross = sums.cross - sums.secondary * sums.primary.transpose() / count; // eq. 5: C
    let of_primary = sums.squares.0 - sums.primary.norm_squared() / count;
    let of_secondary = sums.squares.1 - sums.secondary.norm_squared() / count;
    let both = (of_primary * of_secondary).sqrt();
    if !(both > 0.0 && both.is_finite()) {
        return None;
    }
    let svd = cross.svd(true, true);
    let (left, right) = (svd.u?, svd.v_t?);
    // Singular values come in descending order; the least of them pays for a reflection.
    let handed = (left * right).determinant().signum(); // eq. 5
    let (others, least) = (
        svd.singular_values.sum() - svd.singular_values[2],
        svd.singular_values[2],
    );
    let rotation = left * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, handed)) * right;
    Some(Shift {
        windows,
        rotation: Rotation3::from_matrix_unchecked(rotation),
        correlation: (others + handed * least) / both, // eq. 5: rho
        mirrored: (others - handed * least) / both,
        ratio: (of_secondary / of_primary).sqrt(),
        motion: (of_primary / count).sqrt(),
    })
}
