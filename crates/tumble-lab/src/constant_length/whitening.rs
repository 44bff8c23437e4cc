//! ResidualWhitening of residuals: by the sigma of each, or by the factor of their covariance.

use nalgebra::{DMatrix, DVector};

/// Factor that makes residuals independent and of sigma one.
#[derive(Clone, Debug)]
pub enum ResidualWhitening {
    /// Independent residuals of these sigmas.
    Each(DVector<f64>),
    /// Lower triangle of the covariance of all.
    Lower(DMatrix<f64>),
}

impl ResidualWhitening {
    /// Whitens columns of residuals in place.
    pub fn apply(&self, columns: &mut DMatrix<f64>) {
        match self {
            Self::Each(sigmas) => {
                for mut column in columns.column_iter_mut() {
                    column.component_div_assign(sigmas);
                }
            }
            Self::Lower(factor) => {
                factor.solve_lower_triangular_mut(columns);
            }
        }
    }

    /// Whitens residuals.
    pub fn of(&self, mut values: DVector<f64>) -> DVector<f64> {
        match self {
            Self::Each(sigmas) => values.component_div_assign(sigmas),
            Self::Lower(factor) => {
                factor.solve_lower_triangular_mut(&mut values);
            }
        }
        values
    }
}
