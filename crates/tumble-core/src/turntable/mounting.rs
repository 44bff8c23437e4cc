//! Step 2: the mounting angle of the reference, `m = R_e m_ref + b_a`.

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::products::Length;
use crate::real::{Real, count};
use crate::rotation::Procrustes;

/// A rest of the reference at a pose of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseMean<T: Real> {
    /// Mean specific force, m/s^2, reference case frame.
    pub measured: Vector3<T>,
    /// Unit vector up, table frame.
    pub up: Vector3<T>,
    /// 1-sigma of the mean from noise alone, m/s^2.
    pub sigma: T,
}

/// Mounting angle of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MountingFit<T: Real> {
    /// `R_e`: case_from_table.
    pub rotation: Rotation3<T>,
    /// `b_a`, m/s^2: bias of the reference as the ideal poses show it.
    pub bias: Vector3<T>,
    /// Covariance of the rotation vector, rad^2.
    pub covariance: Matrix3<T>,
    /// Variance of one component of a residual, (m/s^2)^2: errors of the table and noise.
    pub pose_variance: T,
}

impl<T: Real> MountingFit<T> {
    /// Residual of a pose: measured minus `R_e m_ref + b_a`, m/s^2.
    pub fn residual(&self, pose: &PoseMean<T>, gravity: T) -> Vector3<T> {
        pose.measured - (self.rotation * pose.up * gravity + self.bias) // eq. 2
    }

    /// Angle between the commanded pose of the table and the one that the reference measured, rad.
    pub fn table_error(&self, pose: &PoseMean<T>, gravity: T) -> T {
        let residual = self.residual(pose, gravity);
        let up = self.rotation * pose.up;
        (residual - up * up.dot(&residual)).length() / gravity
    }
}

/// Centred Procrustes over the poses with the bias solved beside (docs/theory/turntable.md, eq. 3).
/// `None` where the poses do not determine a rotation.
pub fn fit_mounting<T: Real>(poses: &[PoseMean<T>], gravity: T) -> Option<MountingFit<T>> {
    let mut pairs = Procrustes::new();
    for pose in poses {
        pairs.push(&pose.measured, &(pose.up * gravity), T::one());
    }
    let fit = pairs.solve()?; // eq. 3
    let mut mounting = MountingFit {
        rotation: fit.rotation,
        bias: fit.offset,
        covariance: Matrix3::zeros(),
        pose_variance: T::zero(),
    };
    let squares = poses.iter().fold(T::zero(), |sum, pose| {
        sum + mounting.residual(pose, gravity).norm_squared()
    });
    let n = u32::try_from(poses.len()).unwrap_or(u32::MAX);
    let noise = poses
        .iter()
        .fold(T::zero(), |sum, pose| sum + pose.sigma * pose.sigma)
        / count(n.max(1));
    // Noise leaves three numbers a pose, less rotation and bias. Errors of the table act in two directions of three,
    // of which the rotation takes three numbers and the bias two (docs/theory/turntable.md, eq. 5).
    let of_noise = count::<T>((3 * n).saturating_sub(6)) * noise;
    let of_table = count::<T>((2 * n).saturating_sub(5).max(1));
    mounting.pose_variance = noise + ((squares - of_noise) / of_table).max(T::zero()); // eq. 5
    mounting.covariance = fit.information.try_inverse()? * mounting.pose_variance; // eq. 4
    Some(mounting)
}
