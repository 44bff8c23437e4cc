//! Everything a spin shows, with its uncertainty.

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::real::Real;
use crate::spin::estimator::TurnTotals;

/// A number with its 1-sigma; infinite sigma where the data do not show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScalarEstimate<T: Real> {
    /// The number.
    pub value: T,
    /// 1-sigma; the largest number there is where nothing is known.
    pub sigma: T,
}

impl<T: Real> ScalarEstimate<T> {
    pub(super) fn unknown() -> Self {
        Self {
            value: T::zero(),
            sigma: T::max_value().unwrap_or(T::zero()),
        }
    }

    /// Tests whether it has a finite sigma.
    pub fn is_known(&self) -> bool {
        self.sigma < T::max_value().unwrap_or(T::zero())
    }
}

/// Angles truly turned, from dock to dock or from wheel odometry, where known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueAngle<T: Real> {
    /// Clockwise, rad, positive.
    pub clockwise: Option<T>,
    /// Counter-clockwise, rad.
    pub counter_clockwise: Option<T>,
    /// 1-sigma of each, rad.
    pub sigma: T,
}

/// Three numbers with their 1-sigma, such as the bias of a triad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VectorEstimate<T: Real> {
    /// m/s^2, rad/s or m, case frame.
    pub value: Vector3<T>,
    /// 1-sigma.
    pub sigma: Vector3<T>,
    /// True if the data show it.
    pub observed: bool,
}

/// Everything a spin shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinEstimate<T: Real> {
    /// Angles through which the robot turned.
    pub turned: TurnTotals<T>,
    /// Time at rest, s.
    pub resting_time: T,
    /// Samples at rest and turning.
    pub samples: u32,
    /// Scatter of one sample: accelerometer at rest and turning, m/s^2, gyroscope at rest and turning, rad/s.
    pub noise: [Vector3<T>; 4],
    /// Gyroscope bias, rad/s.
    pub gyroscope_bias: VectorEstimate<T>,
    /// Accelerometer bias whatever the floor, m/s^2.
    pub level_free: VectorEstimate<T>,
    /// Accelerometer bias if the floor is level, m/s^2.
    pub level_floor: VectorEstimate<T>,
    /// True if the level-free bias is the result: at least one full turn, or a part that shows it well enough, and the
    /// floor is not stated to be level.
    pub level_free_is_default: bool,
    /// Covariance of `[accelerometer bias, gyroscope bias]` of that result.
    pub covariance: SMatrix<T, 6, 6>,
    /// Share of the Earth's rotation in the covariance of the gyroscope bias, (rad/s)^2, case frame: spins of one robot on
    /// one floor have it in common.
    pub by_earth: Matrix3<T>,
    /// Turning axis, unit length, case frame.
    pub up: Vector3<T>,
    /// Roll of the IMU against the floor, rad.
    pub roll: ScalarEstimate<T>,
    /// Pitch of the IMU against the floor, rad.
    pub pitch: ScalarEstimate<T>,
    /// Tilt of the floor, rad.
    pub floor_tilt: ScalarEstimate<T>,
    /// Uphill, rad counter-clockwise from forward, at the heading of the first rest.
    pub uphill_bearing: ScalarEstimate<T>,
    /// Position of the IMU from the turning axis, m, case frame, across the axis.
    pub lever_arm: VectorEstimate<T>,
    /// Scale error of the gyroscope about the axis, from harmonics and true angles.
    pub scale: ScalarEstimate<T>,
    /// The same clockwise alone, from the true angle.
    pub scale_clockwise: ScalarEstimate<T>,
    /// The same counter-clockwise alone.
    pub scale_counter_clockwise: ScalarEstimate<T>,
    /// Rate about the axis while the robot seemed to stand still, as the harmonics have it, rad/s.
    pub slow_turn: ScalarEstimate<T>,
    /// True if that rate is significant, and was subtracted from the gyroscope bias.
    pub turned_while_still: bool,
    /// Sum of squared normalised residuals of the model against the free harmonics.
    pub chi_square: T,
    /// Its degrees of freedom.
    pub degrees_of_freedom: u32,
    /// Factor by which all sigmas are wider than noise explains, since the model does not explain the rest; else one.
    pub widening: T,
}

impl<T: Real> SpinEstimate<T> {
    /// Accelerometer bias by the method of choice.
    pub fn accelerometer_bias(&self) -> &VectorEstimate<T> {
        if self.level_free_is_default {
            &self.level_free
        } else {
            &self.level_floor
        }
    }
}
