//! Closed-form rotation between two sets of vectors, and the calculus of small rotations.

use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::eigen;
use crate::products::Length;
use crate::real::{Real, real};

/// The matrix of the cross product, `[v]x w = v x w`.
pub fn cross_matrix<T: Real>(v: &Vector3<T>) -> Matrix3<T> {
    v.cross_matrix()
}

/// Inverse of the left Jacobian of SO(3): `d(log R) = J^-1(phi) d`, where `R' = exp([d]x) R`.
///
/// Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics" (2018), eq. 146.
pub fn inverse_left_jacobian<T: Real>(phi: &Vector3<T>) -> Matrix3<T> {
    let hat = cross_matrix(phi);
    let angle_squared = phi.norm_squared();
    // Below this the series is exact to rounding in f64 as in f32.
    let quadratic = if angle_squared < real(1e-4) {
        real::<T>(1.0 / 12.0) + angle_squared * real(1.0 / 720.0)
    } else {
        let half = angle_squared.square_root() * real(0.5);
        let (sine, cosine) = half.sine_cosine();
        (T::one() - half * cosine / sine) / angle_squared
    };
    Matrix3::identity() - hat * real::<T>(0.5) + hat * hat * quadratic // model.md, eq. 8
}

/// The rotation of a rotation vector in rad: by series where it is small, as it is for a block at rest.
pub fn rotation_of<T: Real>(phi: &Vector3<T>) -> UnitQuaternion<T> {
    let angle_squared = phi.norm_squared();
    if angle_squared > real(1e-7) {
        let half = phi * real::<T>(0.5);
        let size = half.length();
        let (sine, cosine) = size.sine_cosine();
        return UnitQuaternion::new_unchecked(Quaternion::from_parts(cosine, half * (sine / size)));
    }
    // The terms left out, phi^4 / 384 and less, are below the rounding of f64.
    let scalar = T::one() - angle_squared * real(0.125);
    let vector = phi * (real::<T>(0.5) - angle_squared * real(1.0 / 48.0));
    UnitQuaternion::new_unchecked(Quaternion::from_parts(scalar, vector))
}

/// Halvings after which the series below holds for half a turn.
const HALVINGS: u32 = 5;

/// The same for up to half a turn without sines: by series for a part of the rotation, done as often as that part goes into
/// it.
pub fn rotation_by_series<T: Real>(phi: &Vector3<T>) -> UnitQuaternion<T> {
    let half: Vector3<T> = phi * real::<T>(0.5 / 32.0);
    let square = half.norm_squared();
    // The terms left out are below 2e-11 for half a turn.
    let cosine = T::one() - square * (real::<T>(0.5) - square * real::<T>(1.0 / 24.0));
    let sine = T::one() - square * (real::<T>(1.0 / 6.0) - square * real::<T>(1.0 / 120.0));
    let mut turned = Quaternion::from_parts(cosine, half * sine);
    for _ in 0..HALVINGS {
        turned *= turned;
    }
    UnitQuaternion::new_normalize(turned)
}

/// The smallest rotation that brings the direction of `from` onto that of `to`, without sines either; of opposite ones,
/// half a turn about a direction across both. Nothing is turned where there is no direction.
pub fn rotation_onto<T: Real>(from: &Vector3<T>, to: &Vector3<T>) -> UnitQuaternion<T> {
    let size = from.length() * to.length();
    let scalar = size + from.dot(to);
    if size <= T::zero() {
        return UnitQuaternion::identity();
    }
    if scalar > size * real::<T>(1e-6) {
        return UnitQuaternion::new_normalize(Quaternion::from_parts(scalar, from.cross(to)));
    }
    let axis = if from.x.abs() < from.y.abs() {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let across: Vector3<T> = axis - from * (axis.dot(from) / from.norm_squared().max(real(1e-12)));
    UnitQuaternion::new_normalize(Quaternion::from_parts(T::zero(), across))
}

/// Weighted sums over pairs `(to, from)` of vectors, of which a rotation and an offset remain to be solved:
/// `to = R from + offset`. Centred (Welford), so the offset costs no digits.
#[derive(Clone, Copy, Debug)]
pub struct Procrustes<T: Real> {
    weight: T,
    mean_to: Vector3<T>,
    mean_from: Vector3<T>,
    cross: Matrix3<T>,
    spread: Matrix3<T>,
}

/// A rotation with the offset that was solved beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationFit<T: Real> {
    /// `to_from`.
    pub rotation: Rotation3<T>,
    /// Offset in the frame `to`.
    pub offset: Vector3<T>,
    /// Information on the rotation vector for unit weight: `sum w (|a|^2 I - a a^T)`, `a` the centred `from`, turned.
    pub information: Matrix3<T>,
    /// Sum of the weights.
    pub weight: T,
    /// Weighted mean of `from`, on which the offset leans: `offset = mean_to - R mean_from`.
    pub mean_from: Vector3<T>,
}

impl<T: Real> Default for Procrustes<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Procrustes<T> {
    /// No pairs yet.
    pub fn new() -> Self {
        Self {
            weight: T::zero(),
            mean_to: Vector3::zeros(),
            mean_from: Vector3::zeros(),
            cross: Matrix3::zeros(),
            spread: Matrix3::zeros(),
        }
    }

    /// Takes in one pair.
    pub fn push(&mut self, to: &Vector3<T>, from: &Vector3<T>, weight: T) {
        self.weight += weight;
        let share = weight / self.weight;
        let (to_before, from_before) = (to - self.mean_to, from - self.mean_from);
        self.mean_to += to_before * share;
        self.mean_from += from_before * share;
        self.cross += to_before * (from - self.mean_from).transpose() * weight;
        self.spread += from_before * (from - self.mean_from).transpose() * weight;
    }

    /// Solves `to = R from + offset` by the quaternion that belongs to the largest eigenvalue of the matrix of Horn,
    /// "Closed-form solution of absolute orientation using unit quaternions" (1987), section 4: never a reflection.
    /// `None` where the pairs do not span a plane, so that the rotation is not determined.
    pub fn solve(&self) -> Option<RotationFit<T>> {
        let (values, vectors) = eigen::symmetric(self.horn());
        let largest = values.imax();
        let second = (0..4)
            .filter(|i| *i != largest)
            .fold(-values[largest], |second, i| second.max(values[i]));
        // The gap is twice the second singular value of the cross sums, give or take the third.
        if values[largest] - second <= values[largest] * real(1e-5) {
            return None;
        }
        let q = vectors.column(largest);
        let rotation =
            UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3])).to_rotation_matrix();
        let turned = rotation.matrix() * self.spread * rotation.matrix().transpose();
        Some(RotationFit {
            rotation,
            offset: self.mean_to - rotation * self.mean_from, // turntable.md, eq. 3
            information: Matrix3::identity() * turned.trace() - turned, // turntable.md, eq. 4
            weight: self.weight,
            mean_from: self.mean_from,
        })
    }

    /// The matrix N with `q^T N q = sum w to . (q from q*)`.
    fn horn(&self) -> Matrix4<T> {
        let s = self.cross.transpose();
        let curl = Vector3::new(
            s[(1, 2)] - s[(2, 1)],
            s[(2, 0)] - s[(0, 2)],
            s[(0, 1)] - s[(1, 0)],
        );
        let mut n = Matrix4::zeros();
        n[(0, 0)] = s.trace(); // turntable.md, eq. 3
        n.fixed_view_mut::<1, 3>(0, 1).copy_from(&curl.transpose());
        n.fixed_view_mut::<3, 1>(1, 0).copy_from(&curl);
        n.fixed_view_mut::<3, 3>(1, 1)
            .copy_from(&(s + self.cross - Matrix3::identity() * s.trace()));
        n
    }
}
