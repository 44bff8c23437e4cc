//! Which orientation to add: the one that lowers the largest sigma most.

use nalgebra::{DMatrix, DVector, Rotation3, Unit, Vector3};

use super::fit::FieldFit;
use super::readings::{FieldReading, Upward};
use crate::constant_length::directions::covering;
use crate::constant_length::residual::{LengthResidual, derivative};

/// Directions of the field all over the sphere, 15 deg apart.
const CANDIDATES: u32 = 200;

/// Orientations about each of them.
const TURNS: u32 = 8;

/// Reach of a reading on the sphere, rad, for the share that is covered.
const REACH: f64 = 0.524;

/// An orientation that is worth adding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextField {
    /// Direction of the field in the case frame there, a unit vector.
    pub field: Vector3<f64>,
    /// Up in the case frame there; `None` where nothing shows up.
    pub up: Option<Vector3<f64>>,
    /// Largest sigma of an unknown as it is, in units of scale or of the field.
    pub before: f64,
    /// The same with a reading more there.
    pub after: f64,
    /// Which unknown that is, in the state.
    pub unknown: usize,
}

/// Tries a reading of median noise all over the sphere (docs/theory/multipose.md, eq. 9).
pub(super) fn next_field(fit: &FieldFit, readings: &[FieldReading]) -> Option<NextField> {
    let typical = typical(readings)?;
    let largest = |covariance: &DMatrix<f64>| {
        let each = fit
            .places
            .iter()
            .enumerate()
            .filter(|(_, place)| !(12..15).contains(*place));
        let sized = each.map(|(i, place)| {
            let size = if *place < 9 { 1.0 } else { fit.strength };
            (*place, covariance[(i, i)].sqrt() / size)
        });
        sized.max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let (unknown, before) = largest(&fit.linear.covariance)?;
    let inverse = fit.model.correction().ok()?;
    let tried = candidates(fit).filter_map(|(field, up)| {
        let mut covariance = fit.linear.covariance.clone();
        let mean = fit.model.measure(&(field * fit.strength));
        let length = LengthResidual::of(&inverse, &mean, &typical.variance, fit.strength);
        let row = places_of(fit, |place| if place < 12 { length.row[place] } else { 0.0 });
        add(&mut covariance, &(row / length.sigma));
        if let (Some(up), Some(noise)) = (up, &typical.up) {
            let response = inverse.matrix.tr_mul(&up);
            let by_model = derivative(&response, &length.vector);
            let row = places_of(fit, |place| match place {
                0..12 => by_model[place],
                15 => -1.0,
                _ => 0.0,
            });
            let own = response.component_mul(&response).dot(&typical.variance);
            let of_up = noise.covariance.trace() * 0.5 * fit.strength.powi(2);
            add(&mut covariance, &(row / (own + of_up).sqrt()));
        }
        Some(NextField {
            field,
            up,
            before,
            after: largest(&covariance)?.1,
            unknown,
        })
    });
    tried.min_by(|a, b| a.after.total_cmp(&b.after))
}

fn places_of(fit: &FieldFit, value: impl Fn(usize) -> f64) -> DVector<f64> {
    DVector::from_iterator(fit.places.len(), fit.places.iter().map(|place| value(*place)))
}

/// Takes a whitened residual of this derivative into a covariance (docs/theory/multipose.md, eq. 9).
fn add(covariance: &mut DMatrix<f64>, row: &DVector<f64>) {
    let gain = &*covariance * row;
    let innovation = 1.0 + row.dot(&gain);
    *covariance -= &gain * gain.transpose() / innovation;
}

/// Directions of the field, and of up at its dip where that is known.
fn candidates(fit: &FieldFit) -> impl Iterator<Item = (Vector3<f64>, Option<Vector3<f64>>)> {
    let dip = fit.dip();
    covering(CANDIDATES).flat_map(move |field| {
        let turns = if dip.is_some() { TURNS } else { 1 };
        (0..turns).map(move |turn| (field, dip.map(|dip| up_about(&field, dip, turn))))
    })
}

/// Up where the field comes from a direction, turned about that.
fn up_about(field: &Vector3<f64>, dip: f64, turn: u32) -> Vector3<f64> {
    let across = field.cross(&Vector3::ith(field.iamin(), 1.0)).normalize();
    let angle = std::f64::consts::TAU * f64::from(turn) / f64::from(TURNS);
    let level = Rotation3::from_axis_angle(&Unit::new_normalize(*field), angle) * across;
    level * dip.cos() - field * dip.sin()
}

fn typical(readings: &[FieldReading]) -> Option<FieldReading> {
    let mut sorted: Vec<_> = readings.to_vec();
    sorted.sort_by(|a, b| a.variance.sum().total_cmp(&b.variance.sum()));
    sorted.get(sorted.len() / 2).copied()
}

/// Share of all directions that a reading met the field from, within 30 deg.
pub fn coverage(fields: &[Vector3<f64>]) -> f64 {
    let near = |point: &Vector3<f64>| fields.iter().any(|field| field.angle(point) < REACH);
    let seen = covering(CANDIDATES).filter(near).count();
    #[allow(clippy::cast_precision_loss)]
    let share = seen as f64 / f64::from(CANDIDATES);
    share
}

impl Upward {
    /// Up that is known exactly.
    pub fn exact(direction: Vector3<f64>) -> Self {
        Self {
            direction,
            covariance: nalgebra::Matrix3::zeros(),
            by_accelerometer: nalgebra::SMatrix::zeros(),
        }
    }
}
