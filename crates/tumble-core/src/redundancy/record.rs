//! What is stored of a secondary: the error of one sensor against the primary.

use nalgebra::{Matrix3, Vector3};

use crate::model::ErrorModel;
use crate::products::zeros;
use crate::real::{Real, real};
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::Rung;

/// Error of one sensor of a secondary against the primary, both as read: `y_secondary = M y_primary + b`, where
/// specific force of the primary is taken to the place of the secondary first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record<T: Real> {
    /// Of the unit.
    pub identity: u64,
    /// Which sensor of it.
    pub sensor: Sensor,
    /// M leads from the primary's case frame to the axes of the secondary, mounting included.
    pub model: ErrorModel<T>,
    /// 1-sigma of M; infinite where motion did not show it.
    pub matrix_sigma: Matrix3<T>,
    /// 1-sigma of b, given the elements of M that were left as they were; infinite for axes that the sensor has not, or the
    /// primary where they need them.
    pub bias_sigma: Vector3<T>,
    /// From primary to secondary, m, primary's case frame; zero for gyroscopes, and where unknown.
    pub lever_arm: Vector3<T>,
    /// 1-sigma of it; zero where it was given, infinite where motion did not show it.
    pub lever_arm_sigma: Vector3<T>,
    /// What was fitted.
    pub rung: Rung,
    /// Directions of motion along which M was fitted.
    pub directions: u8,
    /// Root mean square of a channel on pairs kept from the fit, m/s^2 or rad/s.
    pub residual: T,
    /// The same with the error stored before.
    pub residual_before: T,
    /// Pairs it was fitted to.
    pub pairs: u32,
    /// Counts the calibrations of this sensor.
    pub sequence: u32,
    /// How far its calibrations together have followed the primary without proof that it was right: what they made differ of
    /// a mean reading, m/s^2 or rad/s, in the axes of the secondary.
    pub followed: Vector3<T>,
}

impl<T: Real> Record<T> {
    /// The first record of a sensor of which nothing is known but its bias, m/s^2 or rad/s, and 1-sigma of that, as a spin
    /// shows it: M is the identity, and may be off by any amount.
    pub fn of_bias(identity: u64, sensor: Sensor, bias: &Vector3<T>, sigma: &Vector3<T>) -> Self {
        let anything: T = real(f64::INFINITY);
        Self {
            identity,
            sensor,
            model: ErrorModel {
                bias: *bias,
                ..ErrorModel::identity()
            },
            matrix_sigma: Matrix3::repeat(anything),
            bias_sigma: *sigma,
            lever_arm: zeros(),
            lever_arm_sigma: Vector3::repeat(anything),
            rung: Rung::Offset,
            directions: 0,
            residual: anything,
            residual_before: anything,
            pairs: 0,
            sequence: 1,
            followed: zeros(),
        }
    }

    /// Whether motion showed all directions of M.
    pub fn shows_matrix(&self) -> bool {
        self.rung >= Rung::Affine && self.directions >= 3
    }

    /// Whether all that is used of it are numbers.
    pub fn is_finite(&self) -> bool {
        let vectors = self
            .model
            .bias
            .iter()
            .chain(self.lever_arm.iter())
            .chain(self.followed.iter());
        self.model.matrix.iter().chain(vectors).all(|x| x.is_finite())
    }

    /// The same record in other numbers.
    pub fn in_numbers<U: Real>(&self, number: impl Fn(T) -> U + Copy) -> Record<U> {
        let vector = |v: &Vector3<T>| v.map(number);
        let matrix = |m: &Matrix3<T>| m.map(number);
        Record {
            identity: self.identity,
            sensor: self.sensor,
            model: ErrorModel {
                matrix: matrix(&self.model.matrix),
                bias: vector(&self.model.bias),
            },
            matrix_sigma: matrix(&self.matrix_sigma),
            bias_sigma: vector(&self.bias_sigma),
            lever_arm: vector(&self.lever_arm),
            lever_arm_sigma: vector(&self.lever_arm_sigma),
            rung: self.rung,
            directions: self.directions,
            residual: number(self.residual),
            residual_before: number(self.residual_before),
            pairs: self.pairs,
            sequence: self.sequence,
            followed: vector(&self.followed),
        }
    }
}

/// Where records outlast a reset.
pub trait Storage<T: Real> {
    /// What can go wrong.
    type Error;

    /// The record of a sensor of a unit, if there is one.
    ///
    /// # Errors
    /// Where there is one but it cannot be read.
    fn load(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error>;

    /// The one from the factory, if it is kept.
    ///
    /// # Errors
    /// Where there is one but it cannot be read.
    fn load_factory(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error>;

    /// Replaces the record of its sensor and unit: afterwards, whatever happens, the old or the new one is there whole.
    ///
    /// # Errors
    /// Where it could not be stored; the old one is still there.
    fn save(&mut self, record: &Record<T>) -> Result<(), Self::Error>;
}
