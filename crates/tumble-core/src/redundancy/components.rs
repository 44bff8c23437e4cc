//! Vector operations by component: the general operators, compiled for size, are loops and calls that take
//! several times as long on a device.

use nalgebra::Vector3;

use crate::real::Real;

/// `a - b`.
pub fn difference<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x - b.x, a.y - b.y, a.z - b.z)
}

/// `v` times a number.
pub fn scaled<T: Real>(v: &Vector3<T>, factor: T) -> Vector3<T> {
    Vector3::new(v.x * factor, v.y * factor, v.z * factor)
}

/// `a + b`.
pub fn sum<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> Vector3<T> {
    Vector3::new(a.x + b.x, a.y + b.y, a.z + b.z)
}

/// `a . b`.
pub fn dot<T: Real>(a: &Vector3<T>, b: &Vector3<T>) -> T {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// Larger of two numbers; the first if the second is NaN. The function of the library would be a call.
pub fn larger<T: Real>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

/// Smaller of two numbers; the first if the second is NaN.
pub fn smaller<T: Real>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

/// Moves a mean by a share of the way to a value.
pub fn follow<T: Real>(mean: &mut Vector3<T>, value: &Vector3<T>, share: T) {
    let left = difference(value, mean);
    *mean = Vector3::new(
        mean.x + left.x * share,
        mean.y + left.y * share,
        mean.z + left.z * share,
    );
}

/// Sets all places to a value by copying it: `fill` clones it field by field, which takes twice the code.
#[inline]
pub fn set_all<X: Copy>(places: &mut [X], value: X) {
    for place in places {
        *place = value;
    }
}
