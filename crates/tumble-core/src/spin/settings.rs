//! Settings of a spin.

use crate::grade::{BiasInstability, Grade};
use crate::gravity::{self, EARTH_RATE};
use crate::real::{Real, real};
use crate::stillness::StillnessSettings;
use crate::turntable::reference::earth_variance;

/// Everything that can be set; lengths of time in microseconds, angles in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinSettings<T: Real> {
    /// Gravity, m/s^2.
    pub gravity: T,
    /// Time to stand still.
    pub still: u64,
    /// Angle to turn, both directions together, rad.
    pub turn: T,
    /// Speed asked for, rad/s: reported to the user, not checked.
    pub rate: T,
    /// Take the floor for level, as the published estimator does.
    pub level_floor: bool,
    /// Largest floor tilt, rad.
    pub largest_floor_tilt: T,
    /// 1-sigma of the gyroscope's scale error about the turning axis, before anything is known of it.
    pub scale_sigma: T,
    /// Bias instability B (docs/theory/noise.md) of the accelerometer, m/s^2; zero where it does not matter.
    pub specific_force_instability: T,
    /// Bias instability of the gyroscope, rad/s; zero as above.
    pub angular_rate_instability: T,
    /// End of the accelerometer's range, m/s^2, where known.
    pub specific_force_range: Option<T>,
    /// End of the gyroscope's range, rad/s, where known.
    pub angular_rate_range: Option<T>,
    /// Longest wait for the robot to stand still.
    pub still_timeout: u64,
    /// Longest wait for the turn.
    pub spin_timeout: u64,
    /// Longest pause in the samples.
    pub longest_gap: u64,
    /// Length of a block.
    pub block: u64,
    /// Shortest stop after the first rest that is counted as a rest.
    pub shortest_stop: u64,
    /// Upward part of the Earth's rotation, rad/s; zero where the latitude is not known. Its size gives that of the part
    /// towards north, so that at the equator it is the smallest number that is not zero.
    pub earth_rate_up: T,
    /// Largest change of the force along the turning axis, m/s^2.
    pub largest_lift: T,
    /// Largest rate across the turning axis, rad/s.
    pub largest_rate_across: T,
    /// Largest rate across the turning axis as a share of the rate about it.
    pub largest_share_across: T,
    /// Largest plausible bias of the gyroscope, rad/s: a robot that seems to turn faster does not stand still.
    pub largest_rate_bias: T,
    /// Largest turn from one sample to the next, rad.
    pub largest_step: T,
    /// Largest scatter of specific force, m/s^2, at which a robot may stand still: an engine may run, but a hand that
    /// shakes it is no rest.
    pub largest_specific_force_scatter: T,
    /// Largest scatter of angular rate, rad/s, at which a robot may stand still.
    pub largest_angular_rate_scatter: T,
    /// Criteria of standing still.
    pub stillness: StillnessSettings<T>,
}

/// Variance of the Earth's rotation, (rad/s)^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EarthVariance<T: Real> {
    /// Along any level direction.
    pub level: T,
    /// Upwards.
    pub up: T,
    /// Along any direction on a floor that may tilt.
    pub across: T,
}

impl<T: Real> EarthVariance<T> {
    /// Along the normal of a floor, of which `sine` is that of the tilt.
    pub fn along_normal(&self, sine: T) -> T {
        let squared = sine * sine;
        self.up * (T::one() - squared).max(T::zero()) + self.level * squared // eq. 6e
    }
}

impl<T: Real> Default for SpinSettings<T> {
    /// For a unit of consumer grade.
    fn default() -> Self {
        Self::for_grade(Grade::Consumer)
    }
}

impl<T: Real> SpinSettings<T> {
    /// Variance of the Earth's rotation, (rad/s)^2, along any level direction and upwards; its direction on the floor is not
    /// known (docs/theory/spin.md, eq. 6e).
    pub fn earth_variance(&self) -> EarthVariance<T> {
        let up = self.earth_rate_up;
        if up == T::zero() {
            let any = earth_variance();
            return EarthVariance {
                level: any,
                up: any,
                across: any,
            };
        }
        let north = (real::<T>(EARTH_RATE * EARTH_RATE) - up * up).max(T::zero());
        let level = north * real(0.5); // eq. 6e
        // Mean square of the sine of a tilt up to the largest, over two directions.
        let tilted = self.largest_floor_tilt * self.largest_floor_tilt / real(6.0);
        EarthVariance {
            level,
            up: T::zero(),
            across: level + up * up * tilted, // eq. 6e
        }
    }

    /// For a unit of this grade: a spin is too short to show the bias instability, which goes into every sigma.
    pub fn for_grade(grade: Grade) -> Self {
        let BiasInstability {
            specific_force,
            angular_rate,
        } = grade.bias_instability();
        Self {
            gravity: real(gravity::STANDARD),
            still: 5_000_000,
            turn: real(2.0 * core::f64::consts::TAU),
            rate: real(1.0),
            level_floor: false,
            largest_floor_tilt: real(10.0_f64.to_radians()),
            scale_sigma: real(0.01),
            specific_force_instability: specific_force,
            angular_rate_instability: angular_rate,
            specific_force_range: None,
            angular_rate_range: None,
            still_timeout: 60_000_000,
            spin_timeout: 120_000_000,
            longest_gap: 250_000,
            block: 200_000,
            shortest_stop: 1_000_000,
            earth_rate_up: T::zero(),
            largest_lift: real(0.5),
            largest_rate_across: real(0.1),
            largest_share_across: real(0.05),
            largest_rate_bias: real(0.5),
            largest_step: real(0.25),
            largest_specific_force_scatter: real(2.0),
            largest_angular_rate_scatter: real(0.2),
            stillness: StillnessSettings::default(),
        }
    }
}
