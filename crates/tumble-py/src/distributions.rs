//! Tails and quantiles of distributions.

use pyo3::prelude::*;
use tumble_lab::distributions;

/// Chance that a chi-square of that many degrees of freedom is larger than x.
#[pyfunction]
fn chi_square_tail(x: f64, freedom: f64) -> f64 {
    distributions::chi_square_tail(x, freedom)
}

/// Quantile of chi-square of that many degrees of freedom that is exceeded with probability `tail`.
#[pyfunction]
fn chi_square_quantile(tail: f64, freedom: f64) -> f64 {
    distributions::chi_square_quantile(tail, freedom)
}

/// The t below which a share `p` of Student's distribution lies.
#[pyfunction]
fn student_quantile(p: f64, freedom: f64) -> f64 {
    distributions::student_quantile(p, freedom)
}

/// Chance that an F of `first` and `second` degrees of freedom, those of its numerator first, is larger than `x`.
#[pyfunction]
fn f_tail(x: f64, first: f64, second: f64) -> f64 {
    distributions::f_tail(x, first, second)
}

/// Adds to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(chi_square_tail, module)?)?;
    module.add_function(wrap_pyfunction!(chi_square_quantile, module)?)?;
    module.add_function(wrap_pyfunction!(student_quantile, module)?)?;
    module.add_function(wrap_pyfunction!(f_tail, module)?)
}
