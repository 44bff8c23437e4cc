//! Directions along which motion is large enough to estimate parameters.

use nalgebra::Matrix3;

use crate::eigen;
use crate::products::{add, columns, outer, zeros};
use crate::real::Real;

/// Inverse of a symmetric matrix over the directions along which it is at least `least`, and the projection onto them.
pub(super) struct ExcitedDirections<T: Real> {
    pub inverse: Matrix3<T>,
    /// Projection onto these directions.
    pub projection: Matrix3<T>,
    /// Number of these directions.
    pub directions: u8,
}

impl<T: Real> ExcitedDirections<T> {
    /// Selects the directions along which the matrix is at least that large.
    pub fn of(matrix: Matrix3<T>, least: T) -> Self {
        let (values, vectors) = eigen::symmetric(matrix);
        let mut excited = Self::nothing();
        for (value, v) in values.iter().zip(columns(&vectors)) {
            if *value >= least {
                let along = outer(&v, &v);
                for (sum, along) in excited.inverse.as_mut_slice().iter_mut().zip(along.as_slice()) {
                    *sum += *along / *value;
                }
                add(&mut excited.projection, &along);
                excited.directions += 1;
            }
        }
        excited
    }

    /// Selects no direction.
    #[inline(never)]
    pub fn nothing() -> Self {
        Self {
            inverse: zeros(),
            projection: zeros(),
            directions: 0,
        }
    }

    /// Selects axis `i` alone.
    pub fn along_axis(matrix: &Matrix3<T>, i: usize, least: T) -> Self {
        let mut excited = Self::nothing();
        let value = matrix.data.0[i][i];
        if value >= least {
            excited.inverse.data.0[i][i] = T::one() / value;
            excited.projection.data.0[i][i] = T::one();
            excited.directions = 1;
        }
        excited
    }
}
