//! Products of vectors and matrices of three, each written out once and called: the compiler would write the general ones out
//! anew at every use, which costs a device more flash than what is done with them.
//!
//! Terms are added in the order of their index, as the general products do: the same bits.

use nalgebra::{ArrayStorage, Matrix3, SMatrix, Vector2, Vector3};

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
    of_columns([product(a, &x), product(a, &y), product(a, &z)])
}

/// `a^T b`.
#[inline(never)]
pub fn transposed_matrix_product<T: Real>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    matrix_product(&a.transpose(), b)
}

/// Sum of vectors, each times a number.
#[inline(never)]
pub fn combined<T: Real>(terms: &[(&Vector3<T>, T)]) -> Vector3<T> {
    terms.iter().fold(zeros(), |sum: Vector3<T>, (v, share)| {
        Vector3::new(sum.x + v.x * *share, sum.y + v.y * *share, sum.z + v.z * *share)
    })
}

/// `x + y + z`.
pub fn total<T: Real>(v: &Vector3<T>) -> T {
    v.x + v.y + v.z
}

/// Part of `v` across `unit`, a vector of unit length.
#[inline(never)]
pub fn across<T: Real>(v: &Vector3<T>, unit: &Vector3<T>) -> Vector3<T> {
    combined(&[(v, T::one()), (unit, -unit.dot(v))])
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
    of_columns([x, y, z])
}

/// `sum += term`.
#[inline(never)]
pub fn add<T: Real>(sum: &mut Matrix3<T>, term: &Matrix3<T>) {
    for (sum, term) in sum.as_mut_slice().iter_mut().zip(term.as_slice()) {
        *sum += *term;
    }
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

/// Zeros, in such words that they are written where they are to be and nowhere before: that would be on the stack.
#[inline(always)]
pub fn zeros<T: Real, const R: usize, const C: usize>() -> SMatrix<T, R, C> {
    SMatrix::from_array_storage(ArrayStorage([[T::zero(); R]; C]))
}

/// The matrix that changes nothing.
pub fn identity<T: Real>() -> Matrix3<T> {
    diagonal(T::one(), T::one(), T::one())
}

/// `diag(x, y, z)`.
pub fn diagonal<T: Real>(x: T, y: T, z: T) -> Matrix3<T> {
    let zero = T::zero();
    Matrix3::new(x, zero, zero, zero, y, zero, zero, zero, z)
}

/// A matrix by its columns.
#[inline(always)]
pub fn of_columns<T: Real>([x, y, z]: [Vector3<T>; 3]) -> Matrix3<T> {
    Matrix3::from_array_storage(ArrayStorage([x.into(), y.into(), z.into()]))
}

/// Length of a vector or matrix, by the root that the processor has.
pub trait Length<T: Real> {
    /// `sqrt(v . v)`, of all elements.
    fn length(&self) -> T;
}

impl<T: Real> Length<T> for Vector2<T> {
    fn length(&self) -> T {
        (self.x * self.x + self.y * self.y).square_root()
    }
}

impl<T: Real> Length<T> for Vector3<T> {
    fn length(&self) -> T {
        squared(self).square_root()
    }
}

impl<T: Real> Length<T> for Matrix3<T> {
    fn length(&self) -> T {
        squared_matrix(self).square_root()
    }
}

/// `|v|^2`.
pub fn squared<T: Real>(v: &Vector3<T>) -> T {
    v.x * v.x + v.y * v.y + v.z * v.z
}

/// Sum of the squares of all elements.
#[inline(never)]
pub fn squared_matrix<T: Real>(m: &Matrix3<T>) -> T {
    let [x, y, z] = columns(m);
    squared(&x) + squared(&y) + squared(&z)
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
