//! The error model `y = M u + b`, and its parts `M = K L Q`.
//!
//! `K` is the diagonal of scale factors (the norms of the rows of `M`), `L` the lower triangular
//! non-orthogonality with rows of unit length, `Q` the mounting rotation `sensor_from_case`. The
//! decomposition is exact and unique for `det M > 0`: Gram-Schmidt on the rows (docs/theory/model.md).

use nalgebra::{Matrix3, Rotation3, SMatrix, UnitQuaternion, Vector3};

use crate::products::{Length, columns, identity, zeros};
use crate::real::{Real, real};
use crate::rotation::inverse_left_jacobian;

/// Length of the parameter vector `[M row by row, b]`.
pub const PARAMETERS: usize = 12;

/// Covariance of `[M row by row, b]`, or of the twelve numbers of [`Decomposition::parameters`].
pub type ModelCovariance<T> = SMatrix<T, PARAMETERS, PARAMETERS>;

/// Why a matrix cannot be taken apart, or inverted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelError {
    /// Two sensing axes coincide, or one is zero or not finite.
    Singular,
    /// `det M < 0`: the axes form a left-handed set, which no mounting explains.
    LeftHanded,
}

/// Forward model of one triad, `y = M u + b`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorModel<T: Real> {
    /// Sensor from case: scale, non-orthogonality and mounting together, without unit.
    pub matrix: Matrix3<T>,
    /// Bias in the unit of the sensor, m/s^2 or rad/s.
    pub bias: Vector3<T>,
}

/// Inverse model of one triad, `u = C (y - b)` with `C = M^-1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<T: Real> {
    /// Case from sensor, `M^-1`.
    pub matrix: Matrix3<T>,
    /// Bias in the unit of the sensor.
    pub bias: Vector3<T>,
}

impl<T: Real> ErrorModel<T> {
    /// Model of an error-free sensor.
    pub fn identity() -> Self {
        Self {
            matrix: identity(),
            bias: zeros(),
        }
    }

    /// Reading of the sensor where the truth is `u`.
    pub fn measure(&self, u: &Vector3<T>) -> Vector3<T> {
        times(&self.matrix, u) + self.bias // eq. 1
    }

    /// The correction that undoes this model.
    ///
    /// # Errors
    /// [`ModelError::Singular`] if `M` has no inverse.
    pub fn correction(&self) -> Result<Correction<T>, ModelError> {
        let matrix = self.matrix.try_inverse().ok_or(ModelError::Singular)?;
        Ok(Correction {
            matrix,
            bias: self.bias,
        })
    }

    /// Takes `M` apart into `K L Q`.
    ///
    /// # Errors
    /// [`ModelError`] where `M` is singular or left-handed.
    pub fn decompose(&self) -> Result<Decomposition<T>, ModelError> {
        Decomposition::of(&self.matrix)
    }
}

impl<T: Real> Correction<T> {
    /// The truth behind the reading `y`.
    #[inline(never)]
    pub fn apply(&self, y: &Vector3<T>) -> Vector3<T> {
        let b = &self.bias;
        times(&self.matrix, &Vector3::new(y.x - b.x, y.y - b.y, y.z - b.z)) // eq. 1
    }
}

/// `m v`, written out: built for size, the general product is a loop of calls that takes a device three times as long.
pub(crate) fn times<T: Real>(m: &Matrix3<T>, v: &Vector3<T>) -> Vector3<T> {
    Vector3::new(
        m.m11 * v.x + m.m12 * v.y + m.m13 * v.z,
        m.m21 * v.x + m.m22 * v.y + m.m23 * v.z,
        m.m31 * v.x + m.m32 * v.y + m.m33 * v.z,
    )
}

/// `M = K L Q`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decomposition<T: Real> {
    /// Diagonal of `K`: scale factor of each axis.
    pub scale: Vector3<T>,
    /// `L`: lower triangular with rows of unit length.
    pub non_orthogonality: Matrix3<T>,
    /// `Q`: sensor_from_case.
    pub mounting: Rotation3<T>,
}

/// The twelve numbers of a calibration as people read them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelParameters<T: Real> {
    /// Bias of each axis, in the unit of the sensor.
    pub bias: Vector3<T>,
    /// Scale factor of each axis.
    pub scale: Vector3<T>,
    /// Deviation from 90 degrees between axes xy, yz, zx: `asin(s_i . s_j)`, rad.
    pub non_orthogonality: Vector3<T>,
    /// Rotation vector of `Q`, rad.
    pub mounting: Vector3<T>,
}

/// Pairs of axes in the order non-orthogonality is reported.
pub const PAIRS: [(usize, usize); 3] = [(0, 1), (1, 2), (2, 0)];

impl<T: Real> Decomposition<T> {
    /// Gram-Schmidt on the rows of `M`.
    ///
    /// # Errors
    /// [`ModelError`] where `M` is singular or left-handed.
    pub fn of(m: &Matrix3<T>) -> Result<Self, ModelError> {
        let tiny = real::<T>(1e-12);
        let [x, y, z] = columns(&m.transpose());
        let k = Vector3::new(x.length(), y.length(), z.length());
        if k.iter().any(|norm| !norm.is_finite() || *norm <= tiny) {
            return Err(ModelError::Singular);
        }
        let s = sensing_axes(m);
        let q1 = s[0];
        let l21 = s[1].dot(&q1); // eq. 3
        let across = s[1] - q1 * l21; // eq. 3
        let l22 = across.length();
        if l22 <= real(1e-6) {
            return Err(ModelError::Singular);
        }
        let q2 = across / l22; // eq. 3
        let q3 = q1.cross(&q2); // eq. 3
        let (l31, l32, l33) = (s[2].dot(&q1), s[2].dot(&q2), s[2].dot(&q3)); // eq. 3
        if l33 <= -real::<T>(1e-6) {
            return Err(ModelError::LeftHanded);
        }
        if !l33.is_finite() || l33 <= real(1e-6) {
            return Err(ModelError::Singular);
        }
        let (zero, one) = (T::zero(), T::one());
        Ok(Self {
            scale: k,
            non_orthogonality: Matrix3::new(one, zero, zero, l21, l22, zero, l31, l32, l33),
            mounting: Rotation3::from_matrix_unchecked(Matrix3::from_rows(&[
                q1.transpose(),
                q2.transpose(),
                q3.transpose(),
            ])),
        })
    }

    /// Puts `M = K L Q` together again.
    pub fn compose(&self) -> Matrix3<T> {
        Matrix3::from_diagonal(&self.scale) * self.non_orthogonality * self.mounting.matrix() // eq. 2
    }

    /// The numbers people read, with the bias beside them.
    pub fn parameters(&self, bias: &Vector3<T>) -> ModelParameters<T> {
        let gram = self.non_orthogonality * self.non_orthogonality.transpose();
        ModelParameters {
            bias: *bias,
            scale: self.scale,
            // The indices are those of PAIRS, written out so that a compiler sees them within bounds.
            non_orthogonality: Vector3::new(gram[(0, 1)], gram[(1, 2)], gram[(2, 0)])
                .map(|sine| sine.clamp(-T::one(), T::one()).arc_sine()), // eq. 4
            mounting: UnitQuaternion::from_rotation_matrix(&self.mounting).scaled_axis(),
        }
    }

    /// Carries the covariance of `[M row by row, b]` to that of [`ModelParameters`]
    /// `[bias, scale, non-orthogonality, mounting]`, to first order (docs/theory/model.md, eq. 5 to 8).
    pub fn carry(&self, covariance: &ModelCovariance<T>) -> ModelCovariance<T> {
        let jacobian = self.jacobian();
        jacobian * covariance * jacobian.transpose()
    }

    /// Derivative of `[bias, scale, non-orthogonality, mounting]` by `[M row by row, b]`.
    pub fn jacobian(&self) -> ModelCovariance<T> {
        let mut jacobian = ModelCovariance::zeros();
        jacobian
            .fixed_view_mut::<3, 3>(0, 9)
            .copy_from(&Matrix3::identity());
        let s = sensing_axes(&(self.non_orthogonality * self.mounting.matrix()));
        for (i, axis) in s.iter().enumerate() {
            jacobian
                .fixed_view_mut::<1, 3>(3 + i, 3 * i)
                .copy_from(&axis.transpose()); // eq. 5: dk
        }
        for (row, &(i, j)) in PAIRS.iter().enumerate() {
            let sine = s[i].dot(&s[j]);
            let cosine = (T::one() - sine * sine).square_root();
            let mut by_axis = |i: usize, j: usize| {
                let gradient = self.turned(&s[i], &s[j], i) / cosine; // eq. 6
                jacobian
                    .fixed_view_mut::<1, 3>(6 + row, 3 * i)
                    .copy_from(&gradient.transpose());
            };
            by_axis(i, j);
            by_axis(j, i);
        }
        jacobian
            .fixed_view_mut::<3, 9>(9, 0)
            .copy_from(&self.mounting_jacobian(&s));
        jacobian
    }

    /// Gradient of `s_i . v` by row i of `M`: only the part of `v` across `s_i` turns the axis.
    fn turned(&self, s_i: &Vector3<T>, v: &Vector3<T>, i: usize) -> Vector3<T> {
        (v - s_i * s_i.dot(v)) / self.scale[i] // eq. 5: ds
    }

    /// Derivative of the rotation vector of `Q` by `M`: with `dq_i = Omega_ij q_j`,
    /// `Omega_12 = ds_1 . q_2`, `Omega_13 = ds_1 . q_3`, `Omega_23 = (ds_2 . q_3 - l_21 Omega_13) / l_22`,
    /// and `[d]x = Omega`, hence `d = -(Omega_23, -Omega_13, Omega_12)`.
    fn mounting_jacobian(&self, s: &[Vector3<T>; 3]) -> SMatrix<T, 3, 9> {
        let q = self.mounting.matrix();
        let (q2, q3) = (q.row(1).transpose(), q.row(2).transpose());
        let (l21, l22) = (self.non_orthogonality[(1, 0)], self.non_orthogonality[(1, 1)]);
        let omega_12 = self.turned(&s[0], &q2, 0); // eq. 7
        let omega_13 = self.turned(&s[0], &q3, 0); // eq. 7
        let mut twist = SMatrix::<T, 3, 9>::zeros();
        twist
            .fixed_view_mut::<1, 3>(0, 0)
            .copy_from(&(-omega_13 * (l21 / l22)).transpose()); // eq. 7: Omega_23
        twist
            .fixed_view_mut::<1, 3>(0, 3)
            .copy_from(&(self.turned(&s[1], &q3, 1) / l22).transpose()); // eq. 7: Omega_23
        twist
            .fixed_view_mut::<1, 3>(1, 0)
            .copy_from(&(-omega_13).transpose());
        twist
            .fixed_view_mut::<1, 3>(2, 0)
            .copy_from(&omega_12.transpose());
        let rotation_vector = UnitQuaternion::from_rotation_matrix(&self.mounting).scaled_axis();
        -inverse_left_jacobian(&rotation_vector) * twist // eq. 8
    }
}

/// Unit rows of `M`: the sensing axes in the case frame.
fn sensing_axes<T: Real>(m: &Matrix3<T>) -> [Vector3<T>; 3] {
    let axis = |row: Vector3<T>| row / row.length();
    [
        axis(Vector3::new(m.m11, m.m12, m.m13)),
        axis(Vector3::new(m.m21, m.m22, m.m23)),
        axis(Vector3::new(m.m31, m.m32, m.m33)),
    ]
}
