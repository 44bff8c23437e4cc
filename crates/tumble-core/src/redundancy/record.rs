//! Stored record of a secondary: the error of one sensor relative to the primary.

use core::slice;

use nalgebra::{Matrix3, Vector3};

use crate::model::ErrorModel;
use crate::products::zeros;
use crate::real::{Real, real};
use crate::redundancy::sensor::Sensor;
use crate::redundancy::settings::FitModel;

/// Error of one sensor of a secondary relative to the primary, for raw readings of both: `y_secondary = M
/// y_primary + b`, where the specific force of the primary is first moved to the place of the secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record<T: Real> {
    /// Identity of the unit.
    pub identity: u64,
    /// Sensor of the unit.
    pub sensor: Sensor,
    /// Error model, in which M leads from the case frame of the primary to the axes of the secondary, mounting
    /// included.
    pub model: ErrorModel<T>,
    /// 1-sigma of M; infinite where motion did not show it.
    pub matrix_sigma: Matrix3<T>,
    /// 1-sigma of b, given the elements of M that kept their stored values; infinite for axes that the sensor
    /// lacks, or that need a missing axis of the primary.
    pub bias_sigma: Vector3<T>,
    /// Vector from primary to secondary, m, case frame of the primary; zero for gyroscopes, and if unknown.
    pub lever_arm: Vector3<T>,
    /// 1-sigma of the lever arm; zero if it was given, infinite where motion did not show it.
    pub lever_arm_sigma: Vector3<T>,
    /// Model that was fitted.
    pub fit_model: FitModel,
    /// Number of directions of motion along which M was fitted.
    pub directions: u8,
    /// Root mean square residual of a channel on held-out pairs, m/s^2 or rad/s.
    pub residual: T,
    /// Root mean square residual with the error stored before.
    pub residual_before: T,
    /// Number of fitted pairs.
    pub pairs: u32,
    /// Number of calibrations of this sensor.
    pub sequence: u32,
    /// Change of a mean reading by all calibrations together that follows the primary without proof, m/s^2 or
    /// rad/s, in the axes of the secondary.
    pub followed: Vector3<T>,
}

/// Names of the numeric parts of a record in files and Python, in the order of [`Record::parts`].
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
    /// Creates a record of zeros, to be filled.
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
            fit_model: FitModel::Offset,
            directions: 0,
            residual: T::zero(),
            residual_before: T::zero(),
            pairs: 0,
            sequence: 0,
            followed: zeros(),
        }
    }

    /// Creates the first record of a sensor whose bias alone is known, m/s^2 or rad/s, with its 1-sigma, for
    /// example from a spin: M is the identity, with infinite sigma.
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

    /// Numbers of the record, part by part; matrices column by column.
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

    /// Numbers of the record, mutable.
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

    /// Returns whether motion showed all directions of M.
    pub fn shows_matrix(&self) -> bool {
        self.fit_model >= FitModel::Affine && self.directions >= 3
    }

    /// Returns whether all numbers in use are finite.
    pub fn is_finite(&self) -> bool {
        let vectors = self
            .model
            .bias
            .iter()
            .chain(self.lever_arm.iter())
            .chain(self.followed.iter());
        self.model.matrix.iter().chain(vectors).all(|x| x.is_finite())
    }

    /// Converts the record to another type of numbers.
    pub fn in_numbers<U: Real>(&self, number: impl Fn(T) -> U + Copy) -> Record<U> {
        let mut other = Record::blank(self.identity, self.sensor);
        (other.fit_model, other.directions) = (self.fit_model, self.directions);
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

/// Storage that keeps records over a reset.
pub trait Storage<T: Real> {
    /// Error of the storage.
    type Error;

    /// Loads the record of a sensor of a unit, if there is one.
    ///
    /// # Errors
    /// A record exists but cannot be read.
    fn load(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error>;

    /// Loads the record from the factory, if it is stored.
    ///
    /// # Errors
    /// A record exists but cannot be read.
    fn load_factory(&mut self, identity: u64, sensor: Sensor) -> Result<Option<Record<T>>, Self::Error>;

    /// Replaces the record of a sensor of a unit: afterwards the old or the new one is stored completely,
    /// whatever happens.
    ///
    /// # Errors
    /// The record could not be stored; the old one remains.
    fn save(&mut self, record: &Record<T>) -> Result<(), Self::Error>;
}
