//! Statistics of each unit: its deviation from the set, and evidence from the unit alone.

use nalgebra::Vector3;

use crate::products::{Length, cross, squared, zeros};
use crate::real::{Real, real, tabulated};
use crate::redundancy::components::{difference, follow, scaled, sum};
use crate::redundancy::isolation::scales::{LatestShares, SCALES, filled};
use crate::redundancy::isolation::shaking::{LeftByVibration, Shaking};
use crate::redundancy::sensor::{SLOW_OFFSET, Sensor};

/// Largest rate of change of a slow offset, m/s^2 and rad/s per second. Consumer units warm up no faster
/// (docs/theory/isolation.md, table 1).
const SLEW: [f32; 2] = [2e-4, 7e-5];

/// Deviation of one sensor of a unit from the set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorDeviation<T: Real> {
    /// Means of the deviation over each scale, minus the slow offset, m/s^2 or rad/s.
    means: [Vector3<T>; SCALES],
    /// Slow offset: drift within specification, which needs no calibration.
    offset: Vector3<T>,
    shaking: Shaking<T>,
    /// Windows received.
    windows: u16,
    /// Number of scales that these windows fill, the shortest first.
    filled: u8,
    /// Windows in succession, up to [`BENT`].
    successive: u8,
}

/// Windows that a second difference follows on.
const BENT: u8 = 2;

impl<T: Real> SensorDeviation<T> {
    /// Creates statistics without any window.
    pub fn new() -> Self {
        Self {
            means: [zeros(); SCALES],
            offset: zeros(),
            shaking: Shaking::new(),
            windows: 0,
            filled: 0,
            successive: 0,
        }
    }

    /// Updates the means with the deviation over the next window; `vibration` is the largest variance that
    /// vibration may leave in it.
    pub fn push(
        &mut self,
        sensor: Sensor,
        deviation: &Vector3<T>,
        vibration: T,
        shares: &mut LatestShares<T>,
    ) {
        let follows = self.successive == BENT;
        self.shaking
            .push(sensor, deviation, vibration, shares.window(), follows);
        self.successive += u8::from(!follows);
        self.windows = self.windows.saturating_add(1);
        self.filled = filled(self.filled, shares.window(), self.windows);
        let value = difference(deviation, &self.offset);
        for (mean, share) in self.means.iter_mut().zip(shares.after(self.windows)) {
            follow(mean, &value, *share); // isolation.md, eq. 2
        }
    }

    /// Skips a window without a reading.
    pub fn skip(&mut self) {
        self.successive = 0;
    }

    /// Variance that vibration leaves in a window.
    pub fn shaken(&self) -> LeftByVibration<T> {
        self.shaking.left()
    }

    /// Lets the slow offset follow the mean, while no fault is suspected.
    pub fn follow(&mut self, sensor: Sensor, window: T) {
        let [_, _, mean, _] = &self.means;
        let (slew, square) = (tabulated::<T>(*sensor.of(&SLEW)) * window, squared(mean));
        if square <= slew * slew {
            self.offset += mean;
        } else {
            self.offset += scaled(mean, slew / square.square_root());
        }
        let (most, square) = (tabulated::<T>(*sensor.of(&SLOW_OFFSET)), squared(&self.offset));
        if square > most * most {
            self.offset = scaled(&self.offset, most / square.square_root());
        }
    }

    /// Resets the means; the slow offset stays.
    pub fn restart(&mut self) {
        *self = Self {
            offset: self.offset,
            shaking: self.shaking,
            ..Self::new()
        };
    }

    /// Restarts with the mean deviation over one second as slow offset: the unit needs no calibration.
    pub fn accept(&mut self, sensor: Sensor) {
        let [_, second, ..] = self.means;
        let offset = self.offset + second;
        self.begin_with(sensor, &offset);
    }

    /// Subtracts a change of the correction from the slow offset.
    pub fn trimmed(&mut self, change: &Vector3<T>) {
        self.offset = difference(&self.offset, change);
    }

    /// Restarts with a slow offset, limited to its largest magnitude.
    pub fn begin_with(&mut self, sensor: Sensor, offset: &Vector3<T>) {
        let most = tabulated::<T>(*sensor.of(&SLOW_OFFSET));
        let size = offset.length();
        *self = Self {
            offset: if size > most {
                offset * (most / size)
            } else {
                *offset
            },
            shaking: self.shaking,
            successive: self.successive,
            ..Self::new()
        };
    }

    /// Drift from the set since the calibration or trim, over ten seconds; `None` before they have passed.
    pub fn drifted(&self) -> Option<Vector3<T>> {
        Some(sum(&self.offset, self.mean(2)?))
    }

    /// Deviation from the set in the window before the latest, minus its mean over ten seconds; `None` where either
    /// is missing.
    pub fn beyond_before(&self) -> Option<Vector3<T>> {
        let usual = self.drifted()?;
        (self.successive == BENT).then(|| difference(self.shaking.before(), &usual))
    }

    /// Means over each filled scale, the shortest first.
    pub fn means(&self) -> &[Vector3<T>] {
        self.means.get(..self.filled.into()).unwrap_or(&self.means)
    }

    /// Mean over one scale; `None` until it is filled.
    pub fn mean(&self, scale: usize) -> Option<&Vector3<T>> {
        self.means().get(scale)
    }
}

/// Gravity carried by the gyroscope of a unit, compared with the reading of its accelerometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriedGravity<T: Real> {
    /// Mean specific force in axes that do not turn, m/s^2; zero until it is initialised. Its direction is that of
    /// carried gravity.
    mean: Vector3<T>,
    /// Angular rate over the window before, rad/s.
    rate: Vector3<T>,
    error: Vector3<T>,
}

/// One plus the cosine of a turn below which its axis is unknown: 174 degrees.
const LEAST_COSINE: f64 = 0.005;

/// Time constants with which carried gravity returns to the reading of the accelerometer and its error is
/// averaged, s.
pub(super) const CARRIED_OVER: f64 = 20.0;
const ERROR_OVER: f64 = 3.0;

impl<T: Real> CarriedGravity<T> {
    /// Creates carried gravity that is not initialised.
    pub fn new() -> Self {
        Self {
            mean: zeros(),
            rate: zeros(),
            error: zeros(),
        }
    }

    /// Updates carried gravity with a window of compensated readings; `usual_up` is the usual direction of gravity in the
    /// axes of the primary, upwards, of length one, and `g` its magnitude, m/s^2 (docs/theory/isolation.md, eq. 14).
    pub fn push(&mut self, f: &Vector3<T>, w: &Vector3<T>, usual_up: &Vector3<T>, g: T, window: T) {
        if squared(&self.mean) == T::zero() {
            (self.mean, self.rate) = (*f, *w);
        }
        // From the middle of the window before to the middle of this one. By the rate of this one alone, rotations lag by
        // half a window, and those about several axes turn carried gravity away.
        let between = scaled(&sum(w, &self.rate), real(0.5));
        self.rate = *w;
        let mean = &mut self.mean;
        // A rotation by -w h, to second order.
        let turn = scaled(&between, -window);
        let first = cross(&turn, mean);
        let second = scaled(&cross(&turn, &first), real(0.5));
        let (size, turned) = (squared(mean), sum(&sum(mean, &first), &second));
        let size_turned = squared(&turned);
        let up = if size_turned > T::zero() {
            scaled(&turned, T::one() / size_turned.square_root())
        } else {
            Vector3::z()
        };
        // A rotation to second order lengthens what it turns.
        *mean = scaled(&up, size.square_root());
        follow(mean, f, window / real::<T>(CARRIED_OVER)); // isolation.md, eq. 14
        let along = squared(mean).square_root() - g;
        let across = difference(f, &scaled(&up, up.dot(f)));
        // The least rotation that takes the vertical to its usual direction in the axes of the unit.
        let both = sum(&up, usual_up);
        let cosine = T::one() + up.dot(usual_up);
        let shifted = if cosine > real(LEAST_COSINE) {
            scaled(&both, -usual_up.dot(&across) / cosine)
        } else {
            zeros()
        };
        let error = sum(&sum(&across, &shifted), &scaled(usual_up, along)); // isolation.md, eq. 14
        follow(&mut self.error, &error, window / real::<T>(ERROR_OVER));
    }

    /// Reading of the accelerometer across carried gravity, and along it the mean specific force minus gravity; mean over
    /// the latest seconds, m/s^2.
    pub fn error(&self) -> &Vector3<T> {
        &self.error
    }
}
