//! Test whether accelerometer and gyroscope of one unit measure the same turns. Wrong units and swapped axes show here.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::acquired::Acquired;
use crate::distributions::median;

/// Consistency of a gyroscope with the accelerometer of its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GyroscopeConsistency {
    /// It turns gravity as the accelerometer sees it turned.
    Consistent,
    /// Too few turns to compare.
    Unknown,
    /// Its readings are this many times too large: 57.3 if degrees were taken for radians.
    Scaled(f64),
    /// Its axes are exchanged: `case axis = sign * sensor axis`, as (index, sign) for x, y, z.
    Permuted([(usize, f64); 3]),
    /// It does not fit, whatever is tried; median misfit in deg.
    Inconsistent(f64),
}

/// Misfit of gravity after a turn that scale errors and bias of a poor sensor explain, rad.
const TOLERABLE: f64 = 0.26;

/// So many turns more has another reading of the gyroscope to explain, to be preferred to the plain one. Turns by 180
/// deg end alike either way round, and one turn may be corrupt.
const CLEARLY_MORE: usize = 2;

/// A turn: gravity before and after, and the gyroscope's angle.
struct GravityTurn {
    before: Vector3<f64>,
    after: Vector3<f64>,
    start_from_end: UnitQuaternion<f64>,
    angle: Vector3<f64>,
}

impl GravityTurn {
    /// Angle between gravity as it was found and as the gyroscope predicts it, rad.
    fn misfit(&self) -> f64 {
        (self.start_from_end.inverse() * self.before).angle(&self.after)
    }

    /// The same for a turn about one axis, if the gyroscope's angle is multiplied by `m`.
    fn misfit_with(&self, m: &Matrix3<f64>) -> f64 {
        let end_from_start = UnitQuaternion::from_scaled_axis(m * self.angle).inverse();
        (end_from_start * self.before).angle(&self.after)
    }
}

/// Compares the gyroscope of a unit with its accelerometer.
pub fn compare_gyroscope(unit: &Acquired) -> GyroscopeConsistency {
    let turns = turned(unit);
    if turns.len() < 3 {
        return GyroscopeConsistency::Unknown;
    }
    let mut plain: Vec<f64> = turns.iter().map(GravityTurn::misfit).collect();
    let others = hypotheses().map(|(matrix, consistency)| {
        let mut misfits: Vec<f64> = turns.iter().map(|turn| turn.misfit_with(&matrix)).collect();
        (
            explained(&misfits),
            median(&mut misfits).unwrap_or(0.0),
            consistency,
        )
    });
    let best = others.max_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let most = |count: usize| 2 * count > turns.len();
    match best {
        Some((count, _, consistency)) if most(count) && count >= explained(&plain) + CLEARLY_MORE => {
            consistency
        }
        _ if most(explained(&plain)) => GyroscopeConsistency::Consistent,
        _ => GyroscopeConsistency::Inconsistent(median(&mut plain).unwrap_or(0.0).to_degrees()),
    }
}

fn explained(misfits: &[f64]) -> usize {
    misfits.iter().filter(|misfit| **misfit < TOLERABLE).count()
}

/// The turns that gravity shows.
fn turned(unit: &Acquired) -> Vec<GravityTurn> {
    unit.turns
        .iter()
        .zip(unit.rests.windows(2))
        .filter(|(turn, _)| turn.complete)
        .map(|(turn, rests)| {
            let bias = (rests[0].angular_rate() + rests[1].angular_rate()) * 0.5;
            GravityTurn {
                before: rests[0].specific_force(),
                after: rests[1].specific_force(),
                start_from_end: turn.start_from_end,
                angle: turn.angle() - bias * turn.duration(),
            }
        })
        .filter(|turn| turn.before.angle(&turn.after) > 0.3)
        .collect()
}

/// Wrong units first, then all ways to exchange and turn axes.
fn hypotheses() -> impl Iterator<Item = (Matrix3<f64>, GyroscopeConsistency)> {
    let degrees = 180.0 / core::f64::consts::PI;
    let scales = [degrees, 1.0 / degrees]
        .into_iter()
        .map(|scale| (Matrix3::identity() / scale, GyroscopeConsistency::Scaled(scale)));
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let permutations = ORDERS.into_iter().flat_map(|order| {
        (0..8_u8).map(move |signs| {
            let sign = |i: u8| if signs & (1 << i) == 0 { 1.0 } else { -1.0 };
            let axes = [(order[0], sign(0)), (order[1], sign(1)), (order[2], sign(2))];
            let mut matrix = Matrix3::zeros();
            for (row, (column, sign)) in axes.iter().enumerate() {
                matrix[(row, *column)] = *sign;
            }
            (matrix, GyroscopeConsistency::Permuted(axes))
        })
    });
    scales.chain(permutations)
}
