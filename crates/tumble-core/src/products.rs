//! Products of vectors and matrices of three, each written out once and called: the compiler would write the general ones out
//! anew at every use, which costs a device more flash than what is done with them.
//!
//! Terms are added in the order of their index, as the general products do: the same bits.

use nalgebra::{Dim, Matrix, Matrix3, Storage, Vector3};

use crate::model::times;
use crate::real::Real;

/// `m v`.
#[inline(never)]
pub fn product<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    times(m, v)
}

/// `m^T v`.
#[inline(never)]
pub fn transposed_product<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        m.m11 * v.x + m.m21 * v.y + m.m31 * v.z,
        m.m12 * v.x + m.m22 * v.y + m.m32 * v.z,
        m.m13 * v.x + m.m23 * v.y + m.m33 * v.z,
    )
}

/// `a b`.
#[inline(never)]
pub fn matrix_product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    let [x, y, z] = columns(b);
    Matrix3::from_columns(&[product(a, &x), product(a, &y), product(a, &z)])
}

/// `a^T b`.
#[inline(never)]
pub fn transposed_matrix_product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    matrix_product(&a.transpose(), b)
}

/// `r m r^T`: a covariance `m` in another frame, into which `r` leads.
#[inline(never)]
pub fn congruent<T: Real>(r: &Matrix3<T>, m: &Matrix3<T>) -> Matrix3<T> {
    matrix_product(&matrix_product(r, m), &r.transpose())
}

/// `a b^T`.
#[inline(never)]
pub fn outer<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Matrix3<T> {
    let [x, y, z] = [b.x, b.y, b.z].map(|share| Vector3::new(a.x * share, a.y * share, a.z * share));
    Matrix3::from_columns(&[x, y, z])
}

/// `a x b`.
#[inline(never)]
pub fn cross<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        a.y * b.z - a.z * b.y,
        a.z * b.x - a.x * b.z,
        a.x * b.y - a.y * b.x,
    )
}

/// The columns of a matrix, by name: the compiler need not prove that a number of a column is one.
pub fn columns<T: Real>(m: &Matrix3<T>) -> [Vector3<T>; 3] {
    [
        Vector3::new(m.m11, m.m21, m.m31),
        Vector3::new(m.m12, m.m22, m.m32),
        Vector3::new(m.m13, m.m23, m.m33),
    ]
}

/// Length of a vector, by the root that the processor has.
pub trait Length<T: Real> {
    /// `sqrt(v . v)`.
    fn length(&self) -> T;
}

impl<T: Real, R: Dim, C: Dim, S: Storage<T, R, C>> Length<T> for Matrix<T, R, C, S> {
    fn length(&self) -> T {
        self.norm_squared().square_root()
    }
}

/// `v / |v|`.
pub fn unit<T: Real>(v: &Vector3<T>) -> Vector3<T> {
    v.unscale(v.length())
}

/// `v / |v|`; `None` where `v` is no longer than `least`.
pub fn unit_beyond<T: Real>(v: &Vector3<T>, least: T) -> Option<Vector3<T>> {
    let length = v.length();
    (length > least).then(|| v.unscale(length))
}
