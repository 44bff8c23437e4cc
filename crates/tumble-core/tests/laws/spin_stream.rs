//! Robots that stand still and turn on the spot, as streams of samples with known truth.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use tumble_core::gravity::{EARTH_RATE, STANDARD};
use tumble_core::real::{Real, real};
use tumble_core::sample::Sample;
use tumble_core::spin::axis::floor_frame;

use super::common::{Draws, direction, vector};

/// Sample interval, microseconds.
pub const INTERVAL: u64 = 10_000;

/// Truth of a spin.
#[derive(Clone, Debug)]
pub struct Truth {
    pub up: Vector3<f64>,
    pub accelerometer_bias: Vector3<f64>,
    pub gyroscope_bias: Vector3<f64>,
    pub floor_tilt: f64,
    pub uphill_bearing: f64,
    /// Forward and left, m.
    pub lever_arm: (f64, f64),
    pub scale: f64,
    /// Seconds at rest before the robot turns.
    pub still: f64,
    /// Turns in order, counter-clockwise positive.
    pub turns: Vec<f64>,
    pub rate: f64,
    /// Relative depth and frequency, Hz, of what makes the speed uneven.
    pub uneven: (f64, f64),
    /// Rate while the robot seems to stand still, rad/s.
    pub slow_turn: f64,
}

impl Truth {
    /// An upright IMU without errors on a level floor: two turns.
    pub fn plain() -> Self {
        Self {
            up: Vector3::z(),
            accelerometer_bias: Vector3::zeros(),
            gyroscope_bias: Vector3::zeros(),
            floor_tilt: 0.0,
            uphill_bearing: 0.0,
            lever_arm: (0.0, 0.0),
            scale: 0.0,
            still: 5.0,
            turns: vec![2.0],
            rate: 1.0,
            uneven: (0.0, 1.0),
            slow_turn: 0.0,
        }
    }

    /// Everything at once: a floor of 1 deg, a tilted IMU off the axis, both directions.
    pub fn usual() -> Self {
        Self {
            up: Vector3::new(0.08, 0.05, 1.0).normalize(),
            accelerometer_bias: Vector3::new(0.3, -0.2, 0.15),
            gyroscope_bias: Vector3::new(0.02, -0.03, 0.05),
            floor_tilt: 1.0_f64.to_radians(),
            uphill_bearing: 0.7,
            lever_arm: (0.1, 0.06),
            turns: vec![3.0, -3.0],
            ..Self::plain()
        }
    }

    /// Forward, left, up as columns in the case frame.
    pub fn floor(&self) -> Matrix3<f64> {
        floor_frame(&self.up)
    }

    pub fn arm(&self) -> Vector3<f64> {
        self.floor() * Vector3::new(self.lever_arm.0, self.lever_arm.1, 0.0)
    }

    /// Rate and its change at a time, and the heading gained since the turns began: each turn speeds up and slows down
    /// as one minus a cosine, so that all three are known exactly.
    fn motion(&self, t: f64) -> (f64, f64, f64) {
        let mut began = self.still;
        let mut heading = self.slow_turn * self.still;
        if t < self.still {
            return (self.slow_turn, 0.0, self.slow_turn * t);
        }
        for turns in &self.turns {
            let angle = turns * core::f64::consts::TAU;
            let duration = angle.abs() / self.rate + 1.0;
            if t < began + duration {
                let (rate, change, gained) = profile(angle, duration, t - began, self.uneven);
                return (rate, change, heading + gained);
            }
            began += duration;
            heading += angle;
        }
        (0.0, 0.0, heading)
    }

    pub fn duration(&self) -> f64 {
        let turning: f64 = self
            .turns
            .iter()
            .map(|turns| turns.abs() * core::f64::consts::TAU / self.rate + 1.0)
            .sum();
        self.still + turning
    }

    /// Readings of an ideal IMU at a time: specific force and angular rate.
    fn ideal(&self, t: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (rate, change, heading) = self.motion(t);
        let floor = self.floor();
        let uphill = floor * Vector3::new(self.uphill_bearing.cos(), self.uphill_bearing.sin(), 0.0);
        let (up, arm) = (self.up, self.arm());
        let gravity = up * self.floor_tilt.cos()
            + (uphill * heading.cos() - up.cross(&uphill) * heading.sin()) * self.floor_tilt.sin();
        (
            gravity * STANDARD - arm * (rate * rate) + up.cross(&arm) * change,
            up * rate,
        )
    }

    /// The Earth's rotation as a robot senses it that points `north` rad counter-clockwise of forward at its first rest, added
    /// to a stream; latitude in rad.
    pub fn on_the_earth(&self, stream: &mut [Sample<f64>], latitude: f64, north: f64) {
        let uphill = Vector3::new(self.uphill_bearing.cos(), self.uphill_bearing.sin(), 0.0);
        let up = Vector3::z() * self.floor_tilt.cos() + uphill * self.floor_tilt.sin();
        let ahead = Vector3::new(north.cos(), north.sin(), 0.0);
        let ahead = (ahead - up * up.dot(&ahead)).normalize();
        let earth = (up * latitude.sin() + ahead * latitude.cos()) * EARTH_RATE;
        for sample in stream {
            let (sine, cosine) = self.motion(sample.time as f64 * 1e-6).2.sin_cos();
            sample.angular_rate += self.floor()
                * Vector3::new(
                    cosine * earth.x + sine * earth.y,
                    cosine * earth.y - sine * earth.x,
                    earth.z,
                );
        }
    }

    /// The stream until `extra` seconds after the last turn, with white noise of these sigmas.
    pub fn stream(&self, noise: (f64, f64), extra: f64, seed: u64) -> Vec<Sample<f64>> {
        let mut draws = Draws::new(seed);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let count = ((self.duration() + extra) * 1e6) as u64 / INTERVAL;
        (0..=count)
            .map(|i| {
                let time = i * INTERVAL;
                let (force, rate) = self.ideal(time as f64 * 1e-6);
                Sample {
                    time,
                    specific_force: force + self.accelerometer_bias + draws.normals::<3>() * noise.0,
                    angular_rate: rate * (1.0 + self.scale)
                        + self.gyroscope_bias
                        + draws.normals::<3>() * noise.1,
                }
            })
            .collect()
    }
}

/// Rate, its change and the angle gained after `t` of a turn by `angle` that lasts `duration`, all of half a second's
/// rise and fall, on which a ripple of whole periods rides.
fn profile(angle: f64, duration: f64, t: f64, (depth, frequency): (f64, f64)) -> (f64, f64, f64) {
    use core::f64::consts::{PI, TAU};
    const RISE: f64 = 1.0;
    let top = angle / (duration - RISE);
    let ramp = |t: f64| {
        if t < RISE {
            let phase = PI * t / RISE;
            (
                (1.0 - phase.cos()) / 2.0,
                phase.sin() * PI / RISE / 2.0,
                (t - phase.sin() * RISE / PI) / 2.0,
            )
        } else {
            (1.0, 0.0, t - RISE / 2.0)
        }
    };
    let (rate, change, gained) = if t < duration - RISE {
        ramp(t)
    } else {
        let (rate, change, gained) = ramp(duration - t);
        (rate, -change, duration - RISE - gained)
    };
    // The ripple starts and ends at zero, with its slope, and adds nothing to the whole angle.
    let periods = (frequency * duration).round().max(1.0);
    let phase = TAU * periods * t / duration;
    let speed = TAU * periods / duration;
    (
        top * (rate + depth * phase.sin()),
        top * (change + depth * speed * phase.cos()),
        top * (gained + depth * (1.0 - phase.cos()) / speed),
    )
}

/// In another precision.
pub fn narrowed<T: Real>(stream: &[Sample<f64>]) -> impl Iterator<Item = Sample<T>> {
    stream.iter().map(|sample| Sample {
        time: sample.time,
        specific_force: sample.specific_force.map(real),
        angular_rate: sample.angular_rate.map(real),
    })
}

/// Any mounting, any floor up to 6 deg, any bias, any lever arm, uneven speed, both directions or one.
pub fn truths() -> impl Strategy<Value = Truth> {
    let turns = prop_oneof![
        Just(vec![2.0]),
        Just(vec![-1.5]),
        Just(vec![1.0, -2.0]),
        Just(vec![-1.0, 1.0, -1.0])
    ];
    let floor = (0.0..0.1_f64, -3.0..3.0_f64);
    let arm = (-0.4..0.4_f64, -0.4..0.4_f64);
    let speed = (0.5..2.5_f64, (0.0..0.4_f64, 0.3..2.0_f64));
    (direction(), vector(1.0), vector(0.4), floor, arm, turns, speed).prop_map(
        |(up, accelerometer_bias, gyroscope_bias, (floor_tilt, uphill_bearing), lever_arm, turns, speed)| {
            Truth {
                up,
                accelerometer_bias,
                gyroscope_bias,
                floor_tilt,
                uphill_bearing,
                lever_arm,
                turns,
                rate: speed.0,
                uneven: speed.1,
                ..Truth::plain()
            }
        },
    )
}
