//! Heading of a robot on the spot: angle, rate and acceleration are functions of time that are each other's exact
//! derivatives.

use core::f64::consts::{PI, TAU};

use rand::RngExt;

use crate::simulate::stream::RandomStream;

/// Heading and its two derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotHeading {
    /// rad.
    pub heading: f64,
    /// rad/s.
    pub rate: f64,
    /// rad/s^2.
    pub acceleration: f64,
}

impl RobotHeading {
    /// The same way, faster and slower by the share `depth` once in every `TAU / wave` of heading, rad.
    ///
    /// The wheels are out of round, so that it is heading that counts, not time: whoever stands is not uneven, and no
    /// `depth` below 1 turns back. With whole waves the angle stays what it is.
    pub fn uneven(self, depth: f64, wave: f64) -> Self {
        let (sine, cosine) = libm::sincos(wave * self.heading);
        let faster = 1.0 + depth * cosine;
        Self {
            heading: self.heading + depth * sine / wave,
            rate: self.rate * faster,
            acceleration: self.acceleration * faster - self.rate * self.rate * depth * wave * sine,
        }
    }
}

/// A dip of the rate: `-depth sin^2` over its width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSlip {
    /// s.
    start: f64,
    /// s.
    width: f64,
    /// rad/s.
    depth: f64,
}

impl WheelSlip {
    /// A slip of 0.3 to 0.7 s, shorter where `part`, s, is, that takes a tenth to four tenths of `rate`, rad/s.
    pub fn draw(start: f64, part: f64, rate: f64, stream: &mut RandomStream) -> Self {
        let width = (0.3 + 0.4 * stream.random::<f64>()).min(part);
        Self {
            start: start + (part - width) * stream.random::<f64>(),
            width,
            depth: rate * (0.1 + 0.3 * stream.random::<f64>()),
        }
    }

    /// Takes from `turning`, at time `t`, s, what is lost by slipping.
    pub fn subtract_from(&self, turning: &mut RobotHeading, t: f64) {
        if t <= self.start {
            return;
        }
        let elapsed = (t - self.start).min(self.width);
        let lost = eased(self.depth * self.width / 2.0, self.width, elapsed);
        turning.heading -= lost.heading;
        turning.rate -= lost.rate;
        turning.acceleration -= lost.acceleration;
    }
}

/// From rest to rest by `angle` in `duration`, as a raised cosine.
pub fn eased(angle: f64, duration: f64, elapsed: f64) -> RobotHeading {
    let elapsed = elapsed.clamp(0.0, duration);
    let speed = TAU / duration;
    let (sine, cosine) = libm::sincos(speed * elapsed);
    let mean = angle / duration;
    RobotHeading {
        heading: mean * (elapsed - sine / speed),
        rate: mean * (1.0 - cosine),
        acceleration: mean * speed * sine,
    }
}

/// From rest to rest by `angle` in `duration`, up to speed and down again over `ramp` as half a cosine.
pub fn ramped(angle: f64, duration: f64, ramp: f64, elapsed: f64) -> RobotHeading {
    let top = angle / (duration - ramp);
    let (gained, rate, change) = if elapsed <= duration / 2.0 {
        rising(ramp, elapsed)
    } else {
        let (left, rate, change) = rising(ramp, duration - elapsed);
        (duration - ramp - left, rate, -change)
    };
    RobotHeading {
        heading: top * gained,
        rate: top * rate,
        acceleration: top * change,
    }
}

/// From rest up to a rate of one over `ramp`, and on.
fn rising(ramp: f64, elapsed: f64) -> (f64, f64, f64) {
    if elapsed >= ramp {
        return (elapsed - ramp / 2.0, 1.0, 0.0);
    }
    let speed = PI / ramp;
    let (sine, cosine) = libm::sincos(speed * elapsed);
    (
        (elapsed - sine / speed) / 2.0,
        (1.0 - cosine) / 2.0,
        speed * sine / 2.0,
    )
}
