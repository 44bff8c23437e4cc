//! The two kinds of sensor in a unit, and the axes it has of each.

use nalgebra::{Matrix3, Vector3};

use crate::products::{columns, squared};
use crate::real::{Real, real};
use crate::sample::{CHANNELS, Sample};

crate::vocabulary! {
    /// Three axes of one kind.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Sensor {
        /// Specific force, m/s^2.
        Accelerometer = "accelerometer",
        /// Angular rate, rad/s.
        Gyroscope = "gyroscope",
    }
}

/// Both, in the order of the channels.
pub const SENSORS: [Sensor; 2] = [Sensor::Accelerometer, Sensor::Gyroscope];

impl Sensor {
    /// The first of its three channels in a sample.
    pub fn first_channel(self) -> usize {
        match self {
            Sensor::Accelerometer => 0,
            Sensor::Gyroscope => 3,
        }
    }

    /// The sensor of a channel.
    pub fn of_channel(channel: usize) -> Self {
        if channel < 3 {
            Sensor::Accelerometer
        } else {
            Sensor::Gyroscope
        }
    }

    /// Of two things, accelerometer first, its own.
    pub fn of<S>(self, [accelerometer, gyroscope]: &[S; 2]) -> &S {
        match self {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        }
    }

    /// Of two things, accelerometer first, its own, to be changed.
    pub fn of_mut<S>(self, [accelerometer, gyroscope]: &mut [S; 2]) -> &mut S {
        match self {
            Sensor::Accelerometer => accelerometer,
            Sensor::Gyroscope => gyroscope,
        }
    }

    /// Of six channels, its three.
    pub fn triad<T: Real>(self, channels: &[T; CHANNELS]) -> Vector3<T> {
        let [fx, fy, fz, wx, wy, wz] = *channels;
        match self {
            Sensor::Accelerometer => Vector3::new(fx, fy, fz),
            Sensor::Gyroscope => Vector3::new(wx, wy, wz),
        }
    }

    /// Squared distance of its three channels in one reading from those in another.
    pub fn squared_distance<T: Real>(self, a: &[T; CHANNELS], b: &[T; CHANNELS]) -> T {
        squared(&(self.triad(a) - self.triad(b)))
    }
}

/// Share of an axis that a rotation written with four digits may leave where there is none.
const NEGLIGIBLE: f64 = 1e-3;

/// Which of the six channels a unit has: not every sensor has three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes(pub [bool; CHANNELS]);

impl Axes {
    /// Three of each.
    pub const ALL: Self = Self([true; CHANNELS]);

    /// The three of one sensor.
    pub fn of(&self, sensor: Sensor) -> &[bool; 3] {
        let triad = match sensor {
            Sensor::Accelerometer => self.0.first_chunk(),
            Sensor::Gyroscope => self.0.last_chunk(),
        };
        // Of six channels both triads are there.
        triad.unwrap_or(&[true; 3])
    }

    /// Whether a sensor has all three.
    pub fn complete(&self, sensor: Sensor) -> bool {
        *self.of(sensor) == [true; 3]
    }

    /// Whether a sensor has any.
    pub fn any(&self, sensor: Sensor) -> bool {
        *self.of(sensor) != [false; 3]
    }

    /// Whether those of one sensor are all among another's.
    pub fn within(&self, other: &Self, sensor: Sensor) -> bool {
        let both = self.of(sensor).iter().zip(other.of(sensor));
        both.into_iter().all(|(own, other)| !own || *other)
    }

    /// Three numbers of a sensor, with zeros where it has no axis.
    pub fn present<T: Real>(&self, sensor: Sensor, v: &Vector3<T>) -> Vector3<T> {
        or_else(*self.of(sensor), v, T::zero())
    }

    /// Three numbers of a sensor, with not-a-number where it has no axis.
    pub fn shown<T: Real>(&self, sensor: Sensor, v: &Vector3<T>) -> Vector3<T> {
        or_else(*self.of(sensor), v, real(f64::NAN))
    }

    /// Axes of a unit, of which nominal rotation `turn` leads to its own from others, that can be told from these others.
    /// Rows of the rotation say which of them each needs (docs/theory/redundancy.md, eq. 24).
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

    /// Whether every sensor that has any is among these, accelerometer first.
    #[inline(never)]
    pub fn covered_by(&self, sensors: [bool; 2]) -> bool {
        let both = SENSORS.into_iter().zip(sensors);
        both.into_iter().all(|(sensor, among)| among || !self.any(sensor))
    }

    /// Puts zeros in channels that the unit does not have, whatever was written there.
    pub fn blank<T: Real>(&self, sample: &mut Sample<T>) {
        if *self == Self::ALL {
            return;
        }
        sample.specific_force = self.present(Sensor::Accelerometer, &sample.specific_force);
        sample.angular_rate = self.present(Sensor::Gyroscope, &sample.angular_rate);
    }
}

/// With another number in the place of those that are not there.
fn or_else<T: Real>([x, y, z]: [bool; 3], v: &Vector3<T>, other: T) -> Vector3<T> {
    let only = |value: T, has: bool| if has { value } else { other };
    Vector3::new(only(v.x, x), only(v.y, y), only(v.z, z))
}
