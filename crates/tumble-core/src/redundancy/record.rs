//! What is stored of a secondary: the error of one sensor against the primary.

use core::slice;

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

/// Parts of a record that are numbers: what files and Python call them, in the order of [`Record::parts`].
pub const PART_NAMES: [&str; 9] = [
    "matrix",
    "bias",
    "matrix_sigma",
    "bias_sigma",
    "lever_arm",
    "lever_arm_sigma",
    "residual",
    "residual_before",
    "followed",
];

impl<T: Real> Record<T> {
    /// A record of zeros and of counts that are zero, to be filled.
    pub fn blank(identity: u64, sensor: Sensor) -> Self {
        Self {
            identity,
            sensor,
            model: ErrorModel {
                matrix: zeros(),
                bias: zeros(),
            },
            matrix_sigma: zeros(),
            bias_sigma: zeros(),
            lever_arm: zeros(),
            lever_arm_sigma: zeros(),
            rung: Rung::Offset,
            directions: 0,
            residual: T::zero(),
            residual_before: T::zero(),
            pairs: 0,
            sequence: 0,
            followed: zeros(),
        }
    }

    /// The first record of a sensor of which nothing is known but its bias, m/s^2 or rad/s, and 1-sigma of that, as a spin
    /// shows it: M is the identity, and may be off by any amount.
    pub fn of_bias(identity: u64, sensor: Sensor, bias: &Vector3<T>, sigma: &Vector3<T>) -> Self {
        let anything: T = real(f64::INFINITY);
        Self {
            model: ErrorModel {
                bias: *bias,
                ..ErrorModel::identity()
            },
            matrix_sigma: Matrix3::repeat(anything),
            bias_sigma: *sigma,
            lever_arm_sigma: Vector3::repeat(anything),
            residual: anything,
            residual_before: anything,
            sequence: 1,
            ..Self::blank(identity, sensor)
        }
    }

    /// Its numbers, part by part; matrices column by column.
    pub fn parts(&self) -> [&[T]; PART_NAMES.len()] {
        [
            self.model.matrix.as_slice(),
            self.model.bias.as_slice(),
            self.matrix_sigma.as_slice(),
            self.bias_sigma.as_slice(),
            self.lever_arm.as_slice(),
            self.lever_arm_sigma.as_slice(),
            slice::from_ref(&self.residual),
            slice::from_ref(&self.residual_before),
            self.followed.as_slice(),
        ]
    }

    /// The same numbers, to be changed.
    pub fn parts_mut(&mut self) -> [&mut [T]; PART_NAMES.len()] {
        [
            self.model.matrix.as_mut_slice(),
            self.model.bias.as_mut_slice(),
            self.matrix_sigma.as_mut_slice(),
            self.bias_sigma.as_mut_slice(),
            self.lever_arm.as_mut_slice(),
            self.lever_arm_sigma.as_mut_slice(),
            slice::from_mut(&mut self.residual),
            slice::from_mut(&mut self.residual_before),
            self.followed.as_mut_slice(),
        ]
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
        let mut other = Record::blank(self.identity, self.sensor);
        (other.rung, other.directions) = (self.rung, self.directions);
        (other.pairs, other.sequence) = (self.pairs, self.sequence);
        for (there, here) in other.parts_mut().into_iter().zip(self.parts()) {
            there
                .iter_mut()
                .zip(here)
                .for_each(|(to, from)| *to = number(*from));
        }
        other
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
