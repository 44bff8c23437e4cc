//! Pairs: readings of primary and secondary over the same two windows.

use nalgebra::{Matrix3, Vector3};

use crate::products::{matrix_product, product, zeros};
use crate::real::{Real, seconds};
use crate::redundancy::platform::{MountedUnit, PrimaryCalibration};
use crate::redundancy::relative_error::RelativeError;
use crate::redundancy::samples::window::Means;
use crate::redundancy::sensor::{Axes, Sensor};
use crate::sample::CHANNELS;

/// Channels of a pair of accelerometers: primary 3, lever 9, time, secondary 3.
pub const FORCE_CHANNELS: usize = 16;

/// Channels of a pair of gyroscopes: primary 3, time, secondary 3.
pub const RATE_CHANNELS: usize = 7;

/// Products of the angular rates of the primary, xx yy zz xy yz zx, formed of samples before averaging.
pub fn products<T: Real>(calibration: &PrimaryCalibration<T>, angular_rate: &Vector3<T>) -> [T; CHANNELS] {
    let w = calibration.correct(Sensor::Gyroscope, angular_rate);
    [w.x * w.x, w.y * w.y, w.z * w.z, w.x * w.y, w.y * w.z, w.z * w.x]
}

/// Two successive windows.
pub type TwoWindows<'a, T> = (&'a Means<T, CHANNELS>, &'a Means<T, CHANNELS>);

/// Readings of the primary over two windows, and the effect of a lever arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryMeans<T: Real> {
    /// Raw specific force, m/s^2.
    pub specific_force: Vector3<T>,
    /// Raw angular rate, rad/s.
    pub angular_rate: Vector3<T>,
    /// Raw specific force per metre of lever arm, 1/s^2: `M_p ([dw/dt]x + [w]x [w]x)`.
    pub lever: Matrix3<T>,
}

impl<T: Real> PrimaryMeans<T> {
    /// Computes them from the readings of these axes and the products of the rates (docs/theory/redundancy.md,
    /// eq. 2 to 4). A missing accelerometer axis gets no effect of the lever arm.
    pub fn of(
        axes: &Axes,
        calibration: &PrimaryCalibration<T>,
        readings: TwoWindows<'_, T>,
        products: TwoWindows<'_, T>,
        window: u64,
    ) -> Self {
        let rate = |means: &Means<T, CHANNELS>| {
            let [_, _, _, x, y, z] = means.mean;
            calibration.correct(Sensor::Gyroscope, &Vector3::new(x, y, z))
        };
        let acceleration = (rate(readings.1) - rate(readings.0)) / seconds::<T>(window); // eq. 3
        let [fx, fy, fz, wx, wy, wz] = readings.0.triangle(readings.1);
        let [xx, yy, zz, xy, yz, zx] = products.0.triangle(products.1);
        let centripetal = Matrix3::new(-yy - zz, xy, zx, xy, -zz - xx, yz, zx, yz, -xx - yy);
        let mut matrix = calibration.model(Sensor::Accelerometer).matrix;
        for (mut row, has) in matrix.row_iter_mut().zip(axes.of(Sensor::Accelerometer)) {
            if !has {
                row.fill(T::zero());
            }
        }
        Self {
            specific_force: Vector3::new(fx, fy, fz),
            angular_rate: Vector3::new(wx, wy, wz),
            lever: matrix_product(&matrix, &(acceleration.cross_matrix() + centripetal)), // eq. 4: W
        }
    }
}

/// Pair in the axes of the secondary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPair<T: Real> {
    /// Readings of the primary: specific force, at the place of the secondary if that is known, and angular
    /// rate.
    pub first: [Vector3<T>; 2],
    /// Effect of an unknown lever arm; zero if the lever arm is known.
    pub lever: Matrix3<T>,
    /// Readings of the secondary.
    pub second: [Vector3<T>; 2],
}

impl<T: Real> MotionPair<T> {
    /// Combines the means of the primary with those of the secondary.
    pub fn of(unit: &MountedUnit<T>, primary: &PrimaryMeans<T>, second: &[T; CHANNELS]) -> Self {
        let turn = &unit.sensor_from_primary;
        let (carried, lever) = match &unit.lever_arm {
            Some(arm) => (primary.specific_force + product(&primary.lever, arm), zeros()),
            None => (primary.specific_force, matrix_product(turn, &primary.lever)),
        };
        let [fx, fy, fz, wx, wy, wz] = *second;
        Self {
            first: [product(turn, &carried), product(turn, &primary.angular_rate)],
            lever,
            second: [Vector3::new(fx, fy, fz), Vector3::new(wx, wy, wz)],
        }
    }

    /// Channels of the accelerometers; `time` in s. The primary is moved to the place given by the stored lever
    /// arm; the stored prediction is subtracted from the secondary.
    pub fn forces(&self, time: T, stored: &RelativeError<T>) -> [T; FORCE_CHANNELS] {
        let ([u, _], w, [y, _]) = (&self.first, &self.lever, &self.second);
        let u = u + product(w, &stored.lever_arm);
        let d = y - stored.predict(&u); // eq. 6
        [
            u.x, u.y, u.z, w.m11, w.m12, w.m13, w.m21, w.m22, w.m23, w.m31, w.m32, w.m33, time, d.x, d.y, d.z,
        ]
    }

    /// Channels of the gyroscopes; `time` in s. The stored prediction is subtracted from the secondary.
    pub fn rates(&self, time: T, stored: &RelativeError<T>) -> [T; RATE_CHANNELS] {
        let ([_, u], [_, y]) = (&self.first, &self.second);
        let d = y - stored.predict(u); // eq. 6
        [u.x, u.y, u.z, time, d.x, d.y, d.z]
    }
}
