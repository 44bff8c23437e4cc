//! Two kinds of sensor of a unit, and their axes.

use nalgebra::{Matrix3, Vector3};

use crate::products::{columns, squared};
use crate::real::{Real, real};
use crate::sample::{CHANNELS, Sample};

crate::vocabulary! {
    /// Sensor of three axes of one kind.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Sensor {
        /// Specific force, m/s^2.
        Accelerometer = "accelerometer",
        /// Angular rate, rad/s.
        Gyroscope = "gyroscope",
    }
}

/// Both sensors, in the order of the channels.
pub const SENSORS: [Sensor; 2] = [Sensor::Accelerometer, Sensor::Gyroscope];

/// Largest drift of a sensor within its specification, m/s^2 and rad/s (docs/theory/isolation.md, table 1); any
/// deviation beyond counts as a fault.
pub(crate) const SLOW_OFFSET: [f32; 2] = [0.1, 0.01];

impl Sensor {
    /// First of the three channels in a sample.
    pub fn first_channel(self) -> usize {
        match self {
            Sensor::Accelerometer => 0,
            Sensor::Gyroscope => 3,
        }
    }

    /// Sensor of a channel.
    pub fn of_channel(channel: usize) -> Self {
        if channel < 3 {
            Sensor::Accelerometer
        } else {
            Sensor::Gyroscope
        }
    }

    /// Returns the element of this sensor, of two with the accelerometer first.
    pub fn of<S>(self, [accelerometer, gyroscope]: &[S; 2]) -> &S {
        match self {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        }
    }

    /// Returns the element of this sensor, of two with the accelerometer first, mutable.
    pub fn of_mut<S>(self, [accelerometer, gyroscope]: &mut [S; 2]) -> &mut S {
        match self {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        }
    }

    /// Returns the three channels of this sensor, from six.
    pub fn triad<T: Real>(self, channels: &[T; CHANNELS]) -> Vector3<T> {
        let [fx, fy, fz, wx, wy, wz] = *channels;
        match self {
            Sensor::Accelerometer => Vector3::new(fx, fy, fz),
            Sensor::Gyroscope => Vector3::new(wx, wy, wz),
        }
    }

    /// Squared distance of the three channels in two readings.
    pub fn squared_distance<T: Real>(self, a: &[T; CHANNELS], b: &[T; CHANNELS]) -> T {
        squared(&(self.triad(a) - self.triad(b)))
    }
}

/// Share of an axis that a rotation written with four digits may leave where it should be zero.
const NEGLIGIBLE: f64 = 1e-3;

/// Channels of a unit, of the six possible: not every sensor has three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes(pub [bool; CHANNELS]);

impl Axes {
    /// All three axes of both sensors.
    pub const ALL: Self = Self([true; CHANNELS]);

    /// Axes of one sensor.
    pub fn of(&self, sensor: Sensor) -> &[bool; 3] {
        let triad = match sensor {
            Sensor::Accelerometer => self.0.first_chunk(),
            Sensor::Gyroscope => self.0.last_chunk(),
        };
        // Six channels always contain both triads.
        triad.unwrap_or(&[true; 3])
    }

    /// Returns whether a sensor has all three axes.
    pub fn complete(&self, sensor: Sensor) -> bool {
        *self.of(sensor) == [true; 3]
    }

    /// Returns whether a sensor has any axis.
    pub fn any(&self, sensor: Sensor) -> bool {
        *self.of(sensor) != [false; 3]
    }

    /// Returns whether the other has all axes of a sensor.
    pub fn within(&self, other: &Self, sensor: Sensor) -> bool {
        let both = self.of(sensor).iter().zip(other.of(sensor));
        both.into_iter().all(|(own, other)| !own || *other)
    }

    /// Sets missing axes of a vector to zero.
    pub fn present<T: Real>(&self, sensor: Sensor, v: &Vector3<T>) -> Vector3<T> {
        or_else(*self.of(sensor), v, T::zero())
    }

    /// Sets missing axes of a vector to NaN.
    pub fn shown<T: Real>(&self, sensor: Sensor, v: &Vector3<T>) -> Vector3<T> {
        or_else(*self.of(sensor), v, real(f64::NAN))
    }

    /// Axes of a unit that correspond to axes of another, where the nominal rotation `turn` leads from the axes
    /// of the other to those of the unit. The rows of the rotation determine the axes that each needs
    /// (docs/theory/redundancy.md, eq. 24).
    pub fn comparable<T: Real>(&self, others: &Self, turn: &Matrix3<T>) -> Self {
        let mut comparable = *self;
        if *others == Self::ALL {
            return comparable;
        }
        let rows = columns(&turn.transpose());
        for ((channel, has), row) in comparable.0.iter_mut().enumerate().zip(rows.iter().cycle()) {
            let mut needs = row.iter().zip(others.of(Sensor::of_channel(channel)));
            *has &= needs.all(|(share, there)| *there || share.abs() < real(NEGLIGIBLE)); // eq. 24
        }
        comparable
    }

    /// Returns whether all sensors with any axis are among these, accelerometer first.
    #[inline(never)]
    pub fn covered_by(&self, sensors: [bool; 2]) -> bool {
        let both = SENSORS.into_iter().zip(sensors);
        both.into_iter().all(|(sensor, among)| among || !self.any(sensor))
    }

    /// Sets missing channels of a sample to zero.
    pub fn blank<T: Real>(&self, sample: &mut Sample<T>) {
        if *self == Self::ALL {
            return;
        }
        sample.specific_force = self.present(Sensor::Accelerometer, &sample.specific_force);
        sample.angular_rate = self.present(Sensor::Gyroscope, &sample.angular_rate);
    }
}

/// Replaces the missing elements of a vector by another number.
fn or_else<T: Real>([x, y, z]: [bool; 3], v: &Vector3<T>, other: T) -> Vector3<T> {
    let only = |value: T, has: bool| if has { value } else { other };
    Vector3::new(only(v.x, x), only(v.y, y), only(v.z, z))
}
